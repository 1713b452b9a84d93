"""What a jump moves: each way is a file here with an object ``MOVE``."""

from adapters.moves.contract import Jump, Move
from trackbed.choices import find_choice, find_choices

__all__ = ["DEFAULT", "RETIRED", "Jump", "get_move", "list_moves"]

DEFAULT = "smoothed"
"""The way of a scene that names none."""
RETIRED = dict.fromkeys(("robust", "shrunk", "modes", "smooth-field"), "smoothed")
"""Ways that left trackbed, and the nearest one that is here."""


def list_moves() -> tuple[str, ...]:
    """Names of all ways to move grains in a jump, sorted."""
    return tuple(find_choices(__name__, "MOVE"))


def get_move(name: str) -> Move:
    """The way of this name; raises `UsageError` with the nearest name when there is none."""
    move: Move = find_choice(__name__, "MOVE", name, "no jump moves grains by", RETIRED)
    return move
