"""Stress and internal force of every element in plain NumPy: what the fast kernels must give.

Four laws map the displacement gradient H = F - I to the nominal (first Piola-Kirchhoff) stress P;
with the constant reference gradients of the shape functions the force on vertex a is

    f_a = -V0 P grad_X N_a                                     (eqs 9, 10 with the normal outwards)

``finger``       P = T cof(F), T = lambda tr(eps) I + 2 mu eps, eps = (F F^T - I)/2: the paper
``small``        P = T, T = lambda tr(e) I + 2 mu e, e = sym H: linear finite elements
``svk``          P = F S, S = lambda tr(E) I + 2 mu E, E = (F^T F - I)/2: Saint Venant-Kirchhoff
``corotational`` P = R (lambda tr(Y) I + 2 mu Y), Y = U - I, F = R U: Hooke in the rotated frame

All agree with ``small`` up to a relative difference of the order of the strain.  ``finger``,
``svk`` and ``corotational`` are objective, P(QF) = Q P(F); ``small`` is not: do not use it on
bodies that turn.  ``svk`` and ``corotational`` derive from a potential; ``finger`` does only for
lambda = mu (nu = 0.25), else a closed loop of strains of size a returns with work of the order of
a times the stored energy.

Everything is written in H, so that stresses keep their relative precision down to the smallest
displacements: F F^T - I is formed as H + H^T + H H^T.  Arrays hold one 3x3 matrix for each
element, (m, 3, 3); material constants are floats or (m,) arrays.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from qdem_fem.construction import isotropic, particle_forces, strain_rate

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
Strain = Literal["finger", "small", "svk", "corotational"]

IDENTITY = np.eye(3)


class Elements(NamedTuple):
    """What an element keeps of the reference configuration."""

    nodes: IntArray
    """Node numbers (m, 4)."""
    gradients: FloatArray
    """Rows: grad_X N_1, grad_X N_2, grad_X N_3 [1/m], (m, 3, 3), the inverse of the edge vectors;
    grad_X N_0 is minus their sum."""
    volume: FloatArray
    """Reference volume V0 [m^3], (m,)."""


# --- kinematics ----------------------------------------------------------------------------------


def displacement_gradient(
    gradients: FloatArray, elements: IntArray, displacement: FloatArray
) -> FloatArray:
    """H = sum_a u_a (x) grad_X N_a [-], (m, 3, 3), of displacements (n, 3) [m]; F = I + H (eq. 1).

    Of velocities [m/s] it is the rate of H [1/s].  Only differences to vertex 0 enter, so a common
    translation leaves no trace.
    """
    u = displacement[elements]
    return np.swapaxes(u[:, 1:] - u[:, :1], -1, -2) @ gradients


def transposed(matrix: FloatArray) -> FloatArray:
    """A^T of every matrix."""
    return np.swapaxes(matrix, -1, -2)


def trace(matrix: FloatArray) -> FloatArray:
    """tr A of every matrix, with two axes of length 1 to multiply matrices."""
    return np.trace(matrix, axis1=-2, axis2=-1)[..., None, None]


def contraction(first: FloatArray, second: FloatArray) -> FloatArray:
    """A : B of every pair of matrices, (m,)."""
    return np.einsum("...ij,...ij->...", first, second)


def cofactor(matrix: FloatArray) -> FloatArray:
    """cof A = det(A) A^-T of every matrix, also where A has no inverse: cyclic minors."""
    minors = np.empty_like(matrix)
    for i, j in np.ndindex(3, 3):
        (a, b), (c, d) = ((i - 2, i - 1), (j - 2, j - 1))
        minors[..., i, j] = (
            matrix[..., a, c] * matrix[..., b, d] - matrix[..., a, d] * matrix[..., b, c]
        )
    return minors


def volume_change(H: FloatArray) -> FloatArray:
    """J - 1 = tr H + tr cof H + det H [-], (m,), without cancellation."""
    minors = cofactor(H)
    determinant = contraction(H, minors) / 3
    return trace(H)[..., 0, 0] + trace(minors)[..., 0, 0] + determinant


def strain_finger(H: FloatArray) -> FloatArray:
    """eps = (F F^T - I)/2 = (H + H^T + H H^T)/2 [-] (eqs 3, 4)."""
    return (H + transposed(H) + H @ transposed(H)) / 2


def strain_small(H: FloatArray) -> FloatArray:
    """e = (H + H^T)/2 [-]."""
    return (H + transposed(H)) / 2


def strain_svk(H: FloatArray) -> FloatArray:
    """Green's strain E = (F^T F - I)/2 = (H + H^T + H^T H)/2 [-]."""
    return (H + transposed(H) + transposed(H) @ H) / 2


def strain_corotational(H: FloatArray) -> FloatArray:
    """Biot's strain Y = U - I [-], of the polar decomposition F = R U.

    U^2 = I + 2 E, so Y has the directions of E and the values sqrt(1 + 2 e) - 1, written
    2 e/(1 + sqrt(1 + 2 e)).
    """
    value, direction = np.linalg.eigh(strain_svk(H))
    # a flat element has the stretch 0; round-off may leave its square just below
    stretch = 2 * value / (1 + np.sqrt(np.maximum(1 + 2 * value, 0)))
    return (direction * stretch[..., None, :]) @ transposed(direction)


# --- elastic stress ------------------------------------------------------------------------------


def stress_finger(H: FloatArray, lame_first: ArrayLike, lame_second: ArrayLike) -> FloatArray:
    """P = T cof(F) [Pa] with the Cauchy stress T of the Finger strain (eqs 2, 9, 10)."""
    return isotropic(strain_finger(H), lame_first, lame_second) @ cofactor(IDENTITY + H)


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


def stress_small(H: FloatArray, lame_first: ArrayLike, lame_second: ArrayLike) -> FloatArray:
    """P = T = lambda tr(e) I + 2 mu e [Pa] of linear elasticity."""
    return isotropic(strain_small(H), lame_first, lame_second)


def stress_svk(H: FloatArray, lame_first: ArrayLike, lame_second: ArrayLike) -> FloatArray:
    """P = F S [Pa], S = lambda tr(E) I + 2 mu E; P = dW/dF of W = lambda/2 tr(E)^2 + mu E : E.

    Softens under compression, and loses all stiffness below a stretch of 0.58.
    """
    return (IDENTITY + H) @ isotropic(strain_svk(H), lame_first, lame_second)


def stress_corotational(H: FloatArray, lame_first: ArrayLike, lame_second: ArrayLike) -> FloatArray:
    """P = R (lambda tr(Y) I + 2 mu Y) [Pa]; P = dW/dF of W = lambda/2 tr(Y)^2 + mu Y : Y.

    R = F U^-1.  Not for flat elements, where U has no inverse (`numpy.linalg.LinAlgError`).
    """
    Y = strain_corotational(H)
    rotation = (IDENTITY + H) @ np.linalg.inv(IDENTITY + Y)
    return rotation @ isotropic(Y, lame_first, lame_second)


STRESS = {
    "finger": stress_finger,
    "small": stress_small,
    "svk": stress_svk,
    "corotational": stress_corotational,
}


# --- viscous stress ------------------------------------------------------------------------------


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


# --- what is read from a stress ------------------------------------------------------------------


def stress_cauchy(H: FloatArray, nominal: FloatArray, strain: Strain) -> FloatArray:
    """Cauchy stress T = P F^T/J [Pa], (m, 3, 3); ``small`` does not tell T from P."""
    if strain == "small":
        return nominal
    return nominal @ transposed(IDENTITY + H) / (1 + volume_change(H))[..., None, None]


def von_mises(cauchy: FloatArray) -> FloatArray:
    """sqrt(3/2 s : s) [Pa], (m,), with the deviator s of the Cauchy stress (m, 3, 3)."""
    deviator = cauchy - trace(cauchy) * IDENTITY / 3
    return np.sqrt(1.5 * contraction(deviator, deviator))


def elastic_energy(
    H: FloatArray,
    volume: FloatArray,
    lame_first: ArrayLike,
    lame_second: ArrayLike,
    strain: Strain,
) -> FloatArray:
    """Stored energy of every element [J], (m,); ``volume`` is V0 (m,) [m^3].

    ``small``, ``svk``, ``corotational``: the potential V0 (lambda/2 tr(e)^2 + mu e : e) of the
    stress, e the strain of that law.  ``finger`` has the potential
    V0 mu (J tr(eps) - (J - 1)) for lambda = mu, and none else: V0 (lambda - mu)/2 tr(eps)^2 is
    added, so the value is exact for nu = 0.25 and within the order of the strain otherwise.
    """
    lam, mu = np.asarray(lame_first, float), np.asarray(lame_second, float)
    if strain == "finger":
        first, minors = trace(H)[..., 0, 0], cofactor(H)
        spread = first + contraction(H, H) / 2  # tr(eps)
        beyond_first = trace(minors)[..., 0, 0] + contraction(H, minors) / 3
        j = first + beyond_first  # volume_change(H)
        # (1 + j) tr(eps) - j, its first order tr H - tr H left out
        density = mu * (contraction(H, H) / 2 - beyond_first + j * spread)
        return volume * (density + (lam - mu) / 2 * spread**2)
    measure = {
        "small": strain_small,
        "svk": strain_svk,
        "corotational": strain_corotational,
    }[strain](H)
    return volume * (lam / 2 * trace(measure)[..., 0, 0] ** 2 + mu * contraction(measure, measure))


# --- forces --------------------------------------------------------------------------------------


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
