"""All contacts stick: one linear system, exact for towers and much of what stands.

Where no contact is open and none slides, Coulomb's law is ``W r + q = 0`` with r inside its cones.
W may be singular: proximal steps from nothing,

    (W + alpha) (r_(k+1) - r_k) = -(W r_k + q),

converge to forces of least norm among those that fit, all with one factorisation.  What W answers
with less than alpha (heavy bodies on light ones) they better little: where a step does not pay, a
few products by the same factors find it (`solve_gmres`).

So do the last digits of Newton's method (`refine_forces`), which solves ``(A + B W) dr = -F`` with
A shifted by ``shift / rho``.  The shift holds back what W answers with less than it: a boulder on a
pebble moves with all contacts below it loaded alike, at an eigenvalue of W smaller than the mean of
its diagonal by the ratio of their masses.  Plain steps better that part by ``lambda / (lambda +
shift)`` each.  Instead the shifted factors precondition GMRES (Saad and Schultz, SIAM J. Sci. Stat.
Comput. 7 (1986) 856) for the matrix as it is.  All its eigenvalues are next to 1 then, or to 0
where forces are not unique, but for the few that the shift hides, so a handful of products end at
round-off.  What round-off is: forces of ``F`` leave ``1e-16 F / m`` of the acceleration of a mass m
between them, no matter how they are found.
"""

from dataclasses import dataclass

import numpy as np

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.linear import Factorisation, SingularSystem, Solve, choose_factorisation
from rigid_lcp.friction.methods import find_alart_curnier
from rigid_lcp.friction.problem import (
    FORCE_ROUND_OFF,
    FrictionProblem,
    FrictionSolution,
    judge_forces,
    norm,
)


@dataclass(frozen=True)
class RefinementNumbers:
    """Steps without a shift, and what ends them."""

    shift: float = 1e-9  # proximal shift of the factors, over the mean of W's diagonal [-]
    products: int = 8
    """Dimension of the space that GMRES builds at most: one for each eigenvalue that the shift
    hides, and one for all others."""
    steps: int = 8
    """Most Newton steps: where contacts at Coulomb's limit turn it rises before it falls."""
    level: int = 2  # they end where so many in turn leave it where it was: at round-off
    exact: float = 2.2e-16  # a residual [-] that no step betters
    enough: float = 1e-6
    """Error of a solution over the right hand side [-]: a Newton step needs no less."""
    little: float = 1e-14  # part of a vector that is round-off of it [-]


REFINEMENT = RefinementNumbers()


def refine_forces(
    problem: FrictionProblem, start: Floats, tolerance: float, *,
    linear: Factorisation | None = None, steps: int = REFINEMENT.steps,
) -> FrictionSolution:  # fmt: skip
    """The best point of some Newton steps from ``start`` (nc * dim,), forces near a solution.

    ``tolerance``: scale-free residual that is enough.  ``linear``: factorisations of this
    problem's W, made if not given.  Not for starts that are far: which contacts are open, stick
    and slide must be nearly known.
    """
    shape = (problem.contacts, problem.dim)
    linear = linear or choose_factorisation(problem)
    rho = problem.contact_rho
    force = best = start
    tolerance = max(tolerance, REFINEMENT.exact)
    least, done, level = problem.residual(start), 0, 0
    try:
        while least > tolerance and done < steps and level < REFINEMENT.level:
            velocity = problem.velocity(force).reshape(shape)
            f, a, b, _ = find_alart_curnier(force.reshape(shape), velocity, problem.friction, rho)
            solve = linear.factor(a + (REFINEMENT.shift / problem.rho) * b, b)
            force = force - solve_gmres(problem, a, b, solve, f.ravel())
            residual = problem.residual(force)
            done += 1
            level = level + 1 if 0.5 * least < residual < 10.0 * least else 0
            last = least <= FORCE_ROUND_OFF and residual > 0.5 * least
            if residual < least:
                best, least = force, residual
            if last:
                break
    except SingularSystem:
        pass
    return judge_forces(problem, best, tolerance, "refinement", {"factorisations": float(done)})


def solve_gmres(
    problem: FrictionProblem, a: Floats, b: Floats, solve: Solve, right: Floats
) -> Floats:
    """What makes ``(A + B W) dr - right`` least, preconditioned from the right by ``solve``.

    Arnoldi's vectors, made orthogonal twice: their number is small, their accuracy counts.
    """
    response = problem.delassus.__matmul__ if problem.bodies is None else problem.bodies.product
    shape = (problem.contacts, problem.dim)
    length = float(np.linalg.norm(right))
    if length == 0.0 or not np.isfinite(length):
        return np.zeros_like(right)
    basis, images = [right / length], []
    height = np.zeros((REFINEMENT.products + 1, REFINEMENT.products))
    for k in range(REFINEMENT.products):
        image = solve(basis[k])
        images.append(image)
        velocity = response(image).reshape(*shape, 1)
        product = (a @ image.reshape(*shape, 1) + b @ velocity).ravel()
        size = float(np.linalg.norm(product))
        for _ in range(2):
            for i, each in enumerate(basis):
                part = float(each @ product)
                height[i, k] += part
                product = product - part * each
        height[k + 1, k] = left = float(np.linalg.norm(product))
        wanted = np.zeros(k + 2)
        wanted[0] = length
        heights = height[: k + 2, : k + 1]
        weights = np.linalg.lstsq(heights, wanted, rcond=REFINEMENT.little)[0]
        error = float(np.linalg.norm(heights @ weights - wanted))
        if error <= REFINEMENT.enough * length or not left > REFINEMENT.little * size:
            break
        basis.append(product / left)
    return np.asarray(weights @ np.array(images))


@dataclass(frozen=True)
class StickingNumbers:
    """All contacts stick: when that is tried, and when given up."""

    shift: float = 1e-9  # alpha over the mean of W's diagonal [-]
    steps: int = 6  # proximal steps at most
    pays: float = 0.01  # what a step leaves of the residual [-] if plain ones are enough;
    stands: float = 0.5  # and if no more are of use
    hopeless: float = 1e-2  # a residual [-] above this after a step: some contact does not stick
    loose: float = 0.4
    """Share of contacts [-] that would have to be pulled to stick: much is loose (beds at rest:
    0.2 to 0.4, as their forces of least norm pull at some)."""
    at_limit: float = 1.0 - 1e-9
    """Share of Coulomb's limit [-] from which on a contact is called sliding."""
    straight: float = 0.3
    """Tangential forces over normal ones [-], up to which the forces of sticking show what bears
    what."""
    heavy: float = 1e3  # forces over ``rho |q|`` [-] that heavy bodies on light ones have,
    great: float = 10.0  # and from which on their part is asked for more exactly


STICKING = StickingNumbers()


def solve_sticking(
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
        linear = linear or choose_factorisation(problem)
        solve = linear.factor(identity * (STICKING.shift / problem.rho), identity)
        for _ in range(STICKING.steps):
            velocity = problem.velocity(force)
            step = (
                solve_gmres(problem, 0.0 * identity, identity, solve, velocity) if hidden else None
            )
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


def find_heaviness(problem: FrictionProblem, stuck: Floats) -> float:
    """How much finer than usual the residual has to be, as light bodies bear heavy ones; 1 or more.

    The residual is measured on the forces of all contacts.  ``stuck`` r (nc * dim,) [N or N s]:
    forces at which all contacts stick; where they are great but not mostly normal they are those
    of an ill-conditioned W and tell nothing.
    """
    offered = problem.rho * norm(problem.offset)
    r = np.abs(stuck.reshape(-1, problem.dim))
    if offered == 0.0 or r[:, 1:].sum() > STICKING.straight * r[:, 0].sum():
        return 1.0
    forces = norm(stuck) / offered
    return max(1.0, min((forces / STICKING.heavy) ** 2, forces / STICKING.great))
