"""Whether elastic contacts hold all together: the case of section 8 with one answer, whatever the
start.

Let every contact be closed and stick (a frictionless one carry its normal force), so that springs
are linear, ``f = -K J dq``.  Balance ``J^T f + Q = 0`` then has one f: K is positive, and f is the
force of least ``sum f^2 / k`` of all that balance, cones or no cones.  If it lies in the cones of
friction it solves the rigid problem, is that of Coulomb's springs at rest, and the least there is
in the cones as well.  That is asked here, from the problem alone and before any relaxation, so an
earlier state has no part in it.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from rigid_lcp.friction.problem import FrictionProblem
from rigid_lcp.unique.elastic_network import slider_forces

Floats = NDArray[np.float64]

HELD_STEP = 1e10
"""Length of the proximal steps in units of the stiffest mode's time."""
HELD_STEPS = 8
"""Proximal steps, all with one factorisation: each leaves 1e-10 over the softest mode of the
error."""
OUTSIDE_CONE = 1e-3
"""Part of the greatest force by which a contact may be outside its cone after the first step."""


def find_held_displacement(
    problem: FrictionProblem, jacobian: sp.csr_array, free: Floats, stiffness: Floats,
    tolerance: float,
) -> Floats | None:  # fmt: skip
    """Mass-free displacements (ndof,) at which all contacts hold, or None where they do not.

    ``jacobian`` (nc * dim, ndof) mass free; ``free`` (ndof,) accelerations without contact forces;
    ``stiffness`` (nc, dim) in units of the stiffest mode; ``tolerance`` on the scale-free residual
    and on the relative change of the forces in a last step.
    """
    springs = keep_held_stiffness(stiffness, problem.friction)
    weighted = sp.csr_array(sp.diags_array(springs.ravel()) @ jacobian)
    identity = sp.eye_array(jacobian.shape[1], format="csc")
    solve = splu(sp.csc_array(identity / HELD_STEP + jacobian.T @ weighted)).solve
    displacement, trial = np.zeros(jacobian.shape[1]), np.zeros(springs.shape)
    for _ in range(HELD_STEPS):
        displacement = displacement + solve(free + jacobian.T @ trial.ravel())
        before, trial = trial, -(weighted @ displacement).reshape(springs.shape)
        force = slider_forces(trial, problem.friction * np.maximum(trial[:, 0], 0.0))
        if not np.abs(trial - force).max() <= OUTSIDE_CONE * np.abs(trial).max():
            return None
        change = float(np.linalg.norm(trial - before))
        if (
            change <= tolerance * float(np.linalg.norm(trial))
            and problem.residual(force.ravel()) <= tolerance
        ):
            return displacement
    return None


def keep_held_stiffness(stiffness: Floats, friction: Floats) -> Floats:
    """Stiffness (nc, dim) [N/m] of contacts that hold: none sideways without friction."""
    springs = stiffness.copy()
    springs[friction <= 0.0, 1:] = 0.0
    return springs
