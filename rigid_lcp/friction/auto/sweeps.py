"""Attempts by sweeps of Gauss-Seidel, alone and by turns with extrapolated proximal points.

A self-stress may have to grow a long way before the next contact lets go.  Sweeps of Gauss-Seidel
are cheap and hardly ever fail, but creep; extrapolated proximal points run far ahead, and get stuck
among changes of status, out of which sweeps lead.  So each goes on from where the other ended, and
not from its best point: the residual does not show the way made, and sweeps that begin again from
the best point stop at 1e-4 to 1e-6 where in one run they end below 1e-9.
"""

from dataclasses import dataclass

import numpy as np

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.attempts import PROXIMAL, solve_proximal
from rigid_lcp.friction.auto.trial import LIMITS, Trial
from rigid_lcp.friction.problem import FrictionSolution


@dataclass(frozen=True)
class BriefSweeps:
    """A few sweeps, for what they solve at once."""

    sweeps: int = 30
    creep: tuple[int, float] = (15, 4e-3)
    """They end where so many of them leave more than this residual [-] (towers)."""
    fast: float = 3e-4
    """A residual [-] that few sweeps leave where more may end it (loose grains, crystals)."""
    fast_sweeps: int = 200  # so many more


@dataclass(frozen=True)
class LongSweeps:
    """Sweeps of a large bed with a start, in one run."""

    sweeps: int = 1600
    until: float = 1e-9  # residual [-] at which Newton's method takes over
    yielding_sweeps: int = 2000  # where the bed yields and a rough answer is asked for
    near: float = 1.4
    """They end at so many times the tolerance [-], from where proximal points with a great shift,
    which hardly ever fail, take off what is stiff of the error: a third and more."""
    few: int = 1000  # after fewer sweeps some more cost less than such points
    shift: float = 1e-3  # first shift of the points, over the mean of W's diagonal [-]
    factorisations: int = 8  # of the points


@dataclass(frozen=True)
class Turns:
    """Sweeps and extrapolated points by turns."""

    sweeps: int = 1000  # a turn
    points: int = 1500  # factorisations a turn at most
    points_patience: int = 30
    """Factorisations after which points that did not halve their residual are left."""
    patience: int = 8  # turns that may fail to halve the least residual so far
    flops: float = 6e10  # effort after which there is no next turn


BRIEF, LONG, TURNS = BriefSweeps(), LongSweeps(), Turns()


def sweep_briefly(trial: Trial) -> bool:
    """A few sweeps, and more where they converge fast (`BriefSweeps`)."""
    for sweeps, slow in ((BRIEF.sweeps, BRIEF.creep), (BRIEF.fast_sweeps, (0, np.inf))):
        found = trial.run_sweeps(trial.best.r, trial.tolerance, sweeps, slow=slow)
        if trial.best.solved or found.residual > BRIEF.fast:
            break
    if trial.small:
        trial.sharpen()
    else:
        trial.sharpen_by_sweeps()
    return trial.best.solved


def sweep_on(trial: Trial) -> bool:
    """Sweeps from the best point, and proximal points from their end.

    Where there is no solution forces grow without end here, and a proof is looked for at once.
    """
    until = max(trial.coarse, LIMITS.hand_over)
    points = PROXIMAL.factorisations
    return trial.sweep(trial.best.r, TURNS.sweeps, until=until, factorisations=points)


def sweep_yielding(trial: Trial) -> bool:
    """Sweeps that drift, as the error falls like one over their number, and a proximal point
    at their end.  In one run: begun again from their best point sweeps may go round in circles."""
    near = LONG.near * trial.tolerance
    if trial.sweep(trial.start, LONG.yielding_sweeps, until=near, factorisations=0):
        return True
    done = int(trial.work["sweeps"])
    if done < LONG.few and trial.sweep(
        trial.best.r, BRIEF.fast_sweeps + done // 2, factorisations=0
    ):  # fmt: skip
        return True
    if not trial.dear:
        trial.attempt(
            solve_proximal, trial.best.r, trial.best.method, factorisations=LONG.factorisations,
            first_shift=LONG.shift,
        )  # fmt: skip
    return trial.best.solved


def sweep_deep(trial: Trial) -> bool:
    """Sweeps far down from the start, and Newton."""
    return trial.sweep(trial.start, LONG.sweeps, until=LONG.until, factorisations=0)


def turn_once(trial: Trial) -> bool:
    """Where W gives energy no solution need exist: what is near is found in one turn, the last."""
    take_turns(trial, trial.best.r if trial.path_end is None else trial.path_end, patience=1)
    return True


def sweep_turn(trial: Trial, start: Floats) -> FrictionSolution:
    """Sweeps of one turn from ``start``, and where they end."""
    found = trial.run_sweeps(start, trial.tolerance, TURNS.sweeps, last=True)
    trial.sharpen()
    return found


def take_turns(trial: Trial, force: Floats, patience: int | None = None) -> bool:
    """Sweeps and extrapolated points by turns, from forces r (nc * dim,) [N or N s], until
    ``patience`` of them failed to halve the least residual; whether the tolerance is reached."""
    patience = TURNS.patience if patience is None else patience
    most, mark, waited = trial.effort + TURNS.flops, np.inf, 0
    while waited < patience and trial.effort < most and trial.affordable:
        found = sweep_turn(trial, force)
        if trial.is_endless(found.r):  # sweeps diverge where friction makes W no descent
            break
        if not trial.best.solved:
            found = trial.extrapolate(TURNS.points, np.inf, found, TURNS.points_patience)
        if trial.best.solved:
            break
        force, waited = found.r, waited + 1
        if found.residual < 0.5 * mark:
            mark, waited = found.residual, 0
    return trial.best.solved
