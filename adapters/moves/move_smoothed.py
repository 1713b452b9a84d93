"""Every grain by its own law, cut at the 95th percentile and smoothed over its neighbours."""

from __future__ import annotations

from adapters.container import Container
from adapters.jump_field import jump_field
from adapters.laws.law import Law
from adapters.moves.move import Move
from adapters.state import FloatArray


def displacement(
    cycle: FloatArray,
    position: FloatArray,
    radius: FloatArray,
    law: Law,
    h: float,
    container: Container,
) -> FloatArray:
    """`jump_field` as it stands [m], shape (n, 3); see `moves.move.Displacement`."""
    return jump_field(cycle, position, radius, law, h)


MOVE = Move("smoothed", displacement)
