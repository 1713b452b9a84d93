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

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.auto import paths as along
from rigid_lcp.friction.auto import sweeps as by
from rigid_lcp.friction.auto.trial import LIMITS, Trial
from rigid_lcp.friction.linear import NO_LIMIT, Clock
from rigid_lcp.friction.problem import FrictionProblem, prove_forces_insufficient

PROOF_CONTACTS = 3000
"""Up to so many contacts a linear programme looks for the proof that there is no solution."""


@dataclass(frozen=True)
class Stage:
    """One row of a plan."""

    name: str
    when: Callable[[Trial], bool]  # its condition
    attempt: Callable[[Trial], bool] | tuple[Stage, ...]
    """What is tried, with its budget, and whether that ends the search; or rows of its own."""


def run_plan(trial: Trial, plan: tuple[Stage, ...]) -> bool:
    """Try the stages of ``plan`` one after another; whether one of them ended the search."""
    for stage in plan:
        if trial.clock.late:
            return True
        if not stage.when(trial):
            continue
        if isinstance(stage.attempt, tuple):
            ended = run_plan(trial, stage.attempt)
        else:
            ended = stage.attempt(trial)
        if ended:
            return True
    return False


def run_attempts(
    problem: FrictionProblem, start: Floats | None, tolerance: float, accept: float = 0.0,
    plan: tuple[Stage, ...] | None = None, clock: Clock = NO_LIMIT,
) -> Trial:  # fmt: skip
    """`PLAN`, or another, until a stage reaches ``tolerance``, or ``accept`` where the problem is
    large; the trial holds the best point."""
    trial = Trial(problem, start, tolerance, accept, clock)
    if trial.best.solved:
        trial.sharpen()
    else:
        run_plan(trial, PLAN if plan is None else plan)
    return trial


def prove_insoluble(trial: Trial) -> bool:
    """Look for a proof that there is no solution, before paths are followed in vain."""
    if not is_proved_insoluble(trial.problem, trial.clock):
        return False
    trial.forget_endless()
    trial.best = replace(trial.best, status="no solution")
    return True


def is_proved_insoluble(problem: FrictionProblem, clock: Clock = NO_LIMIT) -> bool:
    """Whether a linear programme proves that there is no solution, in the time left."""
    few = problem.contacts <= PROOF_CONTACTS and not clock.late
    return few and prove_forces_insufficient(problem, seconds=clock.left)


# --- the plan ---------------------------------------------------------------------------------
# stage, condition, attempt with its budget (sweeps; factorisations of Newton's steps, of points or
# along a path; flops).  Constants of a method stand beside it.

FROM_PATH = (
    Stage("sharp path", lambda t: not t.sharp, along.follow_sharp_path),
    Stage("convex end", lambda t: t.convex_part is not None, along.end_convex_path),
    Stage("smoothed path", lambda t: True, along.smooth_further),
    Stage("turns", lambda t: True, lambda t: by.take_turns(t, t.best.r)),
)  # fmt: skip
"""From where the convex path was left or ended short.  The sharp path solves most of what is left,
and jams where forces are many times what approaches; Newton's method ends the convex path where a
bed all but yields; the smoothed path need not stay inside the cones (kicked, tilted and slippery
beds); turns let a self-stress grow a long way."""

ALL_PATHS = (
    Stage("convex path, late", lambda t: t.path_point is None, along.follow_convex_path),
    Stage("from path, late", lambda t: t.path_point is not None, FROM_PATH),
)
"""The paths not followed yet, as factorisations are dear or there was a start."""

FIRST = (
    Stage("few sweeps", lambda t: t.cold and not t.small, by.sweep_briefly),
    Stage("all stick", lambda t: True, along.stick_all),
    Stage("few sweeps, loose", lambda t: t.small and t.loose and not t.heavy, by.sweep_briefly),
    Stage("heavy path", lambda t: t.heavy, along.follow_heavy_path),
    Stage("convex path", lambda t: t.stuck is not None and not t.heavy, along.follow_convex_path),
    Stage("sweeps, small", lambda t: t.small,
          lambda t: t.sweep(t.start, 100, until=t.coarse, factorisations=20)),
    Stage("from path", lambda t: t.path_point is not None, FROM_PATH),
    Stage("deep sweeps", lambda t: t.moving and not t.rough and not t.dear, by.sweep_deep),
    Stage("sweeps, yielding", lambda t: t.rough and t.moving, by.sweep_yielding),
    Stage("sweeps, rough", lambda t: t.rough and not t.moving,
          lambda t: t.sweep(None, 1000, factorisations=0)),
    Stage("sweeps, dear", lambda t: not t.small and t.dear,
          lambda t: t.sweep(t.start, 6000, factorisations=0)),
    Stage("paths, dear", lambda t: not t.small and t.cold and t.dear, ALL_PATHS),
    Stage("sweeps and points, small", lambda t: t.small, by.sweep_on),
    Stage("accept", lambda t: not t.small, Trial.accepts),
)  # fmt: skip
"""What solves nearly all: what sticks, the convex path, Gauss-Seidel with momentum and proximal
points by Newton at its end.  A large bed with a start goes far down by sweeps in one run: near 1e-7
Newton's method still guesses dozens of 10,000 contacts wrong, after these few."""

LAST = (
    Stage("proof", lambda t: t.forces > LIMITS.endless, prove_insoluble),
    Stage("one turn", lambda t: t.gives_energy, by.turn_once),
    Stage("paths, late", lambda t: t.convex_useful and not t.smoothed, ALL_PATHS),
    Stage("turns from paths", lambda t: True, along.turn_from_paths),
)  # fmt: skip
"""What is dear and seldom needed, where nothing proves that there is no solution: some ten seconds
of it solve large packings of little friction."""

PLAN = (*FIRST, *LAST)
