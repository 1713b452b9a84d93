"""The paper's strain eps = (F F^T - I)/2: ``P = T cof F``, ``T = lambda tr(eps) I + 2 mu eps``.

Objective.  It derives from a potential only for lambda = mu (nu = 0.25); else a closed loop of
strains of size a returns with work of the order of a times the stored energy.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from qdem_fem.element.kinematics import (
    IDENTITY,
    apply_hooke,
    contract,
    find_cofactor,
    find_trace,
    transpose,
)
from qdem_fem.element.stress import Nine, find_viscous_stress
from qdem_fem.files import Floats

find_viscous_numbers = find_viscous_stress


class Finger(NamedTuple):
    """The paper's strain; ``half`` is 0.5 in the kernel's precision."""

    half: Any


MEASURE = Finger
OBJECTIVE = True


def compute_strain(H: Floats) -> Floats:
    """eps = (F F^T - I)/2 = (H + H^T + H H^T)/2 [-] (eqs 3, 4)."""
    return (H + transpose(H) + H @ transpose(H)) / 2


def compute_nominal_stress(H: Floats, lame_first: ArrayLike, lame_second: ArrayLike) -> Floats:
    """P = T cof(F) [Pa] with the Cauchy stress T of the Finger strain (eqs 2, 9, 10)."""
    return apply_hooke(compute_strain(H), lame_first, lame_second) @ find_cofactor(IDENTITY + H)


def compute_stored_energy(
    H: Floats, volume: Floats, lame_first: ArrayLike, lame_second: ArrayLike
) -> Floats:
    """Stored energy of every element [J], (m,): ``V0 mu (J tr(eps) - (J - 1))`` for lambda = mu.

    There is none else: ``V0 (lambda - mu)/2 tr(eps)^2`` is added, so the value is exact for
    nu = 0.25 and within the order of the strain otherwise.
    """
    lam, mu = np.asarray(lame_first, float), np.asarray(lame_second, float)
    first, minors = find_trace(H)[..., 0, 0], find_cofactor(H)
    spread = first + contract(H, H) / 2  # tr(eps)
    beyond_first = find_trace(minors)[..., 0, 0] + contract(H, minors) / 3
    j = first + beyond_first  # find_volume_change(H)
    # (1 + j) tr(eps) - j, its first order tr H - tr H left out
    density = mu * (contract(H, H) / 2 - beyond_first + j * spread)
    return volume * (density + (lam - mu) / 2 * spread**2)


def find_stress_numbers(h: Nine, lame_first: Any, lame_second: Any, half: Any) -> tuple[Nine, Any]:
    """``P = T cof F`` with ``T = lambda tr(eps) I + 2 mu eps``, ``eps = (B - I)/2`` (eqs 2-4).

    Since ``B cof F = J F``, with ``K = H^T - cof H``, ``II = tr cof H``, ``III = det H``::

        P = a cof F + mu (J F - cof F) = alpha I + beta H + gamma K,   a = lambda tr(eps),
        alpha = a (1 + tr H) + mu (II + III),  beta = mu J,  gamma = mu - a.

    Returns ``P`` and ``J = det F``.  Not hyperelastic unless ``lambda = mu``: a closed cycle of
    strain e leaves work of the order e times the energy stored; that of ``svk``
    leaves none.
    """
    h0, h1, h2, h3, h4, h5, h6, h7, h8 = h
    c0, c1, c2 = h4 * h8 - h5 * h7, h5 * h6 - h3 * h8, h3 * h7 - h4 * h6
    c3, c4, c5 = h2 * h7 - h1 * h8, h0 * h8 - h2 * h6, h1 * h6 - h0 * h7
    c6, c7, c8 = h1 * h5 - h2 * h4, h2 * h3 - h0 * h5, h0 * h4 - h1 * h3
    trace = h0 + h4 + h8
    change = (c0 + c4 + c8) + (h0 * c0 + h1 * c1 + h2 * c2)
    square = h0 * h0 + h1 * h1 + h2 * h2 + h3 * h3 + h4 * h4 + h5 * h5 + h6 * h6 + h7 * h7 + h8 * h8
    pressure = lame_first * (trace + half * square)
    alpha = (pressure + pressure * trace) + lame_second * change
    growth = trace + change
    beta = lame_second + lame_second * growth
    gamma = lame_second - pressure
    stress = (
        (alpha + beta * h0) + gamma * (h0 - c0),
        beta * h1 + gamma * (h3 - c1),
        beta * h2 + gamma * (h6 - c2),
        beta * h3 + gamma * (h1 - c3),
        (alpha + beta * h4) + gamma * (h4 - c4),
        beta * h5 + gamma * (h7 - c5),
        beta * h6 + gamma * (h2 - c6),
        beta * h7 + gamma * (h5 - c7),
        (alpha + beta * h8) + gamma * (h8 - c8),
    )
    return stress, (half + half) + growth


def find_fused_pulls(
    h: Nine, w: Nine, g: Nine, lame_first: Any, lame_second: Any, viscous_first: Any,
    viscous_second: Any, half: Any,
) -> tuple[Nine, Any, Any]:  # fmt: skip
    """Pulls of `find_stress_numbers` and `find_viscous_stress` together, with less work.

    With ``c_a = cof(F) grad N_a``, which is ``J`` times the gradient in the current
    configuration: ``J L = sum_a w_a (x) c_a`` (eq. 5) and ``f_a = -V0 T c_a`` (eqs 8-10).
    ``w``: edges of the velocity [m/s], as the edges of `compute_element_gradient`.  Returns the
    pulls, ``J`` and the power that viscosity takes, ``V0 J T_D : D`` [W].
    """
    h0, h1, h2, h3, h4, h5, h6, h7, h8 = h
    one = half + half
    f0, f4, f8 = one + h0, one + h4, one + h8
    c0, c1, c2 = f4 * f8 - h5 * h7, h5 * h6 - h3 * f8, h3 * h7 - f4 * h6
    c3, c4, c5 = h2 * h7 - h1 * f8, f0 * f8 - h2 * h6, h1 * h6 - f0 * h7
    c6, c7, c8 = h1 * h5 - h2 * f4, h2 * h3 - f0 * h5, f0 * f4 - h1 * h3
    jacobian = f0 * c0 + h1 * c1 + h2 * c2
    inverse = one / jacobian
    ax, ay, az = (
        c0 * g[0] + c1 * g[1] + c2 * g[2],
        c3 * g[0] + c4 * g[1] + c5 * g[2],
        c6 * g[0] + c7 * g[1] + c8 * g[2],
    )
    bx, by, bz = (
        c0 * g[3] + c1 * g[4] + c2 * g[5],
        c3 * g[3] + c4 * g[4] + c5 * g[5],
        c6 * g[3] + c7 * g[4] + c8 * g[5],
    )
    cx, cy, cz = (
        c0 * g[6] + c1 * g[7] + c2 * g[8],
        c3 * g[6] + c4 * g[7] + c5 * g[8],
        c6 * g[6] + c7 * g[7] + c8 * g[8],
    )
    second = viscous_second * inverse
    lxx = w[0] * ax + w[3] * bx + w[6] * cx
    lyy = w[1] * ay + w[4] * by + w[7] * cy
    lzz = w[2] * az + w[5] * bz + w[8] * cz
    lxy = w[0] * ay + w[3] * by + w[6] * cy + (w[1] * ax + w[4] * bx + w[7] * cx)
    lxz = w[0] * az + w[3] * bz + w[6] * cz + (w[2] * ax + w[5] * bx + w[8] * cx)
    lyz = w[1] * az + w[4] * bz + w[7] * cz + (w[2] * ay + w[5] * by + w[8] * cy)
    exx = h0 + half * (h0 * h0 + h1 * h1 + h2 * h2)
    eyy = h4 + half * (h3 * h3 + h4 * h4 + h5 * h5)
    ezz = h8 + half * (h6 * h6 + h7 * h7 + h8 * h8)
    exy = (h1 + h3) + (h0 * h3 + h1 * h4 + h2 * h5)
    exz = (h2 + h6) + (h0 * h6 + h1 * h7 + h2 * h8)
    eyz = (h5 + h7) + (h3 * h6 + h4 * h7 + h5 * h8)
    flow = lxx + lyy + lzz
    drag = viscous_first * inverse * flow
    pressure = lame_first * (exx + eyy + ezz) + drag
    elastic, viscous = lame_second + lame_second, second + second
    taken = (
        drag * flow
        + viscous * (lxx * lxx + lyy * lyy + lzz * lzz)
        + second * (lxy * lxy + lxz * lxz + lyz * lyz)
    )
    txx = pressure + elastic * exx + viscous * lxx
    tyy = pressure + elastic * eyy + viscous * lyy
    tzz = pressure + elastic * ezz + viscous * lzz
    txy = lame_second * exy + second * lxy
    txz = lame_second * exz + second * lxz
    tyz = lame_second * eyz + second * lyz
    pulls = (
        txx * ax + txy * ay + txz * az, txy * ax + tyy * ay + tyz * az,
        txz * ax + tyz * ay + tzz * az, txx * bx + txy * by + txz * bz,
        txy * bx + tyy * by + tyz * bz, txz * bx + tyz * by + tzz * bz,
        txx * cx + txy * cy + txz * cz, txy * cx + tyy * cy + tyz * cz,
        txz * cx + tyz * cy + tzz * cz,
    )  # fmt: skip
    return pulls, jacobian, taken
