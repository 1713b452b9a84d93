"""Newton's steps without their shift: what great mass ratios need of the last digits.

A Newton step solves ``(A + B W) dr = -F`` with A shifted by ``shift / rho``, as W is singular where
forces are not unique (`rigid_lcp.friction.methods.newton`).  The shift holds back what W answers
with less than it: a boulder on a pebble moves with all contacts below it loaded alike, at an
eigenvalue of W smaller than the mean of its diagonal by the ratio of their masses.  Plain steps
better that part by ``lambda / (lambda + shift)`` each; at a ratio of 1e8 they never end.

Here the shifted factors precondition GMRES (Saad and Schultz, SIAM J. Sci. Stat. Comput. 7 (1986)
856) for the matrix as it is.  All its eigenvalues are next to 1 then, or to 0 where forces are not
unique, but for the few that the shift hides, so a handful of products end at round-off.  What
round-off is: forces of ``F`` leave ``1e-16 F / m`` of the acceleration of a mass m between them,
no matter how they are found.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.linear import Factorisation, SingularSystem, Solve, factorisation
from rigid_lcp.friction.methods import alart_curnier
from rigid_lcp.friction.problem import (
    FORCE_ROUND_OFF,
    FrictionProblem,
    FrictionSolution,
    judge_forces,
)


@dataclass(frozen=True)
class RefinementNumbers:
    """Steps without a shift, and what ends them."""

    shift: float = 1e-9
    """Proximal shift of the factors, over the mean of W's diagonal [-]."""
    products: int = 8
    """Dimension of the space that GMRES builds at most: one for each eigenvalue that the shift
    hides, and one for all others."""
    steps: int = 8
    """Most Newton steps: where contacts at Coulomb's limit turn it rises before it falls."""
    level: int = 2
    """They end where so many in turn leave it where it was: at round-off."""
    exact: float = 2.2e-16
    """A residual [-] that no step betters."""
    enough: float = 1e-6
    """Error of a solution over the right hand side [-]: a Newton step needs no less."""
    little: float = 1e-14
    """Part of a vector that is round-off of it [-]."""


REFINEMENT = RefinementNumbers()


def refined(
    problem: FrictionProblem, start: Floats, tolerance: float, *,
    linear: Factorisation | None = None, steps: int = REFINEMENT.steps,
) -> FrictionSolution:  # fmt: skip
    """The best point of some Newton steps from ``start`` (nc * dim,), forces near a solution.

    ``tolerance``: scale-free residual that is enough.  ``linear``: factorisations of this
    problem's W, made if not given.  Not for starts that are far: which contacts are open, stick
    and slide must be nearly known.
    """
    shape = (problem.contacts, problem.dim)
    linear = linear or factorisation(problem)
    rho = problem.contact_rho
    force = best = start
    tolerance = max(tolerance, REFINEMENT.exact)
    least, done, level = problem.residual(start), 0, 0
    try:
        while least > tolerance and done < steps and level < REFINEMENT.level:
            velocity = problem.velocity(force).reshape(shape)
            f, a, b, _ = alart_curnier(force.reshape(shape), velocity, problem.friction, rho)
            solve = linear.factor(a + (REFINEMENT.shift / problem.rho) * b, b)
            force = force - gmres(problem, a, b, solve, f.ravel())
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


def gmres(problem: FrictionProblem, a: Floats, b: Floats, solve: Solve, right: Floats) -> Floats:
    """What makes ``(A + B W) dr - right`` least, preconditioned from the right by ``solve``.

    Arnoldi's vectors, made orthogonal twice: their number is small, their accuracy counts.
    """
    response = problem.delassus.__matmul__ if problem.bodies is None else problem.bodies.product
    shape = (problem.contacts, problem.dim)
    length = float(np.linalg.norm(right))
    if length == 0.0 or not np.isfinite(length):
        return np.zeros_like(right)
    basis, images, height = (
        [right / length],
        [],
        np.zeros((REFINEMENT.products + 1, REFINEMENT.products)),
    )
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
