"""Hooke in the rotated frame: ``P = R (lambda tr(Y) I + 2 mu Y)``, ``Y = U - I``, ``F = R U``.

Objective, derives from a potential.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from qdem_fem.element.kinematics import (
    IDENTITY,
    FloatArray,
    energy_quadratic,
    isotropic,
    strain_green,
    transposed,
)
from qdem_fem.element.stress import Nine, viscous_current

viscous_numbers = viscous_current


class Corotational(NamedTuple):
    """Hooke's law in the element's turned frame; ``half`` is 0.5 in its precision."""

    half: Any


MEASURE = Corotational
OBJECTIVE = True


def strain_of(H: FloatArray) -> FloatArray:
    """Biot's strain Y = U - I [-], of the polar decomposition F = R U.

    U^2 = I + 2 E, so Y has the directions of E and the values sqrt(1 + 2 e) - 1, written
    2 e/(1 + sqrt(1 + 2 e)).
    """
    value, direction = np.linalg.eigh(strain_green(H))
    # a flat element has the stretch 0; round-off may leave its square just below
    stretch = 2 * value / (1 + np.sqrt(np.maximum(1 + 2 * value, 0)))
    return (direction * stretch[..., None, :]) @ transposed(direction)


def stress_nominal(H: FloatArray, lame_first: ArrayLike, lame_second: ArrayLike) -> FloatArray:
    """P = R (lambda tr(Y) I + 2 mu Y) [Pa]; P = dW/dF of W = lambda/2 tr(Y)^2 + mu Y : Y.

    R = F U^-1.  Not for flat elements, where U has no inverse (`numpy.linalg.LinAlgError`).
    """
    Y = strain_of(H)
    rotation = (IDENTITY + H) @ np.linalg.inv(IDENTITY + Y)
    return rotation @ isotropic(Y, lame_first, lame_second)


def energy_stored(
    H: FloatArray, volume: FloatArray, lame_first: ArrayLike, lame_second: ArrayLike
) -> FloatArray:
    """Stored energy of every element [J], (m,): the potential of the stress."""
    return energy_quadratic(strain_of(H), volume, lame_first, lame_second)


def stress_numbers(h: Nine, lame_first: Any, lame_second: Any, half: Any) -> tuple[Nine, Any]:
    """``P = R (lambda tr(Y) I + 2 mu Y)``, with ``F = R (I + Y)``: Hooke's law in the turned frame.

    The stretch ``Y`` solves ``Y^2 + 2 Y = F^T F - I`` by six Newton steps from ``Y = 0``
    (quadratic; to round-off for stretches between 0.3 and 3), so that nothing is lost at small
    strain.  Conservative: ``W = mu Y:Y + lambda/2 tr(Y)^2``.  Returns ``P`` and ``J``.
    """
    h0, h1, h2, h3, h4, h5, h6, h7, h8 = h
    one = half + half
    xx = (h0 + h0) + (h0 * h0 + h3 * h3 + h6 * h6)  # F^T F - I
    yy = (h4 + h4) + (h1 * h1 + h4 * h4 + h7 * h7)
    zz = (h8 + h8) + (h2 * h2 + h5 * h5 + h8 * h8)
    xy = (h1 + h3) + (h0 * h1 + h3 * h4 + h6 * h7)
    xz = (h2 + h6) + (h0 * h2 + h3 * h5 + h6 * h8)
    yz = (h5 + h7) + (h1 * h2 + h4 * h5 + h7 * h8)
    nought = xx - xx
    y0, y1, y2, y3, y4, y5 = nought, nought, nought, nought, nought, nought  # xx xy xz yy yz zz
    i0, i1, i2 = one + nought, nought, nought  # (I + Y)^-1
    i3, i4, i5 = one + nought, nought, one + nought
    determinant = one + nought
    for _ in range(6):
        a0 = xx + (y0 * y0 + y1 * y1 + y2 * y2)
        a1 = xy + (y0 * y1 + y1 * y3 + y2 * y4)
        a2 = xz + (y0 * y2 + y1 * y4 + y2 * y5)
        a3 = yy + (y1 * y1 + y3 * y3 + y4 * y4)
        a4 = yz + (y1 * y2 + y3 * y4 + y4 * y5)
        a5 = zz + (y2 * y2 + y4 * y4 + y5 * y5)
        y0 = half * (i0 * a0 + i1 * a1 + i2 * a2)
        y1 = half * (i0 * a1 + i1 * a3 + i2 * a4)
        y2 = half * (i0 * a2 + i1 * a4 + i2 * a5)
        y3 = half * (i1 * a1 + i3 * a3 + i4 * a4)
        y4 = half * (i1 * a2 + i3 * a4 + i4 * a5)
        y5 = half * (i2 * a2 + i4 * a4 + i5 * a5)
        u0, u3, u5 = one + y0, one + y3, one + y5
        i0, i1, i2 = u3 * u5 - y4 * y4, y2 * y4 - y1 * u5, y1 * y4 - y2 * u3
        i3, i4, i5 = u0 * u5 - y2 * y2, y1 * y2 - u0 * y4, u0 * u3 - y1 * y1
        determinant = u0 * i0 + y1 * i1 + y2 * i2
        inverse = one / determinant
        i0, i1, i2 = i0 * inverse, i1 * inverse, i2 * inverse
        i3, i4, i5 = i3 * inverse, i4 * inverse, i5 * inverse
    pressure = lame_first * (y0 + y3 + y5)
    twice = lame_second + lame_second
    b0, b1, b2 = pressure + twice * y0, twice * y1, twice * y2  # Biot stress
    b3, b4, b5 = pressure + twice * y3, twice * y4, pressure + twice * y5
    s0 = i0 * b0 + i1 * b1 + i2 * b2  # (I + Y)^-1 and the Biot stress commute
    s1 = i0 * b1 + i1 * b3 + i2 * b4
    s2 = i0 * b2 + i1 * b4 + i2 * b5
    s3 = i1 * b1 + i3 * b3 + i4 * b4
    s4 = i1 * b2 + i3 * b4 + i4 * b5
    s5 = i2 * b2 + i4 * b4 + i5 * b5
    stress = (
        s0 + (h0 * s0 + h1 * s1 + h2 * s2),
        s1 + (h0 * s1 + h1 * s3 + h2 * s4),
        s2 + (h0 * s2 + h1 * s4 + h2 * s5),
        s1 + (h3 * s0 + h4 * s1 + h5 * s2),
        s3 + (h3 * s1 + h4 * s3 + h5 * s4),
        s4 + (h3 * s2 + h4 * s4 + h5 * s5),
        s2 + (h6 * s0 + h7 * s1 + h8 * s2),
        s4 + (h6 * s1 + h7 * s3 + h8 * s4),
        s5 + (h6 * s2 + h7 * s4 + h8 * s5),
    )
    f0, f4, f8 = one + h0, one + h4, one + h8
    jacobian = f0 * (f4 * f8 - h5 * h7) + h1 * (h5 * h6 - h3 * f8) + h2 * (h3 * h7 - f4 * h6)
    return stress, jacobian
