"""`solve_friction`: one call for friction problems, and the default that chooses and falls back.

``auto`` takes the first point that is exact enough, and otherwise the best of all:

    no forces        where nothing approaches
    frictionless     where no contact has friction: sweeps and principal pivoting, exact; there are
                     no tangential unknowns
    all stick        one factorisation; exact for towers and much of what stands.  Large problems
                     are swept a few times before, which ends what is loose or regular
    convex path      without a start: a part of it, and Newton; solves most static piles.  Where it
                     does not, the path is bent to Coulomb's law, and Newton again
    Gauss-Seidel     with momentum, from the start given or from nothing, and proximal points by
                     Newton at its end: first few sweeps and factorisations, then many, as what is
                     hard for the one is often easy for the other
    interior point   along several paths to Coulomb's law (`rigid_lcp.interior_point`); each end
                     goes to Newton, and if that is not enough to Gauss-Seidel and Newton again.
                     They end after the effort that `FALLBACK_SHARE` names, or before they begin
                     where a linear programme proves that there is no solution
    islands          what is still not solved, each island apart, by all of this (large problems
                     of few islands at once)

Every method alone can fail on real problems: Newton far from a solution, the interior point where
its path folds back, Gauss-Seidel on tall piles.  Together they fail seldom (`docs/rigid-solvers.md`
counts it); there is no proof: read ``status`` and ``residual``.

Cost: hundreds of sweeps or some factorisations; the interior point takes some 20 a path.  In 3D
their fill grows fast: where one costs as much as a hundred sweeps (3D packings above some 3,000
contacts), thousands of sweeps go first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal, get_args

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from rigid_lcp.body_factorisation import factorisation
from rigid_lcp.errors import ProblemError, UsageError
from rigid_lcp.friction_problem import (
    BodySpace,
    FrictionProblem,
    FrictionSolution,
    friction_problem,
    friction_solution,
)
from rigid_lcp.frictionless import frictionless
from rigid_lcp.gauss_seidel import gauss_seidel
from rigid_lcp.interior_point import Path, interior_point
from rigid_lcp.islands import islands, solve_islands
from rigid_lcp.newton import newton
from rigid_lcp.problem_input import finite_numbers, in_range, one_number
from rigid_lcp.proximal_newton import FACTORISATIONS as MANY
from rigid_lcp.solver_trial import CONVEX_CONTACTS, FEW_CONTACTS, HAND_OVER, LAST_WORD, Trial

Floats = NDArray[np.float64]
Method = Literal["auto", "newton", "interior-point", "gauss-seidel", "pivoting", "dantzig"]

TINY = 1e-60
"""Problems with a smaller q are solved in other units."""
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
FEW_ISLANDS = 20
"""Up to so many islands, single contacts not counted, of a large problem are solved apart at once:
a few grains that lie loose can keep a whole bed from converging.  More cost more than they gain."""
FIRST_SWEEPS = 1000
"""What is spent where the first try was too short."""
LAST_SWEEPS = 2000
DEAR_SWEEPS = 6000
"""What is spent before a factorisation that is dear."""
FALLBACK_SHARE, FALLBACK_FLOPS = 1.0, 2e10
"""What the paths of the interior point may cost in all before no further one is begun: so many
times what was spent before them, or so many flops (some seconds) if that is more."""
ENDLESS = 1e6
"""Forces over ``rho |q|`` that look endless: a proof is looked for before the paths."""
PROOF_CONTACTS = 3000
"""Up to so many contacts a linear programme looks for the proof that there is no solution."""


def solve_friction(
    W: ArrayLike | sp.sparray | sp.spmatrix | BodySpace,
    q: ArrayLike,
    mu: ArrayLike,
    dim: int,
    start: ArrayLike | None = None,
    tolerance: float = 1e-12,
    method: Method = "auto",
    accept: float = 0.0,
) -> FrictionSolution:
    """Forces r and velocities u with ``u = W r + q`` under unilateral contact and Coulomb friction.

    ``W`` (nc * dim, nc * dim): dense, sparse, or its factors as a `BodySpace`; may be singular
    and slightly non-symmetric.  ``q`` (nc * dim,), contact after contact: (n, t) or (n, t1, t2);
    r in N and u in m/s^2, or in N s and m/s, with W to match.  ``mu`` (nc,) or one number [-].
    ``start`` r (nc * dim,): forces of the step before.  ``tolerance``: on the scale-free residual
    (`rigid_lcp.cones`); round-off ends near 1e-15 times the condition of W.

    ``accept``: where sweeps and Newton leave more than ``tolerance``, but not more than this,
    ``auto`` tries no more on problems of more than `FEW_CONTACTS` contacts.

    ``method``: ``auto`` (module docstring); ``interior-point`` and ``newton`` are polished by
    Newton; ``pivoting`` and ``dantzig`` (2D) are in the modules of their names.

    Never fails silently: see ``status`` and ``message`` of the `FrictionSolution`, which holds
    the best point found.  Raises `ProblemError` for input that poses no problem, `UsageError` for
    an unknown method or a tolerance that is not positive.  Forces, and sometimes velocities, are
    not unique: compare residuals.
    """
    problem: FrictionProblem = friction_problem(W, q, mu, dim)
    if method not in get_args(Method):
        raise UsageError(
            f"there is no method {method!r}", where="method",
            remedy="one of " + ", ".join(get_args(Method)),
        )  # fmt: skip
    tolerance, accept = one_number(tolerance, "tolerance"), one_number(accept, "accept", zero=True)
    begin = None if start is None else _start(start, problem)
    if problem.contacts == 0:
        return friction_solution(problem, problem.offset.copy(), tolerance, method)
    largest = float(np.abs(problem.offset).max())
    if 0.0 < largest < TINY:  # squares of such numbers are zero
        unit = 2.0 ** np.frexp(largest)[1]
        large = replace(problem, offset=problem.offset / unit)
        found = solve_friction(
            large.bodies or large.delassus, large.offset, large.friction, dim,
            None if begin is None else begin / unit, tolerance, method, accept,
        )  # fmt: skip
        return replace(found, r=found.r * unit, u=found.u * unit)
    if method == "auto":
        return solve_auto(problem, begin, tolerance, accept)
    return _methods()[method](problem, begin, tolerance)


def solve_auto(
    problem: FrictionProblem, start: Floats | None = None, tolerance: float = 1e-12,
    accept: float = 0.0,
) -> FrictionSolution:  # fmt: skip
    """The default of `solve_friction` on a problem that is made already."""
    if not problem.friction.any():
        exact = frictionless(problem, start, tolerance)
        if exact.solved:
            return exact
    parts = islands(problem) if problem.contacts > FEW_CONTACTS else []
    larger = sum(len(part) > 1 for part in parts)
    split = len(parts) > 1 and larger <= FEW_ISLANDS
    if split:
        trial = Trial(problem, start, tolerance)
        trial.keep(solve_islands(problem, _solve_island, start, tolerance, accept=accept))
    else:
        trial = _attempts(problem, start, tolerance, accept)
    if trial.best.solved or (
        trial.best.residual <= accept and problem.contacts > FEW_CONTACTS
    ):  # fmt: skip
        return trial.solution()
    parts = parts or islands(problem)
    if len(parts) > 1 and not split and trial.best.status != "no solution":
        apart = trial.keep(solve_islands(problem, _solve_island, trial.best.r, tolerance))
        if _error(apart) < _error(trial.best):  # endless forces on one hide the errors of others
            trial.best = apart
    if not trial.best.solved and (trial.best.status == "no solution" or _proved_insoluble(problem)):
        return trial.solution(
            "no solution",
            "no forces within the cones of friction keep all contacts from approaching (proved by"
            " a linear programme)\n  -> use impulses: a velocity-level time step, or look for"
            " contacts that bear on no mass",
        )
    return trial.solution()


def _attempts(
    problem: FrictionProblem, start: Floats | None, tolerance: float, accept: float = 0.0
) -> Trial:
    trial = Trial(problem, start, tolerance)
    if trial.best.solved:
        trial.sharpen()
        return trial
    if not problem.friction.any():
        trial.keep(frictionless(problem, start, tolerance))
        if trial.best.solved:
            return trial
    rough = tolerance if tolerance > LAST_WORD else HAND_OVER
    small = problem.contacts <= FEW_CONTACTS
    cold = start is None and tolerance < HAND_OVER and problem.contacts <= CONVEX_CONTACTS
    if trial.convex_start() if cold else trial.stick_if_likely():
        return trial
    if small and trial.sweep(start, FEW_SWEEPS, until=rough, factorisations=FEW):
        return trial
    moving = not small and start is not None
    if tolerance >= HAND_OVER and not small:  # rough answers need few factorisations or none
        if trial.yielding(start) if moving else trial.sweep(None, FIRST_SWEEPS, factorisations=0):
            return trial
        if trial.best.residual <= accept:
            return trial
    if not small and trial.dear and trial.sweep(start, DEAR_SWEEPS, factorisations=0):
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
    _paths(trial, accept)
    return trial


def _paths(trial: Trial, accept: float) -> None:
    """The interior point along one path after another, within the effort of `FALLBACK_SHARE`."""
    problem, tolerance = trial.problem, trial.tolerance
    if trial.forces > ENDLESS and _proved_insoluble(problem):
        trial.best = replace(trial.best, status="no solution")
        return
    most = max(FALLBACK_FLOPS, (1.0 + FALLBACK_SHARE) * trial.effort)
    for path, sweeps in PATHS:
        if trial.effort > most:
            return
        trial.linear = trial.linear or factorisation(problem)
        found = trial.keep(
            interior_point(problem, None, max(HAND_OVER, tolerance), path, linear=trial.linear)
        )
        if trial.polish(found) or trial.sweep(found.r, sweeps, "interior-point"):
            return
        if trial.best.residual <= accept and problem.contacts > FEW_CONTACTS:
            return
    trial.sweep(None, LAST_SWEEPS)


def _error(found: FrictionSolution) -> float:
    """Size of the natural map in units of force, not over that of the forces."""
    return found.residual * float(np.linalg.norm(found.r))


def _solve_island(
    problem: FrictionProblem, start: Floats | None, tolerance: float, accept: float = 0.0
) -> FrictionSolution:
    return _attempts(problem, start, tolerance, accept).solution()


def _interior_point(
    problem: FrictionProblem, start: Floats | None, tolerance: float
) -> FrictionSolution:
    trial = Trial(problem, None, tolerance)
    trial.linear = factorisation(problem)
    found = interior_point(
        problem, None, max(HAND_OVER, tolerance), PATHS[0][0], linear=trial.linear
    )
    trial.keep(found)
    trial.polish(found)
    return trial.solution()


def _methods() -> dict[str, Callable[..., FrictionSolution]]:
    from rigid_lcp.dantzig import dantzig  # compiled when they are asked for
    from rigid_lcp.pivoting import pivoting

    return {
        "newton": newton,
        "interior-point": _interior_point,
        "gauss-seidel": gauss_seidel,
        "pivoting": pivoting,
        "dantzig": dantzig,
    }


def _proved_insoluble(problem: FrictionProblem) -> bool:
    from rigid_lcp.force_proof import forces_insufficient

    return problem.contacts <= PROOF_CONTACTS and forces_insufficient(problem)


def _start(start: ArrayLike, problem: FrictionProblem) -> Floats:
    force = finite_numbers(start, "start").ravel()
    if force.shape != problem.offset.shape:
        raise ProblemError(
            f"it has {len(force)} numbers and q has {len(problem.offset)}", where="start",
            remedy="give the forces of all contacts, in the order of q",
        )  # fmt: skip
    in_range(force, "start", least=0.0)
    return force
