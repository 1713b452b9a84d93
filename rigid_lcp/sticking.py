"""All contacts stick: one linear system, exact for towers and much of what stands.

Where no contact is open and none slides, Coulomb's law is ``W r + q = 0`` with r inside its cones.
W may be singular: proximal steps from nothing,

    (W + alpha) (r_(k+1) - r_k) = -(W r_k + q),

converge to forces of least norm among those that fit, all with one factorisation.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.body_factorisation import Factorisation, SingularSystem, factorisation
from rigid_lcp.friction_problem import FrictionProblem, FrictionSolution, friction_solution

Floats = NDArray[np.float64]

SHIFT = 1e-9
"""alpha over mean(diag W)."""
STEPS = 6
HOPELESS = 1e-2
"""A residual above this after a step: some contact does not stick."""
LOOSE = 0.4
"""Share of contacts that would have to be pulled to stick: much is loose (beds at rest: 0.2 to
0.4, as their forces of least norm pull at some)."""
AT_LIMIT = 1.0 - 1e-9
"""Share of Coulomb's limit from which on a contact is called sliding."""


def sticking(
    problem: FrictionProblem, tolerance: float, *, linear: Factorisation | None = None
) -> FrictionSolution:
    """Forces that keep every contact at rest, if they lie in the cones of friction.

    ``linear``: factorisations of this problem's W, made if not given.  Steps go on as long as
    they better the residual: W's least eigenvalues decide how soon.
    """
    contacts, dim = problem.contacts, problem.dim
    identity = np.broadcast_to(np.eye(dim), (contacts, dim, dim)).copy()
    force = best = np.zeros(contacts * dim)
    least = np.inf
    try:
        linear = linear or factorisation(problem)
        solve = linear.factor(identity * (SHIFT / problem.rho), identity)
        for _ in range(STEPS):
            force = force - solve(problem.velocity(force))
            residual = problem.residual(force)
            if not residual < least:
                break
            best, least = force, residual
            if residual <= tolerance or residual > HOPELESS:
                break
    except SingularSystem:
        pass
    return friction_solution(problem, best, tolerance, "sticking", {"factorisations": 1.0})


def seem_to_stick(problem: FrictionProblem, force: Floats) -> bool:
    """Whether in these rough forces no contact is open, and less than half of them slide."""
    r = force.reshape(-1, problem.dim)
    if not (r[:, 0] > 0.0).all():
        return False
    limit = AT_LIMIT * problem.friction * r[:, 0]
    return 2 * int((np.linalg.norm(r[:, 1:], axis=1) >= limit).sum()) < problem.contacts


def seem_loose(problem: FrictionProblem, force: Floats) -> bool:
    """Whether in these forces, at which all contacts stick, many are pulled."""
    pulled = int((force[:: problem.dim] <= 0.0).sum())
    return pulled >= LOOSE * problem.contacts
