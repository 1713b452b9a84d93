"""A twin of the unique forces: least squares."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from rigid_lcp import FrictionProblem
from rigid_lcp.arrays import Floats
from rigid_lcp.unique.micro_displacements import (
    find_free_motion,
    require_bodies,
    require_stiffness,
    scale_jacobian,
)


def find_least_forces(problem: FrictionProblem, stiffness: ArrayLike = 1.0) -> Floats:
    """``argmin sum f^2 / k`` with every contact closed and sticking, (nc * dim,) [N]."""
    weight = np.sqrt(require_stiffness(problem, stiffness).ravel())
    jacobian, _ = scale_jacobian(require_bodies(problem))
    scaled = sp.csr_array(sp.diags_array(weight) @ jacobian).toarray()
    least, *_ = np.linalg.lstsq(scaled.T, -find_free_motion(jacobian, problem.offset), rcond=1e-12)
    return np.asarray(weight * least)
