"""Laws of residual displacement, one file each: ``law_NAME.py`` with an object ``LAW``."""

from __future__ import annotations

from difflib import get_close_matches
from importlib import import_module
from pkgutil import iter_modules

from adapters.errors import UsageError
from adapters.laws.law import Law

__all__ = ["Law", "law_named", "laws_known"]


def laws_known() -> tuple[str, ...]:
    """Names of all laws, sorted: the files ``law_*.py`` of this package."""
    files = (module.name for module in iter_modules(__path__))
    return tuple(
        sorted(name.removeprefix("law_").replace("_", "-") for name in files if name[:4] == "law_")
    )


def law_named(name: str) -> Law:
    """The law of this name; raises `UsageError` with the nearest name when there is none."""
    known = laws_known()
    if name not in known:
        near = get_close_matches(name.lower().replace("_", "-"), known, n=1)
        raise UsageError(
            f"there is no law '{name}'" + (f"; did you mean '{near[0]}'?" if near else ""),
            remedy="the laws are: " + ", ".join(known),
        )
    law: Law = import_module(f"{__name__}.law_{name.replace('-', '_')}").LAW
    return law
