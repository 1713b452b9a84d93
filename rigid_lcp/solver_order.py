"""The order in which the default of `rigid_lcp.solver` tries its methods.

``auto`` takes the first point that is exact enough, and otherwise the best of all:

    no forces        where nothing approaches
    frictionless     where no contact has friction: sweeps and principal pivoting, exact; there are
                     no tangential unknowns
    all stick        one factorisation; exact for towers and much of what stands.  Large problems
                     are swept a few times before, which ends what is loose or regular
    convex path      without a start: a part of it, and Newton; solves most static piles.  Where it
                     does not, all of it if it seems to end at rest; then the path is bent to
                     Coulomb's law, and Newton again
    sharp path       the interior point along Coulomb's law hardly rounded, Newton, and where its
                     end is near turns (below): most of what is left.  It jams where forces are
                     many times what approaches
    smoothed path    from the convex one's end on, as it needs not stay inside the cones
                     (`rigid_lcp.smoothed_path`): kicked, tilted and slippery beds.  Where
                     factorisations are dear sweeps go before all paths, and with a start all of
                     Gauss-Seidel below
    by turns         from there on, sweeps of Gauss-Seidel and proximal points that run ahead of
                     their drift (`rigid_lcp.extrapolated_points`): beds whose self-stress has to
                     grow a long way before a contact lets go.  Neither goes back to its best point,
                     as the residual does not show the way made
    Gauss-Seidel     with momentum, from the start given or from nothing, and proximal points by
                     Newton at its end: first few sweeps and factorisations, then many, as what is
                     hard for the one is often easy for the other.  Where W is found to give
                     energy (`rigid_lcp.energy_proof`) no solution need exist, and one more turn is
                     the last
    by turns again   from the end of the convex path, and of three paths of the interior point
    folded path      by arc length round the folds (`rigid_lcp.folded_path`), and turns from there;
                     then extrapolated points from the best
    interior point   along several paths to Coulomb's law (`rigid_lcp.interior_point`); each end
                     goes to Newton, and if that is not enough to Gauss-Seidel and Newton again.
                     They end after the effort that `FALLBACK_SHARE` names, or before they begin
                     where a linear programme proves that there is no solution.  Then extrapolated
                     points again from the best
                     Where friction is above 10, problems of less come first, each the start of the
                     next
    islands          what is still not solved, each island apart, by all of this (large problems
                     of few islands at once)

Forces to start from that are twice as far from the answer as none (by the natural map) are left
aside: they would keep the convex path, which needs no start, from being tried first.

Every method alone can fail on real problems: Newton far from a solution, the interior point where
its path folds back, Gauss-Seidel on tall piles.  Together they fail seldom (`docs/rigid-solvers.md`
counts it); there is no proof: read ``status`` and ``residual``.

Cost: hundreds of sweeps or some factorisations; the interior point takes some 20 a path.  In 3D
their fill grows fast: where one costs as much as a hundred sweeps (3D packings above some 3,000
contacts), thousands of sweeps go before the convex path.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.body_factorisation import factorisation
from rigid_lcp.folded_path import folded_walk
from rigid_lcp.friction_problem import FrictionProblem
from rigid_lcp.frictionless import frictionless
from rigid_lcp.interior_point import ITERATIONS, Path, interior_point
from rigid_lcp.proximal_newton import FACTORISATIONS as MANY
from rigid_lcp.solver_cold import CONVEX_CONTACTS, convex_path, convex_start
from rigid_lcp.solver_trial import (
    ENDLESS,
    FEW_CONTACTS,
    FEW_DRIFT,
    HAND_OVER,
    LAST_WORD,
    Trial,
)
from rigid_lcp.solver_turns import by_turns, from_path, sharp_path, turns_from_paths
from rigid_lcp.solver_warm import deep, yielding

Floats = NDArray[np.float64]

PATHS = (
    (Path(rounding=0.3, compliance=0.01), 100),
    (Path(rounding=0.03, compliance=1.0), 100),
    (Path(rounding=1.0, compliance=0.1), 100),
    (Path(rounding=1e-3, compliance=1e-3), 300),
    (Path(rounding=0.3, compliance=0.1), 300),
    (Path(convex=True, compliance=1e-4), 300),
)
"""Paths of the interior point, and sweeps of Gauss-Seidel where Newton fails at their end."""
FEW_SWEEPS, FEW = 100, 20
"""Sweeps and factorisations that are tried first on small problems: enough for most steps of a pile
in motion; where there are more contacts, news need more sweeps to get through them."""
FIRST_SWEEPS = 1000
"""What is spent where the first try was too short."""
LAST_SWEEPS = 2000
DEAR_SWEEPS = 6000
"""What is spent before a factorisation that is dear."""
FALLBACK_SHARE, FALLBACK_FLOPS = 1.0, 2e10
"""What the paths of the interior point may cost in all before no further one is begun: so many
times what was spent before them, or so many flops (some seconds) if that is more."""
FOLDED_STEPS, FOLDED_FLOPS, FOLDED_SHARE = 1000, 4e10, 0.5
"""Factorisations along a path by arc length, their cost, and their share of what is affordable."""
DRIFT, DRIFT_FLOPS = 1500, 5e9
"""Factorisations of extrapolated points before the paths, and their cost in all (or so much as was
spent before, if that is more)."""
FRICTION_STEPS = (10.0, 30.0, 100.0, 300.0)
"""Coefficients of friction at which greater ones stop on their way."""
LAST_DRIFT, LAST_DRIFT_FLOPS = 4000, 4e10
"""The same after the paths, when nothing else is left: large packings of little friction take some
ten seconds of it."""
PROOF_CONTACTS = 3000
"""Up to so many contacts a linear programme looks for the proof that there is no solution."""


def attempts(
    problem: FrictionProblem,
    start: Floats | None,
    tolerance: float,
    accept: float = 0.0,
    *,
    paths: bool = True,
    by_friction: bool = True,
) -> Trial:
    """All methods in this order until one reaches ``tolerance``, or ``accept`` where the problem is
    large; the trial holds the best point.  ``paths``: whether the dear ones at the end are tried
    too; ``by_friction``: and great friction come to in steps."""
    trial = Trial(problem, start, tolerance)
    if trial.best.solved:
        trial.sharpen()
        return trial
    start = trial.start
    if not problem.friction.any():
        trial.keep(frictionless(problem, start, tolerance))
        if trial.best.solved:
            return trial
    rough = tolerance if tolerance > LAST_WORD else HAND_OVER
    small = problem.contacts <= FEW_CONTACTS
    cold = start is None and tolerance < HAND_OVER and problem.contacts <= CONVEX_CONTACTS
    if convex_start(trial) if cold else trial.stick_if_likely():
        return trial
    if small and trial.sweep(start, FEW_SWEEPS, until=rough, factorisations=FEW):
        return trial
    if trial.path_point is not None and from_path(trial, trial.path_point):
        return trial
    moving = not small and start is not None
    if moving and tolerance < HAND_OVER and not trial.dear and deep(trial, start, accept):
        return trial
    if tolerance >= HAND_OVER and not small:  # rough answers need few factorisations or none
        if yielding(trial, start) if moving else trial.sweep(None, FIRST_SWEEPS, factorisations=0):
            return trial
        if trial.best.residual <= accept:
            return trial
    if (not small and trial.dear) and (
        trial.sweep(start, DEAR_SWEEPS, factorisations=0) or (cold and all_paths(trial))
    ):
        return trial
    plan: tuple[tuple[int, int], ...] = ((FIRST_SWEEPS, MANY if small else FEW),)
    if moving:  # where one place of a large bed resists, proximal points fail for all
        plan = ((FIRST_SWEEPS, 0), (LAST_SWEEPS, FEW))
    for count, factorisations in plan:
        if trial.sweep(
            trial.best.r, count, until=max(rough, HAND_OVER), factorisations=factorisations
        ):
            return trial
    if trial.best.residual <= accept and not small:
        return trial
    if rough > tolerance and trial.sweep(trial.best.r, FIRST_SWEEPS):
        return trial
    if paths and not (by_friction and friction_steps(trial)):
        fallback_paths(trial, accept)
    return trial


def all_paths(trial: Trial) -> bool:
    """The paths that were not followed yet, as factorisations are dear or there was a start: the
    convex one, which finds rest, and those of `from_path`; where they are dear Coulomb's, hardly
    rounded, first, which solves more."""
    if trial.dear and not trial.sharp and sharp_path(trial):
        return True
    if trial.path_point is None and convex_path(trial):
        return True
    return trial.path_point is not None and from_path(trial, trial.path_point)


def friction_steps(trial: Trial) -> bool:
    """Friction above 10 (contacts that all but can not slide, beside others that can) in steps,
    each from the forces of the step before; whether the tolerance is reached.

    The steeper a cone is, the less of its inside a path or a sweep sees; a little steeper one holds
    most of the forces of the last.
    """
    problem, start = trial.problem, None
    for most in FRICTION_STEPS:
        if not problem.friction.max(initial=0.0) > most:
            break
        eased = replace(problem, friction=np.minimum(problem.friction, most))
        found = attempts(eased, start, trial.tolerance, by_friction=False).best
        if not found.solved:
            return False
        start = found.r
    if start is not None:
        trial.keep(
            attempts(problem, start, trial.tolerance, paths=False).solution(), "friction in steps"
        )
    return trial.best.solved


def fallback_paths(trial: Trial, accept: float) -> None:
    """The smoothed path, where a start kept it from being tried; turns, the folded path,
    extrapolated points, then the interior point along path after path, within the effort of
    `FALLBACK_SHARE`, and extrapolated points again."""
    problem, tolerance = trial.problem, trial.tolerance
    if trial.forces > ENDLESS and proved_insoluble(problem):  # a proof before the paths
        trial.forget_endless()
        trial.best = replace(trial.best, status="no solution")
        return
    if trial.gives_energy:  # what is near is found in one turn
        by_turns(trial, trial.best.r if trial.path_end is None else trial.path_end, patience=1)
        return
    new = tolerance < HAND_OVER and problem.contacts <= CONVEX_CONTACTS and not trial.smoothed
    if new and all_paths(trial):  # where there was a start
        return
    most = max(FALLBACK_FLOPS, (1.0 + FALLBACK_SHARE) * trial.effort)
    if turns_from_paths(trial) or folded(trial):
        return
    trial.drift(DRIFT, max(DRIFT_FLOPS, trial.effort))
    if trial.best.solved:
        return
    for path, sweeps in PATHS:
        if trial.effort > most or not trial.affordable:
            break
        found = trial.keep(
            interior_point(
                problem, None, max(HAND_OVER, tolerance), path, linear=trial.linear,
                iterations=min(ITERATIONS, trial.affordable),
            )
        )  # fmt: skip
        if trial.polish(found) or trial.sweep(found.r, sweeps, "interior-point"):
            return
        if trial.best.residual <= accept and problem.contacts > FEW_CONTACTS:
            return
    trial.drift(LAST_DRIFT, LAST_DRIFT_FLOPS)
    if trial.best.solved:
        return
    if trial.effort <= most:
        trial.sweep(None, LAST_SWEEPS)


def folded(trial: Trial) -> bool:
    """Coulomb's path by arc length, past its folds, and turns from where it is left."""
    trial.linear = trial.linear or factorisation(trial.problem)
    dearest = FOLDED_FLOPS / trial.linear.flops
    count = int(min(FOLDED_STEPS, dearest, FOLDED_SHARE * trial.affordable))
    if count < FEW_DRIFT:
        return False
    found, left = folded_walk(trial.problem, trial.tolerance, trial.linear, count)
    trial.keep(found)
    trial.sharpen()
    if not trial.best.solved and found.residual <= HAND_OVER:
        trial.newton(found.r, FEW, found.method)
    return trial.best.solved or by_turns(trial, left)


def proved_insoluble(problem: FrictionProblem) -> bool:
    """Whether a linear programme proves that there is no solution."""
    from rigid_lcp.force_proof import forces_insufficient

    return problem.contacts <= PROOF_CONTACTS and forces_insufficient(problem)
