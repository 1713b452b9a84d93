"""Linear finite elements: ``P = lambda tr(e) I + 2 mu e``, ``e = sym H``.

Not objective: do not use it on bodies that turn.
"""

from typing import Any, NamedTuple

from numpy.typing import ArrayLike

from qdem_fem.element.kinematics import apply_hooke, compute_quadratic_energy, transpose
from qdem_fem.element.stress import Nine
from qdem_fem.files import Floats


class Small(NamedTuple):
    """Linear elasticity; ``half`` is 0.5 in the kernel's precision."""

    half: Any


MEASURE = Small
OBJECTIVE = False


def compute_strain(H: Floats) -> Floats:
    """e = (H + H^T)/2 [-]."""
    return (H + transpose(H)) / 2


def compute_nominal_stress(H: Floats, lame_first: ArrayLike, lame_second: ArrayLike) -> Floats:
    """P = T = lambda tr(e) I + 2 mu e [Pa] of linear elasticity."""
    return apply_hooke(compute_strain(H), lame_first, lame_second)


def compute_stored_energy(
    H: Floats, volume: Floats, lame_first: ArrayLike, lame_second: ArrayLike
) -> Floats:
    """Stored energy of every element [J], (m,): the potential of the stress."""
    return compute_quadratic_energy(compute_strain(H), volume, lame_first, lame_second)


def find_stress_numbers(h: Nine, lame_first: Any, lame_second: Any, half: Any) -> tuple[Nine, Any]:
    """Linear elasticity, ``P = lambda tr(H) I + mu (H + H^T)``; with it the method is linear FEM.

    Returns 1 for ``J`` (NaN where ``H`` is not finite).  Not for bodies that turn: a rotation by
    the angle t is taken for a strain of t^2/2.
    """
    h0, h1, h2, h3, h4, h5, h6, h7, h8 = h
    trace = h0 + h4 + h8
    pressure = lame_first * trace
    twice = lame_second + lame_second
    xy, xz, yz = lame_second * (h1 + h3), lame_second * (h2 + h6), lame_second * (h5 + h7)
    stress = (
        pressure + twice * h0, xy, xz, xy, pressure + twice * h4, yz, xz, yz, pressure + twice * h8
    )  # fmt: skip
    return stress, (half + half) + (trace - trace)


def find_viscous_numbers(
    h: Nine, d: Nine, viscous_first: Any, viscous_second: Any, half: Any
) -> Nine:
    """``P = lambda_D tr(Hdot) I + mu_D (Hdot + Hdot^T)``: linear viscosity."""
    pressure = viscous_first * (d[0] + d[4] + d[8])
    twice = viscous_second + viscous_second
    xy, xz = viscous_second * (d[1] + d[3]), viscous_second * (d[2] + d[6])
    yz = viscous_second * (d[5] + d[7])
    return (
        pressure + twice * d[0], xy, xz, xy, pressure + twice * d[4], yz, xz, yz,
        pressure + twice * d[8],
    )  # fmt: skip
