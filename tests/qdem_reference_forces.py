"""Forces of the elements in plain NumPy: what the compiled kernels must give, and what they read.

Names of all measures together, so that a test runs over them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from qdem_fem.element.finger import compute_nominal_stress as stress_finger
from qdem_fem.element.finger import compute_strain as strain_finger
from qdem_fem.element.kinematics import (
    IDENTITY,
    apply_hooke,
    contract,
    find_cofactor,
    find_displacement_gradient,
    find_trace,
    find_volume_change,
    find_von_mises,
    transpose,
)
from qdem_fem.element.small import compute_nominal_stress as stress_small
from qdem_fem.element.strain_measures import MEASURES, Strain, compute_cauchy_stress
from qdem_fem.files import Floats, Integers
from tests.qdem_construction import particle_forces, strain_rate

__all__ = [
    "IDENTITY", "STRESS", "Elements", "Strain", "apply_hooke", "compute_cauchy_stress",
    "compute_elastic_energy", "contract", "find_cofactor", "find_displacement_gradient",
    "find_trace", "find_volume_change", "find_von_mises", "internal_forces", "strain_finger",
    "stress_finger", "stress_small", "stress_viscous", "stress_viscous_small", "transpose",
]  # fmt: skip
STRESS = {name: measure.compute_nominal_stress for name, measure in MEASURES.items()}


def compute_elastic_energy(
    H: Floats, volume: Floats, lame_first: ArrayLike, lame_second: ArrayLike, strain: Strain
) -> Floats:
    """Stored energy of every element [J], (m,)."""
    found: Floats = MEASURES[strain].compute_stored_energy(H, volume, lame_first, lame_second)
    return found


class Elements(NamedTuple):
    """What an element keeps of the reference configuration."""

    nodes: Integers  # node numbers (m, 4)
    gradients: Floats
    """Rows: grad_X N_1, grad_X N_2, grad_X N_3 [1/m], (m, 3, 3), the inverse of the edge vectors;
    grad_X N_0 is minus their sum."""
    volume: Floats  # reference volume V0 [m^3], (m,)


def stress_viscous(
    H: Floats, H_rate: Floats, viscous_first: ArrayLike, viscous_second: ArrayLike
) -> Floats:
    """P_D = T_D cof(F) [Pa] in the current configuration: L = H_rate F^-1, D = sym L (eqs 5-7).

    ``H_rate`` [1/s], viscosities [Pa s].  Goes with ``finger`` and ``svk``.
    """
    L = H_rate @ np.linalg.inv(IDENTITY + H)
    return apply_hooke(strain_rate(L), viscous_first, viscous_second) @ find_cofactor(IDENTITY + H)


def stress_viscous_small(
    H_rate: Floats, viscous_first: ArrayLike, viscous_second: ArrayLike
) -> Floats:
    """P_D = lambda_D tr(e_rate) I + 2 mu_D e_rate [Pa], e_rate = sym H_rate, for ``small``."""
    return apply_hooke(strain_rate(H_rate), viscous_first, viscous_second)


def internal_forces(
    elements: Elements,
    displacement: Floats,
    velocity: Floats,
    lame: tuple[ArrayLike, ArrayLike],
    viscous: tuple[ArrayLike, ArrayLike] = (0.0, 0.0),
    strain: Strain = "finger",
) -> Floats:
    """Internal forces on all nodes [N], (n, 3): sum over the elements of -V0 P grad_X N_a (eq. 11).

    ``displacement`` (n, 3) [m], ``velocity`` (n, 3) [m/s]; ``lame`` = (lambda_E, mu_E) [Pa],
    ``viscous`` = (lambda_D, mu_D) [Pa s], each a float or (m,).  No limit is put on lambda_D.
    """
    H = find_displacement_gradient(elements.gradients, elements.nodes, displacement)
    P = STRESS[strain](H, *lame)
    if any(np.any(value) for value in viscous):
        H_rate = find_displacement_gradient(elements.gradients, elements.nodes, velocity)
        if strain == "small":
            P = P + stress_viscous_small(H_rate, *viscous)
        else:
            P = P + stress_viscous(H, H_rate, *viscous)
    others = -elements.volume[:, None, None] * (elements.gradients @ transpose(P))
    forces = np.concatenate([-others.sum(axis=1, keepdims=True), others], axis=1)
    return particle_forces(elements.nodes, forces, len(displacement))
