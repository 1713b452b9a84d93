"""The plan of `solve_friction`'s default: which attempt follows which, when, and what it may cost.

`PLAN` is read from above: a stage is tried where its condition holds, and the first one that is
enough ends the search.  The best point of all is kept (`rigid_lcp.friction.auto.trial`).

Every method alone fails on some real problems: Newton far from a solution, the interior point where
its path folds back, Gauss-Seidel on tall piles.  Together they fail seldom (`docs/rigid-solvers.md`
counts it); there is no proof: read ``status`` and ``residual``.  What is cheap goes before what is
dear.  In 3D the fill of a factorisation grows fast: where one costs as much as a hundred sweeps
(packings above some 3,000 contacts), thousands of sweeps go before the paths.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.friction.attempts import PROXIMAL, frictionless
from rigid_lcp.friction.auto import paths as along
from rigid_lcp.friction.auto import sweeps as by
from rigid_lcp.friction.auto.trial import ENDLESS, Trial
from rigid_lcp.friction.problem import FrictionProblem

Floats = NDArray[np.float64]

FRICTION_STEPS = (10.0, 30.0, 100.0, 300.0)
"""Coefficients of friction [-] at which greater ones stop on their way."""
PROOF_CONTACTS = 3000
"""Up to so many contacts a linear programme looks for the proof that there is no solution."""


@dataclass(frozen=True)
class Stage:
    """One row of a plan."""

    name: str
    when: Callable[[Trial], bool]
    """Its condition."""
    attempt: Callable[[Trial], bool] | tuple[Stage, ...]
    """What is tried, with its budget, and whether that ends the search; or rows of its own."""


def run_plan(trial: Trial, plan: tuple[Stage, ...]) -> bool:
    """Try the stages of ``plan`` one after another; whether one of them ended the search."""
    for stage in plan:
        if not stage.when(trial):
            continue
        if isinstance(stage.attempt, tuple):
            ended = run_plan(trial, stage.attempt)
        else:
            ended = stage.attempt(trial)
        if ended:
            return True
    return False


def attempts(
    problem: FrictionProblem,
    start: Floats | None,
    tolerance: float,
    accept: float = 0.0,
    plan: tuple[Stage, ...] | None = None,
) -> Trial:
    """`PLAN`, or another, until a stage reaches ``tolerance``, or ``accept`` where the problem is
    large; the trial holds the best point."""
    trial = Trial(problem, start, tolerance, accept)
    if trial.best.solved:
        trial.sharpen()
    else:
        run_plan(trial, PLAN if plan is None else plan)
    return trial


# --- attempts that need more than a method ----------------------------------------------------


def try_frictionless(trial: Trial) -> bool:
    """Sweeps and principal pivoting, exact: there are no tangential unknowns."""
    trial.keep(frictionless(trial.problem, trial.start, trial.tolerance))
    return trial.best.solved


def step_friction(trial: Trial) -> bool:
    """Friction above 10 (contacts that all but cannot slide, beside others that can) in steps,
    each from the forces of the step before; whether the tolerance is reached.

    The steeper a cone is, the less of its inside a path or a sweep sees; a little steeper one holds
    most of the forces of the last.
    """
    problem, start = trial.problem, None
    for most in FRICTION_STEPS:
        if not problem.friction.max(initial=0.0) > most:
            break
        eased = replace(problem, friction=np.minimum(problem.friction, most))
        found = attempts(eased, start, trial.tolerance, plan=FIRST + LAST).best
        if not found.solved:
            return False
        start = found.r
    if start is not None:
        found = attempts(problem, start, trial.tolerance, plan=FIRST).solution()
        trial.keep(found, "friction in steps")
    return trial.best.solved


def prove_insoluble(trial: Trial) -> bool:
    """Look for a proof that there is no solution, before paths are followed in vain."""
    if not is_proved_insoluble(trial.problem):
        return False
    trial.forget_endless()
    trial.best = replace(trial.best, status="no solution")
    return True


def is_proved_insoluble(problem: FrictionProblem) -> bool:
    """Whether a linear programme proves that there is no solution."""
    from rigid_lcp.friction.problem import prove_forces_insufficient

    return problem.contacts <= PROOF_CONTACTS and prove_forces_insufficient(problem)


# --- the plan ---------------------------------------------------------------------------------
# stage, condition, attempt with its budget (sweeps; factorisations of Newton's steps, of points or
# along a path; flops).  Constants of a method stand beside it.

FROM_PATH = (
    Stage("sharp path", lambda t: not t.sharp, along.follow_sharp_path),
    Stage("sweeps first", lambda t: t.sweeps_a_factorisation > 20.0 and t.path_end is not None,
          by.sweep_from_path),
    Stage("smoothed path", lambda t: True, along.smooth_further),
    Stage("turns", lambda t: True, by.turn_from_best),
)  # fmt: skip
"""From where the convex path ended short.  The sharp path solves most of what is left and jams
where forces are many times what approaches; the smoothed one need not stay inside the cones
(kicked, tilted and slippery beds); turns let a self-stress grow a long way."""

ALL_PATHS = (
    Stage("sharp path, dear", lambda t: t.dear and not t.sharp, along.follow_sharp_path),
    Stage("convex path, late", lambda t: t.path_point is None, along.follow_convex_path),
    Stage("from path", lambda t: t.path_point is not None, FROM_PATH),
)
"""The paths not followed yet, as factorisations are dear or there was a start.  Where they are dear
the sharp one goes first, as it solves more."""

DEEP = (
    Stage("deep sweeps", lambda t: True, by.sweep_deep),
    Stage("accept, moving", lambda t: t.accept > 0.0, Trial.accepts_large),
    Stage("convex path, moving", lambda t: t.accept == 0.0, along.follow_convex_path),
    Stage("deep sweeps, path", lambda t: t.accept == 0.0 and t.path_end is not None,
          by.sweep_deep_from_path),
)  # fmt: skip
"""A large bed with a start, to the last digits: near 1e-7 Newton's method still guesses dozens of
10,000 contacts wrong; after sweeps far down, in one run, few.  The end of the convex path is no
better than the best point, but sweeps from it end sooner."""

FIRST = (
    Stage("frictionless", lambda t: not t.problem.friction.any(), try_frictionless),
    Stage("few sweeps", lambda t: t.cold and not t.small, by.sweep_briefly),
    Stage("all stick", lambda t: True, along.stick_all),
    Stage("few sweeps, loose", lambda t: t.small and t.loose and not t.heavy, by.sweep_briefly),
    Stage("Newton, nearly stuck", lambda t: t.nearly_stuck, along.step_from_best),
    Stage("Newton, heavy", lambda t: t.heavy and not t.loose and not t.nearly_stuck,
          along.step_from_stuck),
    Stage("heavy path", lambda t: t.heavy, along.follow_heavy_path),
    Stage("convex path", lambda t: t.stuck is not None and not t.heavy and not t.nearly_stuck,
          along.follow_convex_path),
    Stage("sweeps, small", lambda t: t.small,
          lambda t: t.sweep(t.start, 100, until=t.coarse, factorisations=20)),
    Stage("from path", lambda t: t.path_point is not None, FROM_PATH),
    Stage("deep", lambda t: t.moving and not t.rough and not t.dear, DEEP),
    Stage("sweeps, yielding", lambda t: t.rough and t.moving, by.sweep_yielding),
    Stage("sweeps, rough", lambda t: t.rough and t.new,
          lambda t: t.sweep(None, 1000, factorisations=0)),
    Stage("accept, rough", lambda t: t.rough and not t.small, Trial.accepts),
    Stage("sweeps, dear", lambda t: not t.small and t.dear,
          lambda t: t.sweep(t.start, 6000, factorisations=0)),
    Stage("paths, dear", lambda t: not t.small and t.cold and t.dear, ALL_PATHS),
    Stage("sweeps and points, small", lambda t: t.small,
          partial(by.sweep_on, sweeps=1000, points=PROXIMAL.factorisations)),
    Stage("sweeps and points, new", lambda t: t.new, partial(by.sweep_on, sweeps=1000, points=20)),
    Stage("sweeps, moving", lambda t: t.moving, partial(by.sweep_on, sweeps=1000, points=0)),
    Stage("sweeps and points, moving", lambda t: t.moving,
          partial(by.sweep_on, sweeps=2000, points=20)),
    Stage("accept", lambda t: not t.small, Trial.accepts),
    Stage("last digits", lambda t: t.coarse > t.tolerance, lambda t: t.sweep(t.best.r, 1000)),
)  # fmt: skip
"""What solves nearly all: what sticks, the convex path, Gauss-Seidel with momentum and proximal
points by Newton at its end.  Where one place of a large moving bed resists, points fail for all."""

LAST = (
    Stage("proof", lambda t: t.forces > ENDLESS, prove_insoluble),
    Stage("one turn", lambda t: t.gives_energy, by.turn_once),
    Stage("paths, late", lambda t: t.convex_useful and not t.smoothed, ALL_PATHS),
    Stage("bound", lambda t: True, Trial.bound_effort),
    Stage("turns from paths", lambda t: True, along.turn_from_paths),
    Stage("points", lambda t: True,
          lambda t: by.run_points(t, 1500, max(5e9, t.effort))),
    Stage("interior point", lambda t: True, along.follow_paths),
    Stage("more points", lambda t: True, lambda t: by.run_points(t, 4000, 4e10)),
    Stage("more sweeps", lambda t: t.effort <= t.bound, lambda t: t.sweep(None, 2000)),
)  # fmt: skip
"""What is dear and seldom needed, where nothing proves that there is no solution: some ten seconds
of it solve large packings of little friction."""

PLAN = (*FIRST, Stage("friction in steps", lambda t: True, step_friction), *LAST)
