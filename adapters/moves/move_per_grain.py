"""Every grain by its own extrapolated law, as in the paper (section 3.2)."""

from __future__ import annotations

from adapters.container import Container
from adapters.laws.law import Law
from adapters.moves.move import Move, jump_arguments_check, law_moves
from adapters.state import FloatArray


def displacement(
    cycle: FloatArray,
    position: FloatArray,
    radius: FloatArray,
    law: Law,
    h: float,
    container: Container,
) -> FloatArray:
    """The law's increment of each grain's own path [m], shape (n, 3): eqs 16 to 21.

    Arguments and errors as `moves.move.Displacement`.  Do not use it beyond comparisons: a few
    loose grains fly through their neighbours.
    """
    jump_arguments_check(position, radius, h)
    return law_moves(cycle, position, law, h)


MOVE = Move("per-grain", displacement, tames_loose=False)
