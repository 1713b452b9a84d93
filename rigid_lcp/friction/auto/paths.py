"""Attempts by factorisations: what sticks, Newton's method, and paths of the interior point."""

from copy import copy
from dataclasses import dataclass

import numpy as np

from rigid_lcp.friction.attempts import find_heaviness, follow_smoothed, seem_loose, seem_to_stick
from rigid_lcp.friction.auto.sweeps import TURNS, take_turns
from rigid_lcp.friction.auto.trial import LIMITS, Trial
from rigid_lcp.friction.linear import SingularSystem
from rigid_lcp.friction.methods import Path, PathStep, solve_interior_point
from rigid_lcp.friction.problem import FrictionSolution, norm

CONVEX_PATH = Path(convex=True, compliance=1e-4)
BENT_PATH = Path(compliance=1e-4, rounding=0.3)
"""The convex path with the term |u_T|."""
LAGGED_PATH = Path(compliance=1e-4, rounding=1e-3, lagged=True)
SHARP_PATH = Path(compliance=1e-3, rounding=1e-4)


@dataclass(frozen=True)
class ConvexPath:
    """The convex path, all of it where nothing moves, and from a part of it on Coulomb's."""

    steps: int = 7
    until: float = 1e-4  # residual [-] at which it is left
    useful: float = 1e-3  # residual [-] from which Newton is begun (where little slides)
    newton: int = 5  # steps of Newton, and those that may fail to halve the residual:
    patience: int = 3  # from the end of a path it begins to converge in the first two or not at all
    rest: float = 1e-3
    """Where nothing moves the convex law is Coulomb's: velocities so small beside those of q [-]
    are taken for rest, and the path is followed to its end.  Other paths may end at a motion that
    solves the problem as well (an arch that only just stands)."""
    rest_until: float = 1e-8  # residual [-] at that end
    rest_steps: int = 15
    bent_steps: int = 25
    """Along the bent path from where the convex one was left: from there it folds back seldom."""
    bent_useful: float = 3e-6
    """Residual [-] at which Newton is tried, and again at `Limits.hand_over`."""
    bent_newton: int = 8  # steps of Newton
    end_steps: int = 5
    """Further along the convex path, to its end as good as it can be found [-]: where a bed all but
    yields, Newton's method needs a dozen steps from there."""
    heavy_steps: int = 20
    """Along the convex path where light bodies bear heavy ones, as it has to go further."""
    heavy_newton: int = 10  # steps of Newton from its end
    wider: float = 10.0
    """sigma with which the smoothed path goes on from there, over that of the point [-]: where the
    interior point has jammed, some contacts are far from its own."""


@dataclass(frozen=True)
class SharpPath:
    """Coulomb's path of the interior point with hardly any rounding: it can jam, and where it does
    not its end is near."""

    steps: int = 40
    until: float = 3e-8  # residual [-] at its end
    useful: float = 1e-5  # residual [-] from which Newton is begun
    near: float = 1e-7  # residual [-] from which turns are begun
    turns: int = 3  # turns that may fail


@dataclass(frozen=True)
class SmoothedFurther:
    """The smoothed path that goes on from the convex one, and extrapolated points from its end."""

    factorisations: int = 150
    useful: float = 1e-6  # residual [-] from which points are begun
    points: int = 80  # factorisations of them
    points_flops: float = 5e9  # their effort


@dataclass(frozen=True)
class TurnPaths:
    """Paths from whose ends turns begin again: how many turns are needed differs by ten between
    starts that look alike, so a few of many starts cost less than many of one."""

    paths: tuple[Path, ...] = (BENT_PATH, LAGGED_PATH, CONVEX_PATH)
    steps: int = 45  # along each [-]


CONVEX, SHARP, FURTHER, TURN_PATHS = ConvexPath(), SharpPath(), SmoothedFurther(), TurnPaths()


# --- what sticks ------------------------------------------------------------------------------


def stick_all(trial: Trial) -> bool:
    """One factorisation, exact for towers and much of what stands.  With a start, and where
    factorisations are dear, only if the best point looks like it."""
    if not trial.cold or trial.dear:
        if seem_to_stick(trial.problem, trial.best.r):
            trial.stick()
        return trial.best.solved
    trial.stuck = trial.stick()
    if not trial.best.solved:
        trial.loose = seem_loose(trial.problem, trial.stuck.r)
        trial.heaviness = find_heaviness(trial.problem, trial.stuck.r)
    return trial.best.solved


# --- along paths ------------------------------------------------------------------------------


def follow_convex_path(trial: Trial) -> bool:
    """A part of the convex path and Newton; all of it where it seems to end at rest; then from its
    part on Coulomb's, and Newton."""
    if not trial.affordable:
        return False
    try:
        path = PathStep(trial.problem, CONVEX_PATH, trial.factors)
    except SingularSystem:
        return False
    found = follow(trial, path, CONVEX.until, CONVEX.steps)
    if found.residual < CONVEX.useful:
        trial.run_newton(found.r, CONVEX.newton, found.method, CONVEX.patience)
    if not trial.best.solved and seems_at_rest(trial):
        part = path.x, path.s
        rest = follow(trial, path, CONVEX.rest_until, CONVEX.rest_steps)
        trial.run_newton(rest.r, CONVEX.newton, rest.method, CONVEX.patience)
        path.x, path.s = part
    trial.convex_part = copy(path)
    path.path = BENT_PATH
    steps = CONVEX.bent_steps
    for until in (CONVEX.bent_useful, LIMITS.hand_over):
        if trial.best.solved or steps == 0:
            break
        found = follow(trial, path, until, steps)
        if found.residual > CONVEX.bent_useful:
            break
        steps -= int(found.work["iterations"])
        trial.run_newton(found.r, CONVEX.bent_newton, found.method, CONVEX.patience)
    return end_path(trial, path, found)


def follow_heavy_path(trial: Trial) -> bool:
    """The convex path, so much finer as the bodies borne are heavier, from forces of the size of
    those of sticking, and Coulomb's."""
    if not trial.affordable:
        return False
    assert trial.stuck is not None
    size = float(np.sqrt(np.mean(trial.stuck.r**2)))
    path = PathStep(trial.problem, CONVEX_PATH, trial.factors, size)
    for path.path, until, steps in (
        (CONVEX_PATH, CONVEX.until, CONVEX.heavy_steps),
        (BENT_PATH, CONVEX.bent_useful, CONVEX.bent_steps),
        (BENT_PATH, LIMITS.hand_over, CONVEX.bent_steps),
    ):
        found = follow(trial, path, until / trial.heaviness, steps)
        if found.residual > CONVEX.useful or not trial.affordable:
            break
        trial.run_newton(found.r, CONVEX.heavy_newton, found.method)
        if trial.best.solved:
            break
    return end_path(trial, path, found)


def seems_at_rest(trial: Trial) -> bool:
    """Whether the best point is near an answer, by its residual, with velocities of almost none."""
    best, offset = trial.best, trial.problem.offset
    return best.residual <= CONVEX.until and norm(best.u) <= CONVEX.rest * norm(offset)


def follow(trial: Trial, path: Path | PathStep, until: float, steps: int) -> FrictionSolution:
    """So many steps at most along a path, or on along one that is begun."""
    begun, kind = (path, path.path) if isinstance(path, PathStep) else (None, path)
    return trial.keep(
        solve_interior_point(
            trial.problem, None, until, kind, linear=trial.factors, iterations=steps, begun=begun
        )
    )


def end_path(trial: Trial, path: PathStep, found: FrictionSolution) -> bool:
    """Note where a path has ended, for what goes on from there."""
    trial.path_end, trial.path_point = found.r, (path.force(), CONVEX.wider * path.sigma())
    return trial.best.solved


def follow_sharp_path(trial: Trial) -> bool:
    """`SHARP` and Newton from its end, and turns from where that is near."""
    trial.sharp = True
    steps = min(SHARP.steps, trial.affordable)
    found = follow(trial, SHARP_PATH, max(SHARP.until, trial.tolerance), steps)
    if found.residual <= SHARP.useful:
        found = trial.run_newton(found.r, LIMITS.newton, found.method)
    if not trial.best.solved and found.residual <= SHARP.near:
        take_turns(trial, found.r, SHARP.turns)
    return trial.best.solved


def end_convex_path(trial: Trial) -> bool:
    """The convex path from its part to its end, and Newton from there, though the residual of these
    forces may be no less than that of the part's."""
    assert trial.convex_part is not None
    found = follow(trial, trial.convex_part, 0.0, min(CONVEX.end_steps, trial.affordable))
    trial.run_newton(trial.convex_part.force(), LIMITS.newton, found.method)
    return trial.best.solved


def smooth_further(trial: Trial) -> bool:
    """The smoothed path from the forces and sigma where the convex one ended, and from its end
    extrapolated points."""
    assert trial.path_point is not None
    trial.smoothed = True
    most = min(FURTHER.factorisations, trial.affordable)
    found = trial.attempt(follow_smoothed, trial.path_point, factorisations=most)
    if trial.best.solved or found.residual > FURTHER.useful:
        return trial.best.solved
    trial.extrapolate(FURTHER.points, FURTHER.points_flops, found)
    return trial.best.solved


def turn_from_paths(trial: Trial) -> bool:
    """Turns from where the convex path ended and from the ends of a few more; none of these is
    followed once that has cost the effort of turns.

    Forces there are inside their cones, far from every change of status, and so a self-stress has
    less way to go than from swept ones, which lie on the cones' boundaries.
    """
    most = trial.effort + TURNS.flops
    if trial.path_end is not None and take_turns(trial, trial.path_end):
        return True
    for path in TURN_PATHS.paths:
        if trial.effort > most or not trial.affordable:
            break
        steps = min(TURN_PATHS.steps, trial.affordable)
        found = follow(trial, path, max(LIMITS.hand_over, trial.tolerance), steps)
        if trial.polish(found, factorisations=0) or take_turns(trial, found.r):
            return True
    return False
