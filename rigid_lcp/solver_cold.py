"""Where there is no start: what a few sweeps end, what sticks, and a part of the convex path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.body_factorisation import SingularSystem, factorisation
from rigid_lcp.cones import length
from rigid_lcp.friction_problem import FrictionSolution
from rigid_lcp.gauss_seidel import gauss_seidel, sweeper_of
from rigid_lcp.interior_point import Path, PathStep, interior_point
from rigid_lcp.solver_trial import FEW_CONTACTS, FEW_STEPS, HAND_OVER, Trial
from rigid_lcp.sticking import heaviness, seem_loose

Floats = NDArray[np.float64]

CONVEX_PATH = Path(convex=True, compliance=1e-4)
CONVEX_STEPS, CONVEX_CONTACTS = 7, 10_000
CONVEX_END, CONVEX_USEFUL, CONVEX_NEWTON = 1e-4, 1e-3, 5
"""Without a start, and up to so many contacts: steps along the convex path to a residual of
`CONVEX_END`, and so many of Newton if it came below `CONVEX_USEFUL` (where little slides)."""
REST, REST_END, REST_STEPS = 1e-3, 1e-8, 15
"""Where nothing moves the convex law is Coulomb's: velocities so small beside those of q are taken
for rest, and the convex path is followed to its end.  Other paths may end at a motion that solves
the problem as well (an arch that only just stands)."""
CONVEX_SWEEPS, SLOW = 30, (15, 4e-3)
"""Sweeps where much is loose; they end where half of them leave more than that (towers)."""
FAST, FAST_SWEEPS = 3e-4, 200
"""A residual that few sweeps leave where so many more may end it."""
BENT_STEPS, BENT_ROUNDING, BENT_USEFUL = 25, 0.3, 3e-6
"""Where that is not enough: steps with the term |u_T|, from where the convex path was left, to
`BENT_USEFUL`, and Newton; if that fails, on to `HAND_OVER`, and Newton again.  Coming from there
the path folds back seldom."""
WIDER = 10.0
"""sigma with which the smoothed path goes on from there, over that of the point: where the interior
point has jammed, some contacts are far from its own."""
HEAVY_STEPS, HEAVY_PATIENCE = 12, 5
HEAVY_PATH, HEAVY_NEWTON = 20, 10
"""Where light bodies bear heavy ones: steps of Newton from the forces of sticking, steps along a
path, which has to go further, and of Newton from its end."""
NEWTON_PATIENCE = 3
"""Steps of Newton that may fail to halve the residual: from the end of a path it begins to converge
in the first two or not at all."""


def convex_start(trial: Trial) -> bool:
    """A few sweeps, for what they solve at once; what sticks; a part of the convex path and
    Newton, which solve most static piles.  Small problems are swept only where much is loose,
    and dear ones not factored unless they seem to stick."""
    small = trial.problem.contacts <= FEW_CONTACTS
    if not small and few_sweeps(trial):
        return True
    if trial.dear:
        return trial.stick_if_likely()
    stuck = trial.stick()
    if trial.best.solved:
        return True
    loose, finer = seem_loose(trial.problem, stuck.r), heaviness(trial.problem, stuck.r)
    if small and loose and finer == 1.0 and few_sweeps(trial):
        return True
    if trial.best.residual <= HAND_OVER / finer:
        trial.newton(trial.best.r, FEW_STEPS, trial.best.method)
        if trial.best.solved or finer == 1.0:
            return trial.best.solved
    elif finer > 1.0 and not loose:
        trial.newton(stuck.r, HEAVY_STEPS, stuck.method, HEAVY_PATIENCE)
    if finer > 1.0:
        return trial.best.solved or heavy_path(trial, stuck.r, finer)
    return convex_path(trial)


def few_sweeps(trial: Trial) -> bool:
    """`CONVEX_SWEEPS`, and more where they converge fast (loose grains, crystals)."""
    trial.sweeper = trial.sweeper or sweeper_of(trial.problem)
    for sweeps, slow in ((CONVEX_SWEEPS, SLOW), (FAST_SWEEPS, (0, np.inf))):
        found = gauss_seidel(
            trial.problem, trial.best.r, trial.tolerance, sweeps, sweeper=trial.sweeper, slow=slow
        )
        trial.keep(found)
        if trial.best.solved or found.residual > FAST:
            break
    if trial.problem.contacts <= FEW_CONTACTS:
        trial.sharpen()
    else:
        trial.sharpen_by_sweeps()
    return trial.best.solved


def convex_path(trial: Trial) -> bool:
    """A part of the convex path and Newton; all of it where it seems to end at rest; then from its
    part on Coulomb's, and Newton."""
    if not trial.affordable:
        return False
    try:
        path = PathStep(trial.problem, CONVEX_PATH, trial.linear or factorisation(trial.problem))
    except SingularSystem:
        return False
    found = follow(trial, path, CONVEX_END, CONVEX_STEPS)
    if found.residual < CONVEX_USEFUL:
        trial.newton(found.r, CONVEX_NEWTON, found.method, NEWTON_PATIENCE)
    if not trial.best.solved and seems_at_rest(trial):
        part = path.x, path.s
        rest = follow(trial, path, REST_END, REST_STEPS)
        trial.newton(rest.r, CONVEX_NEWTON, rest.method, NEWTON_PATIENCE)
        path.x, path.s = part
    path.path = replace(CONVEX_PATH, convex=False, rounding=BENT_ROUNDING)
    steps = BENT_STEPS
    for until in (BENT_USEFUL, HAND_OVER):
        if trial.best.solved or steps == 0:
            break
        found = follow(trial, path, until, steps)
        if found.residual > BENT_USEFUL:
            break
        steps -= int(found.work["iterations"])
        trial.newton(found.r, CONVEX_STEPS + 1, found.method, NEWTON_PATIENCE)
    trial.path_end, trial.path_point = found.r, (path.force(), WIDER * path.sigma())
    return trial.best.solved


def seems_at_rest(trial: Trial) -> bool:
    """Whether the best point is near an answer, by its residual, with velocities of almost none."""
    best, offset = trial.best, trial.problem.offset
    return best.residual <= CONVEX_END and length(best.u) <= REST * length(offset)


def heavy_path(trial: Trial, stuck: Floats, finer: float) -> bool:
    """The convex path, so much ``finer``, from forces of the size of ``stuck``, and Coulomb's."""
    if not trial.affordable:
        return False
    size = float(np.sqrt(np.mean(stuck**2)))
    linear = trial.linear or factorisation(trial.problem)
    path = PathStep(trial.problem, CONVEX_PATH, linear, size)
    bent = replace(CONVEX_PATH, convex=False, rounding=BENT_ROUNDING)
    for path.path, until, steps in (
        (CONVEX_PATH, CONVEX_END, HEAVY_PATH),
        (bent, BENT_USEFUL, BENT_STEPS),
        (bent, HAND_OVER, BENT_STEPS),
    ):
        found = follow(trial, path, until / finer, steps)
        if found.residual > CONVEX_USEFUL or not trial.affordable:
            break
        trial.newton(found.r, HEAVY_NEWTON, found.method)
        if trial.best.solved:
            break
    trial.path_end, trial.path_point = found.r, (path.force(), WIDER * path.sigma())
    return trial.best.solved


def follow(trial: Trial, path: PathStep, until: float, steps: int) -> FrictionSolution:
    """So many steps on a path at most."""
    return trial.keep(
        interior_point(trial.problem, None, until, path.path, iterations=steps, begun=path)
    )
