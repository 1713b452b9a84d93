"""Laws of residual displacement, one file each: ``law_NAME.py`` with an object ``LAW``."""

from __future__ import annotations

from adapters.laws.law import Law
from adapters.named_files import file_named, names_known

__all__ = ["Law", "law_named", "laws_known"]


def laws_known() -> tuple[str, ...]:
    """Names of all laws, sorted: the files ``law_*.py`` of this package."""
    return names_known(__path__, "law")


def law_named(name: str) -> Law:
    """The law of this name; raises `UsageError` with the nearest name when there is none."""
    law: Law = file_named(__name__, __path__, "law", name, "there is no law").LAW
    return law
