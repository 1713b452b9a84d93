"""Nothing moves: the null hypothesis beside which every other way is shown."""

from __future__ import annotations

import numpy as np

from adapters.bed import Container, FloatArray
from adapters.laws.form import Law
from adapters.moves.contract import Move, check_jump_arguments


def displacement(
    cycle: FloatArray,
    position: FloatArray,
    radius: FloatArray,
    law: Law,
    h: float,
    container: Container,
) -> FloatArray:
    """Zeros [m], shape (n, 3); arguments and errors as `moves.move.Displacement`.

    The cycles are counted as jumped and the bed has not felt them: not for predictions.
    """
    check_jump_arguments(position, radius, h)
    return np.zeros_like(position[-1])


MOVE = Move("still", displacement, moves_piston=False)
