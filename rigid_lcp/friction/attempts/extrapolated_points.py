"""Proximal points with an extrapolated centre, for contacts that are redundant and slide.

Where W is singular and contacts slide, a self-stress may have to grow a long way before the next
contact lets go: the part of ``W r + q = 0`` that the sticking and sliding contacts can not answer
is 1e-9 of q, and proximal points (`rigid_lcp.friction.attempts.proximal_newton`)

    u = W r + q + alpha (r - c),    c = r_k

drift along the null space by a constant step of that part over alpha.  A small alpha makes the
step long, but Newton's method then has to guess dozens of changes of status at once, and cycles;
with a great alpha it can not fail, and thousands of points creep.  So alpha stays as great as
Newton needs it, and the centre runs ahead of the drift,

    c = r_k + theta d,    d = (r_k - r_(k-1)) / (theta_(k-1) + 1),

where theta doubles while points are found in few steps and falls where they are not: as a shift of
``alpha / (theta + 1)`` would do for the drift alone.  At a fixed point ``r = r_k = c``, and no
error of alpha or theta is left.  (Extrapolated centres: Gueler, SIAM J. Optim. 2 (1992) 649, for
convex problems; with Coulomb's law nothing is proved, and the best point is kept.)

Measured on what no other method of this package solved: 100 to 1,500 factorisations.  Sweeps
between them, each going on from where the other ended, save up to nine in ten
(`rigid_lcp.friction.auto.sweeps`); so may a start inside the cones, where a path of the interior
point ends.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.friction.attempts.proximal_newton import PROXIMAL, find_proximal_point
from rigid_lcp.friction.linear import Factorisation, factorisation
from rigid_lcp.friction.problem import FrictionProblem, FrictionSolution, judge_forces, length

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class PointNumbers:
    """Shifts, steps and extrapolation of the points."""

    first_shift: float = 1e-5
    """alpha over the mean of W's diagonal [-] at first,"""
    least_shift: float = 1e-9
    """at least"""
    greatest_shift: float = 10.0
    """and at most."""
    steps: int = 8
    """Newton steps in which a point has to be found."""
    few_steps: int = 3
    """The centre runs further ahead after a point that took so few,"""
    many_steps: int = 5
    """and less far after one that took so many."""
    finer: float = 0.3
    """A point is found where its own error is so small a part of the residual of the one before
    [-];"""
    rough: float = 1e-3
    """of a residual [-] above this, of this."""
    shrink: float = 0.5
    """Factor of alpha after more than `easy` points in turn, the last in `easy_steps` steps."""
    grow: float = 3.0
    """Factor of alpha where no point is found without extrapolation."""
    easy: int = 3
    """Points."""
    easy_steps: int = 3
    """Steps."""
    furthest: float = 1e12
    """Greatest theta [-]: where nothing drifts it would double without end."""
    fall_back: float = 0.25
    """What is left of theta after a point that was not found [-]."""
    endless: float = 1e12
    """Forces over ``rho |q|`` [-] that are not exceeded: the drift of a problem without solution
    never ends."""
    factorisations: int = 1500
    """At most."""


POINTS = PointNumbers()


def extrapolated_points(
    problem: FrictionProblem,
    start: Floats | None = None,
    tolerance: float = 1e-12,
    *,
    linear: Factorisation | None = None,
    factorisations: int = POINTS.factorisations,
    patience: int = POINTS.factorisations,
) -> FrictionSolution:
    """Extrapolated proximal points from ``start`` (zero forces if None): see the module.

    ``start`` r (nc * dim,) [N or N s]; ``tolerance``: on the scale-free residual.  ``linear``:
    factorisations of this problem's W, made if not given; at most ``factorisations`` are spent, and
    ``patience`` of them without halving the residual.  Where it converges
    `rigid_lcp.friction.attempts.proximal_newton` needs far fewer.  ``work``: ``points`` and
    ``factorisations``.
    """
    linear = linear or factorisation(problem)
    force = np.zeros(problem.offset.shape) if start is None else np.array(start, dtype=float)
    best, least = force, problem.residual(force)
    residual, spent, points, easy = least, 0, 0, 0
    mark, marked = least, 0
    shift, ahead, drift = POINTS.first_shift, 0.0, np.zeros_like(force)
    endless = POINTS.endless * max(problem.rho * length(problem.offset), length(force))
    while least > tolerance and spent < min(factorisations, marked + patience):
        centre = force + ahead * drift
        if shift > POINTS.greatest_shift or not length(centre) < endless:
            break
        enough = max(POINTS.finer * min(residual, POINTS.rough), PROXIMAL.finest)
        point, found, steps = find_proximal_point(
            problem, centre, shift / problem.rho, linear, enough,
            min(POINTS.steps, factorisations - spent),
        )  # fmt: skip
        spent, points = spent + steps, points + 1
        if not found:
            easy = 0
            if ahead > 0.0:
                ahead = POINTS.fall_back * ahead if ahead > 1.0 else 0.0
            else:
                shift, drift = POINTS.grow * shift, drift / POINTS.grow
            continue
        drift, force = (point - force) / (ahead + 1.0), point
        residual, easy = problem.residual(force), easy + 1
        if residual < least:
            best, least = force, residual
        if least < 0.5 * mark:
            mark, marked = least, spent
        if steps <= POINTS.few_steps:
            ahead = min(2.0 * ahead + 1.0, POINTS.furthest)
        elif steps >= POINTS.many_steps:
            ahead = 0.5 * ahead
        if (
            easy > POINTS.easy and steps <= POINTS.easy_steps and shift > POINTS.least_shift
        ):  # the drift is as fast
            shift, drift, ahead = (
                POINTS.shrink * shift,
                drift / POINTS.shrink,
                POINTS.shrink * ahead,
            )
    return judge_forces(
        problem, best, tolerance, "extrapolated points",
        {"points": float(points), "factorisations": float(spent)},
    )  # fmt: skip
