"""A pivoting method that does not cycle: a path of exact solutions from an easy problem to ours.

Lemke's idea (Cottle, Pang and Stone, The Linear Complementarity Problem, 1992, 4.4) on the lists
of the paper's section 6 in place of the three or four unknowns a contact of Stewart and Trinkle
(Int. J. Numer. Methods Eng. 39 (1996) 2673): Coulomb's law in 2D with a covering vector d,

    u = W r + q + lambda d,    lambda from large (or 1) down to 0.

The solutions r(lambda) form a path of straight pieces; at each corner one contact changes its list
(events 3a to 3d).  Unlike the driven force of `rigid_lcp.friction.methods.dantzig`, lambda may grow
again: after a corner the path goes on in the sense in which the contact that moved stays
consistent.  A path never meets itself, so nothing cycles.

From no forces, d = n: for large lambda all contacts part.  Along a ray that ends the path,
``dr . du = -mu dr_N |du_T| <= 0`` and ``dr . du = dr . W dr + dlambda dr . d``.  With W positive
definite (it is shifted a little, and the shift removed) and d inside K*, ``dr . d > 0``, so there
is no such ray: the path ends in a solution for every coefficient of friction.

From forces near a solution (of the last step, of Gauss-Seidel, of Newton): the lists are read off
them, and d is what is missing to make them a solution of the problem at lambda = 1.  A few corners
are left.  There d need not be inside K*, so a ray or a detour can end the path.

Networks of 500 contacts, friction 0.1 to 0.8, CPU time of one thread (provisional): from a start of
residual 1e-4 0.02 to 0.1 s (0 to 50 pivots; two of a dozen needed 600 and 0.4 s), from no forces
0.1 to 2 s (600 to 7,000 pivots).  Above a friction of 1.5 some networks are not solved.

2D friction, or 3D without friction.  In 3D friction sliding has a circle of directions, which a
pivoting method can only replace by a polygon (an error of ``1 - cos(pi / k)`` for k edges).
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rigid_lcp.friction.methods.gauss_seidel import gauss_seidel
from rigid_lcp.friction.pivots import (
    BREAKING,
    DONE,
    SHIFT_LEAST,
    SLIDING_DOWN,
    SLIDING_UP,
    STATIC,
    TOO_MANY,
    Geometry,
    Ints,
    Pivots,
    drive_offset,
    judge_pivots,
    multiply_geometry,
    read_pivots_force,
    refresh_reduced,
    remove_shift,
    set_lists,
    slide_sign,
    solve_reduced,
    start_pivots,
)
from rigid_lcp.friction.problem import (
    FrictionProblem,
    FrictionSolution,
    judge_forces,
    require_number,
    require_whole,
)

Floats = NDArray[np.float64]


def pivoting(
    problem: FrictionProblem,
    start: Floats | None = None,
    tolerance: float = 1e-12,
    *,
    sweeps: int = 300,
    tangential_velocity: Floats | None = None,
    shift: float = 1e-2,
    max_pivots: int | None = None,
) -> FrictionSolution:
    """Solve a 2D friction problem, or a frictionless one, exactly by following a path of pivots.

    ``start`` r (nc * dim,): forces near the solution; the nearer, the fewer pivots.  Without it
    ``sweeps`` of Gauss-Seidel make one; ``sweeps=0`` begins with no forces, as Lemke does.  A path
    that takes too many pivots is given up: Gauss-Seidel betters its start, or Lemke's is taken.
    ``tangential_velocity`` u_T (nc,) [m/s]: where not zero the contact slides already and friction
    opposes u_T; only then can there be no solution (Painleve); begins with no forces.  ``shift``:
    added to the diagonal of W, relative to its mean, at first; removed in the end.
    ``max_pivots``: of all paths together, default 60 a contact.

    ``work``: ``pivots``, changes of lists; ``paths``, how many were begun; ``sweeps``.
    Status ``no solution`` is proved by a linear programme.  Raises `ProblemError` in 3D with
    friction and for velocities that are none, `UsageError` for other options that are none.
    Takes memory for (2 nc)^2 numbers and O(k^2) work a pivot for k unknown forces: not for above
    some 2,000 contacts.
    """
    tolerance, sweeps = require_number(tolerance, "tolerance"), require_whole(sweeps, "sweeps")
    shift = require_number(shift, "shift", zero=True)
    most = 60 * problem.contacts + 100
    if max_pivots is not None:
        most = require_whole(max_pivots, "max_pivots")
    few, spent, swept = problem.contacts + 50, 0, 0
    attempts: list[tuple[float, bool, int]] = [(shift, False, 4 * few), (shift, False, most)]
    if (start is not None or sweeps > 0) and tangential_velocity is None:
        attempts = [(shift, True, few), (shift, True, few), (10.0 * shift, True, few), *attempts]
    near = start
    for paths, (amount, warm, limit) in enumerate(attempts, 1):
        state = start_pivots(problem, amount, 0.0, tangential_velocity, False)
        if warm:
            if near is None or paths > 1:
                count = sweeps if near is None else 2000
                swept += count
                near = gauss_seidel(problem, near, 1e-10, count).r
            if problem.residual(near) <= tolerance:
                work = {"pivots": float(spent), "paths": paths - 1.0, "sweeps": float(swept)}
                return judge_forces(problem, np.array(near), tolerance, "pivoting", work)
            if paths == 1:
                amount = min(max(10.0 * problem.residual(near), SHIFT_LEAST), shift)
                state = start_pivots(problem, amount, 0.0, None, False)
            ended = follow_from_forces(problem, state, near, min(limit, most - spent))
        else:
            ended = follow_from_nothing(problem, state, min(limit, most - spent))
        force = read_pivots_force(problem, state)
        if ended == DONE:
            force = remove_shift(problem, state, tolerance, max(few, limit // 4))
        spent += int(state.events[0])
        state.events[0] = spent
        solution = judge_pivots(problem, state, force, tolerance, "pivoting", ended, -1)
        solution.work.update(paths=float(paths), sweeps=float(swept))
        if solution.status in ("solved", "no solution") or spent >= most:
            break
    return solution


def follow_from_nothing(problem: FrictionProblem, state: Pivots, limit: int) -> int:
    """Lemke's path: at lambda = 1 all contacts part, with d = n but for a little against ties."""
    geometry, b = state.geometry, state.b
    if not len(b):
        return DONE
    normal = geometry.normal
    covering = np.zeros(len(b))
    generator = np.random.default_rng(1)
    covering[normal] = generator.uniform(0.9, 1.1, problem.contacts)
    covering *= 1.01 * max(float((-b[normal] / covering[normal]).max()), 0.0)
    exact = b.copy()
    ties = state.geometry.tangent[geometry.tangent >= 0]
    if len(ties):  # which way a contact would slide where q does not say: inside K*
        least = 1e-3 * covering[normal][geometry.tangent >= 0]
        covering[ties] = least * generator.uniform(-1.0, 1.0, len(ties))
    state.reduced.kind[:] = BREAKING
    b += covering
    state.a[:] = b
    return drive_offset(state, exact - b, 1.0, True, limit)


def follow_from_forces(problem: FrictionProblem, state: Pivots, start: Floats, limit: int) -> int:
    """The path from a start: lists from its natural map, d from what it lacks."""
    nc, dim = problem.contacts, problem.dim
    force = np.ascontiguousarray(start, dtype=float).reshape(nc, dim)
    velocity = problem.velocity(force.ravel()).reshape(nc, dim)
    kinds = read_lists(force, velocity, problem.friction, problem.rho, state.geometry.slip)
    reduced, geometry = state.reduced, state.geometry
    set_lists(state, kinds)
    members = reduced.members[: reduced.size[0]]
    if not refresh_reduced(geometry, reduced):
        return TOO_MANY
    exact = state.b - state.shift[0] * force.ravel()[state.rows]  # a proximal step from the start
    state.f[members] = solve_reduced(reduced, exact)
    little = 1e-3 * float(np.abs(state.f).mean()) or 1.0
    noise = np.random.default_rng(2).uniform(0.5, 1.5, (nc, 2))
    make_consistent(geometry, kinds, state.f, state.a, exact, little, problem.rho, noise)
    product = np.zeros_like(exact)
    multiply_geometry(geometry, state.f, product)
    state.b[:] = state.a - product
    return drive_offset(state, exact - state.b, 1.0, True, limit)


@njit(cache=True)
def read_lists(force: Floats, velocity: Floats, mu: Floats, rho: float, slip: Ints) -> Ints:
    """List of each contact: on which face of its cone the natural map projects it."""
    kinds = np.full(len(mu), BREAKING)
    for c in range(len(mu)):
        tangential = force[c, 1] - rho * velocity[c, 1] if mu[c] > 0.0 else 0.0
        normal = force[c, 0] - rho * (velocity[c, 0] + mu[c] * abs(velocity[c, 1]))
        if slip[c] != 0:
            if force[c, 0] > rho * velocity[c, 0]:
                kinds[c] = SLIDING_UP if slip[c] > 0 else SLIDING_DOWN
        elif mu[c] * abs(tangential) > -normal:
            if mu[c] > 0.0 and abs(tangential) <= mu[c] * normal:
                kinds[c] = STATIC
            else:
                kinds[c] = SLIDING_UP if tangential >= 0.0 else SLIDING_DOWN
    return kinds


@njit(cache=True)
def make_consistent(
    geometry: Geometry, kinds: Ints, f: Floats, a: Floats, b: Floats, little: float, rho: float,
    noise: Floats,
) -> None:  # fmt: skip
    """Move f and a, as little as need be, to where every contact obeys the rules of its list."""
    for c in range(len(kinds)):
        n, t, mu, sign = (
            geometry.normal[c],
            geometry.tangent[c],
            geometry.mu[c],
            slide_sign(kinds[c]),
        )
        if kinds[c] == BREAKING:
            f[n] = 0.0
        else:
            f[n] = max(f[n], little * noise[c, 0])
        if t >= 0:
            f[t] = sign * mu * f[n] if kinds[c] != STATIC else f[t]
            bound = mu * f[n] * (1.0 - 1e-3 * noise[c, 1])
            if kinds[c] == STATIC:
                f[t] = min(max(f[t], -bound), bound)
    a[:] = b
    multiply_geometry(geometry, f, a)
    for c in range(len(kinds)):
        n, t, sign = geometry.normal[c], geometry.tangent[c], slide_sign(kinds[c])
        a[n] = max(a[n], little / rho * noise[c, 0]) if kinds[c] == BREAKING else 0.0
        if t >= 0 and kinds[c] == STATIC:
            a[t] = 0.0
        elif t >= 0 and sign != 0.0 and geometry.slip[c] == 0:
            a[t] = -sign * max(-sign * a[t], little / rho * noise[c, 1])


METHOD = pivoting
