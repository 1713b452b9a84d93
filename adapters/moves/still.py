"""Nothing moves: the null hypothesis beside which every other way is shown."""

import numpy as np

from adapters.bed import FloatArray
from adapters.moves.contract import Jump, Move


def find_displacement(jump: Jump) -> FloatArray:
    """Zeros [m], shape (n, 3).

    The cycles are counted as jumped and the bed has not felt them: not for predictions.
    """
    return np.zeros_like(jump.place)


MOVE = Move("still", find_displacement, moves_piston=False)
