"""Semismooth Newton on Alart and Curnier's form of Coulomb's law: the polish to round-off.

With ``z = r_N - rho u_N`` and ``y = r_T - rho u_T`` (Alart and Curnier, CMAME 92 (1991) 353)

    F = (r_N - max(0, z),  r_T - the nearest point to y of the disc of radius mu max(0, z))

is zero exactly at a solution.  One step solves ``(A + B W) dr = -F``, A and B the derivatives of F
by r and u: contacts open, stick or slide in it, and once these are guessed right the step is
exact but for the direction of sliding.  Where forces are not unique (stick, redundant contacts)
W is singular there; W is shifted by ``shift / rho``, which is one proximal-point step on r: the
limit has no error from it, unlike Tikhonov's.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.linear import Factorisation, SingularSystem, choose_factorisation
from rigid_lcp.friction.problem import (
    FrictionProblem,
    FrictionSolution,
    judge_forces,
    norm,
    require_number,
    require_start,
    require_whole,
)

Flags = NDArray[np.int8]


@dataclass(frozen=True)
class NewtonNumbers:
    """Shifts and steps."""

    first_shifts: tuple[float, float] = (1e-5, 1e-3)
    """Proximal shifts over mean(diag W) [-] to begin with, tried in turn."""
    least_shift: float = 1e-10  # least of them [-]
    quiet: float = 0.01
    """The shift falls by this factor at a step on which no contact changes its status: then it is
    all that holds the steps up.  While some do a great one is better: round-off is divided by it,
    and contacts that hardly bear would change at every step."""
    bearable: float = 1e-2
    """Part of what makes the contacts approach, ``rho |q|`` [-], that the first shift may hold back
    of the forces: a great weight on light bodies answers at a small eigenvalue of W."""
    iterations: int = 50  # steps at most,
    patience: int = 8
    """and those that may fail to halve the best residual, as contacts change status first."""


NEWTON = NewtonNumbers()


@njit(cache=True)
def find_alart_curnier(
    force: Floats, velocity: Floats, mu: Floats, rho: Floats
) -> tuple[Floats, Floats, Floats, Flags]:
    """F and its derivatives A = dF/dr, B = dF/du, and the status of each contact.

    ``force`` and ``velocity`` (nc, dim); ``rho`` (nc,) force per velocity.  Status: 0 open,
    1 stick, 2 slide.
    """
    nc, dim = force.shape
    f = np.empty((nc, dim))
    a = np.zeros((nc, dim, dim))
    b = np.zeros((nc, dim, dim))
    status = np.zeros(nc, dtype=np.int8)
    y = np.empty(dim)
    for c in range(nc):
        z = force[c, 0] - rho[c] * velocity[c, 0]
        if z <= 0.0:
            for i in range(dim):
                f[c, i] = force[c, i]
                a[c, i, i] = 1.0
            continue
        f[c, 0] = rho[c] * velocity[c, 0]
        b[c, 0, 0] = rho[c]
        length = 0.0
        for i in range(1, dim):
            y[i] = force[c, i] - rho[c] * velocity[c, i]
            length += y[i] ** 2
        length = np.sqrt(length)
        radius = mu[c] * z
        if length <= radius:
            status[c] = 1
            for i in range(1, dim):
                f[c, i] = rho[c] * velocity[c, i]
                b[c, i, i] = rho[c]
            continue
        status[c] = 2
        for i in range(1, dim):
            y[i] /= length
        for i in range(1, dim):
            f[c, i] = force[c, i] - radius * y[i]
            a[c, i, 0] = -mu[c] * y[i]
            b[c, i, 0] = mu[c] * y[i] * rho[c]
            for j in range(1, dim):
                turn = radius / length * ((1.0 if i == j else 0.0) - y[i] * y[j])
                a[c, i, j] = (1.0 if i == j else 0.0) - turn
                b[c, i, j] = rho[c] * turn
    return f, a, b, status


def solve_newton(
    problem: FrictionProblem, start: Floats | None = None, tolerance: float = 1e-12, *,
    linear: Factorisation | None = None, iterations: int = NEWTON.iterations,
    patience: int = NEWTON.patience,
) -> FrictionSolution:  # fmt: skip
    """Newton steps from ``start`` (zero forces if None) until the residual is small enough.

    Converges fast near a solution, and may go anywhere from a poor start: give it the point of
    another method.  Where it does not halve its residual in ``patience`` steps it goes back to its
    best point and on with a greater shift, which is slower and steadier; asked for less patience
    than by default it ends there.  ``linear``: factorisations of this problem's W, made if
    not given.

    Raises `ProblemError` for a start that is none, `UsageError` for other options that are none.
    """
    tolerance = require_number(tolerance, "tolerance", zero=True)
    iterations = require_whole(iterations, "iterations")
    shape = (problem.contacts, problem.dim)
    linear = linear or choose_factorisation(problem)
    rho = problem.contact_rho
    best = np.zeros(problem.offset.shape)
    if start is not None:
        best = require_start(start, len(best), problem.dim)
    best_residual, done = problem.residual(best), 0
    offered = problem.rho * norm(problem.offset)
    most, *others = NEWTON.first_shifts
    first = min(most, NEWTON.bearable * offered / (norm(best) or 1.0)) or most
    least_shift = min(NEWTON.least_shift, NEWTON.quiet * first)
    for shift in (first, *others) if patience >= NEWTON.patience else (first,):
        force, waited, mark = best, 0, best_residual
        status = np.zeros(0, dtype=np.int8)
        while best_residual > tolerance and done < iterations and waited < patience:
            velocity, last = problem.velocity(force).reshape(shape), status
            f, a, b, status = find_alart_curnier(
                force.reshape(shape), velocity, problem.friction, rho
            )
            if np.array_equal(status, last):
                shift = max(least_shift, NEWTON.quiet * shift)
            done, waited = done + 1, waited + 1
            try:
                solve = linear.factor(a + (shift / problem.rho) * b, b)
            except SingularSystem:
                break
            force = force - solve(f.ravel())
            residual = problem.residual(force)
            if not np.isfinite(residual):
                break
            if residual < best_residual:
                best, best_residual = force, residual
            if best_residual < 0.5 * mark:
                waited, mark = 0, best_residual
            if best_residual <= tolerance:  # once more by the same factors: nearly for nothing
                velocity = problem.velocity(best).reshape(shape)
                f = find_alart_curnier(best.reshape(shape), velocity, problem.friction, rho)[0]
                again = best - solve(f.ravel())
                if problem.residual(again) < best_residual:
                    best = again
    return judge_forces(
        problem, best, tolerance, "newton",
        {"iterations": float(done), "factorisations": float(done)},
    )  # fmt: skip


METHOD = solve_newton
