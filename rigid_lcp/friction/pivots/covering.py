"""Paths of pivots (`rigid_lcp.friction.methods.pivoting`): where each begins, and its covering
vector d."""

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.friction.pivots import updates
from rigid_lcp.friction.pivots.drive import DONE, TOO_MANY
from rigid_lcp.friction.pivots.shift import set_lists
from rigid_lcp.friction.pivots.state import Pivots, drive_offset
from rigid_lcp.friction.problem import FrictionProblem


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
    state.reduced.kind[:] = updates.BREAKING
    b += covering
    state.a[:] = b
    return drive_offset(state, exact - b, True, limit)


def follow_from_forces(problem: FrictionProblem, state: Pivots, start: Floats, limit: int) -> int:
    """The path from a start: lists from its natural map, d from what it lacks."""
    nc, dim = problem.contacts, problem.dim
    force = np.ascontiguousarray(start, dtype=float).reshape(nc, dim)
    velocity = problem.velocity(force.ravel()).reshape(nc, dim)
    kinds = read_lists(force, velocity, problem.friction, problem.rho, state.geometry.slip)
    reduced, geometry = state.reduced, state.geometry
    set_lists(state, kinds)
    members = reduced.members[: reduced.size[0]]
    if not updates.refresh_reduced(geometry, reduced):
        return TOO_MANY
    exact = state.b - state.shift[0] * force.ravel()[state.rows]  # a proximal step from the start
    state.f[members] = updates.solve_reduced(reduced, exact)
    little = 1e-3 * float(np.abs(state.f).mean()) or 1.0
    noise = np.random.default_rng(2).uniform(0.5, 1.5, (nc, 2))
    make_consistent(geometry, kinds, state.f, state.a, exact, little, problem.rho, noise)
    product = np.zeros_like(exact)
    updates.multiply_geometry(geometry, state.f, product)
    state.b[:] = state.a - product
    return drive_offset(state, exact - state.b, True, limit)


@njit(cache=True)
def read_lists(force: Floats, velocity: Floats, mu: Floats, rho: float, slip: Ints) -> Ints:
    """List of each contact: on which face of its cone the natural map projects it."""
    kinds = np.full(len(mu), updates.BREAKING)
    for c in range(len(mu)):
        tangential = force[c, 1] - rho * velocity[c, 1] if mu[c] > 0.0 else 0.0
        normal = force[c, 0] - rho * (velocity[c, 0] + mu[c] * abs(velocity[c, 1]))
        if slip[c] != 0:
            if force[c, 0] > rho * velocity[c, 0]:
                kinds[c] = updates.SLIDING_UP if slip[c] > 0 else updates.SLIDING_DOWN
        elif mu[c] * abs(tangential) > -normal:
            if mu[c] > 0.0 and abs(tangential) <= mu[c] * normal:
                kinds[c] = updates.STATIC
            else:
                kinds[c] = updates.SLIDING_UP if tangential >= 0.0 else updates.SLIDING_DOWN
    return kinds


@njit(cache=True)
def make_consistent(
    geometry: updates.Geometry, kinds: Ints, f: Floats, a: Floats, b: Floats, little: float,
    rho: float, noise: Floats,
) -> None:  # fmt: skip
    """Move f and a, as little as need be, to where every contact obeys the rules of its list."""
    for c in range(len(kinds)):
        n, t, mu = geometry.normal[c], geometry.tangent[c], geometry.mu[c]
        sign = updates.find_slide_sign(kinds[c])
        if kinds[c] == updates.BREAKING:
            f[n] = 0.0
        else:
            f[n] = max(f[n], little * noise[c, 0])
        if t >= 0:
            f[t] = sign * mu * f[n] if kinds[c] != updates.STATIC else f[t]
            bound = mu * f[n] * (1.0 - 1e-3 * noise[c, 1])
            if kinds[c] == updates.STATIC:
                f[t] = min(max(f[t], -bound), bound)
    a[:] = b
    updates.multiply_geometry(geometry, f, a)
    for c in range(len(kinds)):
        n, t, sign = geometry.normal[c], geometry.tangent[c], updates.find_slide_sign(kinds[c])
        a[n] = max(a[n], little / rho * noise[c, 0]) if kinds[c] == updates.BREAKING else 0.0
        if t >= 0 and kinds[c] == updates.STATIC:
            a[t] = 0.0
        elif t >= 0 and sign != 0.0 and geometry.slip[c] == 0:
            a[t] = -sign * max(-sign * a[t], little / rho * noise[c, 1])
