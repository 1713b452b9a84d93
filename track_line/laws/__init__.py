"""Settlement of a bed by load and history: each law is a file here with a class ``LAW``."""

from track_line.laws.contract import SEAT_AREA, BedLoad, Law
from trackbed.choices import find_choice, find_choices

__all__ = ["SEAT_AREA", "BedLoad", "Law", "get_law", "list_laws"]


def list_laws() -> tuple[str, ...]:
    """Names of all laws, sorted."""
    return tuple(find_choices(__name__, "LAW"))


def get_law(name: str) -> type[Law]:
    """The law of this name; raises `UsageError` with the nearest name when there is none."""
    law: type[Law] = find_choice(__name__, "LAW", name, "there is no settlement law")
    return law
