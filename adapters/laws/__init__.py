"""Laws of residual displacement: each is a file here with an object ``LAW``."""

from adapters.laws.form import Law
from trackbed.choices import find_choice, find_choices

__all__ = ["RETIRED", "Law", "get_law", "list_laws"]

RETIRED = {"shenton": "log-linear", "hca": "log-linear", "sato": "stretched-exponential"}
"""Laws that left trackbed, and the nearest one that is here."""


def list_laws() -> tuple[str, ...]:
    """Names of all laws, sorted."""
    return tuple(find_choices(__name__, "LAW"))


def get_law(name: str) -> Law:
    """The law of this name; raises `UsageError` with the nearest name when there is none."""
    law: Law = find_choice(__name__, "LAW", name, "there is no law", RETIRED)
    return law
