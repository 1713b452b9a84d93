"""Proofs: that contacts can not be kept from approaching, and that W gives energy.

Where ``r . W r > 0`` for all forces r of the cones K other than none (W is strictly copositive on
K), a solution exists whatever q is: ``u + mu |u_T| n`` is a continuous map of r, and as
``r . (u + mu |u_T| n) >= r . W r + r . q`` it is coercive on K, which is enough (Hartman and
Stampacchia, Acta Math. 115 (1966) 271).  W of bodies, ``J M^-1 J^T``, never gives energy.  One that
is known to three digits can: forces of a wedged packing that balance each other have ``W r = 0``,
and what an error in W makes of that may have any sign.  Nothing promises a solution there.
"""

from dataclasses import dataclass
from itertools import product
from time import perf_counter

import numpy as np
import scipy.sparse as sp

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.friction.problem.cones import find_natural_map
from rigid_lcp.friction.problem.definition import FrictionProblem


@dataclass(frozen=True)
class ProofNumbers:
    """Descent to the least energy, and forces that do not suffice."""

    descent_steps: int = 3000  # at most [-]: forces in balance take some dozens, rarely a thousand
    certain_energy: float = 1e-10  # over that on the mean diagonal of W: no round-off [-]
    equilibrations: int = 3  # of rows and columns [-]: HiGHS takes what is below 1e-9 for zero
    approach_left: float = 1e-7  # over the largest, that no forces stop [-]
    round_off: float = 1e-12  # of a proof's sums, over their parts [-]


PROOFS = ProofNumbers()


def find_least_energy(problem: FrictionProblem, seconds: float = np.inf) -> tuple[float, Floats]:
    """``rho r . W r`` [-] of forces r in K of length one, and these, (nc * dim,): where a descent
    from equal normal forces ends, in so many seconds, or becomes less than
    -`PROOFS.certain_energy`.

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
    end = perf_counter() + seconds
    for _ in range(PROOFS.descent_steps):
        if perf_counter() > end:
            break
        step = _project_forces(ahead - (form @ ahead) / largest, problem)
        size = float(np.linalg.norm(step))
        if size == 0.0 or energy < -PROOFS.certain_energy:
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


def gives_energy(problem: FrictionProblem, seconds: float = np.inf) -> bool:
    """Whether forces are found, in so many seconds, on which W gives energy; never where it is made
    of bodies."""
    return (
        problem.bodies is None and problem.contacts > 0
        and find_least_energy(problem, seconds)[0] < -PROOFS.certain_energy
    )  # fmt: skip


def _project_forces(force: Floats, problem: FrictionProblem) -> Floats:
    """``P_K(r)``: r less its natural map without velocity."""
    rows = force.reshape(problem.contacts, problem.dim)
    nearest = rows - find_natural_map(rows, np.zeros_like(rows), problem.friction, 1.0)
    return np.asarray(nearest.ravel())


def prove_forces_insufficient(
    problem: FrictionProblem, slip: Ints | None = None, *, seconds: float = np.inf
) -> bool:
    """Whether it is proved that no r in K gives ``u_N >= 0`` at every contact.

    ``slip`` (nc,), in 2D: +-1 where a slip leaves the edge of the cone with that sign only, 0
    where the whole cone is free.  ``seconds``: within so many, or there is no proof.  Every force
    of a cone is a sum of forces along its edges; in 3D the cone is replaced by the pyramid around
    it, so that a proof stays one.

    The programme is: least t with ``-u_N <= t``.  Its dual y >= 0 is the proof (Farkas' lemma): no
    force along an edge makes ``y . approach`` less than without forces, where it is above zero.
    That is looked at here, as HiGHS takes a light body between heavy ones for one of no mass.  With
    masses of a ratio of 1e12 round-off has taken what would tell.
    """
    from scipy.optimize import linprog

    contacts, dim = problem.contacts, problem.dim
    edges = []
    for signs in product((1.0, -1.0), repeat=dim - 1):
        direction = np.ones((contacts, dim))
        free = np.broadcast_to(signs, (contacts, dim - 1))
        side = free if slip is None else np.where(slip[:, None] == 0, free, slip[:, None])
        direction[:, 1:] = problem.friction[:, None] * side
        columns = np.repeat(np.arange(contacts), dim)
        edges.append(sp.csr_array((direction.ravel(), (np.arange(contacts * dim), columns))))
    approach = sp.csr_array(-(problem.delassus[::dim] @ sp.hstack(edges)))
    lengths = np.ones(contacts)
    for _ in range(PROOFS.equilibrations):
        for axis in (0, 1):
            size = abs(approach).max(axis=axis).toarray().ravel()
            factor = 1.0 / np.where(size > 0.0, size, 1.0)
            if axis == 0:
                approach = sp.csr_array(approach @ sp.diags_array(factor))
            else:
                approach = sp.csr_array(sp.diags_array(factor) @ approach)
                lengths *= factor
    bound = problem.offset[::dim] * lengths
    bound /= float(np.abs(bound).max()) or 1.0
    found = linprog(
        np.append(np.zeros(approach.shape[1]), 1.0), bounds=(0, None), method="highs",
        A_ub=sp.hstack([approach, np.full((contacts, 1), -1.0)]), b_ub=bound,
        options={"time_limit": seconds},
    )  # fmt: skip
    if found.status != 0 or found.fun <= PROOFS.approach_left:
        return False
    proof = np.maximum(-found.ineqlin.marginals, 0.0)
    lessened = approach.T @ proof < -PROOFS.round_off * (abs(approach).T @ proof)
    return bool(bound @ proof < 0.0 and not lessened.any())
