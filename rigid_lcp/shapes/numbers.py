"""Numbers that shapes and places are made of: finite, and lengths that can be computed with."""

from sys import float_info

import numpy as np
from numpy.typing import ArrayLike

from rigid_lcp.arrays import Floats
from rigid_lcp.errors import SceneError, ShapeError

LEAST, MOST = 1e-50, 1e50
"""Lengths that a shape may have [m]: their fourth powers are numbers still."""


def require_real(values: ArrayLike) -> Floats:
    """A copy of ``values`` as floats; `TypeError` or `ValueError` says what else they are.

    numpy drops the imaginary part of complex numbers, and takes masked ones for what they hide.
    """
    if np.ma.is_masked(values):
        raise TypeError("some are masked")
    if np.iscomplexobj(values):
        raise TypeError("complex ones")
    return np.array(values, dtype=float)


def require_finite_shape(values: ArrayLike, what: str, where: str) -> Floats:
    """A copy of finite numbers; a `ShapeError` for anything else."""
    try:
        array = require_real(values)
    except (TypeError, ValueError) as error:
        raise ShapeError(
            f"the {what} holds what are not numbers ({error})", where=where, remedy="give metres"
        ) from error
    if not np.isfinite(array).all():
        raise ShapeError(f"the {what} is not finite", where=where, remedy="give metres")
    return array


def require_length(value: float, what: str, where: str) -> float:
    """A length that a shape can have [m]; a `ShapeError` for any other."""
    array = require_finite_shape(value, what, where)
    if array.ndim or not LEAST <= array <= MOST:
        raise ShapeError(
            f"the {what} is {value}", where=where,
            remedy=f"give a positive length, {LEAST:g} to {MOST:g} m",
        )  # fmt: skip
    return float(array)


def require_size(size: float, where: str) -> None:
    """Raise `ShapeError` for a shape whose ``size`` [m] can not be computed with; 0 has a sentence
    of its own."""
    if size != 0 and not LEAST <= size <= MOST:
        raise ShapeError(
            f"it is {size:.1g} m in size", where=where,
            remedy=f"choose other units: {LEAST:g} to {MOST:g} can be computed with",
        )  # fmt: skip


def require_vector(
    values: ArrayLike, size: int, what: str, where: str, most: float = float_info.max
) -> Floats:
    """A copy of ``size`` finite numbers, ``most`` at most; `SceneError` for anything else."""
    try:
        vector = np.atleast_1d(require_real(values))
    except (TypeError, ValueError):
        vector = np.zeros(0)
    if vector.shape != (size,) or not (np.abs(vector) <= most).all():
        bound = "" if most == float_info.max else f", {most:g} at most"
        raise SceneError(
            f"{what} is {values!r}", where=where, remedy=f"give {size} finite number(s){bound}"
        )
    return vector
