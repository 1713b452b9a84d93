"""What a jump moves, one file a way: ``move_NAME.py`` with an object ``MOVE``."""

from __future__ import annotations

from difflib import get_close_matches
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING

from adapters.errors import UsageError

if TYPE_CHECKING:  # a scene asks for names only; the ways themselves load scipy
    from adapters.moves.move import Move

__all__ = ["DEFAULT", "move_named", "moves_known"]

DEFAULT = "smoothed"
"""The way of a scene that names none."""


def moves_known() -> tuple[str, ...]:
    """Names of all ways to move grains in a jump, sorted: the files ``move_*.py`` here."""
    files = (module.name for module in iter_modules(__path__))
    return tuple(
        sorted(
            name.removeprefix("move_").replace("_", "-") for name in files if name[:5] == "move_"
        )
    )


def move_named(name: str) -> Move:
    """The way of this name; raises `UsageError` with the nearest name when there is none."""
    known = moves_known()
    if name not in known:
        near = get_close_matches(name.lower().replace("_", "-"), known, n=1)
        raise UsageError(
            f"no jump moves grains by '{name}'" + (f"; did you mean '{near[0]}'?" if near else ""),
            remedy="the ways are: " + ", ".join(known),
        )
    move: Move = import_module(f"{__name__}.move_{name.replace('-', '_')}").MOVE
    return move
