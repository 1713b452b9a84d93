"""Large beds with the forces of the step before: sweeps first, in one run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.contact_sweeps import MANY_CONTACTS
from rigid_lcp.proximal_newton import proximal_newton
from rigid_lcp.solver_cold import FAST_SWEEPS, convex_path
from rigid_lcp.solver_trial import Trial

Floats = NDArray[np.float64]

YIELDING_SWEEPS, YIELDING_FEW = 2000, 1000
NEAR_ENOUGH, SMOOTH_SHIFT, SMOOTH_FACTORISATIONS = 1.4, 1e-3, 8
"""A bed that yields: sweeps to so many times the tolerance, from where proximal points with a
great shift, which hardly ever fail, take off what is stiff of the error: a third and more.  After
fewer sweeps than `YIELDING_FEW` some more cost less than that."""
DEEP, DEEP_SWEEPS = 1e-9, 1600
"""A large bed with a start, to the last digits: at `HAND_OVER` Newton's method still guesses dozens
of 10,000 contacts wrong, where so many sweeps in one run, to this residual, leave it few."""


def yielding(trial: Trial, start: Floats | None) -> bool:
    """Sweeps that drift, as the error falls like one over their number, and a proximal point
    at their end; whether the tolerance is reached.  In one run: begun again from their best
    point sweeps may go round in circles."""
    near = NEAR_ENOUGH * trial.tolerance
    if trial.sweep(start, YIELDING_SWEEPS, until=near, factorisations=0):
        return True
    done = int(trial.work["sweeps"])
    if done < YIELDING_FEW and trial.sweep(
        trial.best.r, FAST_SWEEPS + done // 2, factorisations=0
    ):  # fmt: skip
        return True
    if not trial.dear:
        trial.keep(
            proximal_newton(
                trial.problem, trial.best.r, trial.tolerance, linear=trial.linear,
                factorisations=SMOOTH_FACTORISATIONS, first_shift=SMOOTH_SHIFT,
            ),
            trial.best.method,
        )  # fmt: skip
    return trial.best.solved


def deep(trial: Trial, start: Floats | None, accept: float) -> bool:
    """Sweeps far down and Newton, from the start and, where no more than the tolerance is
    accepted, from the end of the convex path; whether that is enough.  The end of the path is
    no better than the best point, but sweeps from it end sooner."""
    if trial.sweep(start, DEEP_SWEEPS, until=DEEP, factorisations=0):
        return True
    if accept > 0.0:  # a bed in motion: the next step is due, unless it is a small one
        return trial.best.residual <= accept and trial.problem.contacts >= MANY_CONTACTS
    if convex_path(trial):
        return True
    return trial.path_end is not None and trial.sweep(
        trial.path_end, DEEP_SWEEPS, "interior-point", until=DEEP, factorisations=0
    )
