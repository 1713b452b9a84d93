"""Every grain by its own extrapolated law, as in the paper (section 3.2)."""

from __future__ import annotations

from adapters.bed import Container, FloatArray
from adapters.laws.form import Law
from adapters.moves.contract import Move, check_jump_arguments, extrapolate_grains


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
    check_jump_arguments(position, radius, h)
    return extrapolate_grains(cycle, position, law, h)


MOVE = Move("per-grain", displacement, tames_loose=False)
