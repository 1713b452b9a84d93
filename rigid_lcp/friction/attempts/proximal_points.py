"""Proximal points, each found by Newton's method, for contacts that are redundant and slide.

Where W is singular and contacts slide, Newton's method (`rigid_lcp.friction.methods.newton`)
changes the statuses of the same few contacts to and fro.  A proximal point is the answer of a
regular problem near a centre c (Rockafellar, SIAM J. Control Optim. 14 (1976) 877)

    u = W r + q + alpha (r - c),        c = r_k        so that no error of alpha is left

which Newton finds in a few steps from r_k if alpha is great enough.  So alpha falls while it does,
and grows where it does not: great shifts creep and can not fail, small ones end fast.

A self-stress may have to grow a long way before the next contact lets go: the part of
``W r + q = 0`` that the sticking and sliding contacts can not answer is 1e-9 of q, and points drift
along the null space by a constant step of that part over alpha.  A small alpha makes the step long,
but Newton's method then has to guess dozens of changes of status at once, and cycles.  So for these
alpha stays as great as Newton needs it, and the centre runs ahead of the drift,

    c = r_k + theta d,    d = (r_k - r_(k-1)) / (theta_(k-1) + 1),

where theta doubles while points are found in few steps and falls where they are not: as a shift of
``alpha / (theta + 1)`` would do for the drift alone.  (Extrapolated centres: Gueler, SIAM J. Optim.
2 (1992) 649, for convex problems.)  They take 100 to 1,500 factorisations; sweeps between them
(`rigid_lcp.friction.auto.sweeps`) save up to nine in ten.

With Coulomb's law nothing is proved, as W + alpha is monotone but the law is not; the best point is
kept.
"""

from dataclasses import dataclass

import numpy as np

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.linear import Factorisation, SingularSystem, choose_factorisation
from rigid_lcp.friction.methods import find_alart_curnier
from rigid_lcp.friction.problem import FrictionProblem, FrictionSolution, judge_forces, norm


@dataclass(frozen=True)
class ProximalNumbers:
    """Shifts and steps of the proximal points."""

    first_shift: float = 1e-4
    """alpha over the mean of W's diagonal [-] at first, not greater than the residual,"""
    least_shift: float = 1e-11  # at least
    greatest_shift: float = 10.0  # and at most
    shrink: float = 0.3  # factor of alpha after a point that was found,
    grow: float = 10.0  # and after one that was not
    steps: int = 5
    """Newton steps in which a point has to be found: most take one or two from the one before."""
    finer: float = 0.1
    """A point is found where its own error is so small a part of the residual of the one before
    [-],"""
    finest: float = 1e-15  # or so small [-]
    hopeless: float = 10.0
    """A point is given up where its last error is so many times that of the first step [-],"""
    same: float = 1e-3
    """or is an earlier one again to this part of it [-]: the same changes of status in a circle,"""
    tried: int = 4  # from so many errors on
    factorisations: int = 60  # at most


@dataclass(frozen=True)
class ExtrapolatedNumbers:
    """Shifts, steps and extrapolation of points whose centre runs ahead."""

    first_shift: float = 1e-5  # alpha over the mean of W's diagonal [-] at first,
    least_shift: float = 1e-9  # at least
    greatest_shift: float = 10.0  # and at most
    steps: int = 8  # Newton steps in which a point has to be found
    few_steps: int = 3  # the centre runs further ahead after a point that took so few,
    many_steps: int = 5  # and less far after one that took so many
    finer: float = 0.3
    """A point is found where its own error is so small a part of the residual of the one before
    [-];"""
    rough: float = 1e-3  # of a residual [-] above this, of this
    shrink: float = 0.5
    """Factor of alpha after more than `easy` points in turn, the last in `easy_steps` steps."""
    grow: float = 3.0  # factor of alpha where no point is found without extrapolation
    easy: int = 3  # points
    easy_steps: int = 3  # steps
    furthest: float = 1e12  # greatest theta [-]: where nothing drifts it would double without end
    fall_back: float = 0.25  # what is left of theta after a point that was not found [-]
    endless: float = 1e12
    """Forces over ``rho |q|`` [-] that are not exceeded: the drift of a problem without solution
    never ends."""
    factorisations: int = 1500  # at most


PROXIMAL, POINTS = ProximalNumbers(), ExtrapolatedNumbers()


def solve_proximal(
    problem: FrictionProblem, start: Floats, tolerance: float = 1e-12, *,
    linear: Factorisation | None = None, factorisations: int = PROXIMAL.factorisations,
    first_shift: float | None = None,
) -> FrictionSolution:  # fmt: skip
    """Proximal points from ``start`` r (nc * dim,) until the residual is small enough.

    ``linear``: factorisations of this problem's W, made if not given; at most ``factorisations``
    are spent.  ``first_shift``: alpha over mean(diag W) to begin with; the default is small, to end
    fast; a great one takes off what is stiff of the error.  Good from a rough point on (a few dozen
    sweeps, or the forces of the step before); where `rigid_lcp.friction.methods.newton` converges
    it needs fewer factorisations.  ``work``: ``points`` and ``factorisations``.
    """
    linear = linear or choose_factorisation(problem)
    best = centre = start
    least = residual = problem.residual(start)
    spent, points = 0, 0
    shift = max(PROXIMAL.least_shift, min(PROXIMAL.first_shift, residual))
    shift = shift if first_shift is None else first_shift
    while least > tolerance and spent < factorisations and shift <= PROXIMAL.greatest_shift:
        enough = max(PROXIMAL.finer * residual, PROXIMAL.finest)
        force, found, steps = find_proximal_point(
            problem, centre, shift / problem.rho, linear, enough,
            min(PROXIMAL.steps, factorisations - spent),
        )  # fmt: skip
        spent, points = spent + steps, points + 1
        reached = problem.residual(force)
        at_end = found and shift == PROXIMAL.least_shift and not reached < least
        if reached < least:
            best, least = force, reached
        if at_end:  # nothing but rounding is left
            break
        if found:
            centre, residual = force, reached
        shift = (
            max(PROXIMAL.least_shift, PROXIMAL.shrink * shift) if found else PROXIMAL.grow * shift
        )
    return judge_forces(
        problem, best, tolerance, "proximal newton",
        {"points": float(points), "factorisations": float(spent)},
    )  # fmt: skip


def extrapolate_points(
    problem: FrictionProblem, start: Floats, tolerance: float = 1e-12, *,
    linear: Factorisation | None = None, factorisations: int = POINTS.factorisations,
    patience: int = POINTS.factorisations,
) -> FrictionSolution:  # fmt: skip
    """Points whose centre runs ahead, from ``start`` r (nc * dim,), as `solve_proximal`.

    At most ``factorisations`` are spent, and ``patience`` of them without halving the residual.
    """
    linear = linear or choose_factorisation(problem)
    best = force = start
    least = residual = mark = problem.residual(start)
    spent = points = easy = marked = 0
    shift, ahead, drift = POINTS.first_shift, 0.0, np.zeros_like(force)
    endless = POINTS.endless * max(problem.rho * norm(problem.offset), norm(force))
    while least > tolerance and spent < min(factorisations, marked + patience):
        centre = force + ahead * drift
        if shift > POINTS.greatest_shift or not norm(centre) < endless:
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
        if easy > POINTS.easy and steps <= POINTS.easy_steps and shift > POINTS.least_shift:
            shift, drift = POINTS.shrink * shift, drift / POINTS.shrink  # the drift is as fast
            ahead = POINTS.shrink * ahead
    return judge_forces(
        problem, best, tolerance, "extrapolated points",
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
        f, a, b, _ = find_alart_curnier(
            force.reshape(shape), velocity.reshape(shape), problem.friction, rho
        )
        error = float(np.linalg.norm(f)) / (float(np.linalg.norm(force)) or 1.0)
        if error < least:
            best, least = force, error
        errors.append(error)
        if (error <= enough and step > 0) or step == steps or is_hopeless(errors):
            break
        try:
            force = force - linear.factor(a + alpha * b, b)(f.ravel())
        except SingularSystem:
            return best, False, step + 1
    return best, least <= enough, step


def is_hopeless(errors: list[float]) -> bool:
    """Whether Newton's method goes astray, or in a circle, by the errors of its steps [-]."""
    now = errors[-1]
    if not np.isfinite(now):
        return True
    if len(errors) < PROXIMAL.tried:
        return False
    return now > PROXIMAL.hopeless * errors[1] or any(
        abs(now - e) < PROXIMAL.same * e for e in errors[1:-1]
    )
