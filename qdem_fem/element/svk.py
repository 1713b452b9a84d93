"""Saint Venant-Kirchhoff: ``P = F S``, ``S = lambda tr(E) I + 2 mu E``, ``E = (F^T F - I)/2``.

Objective, derives from a potential; softens under compression.
"""

from typing import Any, NamedTuple

from numpy.typing import ArrayLike

from qdem_fem.element.kinematics import IDENTITY, apply_hooke, compute_quadratic_energy, transpose
from qdem_fem.element.stress import Nine, find_viscous_stress
from qdem_fem.files import Floats

find_viscous_numbers = find_viscous_stress


class Svk(NamedTuple):
    """St. Venant-Kirchhoff; ``half`` is 0.5 in the kernel's precision."""

    half: Any


MEASURE = Svk
OBJECTIVE = True


def compute_strain(H: Floats) -> Floats:
    """Green's strain E = (F^T F - I)/2 = (H + H^T + H^T H)/2 [-]."""
    return (H + transpose(H) + transpose(H) @ H) / 2


def compute_nominal_stress(H: Floats, lame_first: ArrayLike, lame_second: ArrayLike) -> Floats:
    """P = F S [Pa], S = lambda tr(E) I + 2 mu E; P = dW/dF of W = lambda/2 tr(E)^2 + mu E : E.

    Softens under compression, and loses all stiffness below a stretch of 0.58.
    """
    return (IDENTITY + H) @ apply_hooke(compute_strain(H), lame_first, lame_second)


def compute_stored_energy(
    H: Floats, volume: Floats, lame_first: ArrayLike, lame_second: ArrayLike
) -> Floats:
    """Stored energy of every element [J], (m,): the potential of the stress."""
    return compute_quadratic_energy(compute_strain(H), volume, lame_first, lame_second)


def find_stress_numbers(h: Nine, lame_first: Any, lame_second: Any, half: Any) -> tuple[Nine, Any]:
    """St. Venant-Kirchhoff, ``P = F S``, ``S = lambda tr(E) I + 2 mu E``, ``E = (F^T F - I)/2``.

    Conservative and exact under rotation.  Returns ``P`` and ``J``.  Not for strong compression:
    it softens, and has no stiffness at ``F = 0.58 I``.
    """
    h0, h1, h2, h3, h4, h5, h6, h7, h8 = h
    xx = (h0 + h0) + (h0 * h0 + h3 * h3 + h6 * h6)  # 2 E
    yy = (h4 + h4) + (h1 * h1 + h4 * h4 + h7 * h7)
    zz = (h8 + h8) + (h2 * h2 + h5 * h5 + h8 * h8)
    xy = (h1 + h3) + (h0 * h1 + h3 * h4 + h6 * h7)
    xz = (h2 + h6) + (h0 * h2 + h3 * h5 + h6 * h8)
    yz = (h5 + h7) + (h1 * h2 + h4 * h5 + h7 * h8)
    pressure = lame_first * half * (xx + yy + zz)
    sxx, syy, szz = (
        pressure + lame_second * xx,
        pressure + lame_second * yy,
        pressure + lame_second * zz,
    )
    sxy, sxz, syz = lame_second * xy, lame_second * xz, lame_second * yz
    stress = (
        sxx + (h0 * sxx + h1 * sxy + h2 * sxz),
        sxy + (h0 * sxy + h1 * syy + h2 * syz),
        sxz + (h0 * sxz + h1 * syz + h2 * szz),
        sxy + (h3 * sxx + h4 * sxy + h5 * sxz),
        syy + (h3 * sxy + h4 * syy + h5 * syz),
        syz + (h3 * sxz + h4 * syz + h5 * szz),
        sxz + (h6 * sxx + h7 * sxy + h8 * sxz),
        syz + (h6 * sxy + h7 * syy + h8 * syz),
        szz + (h6 * sxz + h7 * syz + h8 * szz),
    )  # fmt: skip
    one = half + half
    f0, f4, f8 = one + h0, one + h4, one + h8
    jacobian = f0 * (f4 * f8 - h5 * h7) + h1 * (h5 * h6 - h3 * f8) + h2 * (h3 * h7 - f4 * h6)
    return stress, jacobian
