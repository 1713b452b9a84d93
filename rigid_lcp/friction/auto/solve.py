"""`solve_friction`: one call for friction problems, and the default that chooses and falls back.

``auto`` tries one method after another, what is cheap before what is dear
(`rigid_lcp.friction.auto.plan`), and takes the first point that is exact enough, and otherwise the
best.
"""

import warnings
from collections.abc import Mapping
from dataclasses import replace
from importlib import import_module
from time import perf_counter

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from rigid_lcp.arrays import Floats
from rigid_lcp.errors import UsageError
from rigid_lcp.friction.attempts import solve_frictionless
from rigid_lcp.friction.auto.islands import find_islands, solve_islands
from rigid_lcp.friction.auto.plan import FIRST, is_proved_insoluble, run_attempts
from rigid_lcp.friction.auto.trial import LIMITS, Trial
from rigid_lcp.friction.linear import NO_LIMIT, Clock
from rigid_lcp.friction.problem import (
    FORCE_ROUND_OFF,
    SHARE_LEFT,
    BodySpace,
    FrictionProblem,
    FrictionSolution,
    judge_forces,
    make_problem,
    norm,
    require_number,
    require_range,
    require_start,
)
from trackbed.choices import find_choices
from trackbed.plausible import describe_implausible

LEAST_OFFSET = 1e-60
"""Problems with a smaller q [that of u] are solved in other units."""
ENERGY_GIVEN = (
    "W gives energy to forces within the cones of friction (r . W r < 0), so a solution need not"
    " exist; the best residual is {:.2g}\n  -> give W by its bodies (BodySpace), or to more digits"
)


def solve_friction(
    W: ArrayLike | sp.sparray | sp.spmatrix | BodySpace, q: ArrayLike, mu: ArrayLike, dim: int,
    start: ArrayLike | None = None, tolerance: float = 1e-12, method: str = "auto",
    accept: float = 0.0, max_time: float | None = None,
) -> FrictionSolution:  # fmt: skip
    """Forces r and velocities u with ``u = W r + q`` under unilateral contact and Coulomb friction.

    ``W`` (nc * dim, nc * dim): dense, sparse, or its factors as a `BodySpace`; may be singular
    and slightly non-symmetric.  ``q`` (nc * dim,), contact after contact: (n, t) or (n, t1, t2);
    r in N and u in m/s^2, or in N s and m/s, with W to match.  ``mu`` (nc,) or one number [-].
    ``start`` r (nc * dim,): forces of the step before.  ``tolerance``: on the scale-free residual
    (`rigid_lcp.friction.problem.cones`); round-off ends near 1e-15 times the condition of W.

    ``accept``: where sweeps and Newton leave more than ``tolerance``, but not more than this,
    ``auto`` tries no more on problems of more than `Limits.few_contacts` contacts.

    ``max_time`` [s] of wall clock, for ``auto``: when it is up the best point so far comes back
    with the status ``out of time``.  A limit that is not reached changes nothing; what one that is
    reached finds depends on the machine.  The first calls of a process load kernels (those after an
    installation compile them), which counts.

    ``method``: ``auto`` (module docstring); ``interior-point`` and ``newton`` are polished by
    Newton; ``pivoting`` and ``dantzig`` (2D) are in the modules of their names.

    Never fails silently: see ``status`` and ``message`` of the `FrictionSolution`, which holds
    the best point found.  Raises `ProblemError` for input that poses no problem, `UsageError` for
    an unknown method, a tolerance or a time that is not positive.  Warns of friction above 2.
    Forces, and sometimes velocities, are not unique: compare residuals.
    """
    seconds = np.inf if max_time is None else require_number(max_time, "max_time")
    clock = NO_LIMIT if max_time is None else Clock(perf_counter() + seconds)
    problem: FrictionProblem = make_problem(W, q, mu, dim)
    if said := describe_implausible("friction", float(problem.friction.max(initial=0.0)), "mu"):
        warnings.warn(said, stacklevel=2)
    if max_time is not None and method != "auto":
        raise UsageError(
            f"{method} knows no time limit", where="max_time", remedy="leave it out, or use auto"
        )
    return solve_problem(problem, start, tolerance, method, accept, clock)


def solve_problem(
    problem: FrictionProblem, start: ArrayLike | None = None, tolerance: float = 1e-12,
    method: str = "auto", accept: float = 0.0, clock: Clock = NO_LIMIT,
) -> FrictionSolution:  # fmt: skip
    """`solve_friction` of a problem that is made already, whose friction is not judged."""
    if method != "auto" and method not in find_methods():
        raise UsageError(
            f"there is no method {method!r}", where="method",
            remedy="one of " + ", ".join(["auto", *find_methods()]),
        )  # fmt: skip
    tolerance = require_number(tolerance, "tolerance")
    accept = require_number(accept, "accept", zero=True)
    begin = None
    if start is not None:
        begin = require_start(start, len(problem.offset), problem.dim)
        require_range(begin, "start", least=0.0)
    if problem.contacts == 0:
        return judge_forces(problem, problem.offset.copy(), tolerance, method)
    largest = float(np.abs(problem.offset).max())
    if 0.0 < largest < LEAST_OFFSET:  # squares of such numbers are zero
        unit = 2.0 ** np.frexp(largest)[1]
        large = replace(problem, offset=problem.offset / unit)
        begin = None if begin is None else begin / unit
        found = solve_problem(large, begin, tolerance, method, accept, clock)
        return replace(found, r=found.r * unit, u=found.u * unit)
    if method == "auto":
        return solve_auto(problem, begin, tolerance, accept, clock)
    return solve_alone(problem, begin, tolerance, method)


def solve_auto(
    problem: FrictionProblem, start: Floats | None = None, tolerance: float = 1e-12,
    accept: float = 0.0, clock: Clock = NO_LIMIT,
) -> FrictionSolution:  # fmt: skip
    """The default of `solve_friction` on a problem that is made already."""
    if not problem.friction.any():
        exact = solve_frictionless(problem, start, tolerance, clock=clock)
        if exact.solved:
            return exact
    parts = find_islands(problem) if problem.contacts > LIMITS.few_contacts else []
    larger = sum(len(part) > 1 for part in parts)
    split = len(parts) > 1 and larger <= LIMITS.few_islands
    if split:
        trial = Trial(problem, start, tolerance)
        trial.keep(solve_islands(problem, _solve_island, start, tolerance, clock, accept=accept))
    else:
        trial = run_attempts(problem, start, tolerance, accept, clock=clock)
    finer = tolerance
    while (
        trial.best.residual <= finer and not trial.best.solved and finer > FORCE_ROUND_OFF
        and not clock.late
    ):  # fmt: skip
        # what leaves little of the error without forces: light bodies that still fall may leave
        # much beside the forces of heavy ones
        enough = SHARE_LEFT * problem.error_without_forces / (norm(trial.best.r) or 1.0)
        finer = 0.5 * min(enough, finer)
        trial.keep(run_attempts(problem, trial.best.r, finer, accept, FIRST, clock).solution())
    if trial.best.solved or (
        trial.best.residual <= accept and problem.contacts > LIMITS.few_contacts
    ):  # fmt: skip
        return trial.solution()
    parts = [] if clock.late else parts or find_islands(problem)
    if len(parts) > 1 and not split:
        apart = trial.keep(solve_islands(problem, _solve_island, trial.best.r, tolerance, clock))
        if _find_error(apart) < _find_error(
            trial.best
        ):  # endless forces on one hide the errors of others
            trial.best = apart
    if not trial.best.solved and (
        trial.best.status == "no solution" or is_proved_insoluble(problem, clock)
    ):
        if len(parts) <= 1:
            trial.forget_endless()
        return trial.solution(
            "no solution",
            "no forces within the cones of friction keep all contacts from approaching (proved by"
            " a linear programme)\n  -> look for bodies held between others that can not give way"
            " (a press), or contacts that bear on no mass; where r are forces, use impulses: a"
            " velocity-level time step",
        )
    if not trial.best.solved and clock.late:
        return trial.solution(
            "out of time",
            f"the time is up at a residual of {trial.best.residual:.2g} (asked: {tolerance:.2g})"
            "\n  -> give it more, ask for less, or begin from these forces",
        )
    if not trial.best.solved and trial.gives_energy:
        return trial.solution(message=ENERGY_GIVEN.format(trial.best.residual))
    return trial.solution()


def _find_error(found: FrictionSolution) -> float:
    """Size of the natural map in units of force, not over that of the forces."""
    return found.residual * float(np.linalg.norm(found.r))


def _solve_island(
    problem: FrictionProblem, start: Floats | None, tolerance: float, accept: float = 0.0,
    clock: Clock = NO_LIMIT,
) -> FrictionSolution:  # fmt: skip
    return run_attempts(problem, start, tolerance, accept, clock=clock).solution()


def solve_alone(
    problem: FrictionProblem, start: Floats | None, tolerance: float, method: str
) -> FrictionSolution:
    """One of `find_methods`, by itself or, where its file says ``POLISHED``, with Newton at its
    end."""
    module = import_module(find_methods()[method])
    solve = module.METHOD
    if not getattr(module, "POLISHED", False):
        alone: FrictionSolution = solve(problem, start, tolerance)
        return alone
    trial = Trial(problem, None, tolerance)
    rough = max(LIMITS.hand_over, tolerance)
    trial.polish(trial.keep(solve(problem, None, rough, linear=trial.factors)))
    return trial.solution()


def find_methods() -> Mapping[str, str]:
    """The methods by name, and the module of each; compiled when they are asked for."""
    return find_choices("rigid_lcp.friction.methods", "METHOD")
