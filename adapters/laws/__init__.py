"""Laws of residual displacement: each is a file here with an object ``LAW``."""

from __future__ import annotations

from adapters.laws.law import Law
from adapters.named_files import find_choice, find_choices

__all__ = ["Law", "law_named", "laws_known"]


def laws_known() -> tuple[str, ...]:
    """Names of all laws, sorted."""
    return tuple(find_choices(__name__, "LAW"))


def law_named(name: str) -> Law:
    """The law of this name; raises `UsageError` with the nearest name when there is none."""
    law: Law = find_choice(__name__, "LAW", name, "there is no law")
    return law
