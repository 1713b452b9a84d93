"""What a jump moves, one file a way: ``move_NAME.py`` with an object ``MOVE``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from adapters.named_files import file_named, names_known

if TYPE_CHECKING:  # a scene asks for names only; the ways themselves load scipy
    from adapters.moves.move import Move

__all__ = ["DEFAULT", "move_named", "moves_known"]

DEFAULT = "smoothed"
"""The way of a scene that names none."""


def moves_known() -> tuple[str, ...]:
    """Names of all ways to move grains in a jump, sorted: the files ``move_*.py`` here."""
    return names_known(__path__, "move")


def move_named(name: str) -> Move:
    """The way of this name; raises `UsageError` with the nearest name when there is none."""
    move: Move = file_named(__name__, __path__, "move", name, "no jump moves grains by").MOVE
    return move
