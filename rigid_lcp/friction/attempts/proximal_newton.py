"""Proximal points, each found by Newton's method, for contacts that are redundant and slide.

Where W is singular and contacts slide, Newton's method (`rigid_lcp.friction.methods.newton`)
changes the statuses of the same few contacts to and fro.  A proximal point is the answer of a
regular problem near the last one (Rockafellar, SIAM J. Control Optim. 14 (1976) 877)

    u = W r + q + alpha (r - r_k),        r_(k+1) = r        so that no error of alpha is left

which Newton finds in a few steps from r_k if alpha is great enough.  So alpha falls while it does,
and grows where it does not: great shifts creep and can not fail, small ones end fast.  Not proved
to converge, as W + alpha is monotone but Coulomb's law is not; the best point is kept.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.friction.linear import Factorisation, SingularSystem, factorisation
from rigid_lcp.friction.methods import alart_curnier
from rigid_lcp.friction.problem import (
    FrictionProblem,
    FrictionSolution,
    judge_forces,
    require_number,
    require_start,
    require_whole,
)

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ProximalNumbers:
    """Shifts and steps of the proximal points."""

    first_shift: float = 1e-4
    """alpha over the mean of W's diagonal [-] at first, not greater than the residual,"""
    least_shift: float = 1e-11
    """at least"""
    greatest_shift: float = 10.0
    """and at most."""
    shrink: float = 0.3
    """Factor of alpha after a point that was found,"""
    grow: float = 10.0
    """and after one that was not."""
    steps: int = 5
    """Newton steps in which a point has to be found: most take one or two from the one before."""
    finer: float = 0.1
    """A point is found where its own error is so small a part of the residual of the one before
    [-],"""
    finest: float = 1e-15
    """or so small [-]."""
    hopeless: float = 10.0
    """A point is given up where its last error is so many times that of the first step [-],"""
    same: float = 1e-3
    """or is an earlier one again to this part of it [-]: the same changes of status in a circle,"""
    tried: int = 4
    """from so many errors on."""
    factorisations: int = 60
    """At most."""


PROXIMAL = ProximalNumbers()


def proximal_newton(
    problem: FrictionProblem,
    start: Floats | None = None,
    tolerance: float = 1e-12,
    *,
    linear: Factorisation | None = None,
    factorisations: int = PROXIMAL.factorisations,
    first_shift: float | None = None,
) -> FrictionSolution:
    """Proximal points from ``start`` (zero forces if None) until the residual is small enough.

    ``linear``: factorisations of this problem's W, made if not given; at most ``factorisations``
    are spent.  ``first_shift``: alpha over mean(diag W) to begin with; the default is small, to end
    fast; a great one takes off what is stiff of the error.  Good from a rough point on (a few dozen
    sweeps, or the forces of the step before); where `rigid_lcp.friction.methods.newton` converges
    it needs fewer factorisations.

    Raises `ProblemError` for a start that is none, `UsageError` for other options that are none.
    """
    tolerance = require_number(tolerance, "tolerance", zero=True)
    factorisations = require_whole(factorisations, "factorisations")
    linear = linear or factorisation(problem)
    centre = np.zeros(problem.offset.shape)
    if start is not None:
        centre = require_start(start, len(centre), problem.dim)
    best, best_residual = centre, problem.residual(centre)
    residual, spent, points = best_residual, 0, 0
    shift = (
        max(PROXIMAL.least_shift, min(PROXIMAL.first_shift, residual))
        if first_shift is None
        else first_shift
    )
    while best_residual > tolerance and spent < factorisations and shift <= PROXIMAL.greatest_shift:
        enough = max(PROXIMAL.finer * residual, PROXIMAL.finest)
        force, found, steps = find_proximal_point(
            problem, centre, shift / problem.rho, linear, enough,
            min(PROXIMAL.steps, factorisations - spent),
        )  # fmt: skip
        spent, points = spent + steps, points + 1
        reached = problem.residual(force)
        at_end = found and shift == PROXIMAL.least_shift and not reached < best_residual
        if reached < best_residual:
            best, best_residual = force, reached
        if at_end:  # nothing but rounding is left
            break
        if found:
            centre, residual = force, reached
        shift = (
            max(PROXIMAL.least_shift, shift * PROXIMAL.shrink) if found else shift * PROXIMAL.grow
        )
    return judge_forces(
        problem, best, tolerance, "proximal newton",
        {"points": float(points), "factorisations": float(spent)},
    )  # fmt: skip


def find_proximal_point(
    problem: FrictionProblem, centre: Floats, alpha: float, linear: Factorisation, enough: float,
    steps: int,
) -> tuple[Floats, bool, int]:  # fmt: skip
    """Forces of ``u = W r + q + alpha (r - centre)``, if they were found, and the steps it took.

    ``alpha`` [velocity per force]; ``enough``: size of Alart and Curnier's F over that of r.
    """
    shape = (problem.contacts, problem.dim)
    rho = problem.contact_rho
    force, least = centre, np.inf
    best, errors = centre, []
    for step in range(steps + 1):
        velocity = problem.velocity(force) + alpha * (force - centre)
        f, a, b, _ = alart_curnier(
            force.reshape(shape), velocity.reshape(shape), problem.friction, rho
        )
        error = float(np.linalg.norm(f)) / (float(np.linalg.norm(force)) or 1.0)
        if error < least:
            best, least = force, error
        errors.append(error)
        if (error <= enough and step > 0) or step == steps or hopeless(errors):
            break
        try:
            force = force - linear.factor(a + alpha * b, b)(f.ravel())
        except SingularSystem:
            return best, False, step + 1
    return best, least <= enough, step


def hopeless(errors: list[float]) -> bool:
    """Whether Newton's method goes astray, or in a circle, by the errors of its steps [-]."""
    now = errors[-1]
    if not np.isfinite(now):
        return True
    if len(errors) < PROXIMAL.tried:
        return False
    return now > PROXIMAL.hopeless * errors[1] or any(
        abs(now - e) < PROXIMAL.same * e for e in errors[1:-1]
    )
