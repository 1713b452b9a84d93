"""Coulomb's central path past its folds: continuation by arc length.

`rigid_lcp.smoothed_path` finds the path's point of each sigma from that of the last, and where the
path folds back there is none.  Here r and ``level = ln(sigma / sigma_1)`` are both unknown, and the
curve ``F(r, level) = 0`` is followed by its arc length s (Keller 1977; Allgower and Georg,
Numerical Continuation Methods, 1990), up and down in sigma, wherever it leads:

    predictor    y + ds t + (ds^2 / 2 ds') (t - t')       y = (r / |r|, level / `LEVEL`), dy/ds = t
    corrector    F_r dr + F_level dlevel = -F,  t . dy = 0

t' and ds' are those of the step before.  Both equations are solved by the matrix F_r alone, twice,
as `rigid_lcp.smoothed_path` does once; at a fold it is singular, and no step ends there by chance.

The term |u_T| of Coulomb's law counts with a share of ``1 - sigma / sigma_1``.  So the curve begins
at a convex problem, which has one point, to which it can not come back; as long as it stays bounded
it leads to Coulomb's law, past any number of folds.  It need not stay bounded, steps may leap from
one stretch of it to another, and where ``sigma / |x|^2`` comes near round-off its self-stresses are
not told any more: from residuals of `HAND_OVER` on extrapolated points try to end it.

A fold takes some 40 factorisations, a wedged bed from none to a hundred folds.  So this is not for
what `rigid_lcp.smoothed_path` or sweeps solve.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.body_factorisation import Factorisation, SingularSystem, Solve, factorisation
from rigid_lcp.cones import length
from rigid_lcp.extrapolated_points import extrapolated_points
from rigid_lcp.friction_problem import FrictionProblem, FrictionSolution, friction_solution
from rigid_lcp.smoothed_path import path_begin, smoothed_map

Floats = NDArray[np.float64]

LEVEL = 3.3
"""Change of level that counts as much as one of the forces by all their size."""
ROUNDING = 1e-2
"""eps over ``sqrt(sigma) / rho``, the velocity of a sticking contact on the path [-]."""
FORCES = 100.0
"""The curve begins where forces are so many times ``sqrt(sigma)``,"""
HIGHEST, LOWEST, DOWN = 1e4, 1e-4, 0.3
"""at such a sigma over that of `path_begin` at most and at least, looked for in such steps."""
CONVEX_CLOSE, CONVEX_STEPS, DECREASE, LEAST_PART = 1e-2, 60, 1e-2, 1e-4
"""How close |F| over ``sqrt(sigma nc)`` has to be for that, Newton's steps, part of a step by which
|F| has to fall, and the least part that is tried."""
SHIFT, LEAST_SHIFT, SHIFT_SHARE = 1e-10, 1e-15, 0.02
"""Of W in the matrices, over 1 / rho: so small a part of ``sigma / |x|^2``, which is the eigenvalue
of a self-stress, within these bounds."""
RESIZED = 0.05
"""Change of |r| from which arc length is measured by the new one."""
FIRST_STEP, LONGEST_STEP, LEAST_STEP = 0.05, 3.0, 1e-8
"""Arc lengths."""
AIM, FAR = 0.2, 8.0
"""Error of the predictor that is aimed at, the greatest component of F over ``sqrt(sigma)``, and so
many times that from which nothing is corrected."""
EXACT, CLOSE, CLOSE_STEP = 1e-5, 1e-4, 0.1
"""A point is found where the error is below the first, or below the second with a last correction
shorter than such a part of the step."""
CORRECTIONS, FACTORED = 12, 6
"""Of a point, and its factorisations: as long as corrections shrink by `SLOW` the last one
serves."""
SLOW, STUCK, STUCK_FACTORED = 0.25, 0.9, 3
"""Where they shrink by no more than the second after so many, the point is not found."""
FINITE = float(np.finfo(float).max)
LEAST_SIGMA = float(np.sqrt(np.finfo(float).tiny))
"""Of [N^2]: higher powers of its root are divided by."""
GROWTH = (1.0, 2.0, 1.4, 1.1, 0.8, 0.6, 0.5)
"""Greatest growth of a step, by the factorisations that the last point took."""
SHORTER, LEAP, LONGEST_LEAP, TURN, SHARP_STEP = 0.4, 2.0, 1.5, 0.3, 1e-6
"""Of a step that failed.  It does where a correction is so many steps long or changes the level by
so much, and where the curve turns by a cosine below the fourth over more than the last."""
HAND_OVER, LOWER, POINTS_STEPS, POINTS_PATIENCE = 1e-6, 0.1, 150, 60
"""Residual from which extrapolated points try to end the path, and again from such a part of it,
and what they may spend."""
LAST_SHARE, LAST_PATIENCE = 0.3, 100
"""What is left for them where the path has ended, and their patience there."""
FACTORISATIONS = 1500


@dataclass(frozen=True)
class Place:
    """A point of the curve, or a step along it."""

    force: Floats
    """r (nc * dim,) [N or N s]."""
    level: float
    """``ln(sigma / sigma_1)`` [-]."""

    def plus(self, other: Place, part: float = 1.0) -> Place:
        """The place that is ``part`` of ``other`` further."""
        return Place(self.force + part * other.force, self.level + part * other.level)


class Spent(ArithmeticError):
    """No further factorisation may be made, or nothing is left to be followed."""


class Curve:
    """F and its derivatives along the curve of a problem, and their factorisations, so many at
    ``most``."""

    def __init__(self, problem: FrictionProblem, linear: Factorisation, most: float) -> None:
        self.problem, self.linear, self.most, self.spent = problem, linear, most, 0
        self.sigma = 1.0
        """sigma_1 [N^2 or N^2 s^2]."""
        self.rho = problem.contact_rho
        self.size = 1.0
        """Of the forces, |r|, as arc length and shift measure them."""

    def measure(self, place: Place) -> None:
        """Measure arc length by the forces of a place.  Raises `SingularSystem` where they are too
        small to be squared."""
        self.size = length(place.force)
        if not self.size**2 > 0.0:
            raise SingularSystem

    def at(self, place: Place) -> tuple[Floats, Floats, Floats]:
        """F (nc * dim,), dF/dr and dF/du (nc, dim, dim), over ``sqrt(sigma)``.

        Raises `Spent` where that is too small to be told."""
        shape = self.problem.contacts, self.problem.dim
        sigma = self.sigma * float(np.exp(place.level))
        if not sigma > LEAST_SIGMA:
            raise Spent
        eps = ROUNDING * np.sqrt(sigma) / float(self.rho.mean())
        f, a, b = smoothed_map(
            place.force.reshape(shape), self.problem.velocity(place.force).reshape(shape),
            self.problem.friction, self.rho, sigma, eps, -float(np.expm1(place.level)),
        )  # fmt: skip
        scale = 1.0 / np.sqrt(sigma)
        return scale * f.ravel(), scale * a, scale * b

    def factor(self, place: Place, a: Floats, b: Floats) -> Solve:
        """What solves with the matrix dF/dr there.  Raises `SingularSystem` and `Spent`."""
        if self.spent >= self.most:
            raise Spent
        share = SHIFT_SHARE * self.sigma * np.exp(place.level) * len(place.force) / self.size**2
        shift = float(np.clip(share, LEAST_SHIFT, SHIFT)) / self.problem.rho
        self.spent += 1
        return self.linear.factor(a + shift * b, b)

    def by_level(self, place: Place, step: float = 1e-5) -> Floats:
        """dF/dlevel (nc * dim,), a central difference."""
        above, below = (self.at(replace(place, level=place.level + d))[0] for d in (step, -step))
        return np.asarray((above - below) / (2.0 * step))

    def product(self, one: Place, other: Place) -> float:
        """Scalar product of two steps, as arc length measures them."""
        forces = float(one.force @ other.force) / self.size**2
        return forces + one.level * other.level / LEVEL**2

    def length(self, step: Place) -> float:
        """Arc length of a step."""
        return float(np.sqrt(self.product(step, step)))


class Border:
    """The factored matrix at a place, and the direction along which F stays."""

    def __init__(self, curve: Curve, place: Place, a: Floats, b: Floats) -> None:
        self.curve, self.solve = curve, curve.factor(place, a, b)
        self.along = Place(-self.solve(curve.by_level(place)), 1.0)

    def tangent(self, like: Place) -> Place:
        """Of length 1, on the side of ``like``."""
        size = self.curve.length(self.along)
        sign = 1.0 if self.curve.product(self.along, like) >= 0.0 else -1.0
        return Place(sign / size * self.along.force, sign / size)

    def correction(self, f: Floats, tangent: Place) -> Place:
        """The step that takes F away, square to the ``tangent``."""
        off = Place(-self.solve(f), 0.0)
        part = -self.curve.product(off, tangent) / self.curve.product(self.along, tangent)
        return off.plus(self.along, part)


class Ends:
    """The best point so far, and what tries to end the path from its points."""

    def __init__(self, problem: FrictionProblem, tolerance: float, linear: Factorisation) -> None:
        self.problem, self.tolerance, self.linear = problem, tolerance, linear
        self.best, self.least = np.zeros(problem.offset.shape), np.inf
        self.hand_over, self.spent = HAND_OVER, 0

    def keep(self, force: Floats, residual: float) -> bool:
        """Forces if they are the best; whether they solve."""
        if residual < self.least:
            self.best, self.least = force, residual
        return self.least <= self.tolerance

    def near(self, force: Floats) -> bool:
        """Whether a point of the curve, or what extrapolated points make of it, solves."""
        residual = self.problem.residual(force)
        if self.keep(force, residual) or residual > self.hand_over:
            return self.least <= self.tolerance
        self.hand_over = LOWER * residual
        return self.end(force, POINTS_STEPS, POINTS_PATIENCE)

    def end(self, force: Floats, factorisations: int, patience: int) -> bool:
        """Whether extrapolated points from there solve."""
        if self.least <= self.tolerance or factorisations <= 0:
            return self.least <= self.tolerance
        found = extrapolated_points(
            self.problem, force, self.tolerance, linear=self.linear,
            factorisations=factorisations, patience=patience,
        )  # fmt: skip
        self.spent += int(found.work["factorisations"])
        return self.keep(found.r, found.residual)


def folded_path(
    problem: FrictionProblem,
    tolerance: float = 1e-12,
    *,
    linear: Factorisation | None = None,
    factorisations: int = FACTORISATIONS,
) -> FrictionSolution:
    """Follow the curve from a convex problem until the residual is at or below ``tolerance``.

    ``linear``: factorisations of this problem's W, made if not given; about ``factorisations`` are
    spent at most.  The best point is given back; ``work``: ``points`` and ``folds`` of the curve,
    and ``factorisations``.
    """
    linear = linear or factorisation(problem)
    return folded_walk(problem, tolerance, linear, factorisations)[0]


def folded_walk(
    problem: FrictionProblem, tolerance: float, linear: Factorisation, factorisations: int
) -> tuple[FrictionSolution, Floats]:
    """The best point of `folded_path`, and the forces r (nc * dim,) where the curve was left."""
    ends, points, folds = Ends(problem, tolerance, linear), 0, 0
    curve = Curve(problem, linear, (1.0 - LAST_SHARE) * factorisations)
    left = ends.best
    if not ends.keep(left, problem.residual(left)):
        try:
            left = curve_begin(curve).force
            step = Step(curve, Place(left, 0.0))
            while not ends.near(left) and curve.spent + ends.spent < curve.most:
                rising = step.tangent.level > 0.0
                if not step.take():
                    break
                left, points = step.here.force, points + 1
                folds += rising != (step.tangent.level > 0.0)
        except (SingularSystem, Spent):
            pass  # the point found last is gone on from
        ends.end(left, factorisations - curve.spent - ends.spent, LAST_PATIENCE)
    work = {"points": float(points), "folds": float(folds)}
    work["factorisations"] = float(curve.spent + ends.spent)
    return friction_solution(problem, ends.best, tolerance, "folded path", work), left


def curve_begin(curve: Curve) -> Place:
    """The point of the convex problem, level 0, at a sigma_1 so small that forces are `FORCES`
    times its root.  Raises `SingularSystem`, also where there are no forces, and `Spent`."""
    curve.spent += 1
    force, sigma = path_begin(curve.problem, curve.linear)
    curve.sigma = HIGHEST * sigma
    here = Place(np.sqrt(HIGHEST) * force, 0.0)
    while True:
        curve.measure(here)
        here = settled(curve, here, CONVEX_CLOSE)
        size = float(np.sqrt(np.mean(here.force**2)))
        if size >= FORCES * np.sqrt(curve.sigma) or curve.sigma <= LOWEST * sigma:
            break
        curve.sigma *= DOWN
    here = settled(curve, here, EXACT)
    curve.measure(here)
    return here


def settled(curve: Curve, here: Place, enough: float) -> Place:
    """The point at the same level, by Newton's method, its steps halved where they do not help."""
    f, a, b = curve.at(here)
    error = length(f)
    for _ in range(CONVEX_STEPS):
        if error <= enough * np.sqrt(curve.problem.contacts):
            break
        step, part = Place(curve.factor(here, a, b)(f), 0.0), 1.0
        while part > LEAST_PART:
            there = here.plus(step, -part)
            f, a, b = curve.at(there)
            if length(f) <= (1.0 - DECREASE * part) * error:
                here, error = there, length(f)
                break
            part *= 0.5
        else:
            break
    return here


class Step:
    """The last point found, and how the next is."""

    def __init__(self, curve: Curve, here: Place) -> None:
        self.curve, self.here, self.arc = curve, here, FIRST_STEP
        down = Place(np.zeros_like(here.force), -1.0)
        self.tangent = Border(curve, here, *curve.at(here)[1:]).tangent(down)
        self.before: tuple[Place, float] | None = None
        """Tangent and arc length of the last step."""
        self.failed = False

    def take(self) -> bool:
        """Go one step, as long as can be corrected; whether one was."""
        while self.arc > LEAST_STEP:
            try:
                error, found = self.corrected(self.predicted())
            except SingularSystem:
                error, found = AIM, None
            if found is not None:
                there, tangent, factored = found
                self.before = self.tangent, self.curve.length(there.plus(self.here, -1.0))
                self.here, self.tangent = there, self.measured(tangent)
                growth = min(GROWTH[factored], (AIM / max(error, EXACT)) ** (1.0 / 3.0))
                growth = min(growth, 1.0) if self.failed else growth
                self.arc = min(self.arc * max(growth, SHORTER), LONGEST_STEP)
                self.failed = False
                return there.level <= 0.0
            aim = 0.8 * np.sqrt(AIM / error) if error > FAR * AIM else SHORTER
            self.arc *= float(np.clip(aim, 0.1, 0.5))
            self.before, self.failed = None, True
        return False

    def measured(self, tangent: Place) -> Place:
        """The tangent, of length 1 as the forces now measure it."""
        if abs(length(self.here.force) / self.curve.size - 1.0) < RESIZED:
            return tangent
        self.curve.measure(self.here)
        self.before = None  # the last step was measured otherwise
        part = 1.0 / self.curve.length(tangent)
        return Place(part * tangent.force, part * tangent.level)

    def predicted(self) -> Place:
        """By the tangent, and by how it turned over the last step."""
        step = Place(self.arc * self.tangent.force, self.arc * self.tangent.level)
        if self.before is not None:
            tangent, arc = self.before
            part = self.arc**2 / (2.0 * arc)
            turn = self.tangent.plus(tangent, -1.0)
            if part * self.curve.length(turn) < 0.5 * self.arc:
                step = step.plus(turn, part)
        return self.here.plus(step)

    def corrected(self, place: Place) -> tuple[float, tuple[Place, Place, int] | None]:
        """The predictor's error, and the point found from there, with its tangent and the
        factorisations that it took; None where it was not found."""
        border, factored, first = None, 0, np.inf
        error, shift, shrunk = np.inf, np.inf, 0.0  # of F, of the last correction, its shrinkage
        for count in range(CORRECTIONS):
            f, a, b = self.curve.at(place)
            error, last = float(np.abs(f).max()), error
            first = error if count == 0 else first
            if not error <= (FAR * AIM if count == 0 else FINITE):
                break
            if border is not None and self.close(error, shift):
                tangent = border.tangent(self.tangent)
                return first, None if self.sharp(tangent) else (place, tangent, factored)
            stale = border is None or error > SLOW * last or shrunk > SLOW
            if (shrunk > STUCK and factored >= STUCK_FACTORED) or (stale and factored == FACTORED):
                break
            if border is None or stale:
                border, factored = Border(self.curve, place, a, b), factored + 1
            step = border.correction(f, self.tangent)
            now = self.curve.length(step)
            shrunk, shift = now / shift, now
            if (now > LEAP * self.arc and error > 10.0 * EXACT) or abs(step.level) > LONGEST_LEAP:
                break
            place = place.plus(step)
        return first, None

    def close(self, error: float, shift: float) -> bool:
        """Whether a point with so great an |F|, behind so long a correction, counts as found."""
        return error < EXACT or (error < CLOSE and shift < CLOSE_STEP * self.arc)

    def sharp(self, tangent: Place) -> bool:
        """Whether the curve turns too far for a step so long."""
        return self.curve.product(tangent, self.tangent) < TURN and self.arc > SHARP_STEP
