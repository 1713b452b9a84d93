"""Which engines with mechanics are installed."""

from __future__ import annotations

from adapters.engines.contract import get_engine, list_real_engines
from adapters.errors import EngineMissing


def list_installed() -> list[str]:
    """Their names; raises `EngineMissing` if there is none."""
    present = []
    for name in list_real_engines():
        try:
            get_engine(name).version()
        except EngineMissing:
            continue
        present.append(name)
    if not present:
        raise EngineMissing("no engine is installed, so there is nothing to validate")
    return present
