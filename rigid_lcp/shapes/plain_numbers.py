"""Real numbers as callers give them: what numpy would read without a word is refused here."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def real_numbers(values: ArrayLike) -> NDArray[np.float64]:
    """A copy of ``values`` as floats; `TypeError` or `ValueError` says what else they are.

    numpy drops the imaginary part of complex numbers, and takes masked ones for what they hide.
    """
    if np.ma.is_masked(values):
        raise TypeError("some are masked")
    if np.iscomplexobj(values):
        raise TypeError("complex ones")
    return np.array(values, dtype=float)
