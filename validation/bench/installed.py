"""Which engines with mechanics are installed."""

from __future__ import annotations

from adapters.engine import engine_named, real_engines
from adapters.errors import EngineMissing


def list_installed() -> list[str]:
    """Their names; raises `EngineMissing` if there is none."""
    present = []
    for name in real_engines():
        try:
            engine_named(name).version()
        except EngineMissing:
            continue
        present.append(name)
    if not present:
        raise EngineMissing("no engine is installed, so there is nothing to validate")
    return present
