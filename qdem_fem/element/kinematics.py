"""Deformation of elements on arrays: gradients, invariants, and what is read from a stress.

Arrays hold one 3x3 matrix for each element, (m, 3, 3); material constants are floats or (m,)
arrays.  All is written in the displacement gradient H = F - I, so that stresses keep their relative
precision down to the smallest displacements.
"""

import numpy as np
from numpy.typing import ArrayLike

from qdem_fem.files import Floats, Integers

IDENTITY = np.eye(3)


def find_displacement_gradient(
    gradients: Floats, elements: Integers, displacement: Floats
) -> Floats:
    """H = sum_a u_a (x) grad_X N_a [-], (m, 3, 3), of displacements (n, 3) [m]; F = I + H (eq. 1).

    Of velocities [m/s] it is the rate of H [1/s].  Only differences to vertex 0 enter, so a common
    translation leaves no trace.
    """
    u = displacement[elements]
    return np.swapaxes(u[:, 1:] - u[:, :1], -1, -2) @ gradients


def transpose(matrix: Floats) -> Floats:
    """A^T of every matrix."""
    return np.swapaxes(matrix, -1, -2)


def find_trace(matrix: Floats) -> Floats:
    """tr A of every matrix, with two axes of length 1 to multiply matrices."""
    return np.trace(matrix, axis1=-2, axis2=-1)[..., None, None]


def contract(first: Floats, second: Floats) -> Floats:
    """A : B of every pair of matrices, (m,)."""
    return np.einsum("...ij,...ij->...", first, second)


def find_cofactor(matrix: Floats) -> Floats:
    """cof A = det(A) A^-T of every matrix, also where A has no inverse: cyclic minors."""
    minors = np.empty_like(matrix)
    for i, j in np.ndindex(3, 3):
        (a, b), (c, d) = ((i - 2, i - 1), (j - 2, j - 1))
        minors[..., i, j] = (
            matrix[..., a, c] * matrix[..., b, d] - matrix[..., a, d] * matrix[..., b, c]
        )
    return minors


def find_volume_change(H: Floats) -> Floats:
    """J - 1 = tr H + tr cof H + det H [-], (m,), without cancellation."""
    minors = find_cofactor(H)
    determinant = contract(H, minors) / 3
    return find_trace(H)[..., 0, 0] + find_trace(minors)[..., 0, 0] + determinant


def apply_hooke(tensor: Floats, first: ArrayLike, second: ArrayLike) -> Floats:
    """first tr(A) I + 2 second A of a symmetric A (..., 3, 3): the common form of eqs 2 and 7."""
    trace = np.trace(tensor, axis1=-2, axis2=-1)[..., None, None]
    one, two = (np.asarray(value, float)[..., None, None] for value in (first, second))
    return one * trace * np.eye(3) + 2 * two * tensor


def compute_quadratic_energy(
    strain: Floats, volume: Floats, lame_first: ArrayLike, lame_second: ArrayLike
) -> Floats:
    """``V0 (lambda/2 tr(e)^2 + mu e : e)`` of every element [J], (m,); ``volume`` is V0 [m^3]."""
    lam, mu = np.asarray(lame_first, float), np.asarray(lame_second, float)
    first = find_trace(strain)[..., 0, 0]
    return volume * (lam / 2 * first**2 + mu * contract(strain, strain))


def find_von_mises(cauchy: Floats) -> Floats:
    """sqrt(3/2 s : s) [Pa], (m,), with the deviator s of the Cauchy stress (m, 3, 3)."""
    deviator = cauchy - find_trace(cauchy) * IDENTITY / 3
    return np.sqrt(1.5 * contract(deviator, deviator))
