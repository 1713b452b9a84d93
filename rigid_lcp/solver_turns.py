"""From where the convex path ends short: two other paths, then sweeps and points by turns.

A self-stress may have to grow a long way before the next contact lets go.  Sweeps of Gauss-Seidel
are cheap and hardly ever fail, but creep; extrapolated proximal points run far ahead, and get stuck
among changes of status, out of which sweeps lead.  So each goes on from where the other ended, and
not from its best point: the residual does not show the way made, and sweeps that begin again from
the best point stop at 1e-4 to 1e-6 where in one run they end below 1e-9.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.body_factorisation import factorisation
from rigid_lcp.friction_problem import FrictionSolution
from rigid_lcp.gauss_seidel import gauss_seidel, sweeper_of
from rigid_lcp.interior_point import Path, interior_point
from rigid_lcp.smoothed_path import smoothed_path
from rigid_lcp.solver_trial import FEW_STEPS, HAND_OVER, Trial

Floats = NDArray[np.float64]

SMOOTHED_STEPS, SMOOTHED_USEFUL = 150, 1e-6
SMOOTHED_DRIFT, SMOOTHED_DRIFT_FLOPS = 80, 5e9
"""Factorisations along the smoothed path that goes on from the convex one, and of extrapolated
points from where it ends, if that is no worse, and their cost."""
SWEPT_FIRST = 20.0
"""Where a factorisation costs as many sweeps, some sweeps go before the smoothed path."""
TURN_SWEEPS, TURN_STEPS, TURN_PATIENCE = 1000, 1500, 30
TURNS_PATIENCE, TURNS_FLOPS = 8, 6e10
"""Sweeps of a turn; factorisations of its points at most, and so many after which they are left for
the next turn if they do not halve their residual; turns that may fail to halve the least so far,
and an effort after which there is no next."""
TURN_PATHS = (
    Path(rounding=0.3, compliance=1e-4),
    Path(rounding=1e-3, compliance=1e-4, lagged=True),
    Path(convex=True, compliance=1e-4),
)
PATH_STEPS = 45
"""Paths from whose ends turns begin again, and steps along each: how many turns are needed differs
by ten between starts that look alike, so a few of many starts cost less than many of one."""
SHARP_PATH, SHARP_STEPS, NEAR_TURNS = Path(rounding=1e-4, compliance=1e-3), 40, 3
SHARP_END, SHARP_USEFUL, SHARP_NEAR = 3e-8, 1e-5, 1e-7
"""Coulomb's path of the interior point with hardly any rounding, steps along it and its end; what
residual Newton may begin from, and from what turns may, so many of which may fail: where the law is
hardly rounded the path can jam, and where it does not its end is near."""


def from_path(trial: Trial, begin: tuple[Floats, float]) -> bool:
    """Where the convex path ended short: Coulomb's, hardly rounded, sweeps if they are cheap
    (`SWEPT_FIRST`), the smoothed path, and turns from the best point; whether the tolerance is
    reached."""
    if not trial.sharp and sharp_path(trial):
        return True
    if trial.sweeps_a_factorisation > SWEPT_FIRST and trial.path_end is not None:
        swept(trial, trial.path_end)
    return trial.best.solved or smoothed_further(trial, begin) or by_turns(trial, trial.best.r)


def sharp_path(trial: Trial) -> bool:
    """`SHARP_PATH` and Newton from its end, and turns from where that is near; whether the
    tolerance is reached."""
    trial.sharp = True
    trial.linear = trial.linear or factorisation(trial.problem)
    found = trial.keep(
        interior_point(
            trial.problem, None, max(SHARP_END, trial.tolerance), SHARP_PATH, linear=trial.linear,
            iterations=min(SHARP_STEPS, trial.affordable),
        )
    )  # fmt: skip
    if found.residual <= SHARP_USEFUL:
        found = trial.newton(found.r, FEW_STEPS, found.method)
    if not trial.best.solved and found.residual <= SHARP_NEAR:
        by_turns(trial, found.r, NEAR_TURNS)
    return trial.best.solved


def by_turns(trial: Trial, force: Floats, patience: int = TURNS_PATIENCE) -> bool:
    """Sweeps and extrapolated points by turns, from forces r (nc * dim,) [N or N s], until
    ``patience`` of them failed to halve the least residual; whether the tolerance is reached."""
    most, mark, waited = trial.effort + TURNS_FLOPS, np.inf, 0
    while waited < patience and trial.effort < most and trial.affordable:
        found = swept(trial, force)
        if trial.endless(found.r):  # sweeps diverge where friction makes W no descent
            break
        if not trial.best.solved:
            found = trial.drift(TURN_STEPS, np.inf, found, TURN_PATIENCE)
        if trial.best.solved:
            break
        force, waited = found.r, waited + 1
        if found.residual < 0.5 * mark:
            mark, waited = found.residual, 0
    return trial.best.solved


def swept(trial: Trial, start: Floats) -> FrictionSolution:
    """Sweeps from ``start``, and where they end."""
    trial.sweeper = trial.sweeper or sweeper_of(trial.problem)
    found = trial.keep(
        gauss_seidel(
            trial.problem, start, trial.tolerance, TURN_SWEEPS, sweeper=trial.sweeper, last=True
        )
    )
    trial.sharpen()
    return found


def smoothed_further(trial: Trial, begin: tuple[Floats, float]) -> bool:
    """The smoothed path from the forces and sigma where the convex one ended, and from its end
    extrapolated points."""
    trial.smoothed = True
    found = smoothed_path(
        trial.problem, trial.tolerance, begin, linear=trial.linear,
        factorisations=min(SMOOTHED_STEPS, trial.affordable),
    )  # fmt: skip
    trial.keep(found)
    trial.sharpen()
    if trial.best.solved or found.residual > SMOOTHED_USEFUL:
        return trial.best.solved
    trial.drift(SMOOTHED_DRIFT, SMOOTHED_DRIFT_FLOPS, found)
    return trial.best.solved


def turns_from_paths(trial: Trial) -> bool:
    """Turns from where the convex path ended and from the ends of a few more; none of these is
    followed once that has cost `TURNS_FLOPS`.

    Forces there are inside their cones, far from every change of status, and so a self-stress has
    less way to go than from swept ones, which lie on the cones' boundaries.
    """
    problem, most = trial.problem, trial.effort + TURNS_FLOPS
    if trial.path_end is not None and by_turns(trial, trial.path_end):
        return True
    for path in TURN_PATHS:
        if trial.effort > most or not trial.affordable:
            break
        found = interior_point(
            problem, None, max(HAND_OVER, trial.tolerance), path, linear=trial.linear,
            iterations=min(PATH_STEPS, trial.affordable),
        )  # fmt: skip
        if trial.polish(trial.keep(found), factorisations=0) or by_turns(trial, found.r):
            return True
    return False
