"""A proof that contacts can not be kept from approaching, by a linear programme."""

from __future__ import annotations

from itertools import product

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rigid_lcp.friction.problem.definition import FrictionProblem

Ints = NDArray[np.int64]

EQUILIBRATIONS = 3
"""Rounds of scaling rows and columns to entries of one: HiGHS takes what is below 1e-9 for zero."""
INFEASIBLE, MARGIN = 1e-7, 1e-12
"""Approach that is left beside the largest [-]; round-off of a proof's sums beside their parts."""


def prove_forces_insufficient(problem: FrictionProblem, slip: Ints | None = None) -> bool:
    """Whether it is proved that no r in K gives ``u_N >= 0`` at every contact.

    ``slip`` (nc,), in 2D: +-1 where a slip leaves the edge of the cone with that sign only, 0
    where the whole cone is free.  Every force of a cone is a sum of forces along its edges; in 3D
    the cone is replaced by the pyramid around it, so that a proof stays one.

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
    for _ in range(EQUILIBRATIONS):
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
        np.append(np.zeros(approach.shape[1]), 1.0),
        A_ub=sp.hstack([approach, np.full((contacts, 1), -1.0)]),
        b_ub=bound,
        bounds=(0, None),
        method="highs",
    )
    if found.status != 0 or found.fun <= INFEASIBLE:
        return False
    proof = np.maximum(-found.ineqlin.marginals, 0.0)
    lessened = approach.T @ proof < -MARGIN * (abs(approach).T @ proof)
    return bool(bound @ proof < 0.0 and not lessened.any())
