"""Forces of the elements in plain NumPy: what the compiled kernels must give, and what they read.

Names of all measures together, so that a test runs over them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from qdem_fem.element.finger import strain_of as strain_finger
from qdem_fem.element.finger import stress_nominal as stress_finger
from qdem_fem.element.kinematics import (
    IDENTITY,
    FloatArray,
    IntArray,
    cofactor,
    contraction,
    displacement_gradient,
    isotropic,
    trace,
    transposed,
    volume_change,
    von_mises,
)
from qdem_fem.element.small import stress_nominal as stress_small
from qdem_fem.element.strain_measures import MEASURES, Strain, elastic_energy, stress_cauchy
from tests.qdem_construction import particle_forces, strain_rate

__all__ = [
    "IDENTITY", "STRESS", "Elements", "FloatArray", "Strain", "cofactor", "contraction",
    "displacement_gradient", "elastic_energy", "internal_forces", "isotropic", "strain_finger",
    "stress_cauchy", "stress_finger", "stress_finger_expanded", "stress_small", "stress_viscous",
    "stress_viscous_small", "trace", "transposed", "volume_change", "von_mises",
]  # fmt: skip
STRESS = {name: measure.stress_nominal for name, measure in MEASURES.items()}


class Elements(NamedTuple):
    """What an element keeps of the reference configuration."""

    nodes: IntArray
    """Node numbers (m, 4)."""
    gradients: FloatArray
    """Rows: grad_X N_1, grad_X N_2, grad_X N_3 [1/m], (m, 3, 3), the inverse of the edge vectors;
    grad_X N_0 is minus their sum."""
    volume: FloatArray
    """Reference volume V0 [m^3], (m,)."""


def stress_finger_expanded(
    H: FloatArray, lame_first: ArrayLike, lame_second: ArrayLike
) -> FloatArray:
    """`stress_finger` from one cofactor matrix and no product of matrices, as kernels do it.

    With C = cof F and a = lambda tr(eps), T = a I + mu (B - I); B C = F F^T cof F = J F gives

        P = T C = a C + mu (J F - C).

    Cofactors are quadratic: C = (1 + tr H) I - K, K = H^T - cof H.  The invariants tr H,
    II = tr cof H, III = det H give J = 1 + j with j = tr H + II + III, and 2 tr(eps) =
    2 tr H + H : H.  In J F - C = (1 + j)(I + H) - (1 + tr H) I + K the unit terms drop out:

        P = alpha I + beta H + gamma K
        alpha = a (1 + tr H) + mu (II + III),  beta = mu (1 + j),  gamma = mu - a

    To first order a I + mu (H + H^T): no small difference of large numbers, at any H.
    """
    lam, mu = (np.asarray(value, float)[..., None, None] for value in (lame_first, lame_second))
    minors = cofactor(H)
    K = transposed(H) - minors
    first, second = trace(H), trace(minors)
    third = contraction(H, minors)[..., None, None] / 3
    a = lam * (first + contraction(H, H)[..., None, None] / 2)
    alpha = a * (1 + first) + mu * (second + third)
    beta = mu * (1 + first + second + third)
    return alpha * IDENTITY + beta * H + (mu - a) * K


def stress_viscous(
    H: FloatArray, H_rate: FloatArray, viscous_first: ArrayLike, viscous_second: ArrayLike
) -> FloatArray:
    """P_D = T_D cof(F) [Pa] in the current configuration: L = H_rate F^-1, D = sym L (eqs 5-7).

    ``H_rate`` [1/s], viscosities [Pa s].  Goes with ``finger``, ``svk`` and ``corotational``.
    """
    L = H_rate @ np.linalg.inv(IDENTITY + H)
    return isotropic(strain_rate(L), viscous_first, viscous_second) @ cofactor(IDENTITY + H)


def stress_viscous_small(
    H_rate: FloatArray, viscous_first: ArrayLike, viscous_second: ArrayLike
) -> FloatArray:
    """P_D = lambda_D tr(e_rate) I + 2 mu_D e_rate [Pa], e_rate = sym H_rate, for ``small``."""
    return isotropic(strain_rate(H_rate), viscous_first, viscous_second)


def internal_forces(
    elements: Elements,
    displacement: FloatArray,
    velocity: FloatArray,
    lame: tuple[ArrayLike, ArrayLike],
    viscous: tuple[ArrayLike, ArrayLike] = (0.0, 0.0),
    strain: Strain = "finger",
) -> FloatArray:
    """Internal forces on all nodes [N], (n, 3): sum over the elements of -V0 P grad_X N_a (eq. 11).

    ``displacement`` (n, 3) [m], ``velocity`` (n, 3) [m/s]; ``lame`` = (lambda_E, mu_E) [Pa],
    ``viscous`` = (lambda_D, mu_D) [Pa s], each a float or (m,).  No limit is put on lambda_D.
    """
    H = displacement_gradient(elements.gradients, elements.nodes, displacement)
    P = STRESS[strain](H, *lame)
    if any(np.any(value) for value in viscous):
        H_rate = displacement_gradient(elements.gradients, elements.nodes, velocity)
        if strain == "small":
            P = P + stress_viscous_small(H_rate, *viscous)
        else:
            P = P + stress_viscous(H, H_rate, *viscous)
    others = -elements.volume[:, None, None] * (elements.gradients @ transposed(P))
    forces = np.concatenate([-others.sum(axis=1, keepdims=True), others], axis=1)
    return particle_forces(elements.nodes, forces, len(displacement))
