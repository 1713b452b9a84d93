"""A problem's contacts and bodies in an order that is theirs and not that of their numbers.

Where a problem has several solutions round-off decides between them, and round-off hangs on the
order of sums.  In its own order a problem is solved by the same operations, however it was written
down.  What is left is round-off of the numbers given.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rigid_lcp.friction.problem import BodySpace, FrictionProblem, friction_problem

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class OwnOrder:
    """A problem in its own order, and where its contacts and bodies were."""

    problem: FrictionProblem
    contact: NDArray[np.int64]
    """Numbers of its contacts in the problem given, (nc,)."""
    row: NDArray[np.int64]
    """Of its forces, (nc * dim,)."""
    column: NDArray[np.int64]
    """Of its freedoms, (ndof,)."""

    def restored(self, force: Floats, freedom: Floats) -> tuple[Floats, Floats]:
        """Forces (nc * dim,) and displacements (ndof,) in the order of the problem given."""
        r, displacement = np.empty_like(force), np.empty_like(freedom)
        r[self.row], displacement[self.column] = force, freedom
        return r, displacement


def own_order(problem: FrictionProblem, bodies: BodySpace) -> OwnOrder:
    """Contacts by what q does to their normal velocities through W twice, bodies by how fast it
    moves them: numbers that no two have alike but by symmetry."""
    dim, size = problem.dim, bodies.body_size
    once = bodies.product(problem.offset)
    contact = np.argsort(bodies.product(once)[::dim], kind="stable")
    speed = np.linalg.norm((bodies.spread @ once).reshape(-1, size), axis=1)
    body = np.argsort(speed, kind="stable")
    row = (contact[:, None] * dim + np.arange(dim)).ravel()
    column = (body[:, None] * size + np.arange(size)).ravel()
    jacobian = sp.csr_array(bodies.jacobian[row][:, column])
    inverse_mass = sp.csr_array(bodies.inverse_mass[column][:, column])
    for each in (jacobian, inverse_mass):
        each.sort_indices()
    mine = friction_problem(
        BodySpace(jacobian, inverse_mass, size), problem.offset[row], problem.friction[contact], dim
    )
    return OwnOrder(mine, contact, row, column)
