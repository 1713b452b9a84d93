"""The compiled time step of rigid bodies: Newton's and Euler's equations, six freedoms a body.

Leapfrog, as the deformable bodies beside them: with shift d and velocity V of the centre, turn q
(a unit quaternion) and angular momentum L about the centre, in the laboratory's directions,

    V(k+1/2) = V(k-1/2) + dt F(k)/M        L(k+1/2) = L(k-1/2) + dt T(k)
    d(k+1)   = d(k) + dt V(k+1/2)          q(k+1)   = drift(q(k), L(k+1/2), dt)

The drift turns the body about its principal axes 1, 2, 3, 2, 1 by ``dt/2, dt/2, dt, dt/2, dt/2``
times ``L_i/I_i`` (Dullweber, Leimkuhler and McLachlan, J. Chem. Phys. 107 (1997) 5840): it is
explicit, of second order, reversible and symplectic, and leaves L as it is, to the bit.
"""

from typing import Any, NamedTuple

import numpy as np

from qdem_fem.kernel import cross, dot, exact, inlined, read_row

FREE, STILL = 3, -1
"""Of ``Rigid.turning``; 0, 1, 2: turns about that axis of the laboratory alone."""


class Rigid(NamedTuple):
    """All rigid bodies: b of them, with v vertices that move with them, and L loads."""

    node_first: Any  # (b + 1,) first vertex of every body, and the end
    node_at: Any  # (v,) of its first component in the fields
    force_at: Any  # (v,) of its first component in the windows of forces
    arm: Any  # (v, 3) X - c [m]
    inverse_mass: Any  # (b,) 1/M [1/kg]
    axes: Any  # (b, 3, 3) principal axes in the reference configuration, by rows
    inverse_inertia: Any  # (b, 3) 1/I_i [1/(kg m^2)]
    shift: Any  # (b, 3) d [m]
    velocity: Any  # (b, 3) V, half a step behind [m/s]
    turn: Any  # (b, 4) q, scalar first
    spin: Any  # (b, 3) L, half a step behind [kg m^2/s]
    given: Any  # (b, 3) series of the table that a component of d follows; -1: free
    given_weight: Any  # (b, 3)
    turning: Any  # (b,) `FREE`, 0, 1, 2 or `STILL`
    load_first: Any  # (b + 1,) first load of every body, and the end
    load_component: Any  # (L,) 0, 1, 2
    load_series: Any  # (L,)
    load_weight: Any  # (L,)
    load_arm: Any  # (L, 3) [m]


@inlined
def read_axis(axes: Any, b: int, i: int) -> Any:  # pragma: no cover
    """Principal axis i of body b."""
    return axes[b, i, 0], axes[b, i, 1], axes[b, i, 2]


@inlined
def find_turn_change(q: Any, a: Any) -> Any:  # pragma: no cover
    """``R(q) a - a``: with ``t = 2 v x a`` it is ``q0 t + v x t``."""
    v = q[1], q[2], q[3]
    t = cross(v, a)
    t = 2.0 * t[0], 2.0 * t[1], 2.0 * t[2]
    w = cross(v, t)
    return q[0] * t[0] + w[0], q[0] * t[1] + w[1], q[0] * t[2] + w[2]


@inlined
def turn_vector(q: Any, a: Any) -> Any:  # pragma: no cover
    """``R(q) a``"""
    less = find_turn_change(q, a)
    return a[0] + less[0], a[1] + less[1], a[2] + less[2]


@inlined
def compose_turn(q: Any, axis: Any, c: float, s: float) -> Any:  # pragma: no cover
    """``q`` behind a turn about ``axis`` (unit) of the body; ``c``, ``s``: of half its angle."""
    x, y, z = s * axis[0], s * axis[1], s * axis[2]
    return (
        q[0] * c - q[1] * x - q[2] * y - q[3] * z,
        q[0] * x + q[1] * c + q[2] * z - q[3] * y,
        q[0] * y - q[1] * z + q[2] * c + q[3] * x,
        q[0] * z + q[1] * y - q[2] * x + q[3] * c,
    )


@inlined
def turn_around(q: Any, axis: Any, m: float, n: float, angle: float) -> Any:  # pragma: no cover
    """``q`` behind a turn by ``angle`` [rad], and the next two components of a fixed vector."""
    c, s = np.cos(0.5 * angle), np.sin(0.5 * angle)
    whole, across = c * c - s * s, 2.0 * c * s
    return compose_turn(q, axis, c, s), whole * m + across * n, whole * n - across * m


@inlined
def drift(c: Any, b: int, q: Any, spin: Any, step: float) -> Any:  # pragma: no cover
    """The turn of body b after ``step`` [s] without torque."""
    first, second, third = read_axis(c.axes, b, 0), read_axis(c.axes, b, 1), read_axis(c.axes, b, 2)
    inverse = read_row(c.inverse_inertia, b)
    back = q[0], -q[1], -q[2], -q[3]
    own = turn_vector(back, spin)
    m0, m1, m2 = dot(first, own), dot(second, own), dot(third, own)
    half = 0.5 * step
    q, m1, m2 = turn_around(q, first, m1, m2, half * m0 * inverse[0])
    q, m2, m0 = turn_around(q, second, m2, m0, half * m1 * inverse[1])
    q, m0, m1 = turn_around(q, third, m0, m1, step * m2 * inverse[2])
    q, m2, m0 = turn_around(q, second, m2, m0, half * m1 * inverse[1])
    q, m1, m2 = turn_around(q, first, m1, m2, half * m0 * inverse[0])
    scale = 1.0 / np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return q[0] * scale, q[1] * scale, q[2] * scale, q[3] * scale


@exact
def find_angular_velocity(c: Any, b: int, spin: Any) -> Any:  # pragma: no cover
    """``I(q)^-1 L`` of body b [1/s]; about its axis alone where it is held to one."""
    turning, q = c.turning[b], read_turn(c, b)
    x, y, z = 0.0, 0.0, 0.0
    if turning == STILL:
        return x, y, z
    if turning != FREE:
        moment = 0.0  # e . I e of the axis e, which the turn about e leaves as it is
        for i in range(3):
            along = turn_vector(q, read_axis(c.axes, b, i))[turning]
            moment += along * along / c.inverse_inertia[b, i]
        rate = spin[turning] / moment
        if turning == 0:
            return rate, y, z
        return (x, rate, z) if turning == 1 else (x, y, rate)
    for i in range(3):
        axis = turn_vector(q, read_axis(c.axes, b, i))
        rate = dot(axis, spin) * c.inverse_inertia[b, i]
        x, y, z = x + rate * axis[0], y + rate * axis[1], z + rate * axis[2]
    return x, y, z


@inlined
def read_turn(c: Any, b: int) -> Any:  # pragma: no cover
    """The turn of body b."""
    return c.turn[b, 0], c.turn[b, 1], c.turn[b, 2], c.turn[b, 3]


@inlined
def take_pulls(c: Any, b: int, forces: Any) -> Any:  # pragma: no cover
    """Force [N] and torque [N m] of what lies at the vertices of body b, which is taken away."""
    q, force, torque = read_turn(c, b), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for i in range(c.node_first[b], c.node_first[b + 1]):
        at = c.force_at[i]
        f = forces[at], forces[at + 1], forces[at + 2]
        if f[0] == 0.0 and f[1] == 0.0 and f[2] == 0.0:
            continue
        for k in range(3):
            forces[at + k] = 0.0
        force, torque = add_pull(force, torque, turn_vector(q, read_row(c.arm, i)), f)
    return force, torque


@exact
def take_loads(c: Any, b: int, table_row: Any) -> Any:  # pragma: no cover
    """Force [N] and torque [N m] of the loads on body b."""
    q, force, torque = read_turn(c, b), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    for i in range(c.load_first[b], c.load_first[b + 1]):
        size, k = c.load_weight[i] * table_row[c.load_series[i]], c.load_component[i]
        f = size * (k == 0), size * (k == 1), size * (k == 2)
        force, torque = add_pull(force, torque, turn_vector(q, read_row(c.load_arm, i)), f)
    return force, torque


@inlined
def add_pull(force: Any, torque: Any, arm: Any, f: Any) -> Any:  # pragma: no cover
    """Force and torque with ``f`` [N] at ``arm`` [m] in addition."""
    m = cross(arm, f)
    return (
        (force[0] + f[0], force[1] + f[1], force[2] + f[2]),
        (torque[0] + m[0], torque[1] + m[1], torque[2] + m[2]),
    )


@inlined
def place_vertices(
    c: Any, b: int, displacement: Any, velocity: Any, step: float
) -> None:  # pragma: no cover
    """Move the vertices of body b; their velocity is the way in this step over ``step`` [s]."""
    q, rate = read_turn(c, b), 1.0 / step
    x = find_turn_change(q, (1.0, 0.0, 0.0))
    y = find_turn_change(q, (0.0, 1.0, 0.0))
    z = find_turn_change(q, (0.0, 0.0, 1.0))
    for i in range(c.node_first[b], c.node_first[b + 1]):
        arm, at = read_row(c.arm, i), c.node_at[i]
        for k in range(3):
            there = c.shift[b, k] + (x[k] * arm[0] + y[k] * arm[1] + z[k] * arm[2])
            velocity[at + k] = (there - displacement[at + k]) * rate
            displacement[at + k] = there


@exact
def advance_rigid(
    c: Any, forces: Any, displacement: Any, velocity: Any, table: Any, gravity: Any, work: Any,
    step: float,
) -> None:  # fmt: skip  # pragma: no cover
    """One step of all rigid bodies.

    ``forces`` [N], ``displacement`` [m], ``velocity`` [m/s]: flat, of the kernel; ``table``
    (2, series): amplitudes now and at the end of the step; ``gravity`` (3 or more,) [m/s^2] or
    None; ``work`` (3,) [J]: its first two, of the loads and of prescribed motion, are added to.
    """
    for b in range(c.inverse_mass.size):
        pull, twist = take_pulls(c, b, forces)
        load, lever = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        slow, fast, turning = load, load, c.turning[b]
        loaded = c.load_first[b + 1] > c.load_first[b]
        if loaded:
            load, lever = take_loads(c, b, table[0])
            slow = find_angular_velocity(c, b, read_row(c.spin, b))
        for k in range(3):
            c.spin[b, k] += step * (twist[k] + lever[k])
        if loaded or turning != FREE:
            fast = find_angular_velocity(c, b, read_row(c.spin, b))
        done = 0.0
        for k in range(3):
            before = c.velocity[b, k]
            after = before + step * c.inverse_mass[b] * (pull[k] + load[k])
            if gravity is not None:
                after += step * gravity[k]
            if c.given[b, k] >= 0:
                target = c.given_weight[b, k] * table[1, c.given[b, k]]
                given = (target - c.shift[b, k]) / step
                work[1] += 0.5 * (given - after) / c.inverse_mass[b] * (given + before)
                after = given
                c.shift[b, k] = target
            else:
                c.shift[b, k] += step * after
            c.velocity[b, k] = after
            done += load[k] * (before + after) + lever[k] * (slow[k] + fast[k])
        work[0] += 0.5 * step * done
        q = read_turn(c, b)
        if turning == FREE:
            q = drift(c, b, q, read_row(c.spin, b), step)
        elif turning != STILL:
            q = turn_by_rate(q, fast, step)
        c.turn[b, 0], c.turn[b, 1], c.turn[b, 2], c.turn[b, 3] = q
        place_vertices(c, b, displacement, velocity, step)


@inlined
def turn_by_rate(q: Any, rate: Any, step: float) -> Any:  # pragma: no cover
    """``q`` ahead of a turn with angular velocity ``rate`` [1/s] of the laboratory."""
    size = np.sqrt(dot(rate, rate))
    scale = 1.0 / size if size > 0.0 else 0.0
    axis = rate[0] * scale, rate[1] * scale, rate[2] * scale
    half, own = 0.5 * size * step, turn_vector((q[0], -q[1], -q[2], -q[3]), axis)
    return compose_turn(q, own, np.cos(half), np.sin(half))
