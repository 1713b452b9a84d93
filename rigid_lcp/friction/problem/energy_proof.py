"""Whether a W gives energy: forces within the cones of friction with ``r . W r < 0``.

Where ``r . W r > 0`` for all forces r of the cones K other than none (W is strictly copositive on
K), a solution exists whatever q is: ``u + mu |u_T| n`` is a continuous map of r, and as
``r . (u + mu |u_T| n) >= r . W r + r . q`` it is coercive on K, which is enough (Hartman and
Stampacchia, Acta Math. 115 (1966) 271).  W of bodies, ``J M^-1 J^T``, never gives energy.  One that
is known to three digits can: forces of a wedged packing that balance each other have ``W r = 0``,
and what an error in W makes of that may have any sign.  Nothing promises a solution there.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rigid_lcp.friction.problem.cones import natural_map
from rigid_lcp.friction.problem.definition import FrictionProblem

Floats = NDArray[np.float64]

DESCENT_STEPS = 3000
"""Of the descent: forces that balance each other are found in some dozens, rarely in a thousand."""
CERTAIN_ENERGY = 1e-10
"""Energy over that of the same forces on the mean diagonal of W that is no round-off [-]."""


def find_least_energy(problem: FrictionProblem) -> tuple[float, Floats]:
    """``rho r . W r`` [-] of forces r in K of length one, and these, (nc * dim,): where a descent
    from equal normal forces ends, or becomes less than -`CERTAIN_ENERGY`.

    Negative: a proof that W gives energy.  Positive: no proof that it does not, as the least of a
    form that is not convex may be elsewhere.  The steps, ``r -> P_K(r - S r / |S|)`` with S the
    symmetric part of W, have Nesterov's momentum, which is dropped where the energy grows.
    """
    w = problem.delassus
    form = sp.csr_array((w + w.T) * (0.5 * problem.rho))
    largest = float(abs(form).sum(axis=1).max())
    force = np.zeros(len(problem.offset))
    force[:: problem.dim] = problem.contacts**-0.5
    energy, ahead, momentum = float(force @ (form @ force)), force, 1.0
    for _ in range(DESCENT_STEPS):
        step = _in_cones(ahead - (form @ ahead) / largest, problem)
        size = float(np.linalg.norm(step))
        if size == 0.0 or energy < -CERTAIN_ENERGY:
            break
        step /= size
        reached = float(step @ (form @ step))
        if reached <= energy:
            after = 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * momentum**2))
            ahead = step + (momentum - 1.0) / after * (step - force)
            force, energy, momentum = step, reached, after
        elif ahead is force:  # round-off: without momentum the energy does not grow
            break
        else:
            ahead, momentum = force, 1.0
    return energy, force


def gives_energy(problem: FrictionProblem) -> bool:
    """Whether forces are found on which W gives energy; never where it is made of bodies."""
    return (
        problem.bodies is None
        and problem.contacts > 0
        and find_least_energy(problem)[0] < -CERTAIN_ENERGY
    )


def _in_cones(force: Floats, problem: FrictionProblem) -> Floats:
    """``P_K(r)``: r less its natural map without velocity."""
    rows = force.reshape(problem.contacts, problem.dim)
    nearest = rows - natural_map(rows, np.zeros_like(rows), problem.friction, 1.0)
    return np.asarray(nearest.ravel())
