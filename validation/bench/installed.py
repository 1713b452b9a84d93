"""Which engines with mechanics are installed."""

from __future__ import annotations

from adapters.engine import engine_named
from adapters.engine_names import REAL_ENGINES
from adapters.errors import EngineMissing


def list_installed() -> list[str]:
    """Their names; raises `EngineMissing` if there is none."""
    present = []
    for name in REAL_ENGINES:
        try:
            engine_named(name).version()
        except EngineMissing:
            continue
        present.append(name)
    if not present:
        raise EngineMissing("no engine is installed, so there is nothing to validate")
    return present
