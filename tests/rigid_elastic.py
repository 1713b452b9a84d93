"""A twin of the unique forces: least squares."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from rigid_lcp import FrictionProblem
from rigid_lcp.arrays import Floats
from rigid_lcp.unique.micro_displacements import (
    bodies_of,
    contact_stiffness,
    free_motion,
    mass_free_jacobian,
)


def find_least_forces(problem: FrictionProblem, stiffness: ArrayLike = 1.0) -> Floats:
    """``argmin sum f^2 / k`` with every contact closed and sticking, (nc * dim,) [N]."""
    weight = np.sqrt(contact_stiffness(problem, stiffness).ravel())
    jacobian, _ = mass_free_jacobian(bodies_of(problem))
    scaled = sp.csr_array(sp.diags_array(weight) @ jacobian).toarray()
    least, *_ = np.linalg.lstsq(scaled.T, -free_motion(jacobian, problem.offset), rcond=1e-12)
    return np.asarray(weight * least)
