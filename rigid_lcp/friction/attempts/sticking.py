"""All contacts stick: one linear system, exact for towers and much of what stands.

Where no contact is open and none slides, Coulomb's law is ``W r + q = 0`` with r inside its cones.
W may be singular: proximal steps from nothing,

    (W + alpha) (r_(k+1) - r_k) = -(W r_k + q),

converge to forces of least norm among those that fit, all with one factorisation.  What W answers
with less than alpha (heavy bodies on light ones) they better little: where a step does not pay, a
few products by the same factors find it (`rigid_lcp.friction.attempts.refinement.gmres`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.attempts.refinement import gmres
from rigid_lcp.friction.linear import Factorisation, SingularSystem, factorisation
from rigid_lcp.friction.problem import FrictionProblem, FrictionSolution, judge_forces, length


@dataclass(frozen=True)
class StickingNumbers:
    """All contacts stick: when that is tried, and when given up."""

    shift: float = 1e-9
    """alpha over the mean of W's diagonal [-]."""
    steps: int = 6
    """Proximal steps at most."""
    pays: float = 0.01
    """What a step leaves of the residual [-] if plain ones are enough;"""
    stands: float = 0.5
    """and if no more are of use."""
    hopeless: float = 1e-2
    """A residual [-] above this after a step: some contact does not stick."""
    loose: float = 0.4
    """Share of contacts [-] that would have to be pulled to stick: much is loose (beds at rest:
    0.2 to 0.4, as their forces of least norm pull at some)."""
    at_limit: float = 1.0 - 1e-9
    """Share of Coulomb's limit [-] from which on a contact is called sliding."""
    straight: float = 0.3
    """Tangential forces over normal ones [-], up to which the forces of sticking show what bears
    what."""
    heavy: float = 1e3
    """Forces over ``rho |q|`` [-] that heavy bodies on light ones have,"""
    great: float = 10.0
    """and from which on their part is asked for more exactly."""


STICKING = StickingNumbers()


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
    least, hidden = np.inf, False
    try:
        linear = linear or factorisation(problem)
        solve = linear.factor(identity * (STICKING.shift / problem.rho), identity)
        for _ in range(STICKING.steps):
            velocity = problem.velocity(force)
            step = gmres(problem, 0.0 * identity, identity, solve, velocity) if hidden else None
            force = force - (solve(velocity) if step is None else step)
            residual = problem.residual(force)
            ends = residual <= tolerance or residual > min(
                STICKING.hopeless, STICKING.stands * least
            )
            hidden = hidden or residual > STICKING.pays * least
            if residual < least:
                best, least = force, residual
            if ends:
                break
    except SingularSystem:
        pass
    return judge_forces(problem, best, tolerance, "sticking", {"factorisations": 1.0})


def seem_to_stick(problem: FrictionProblem, force: Floats) -> bool:
    """Whether in these rough forces no contact is open, and less than half of them slide."""
    r = force.reshape(-1, problem.dim)
    if not (r[:, 0] > 0.0).all():
        return False
    limit = STICKING.at_limit * problem.friction * r[:, 0]
    return 2 * int((np.linalg.norm(r[:, 1:], axis=1) >= limit).sum()) < problem.contacts


def seem_loose(problem: FrictionProblem, force: Floats) -> bool:
    """Whether in these forces, at which all contacts stick, many are pulled."""
    pulled = int((force[:: problem.dim] <= 0.0).sum())
    return pulled >= STICKING.loose * problem.contacts


def heaviness(problem: FrictionProblem, stuck: Floats) -> float:
    """How much finer than usual the residual has to be, as light bodies bear heavy ones; 1 or more.

    The residual is measured on the forces of all contacts.  ``stuck`` r (nc * dim,) [N or N s]:
    forces at which all contacts stick; where they are great but not mostly normal they are those
    of an ill-conditioned W and tell nothing.
    """
    offered = problem.rho * length(problem.offset)
    r = np.abs(stuck.reshape(-1, problem.dim))
    if offered == 0.0 or r[:, 1:].sum() > STICKING.straight * r[:, 0].sum():
        return 1.0
    forces = length(stuck) / offered
    return max(1.0, min((forces / STICKING.heavy) ** 2, forces / STICKING.great))
