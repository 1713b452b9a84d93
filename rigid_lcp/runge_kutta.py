"""Acceleration level: contact forces at every stage of a fourth-order Runge-Kutta step (section 9).

A step, as in section 4 of the paper: contacts; collisions, where touching bodies approach (section
7); the geometry equations (26) with Coulomb's law (27); integration.  A step that ends in an
overlap is taken back and halved; after three clean steps the step is doubled, up to the longest
one.  Three things are added to the paper:

* Bounces that get shorter without end (Zeno) are cut off: an approach slower than ``REST_SPEED``
  times the free-fall speed over a body's size is a collision without restitution.
* A sliding contact keeps the direction of its friction during a step.  A step in which it comes
  to rest is taken back and shortened to end there; from then on it may stick.
* Gaps and velocities of lasting contacts are put back to zero after each step, as the second
  derivative of a gap alone would let them drift (by the fifth power of the step).

Use it for few bodies and where order counts; where forces do not exist (Painleve) it raises
`NoSolution`, and velocity-level time stepping goes on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigid_lcp.contacts import ContactForces, Contacts, contact_rows
from rigid_lcp.equations import body_space, contact_offset, relative_velocity
from rigid_lcp.errors import NoSolution, NotConverged, Overlapping
from rigid_lcp.friction_problem import BodySpace, FrictionSolution, friction_problem
from rigid_lcp.motion import Motion, motion_displaced, motion_with_rates
from rigid_lcp.pivoting import pivoting
from rigid_lcp.scene import Loads, World
from rigid_lcp.solver import solve_friction
from rigid_lcp.time_stepping import contact_forces, forces_error

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

TOUCH = 1e-9
"""Gap below which two bodies touch, as a share of the smallest body's size."""
OVERLAP = 1e-11
"""Overlap that makes a step too long, likewise."""
REST_SPEED = 1e-4
"""Approach that ends without a bounce, as a share of ``sqrt(g size)``."""
STILL = 1e-9
"""Relative velocity that counts as none, normal or tangential, likewise."""
CLEAN_STEPS = 3
"""Steps without an overlap before the step is doubled (section 9)."""
SHORTEST = 1e-12
"""Shortest step as a share of the longest one."""
ACCEPTED = 1e-8
"""Residual of forces above which a step is not made."""
TRAVEL = 0.25
"""Way a body may go in one step, in sizes of the smallest body: nothing jumps over another."""


@dataclass
class Pace:
    """The step control's memory, and what it has counted."""

    longest: float
    """Longest step [s]."""
    step: float
    """Step that is tried next [s]."""
    clean: int = 0
    """Steps since the last overlap."""
    accepted: int = 0
    halved: int = 0
    """Steps taken back because bodies overlapped."""
    shortened: int = 0
    """Steps taken back because a sliding contact came to rest within them."""
    collisions: int = 0
    worst_residual: float = 0.0


@dataclass(frozen=True)
class Lasting:
    """The contacts that touch and do not part, as a step takes them to be."""

    contacts: Contacts
    slip: Floats
    """Tangential velocities (nc, dim - 1) [m/s], zero for contacts that may stick."""

    @property
    def sliding(self) -> Bools:
        """Contacts whose friction has its direction from the velocity, (nc,)."""
        return (self.slip != 0).any(axis=1)


@dataclass(frozen=True)
class Rate:
    """Time derivative of a state, and the contact forces behind it."""

    position: Floats
    angle: Floats
    rates: Floats
    contacts: Contacts
    force: Floats
    """(nc, dim) [N]."""
    acceleration: Floats
    """Relative, (nc, dim) [m/s^2]."""


def runge_kutta_advance(
    world: World, motion: Motion, time: float, seconds: float, pace: Pace, loads: Loads | None,
    tolerance: float,
) -> tuple[Motion, ContactForces]:  # fmt: skip
    """The state ``seconds`` [s] later, and the forces at the start of the last step.

    Raises `NoSolution` (Painleve), `NotConverged`, or `Overlapping` where no step is short enough.
    """
    end, forces = time + seconds, None
    while end - time > SHORTEST * pace.longest or forces is None:
        motion = collided(world, motion, pace, tolerance)
        lasting = lasting_contacts(world, motion)
        motion = motion_constrained(world, motion, lasting)
        while True:
            h = min(pace.step, end - time, _travel_limit(world, motion))
            rate, after = runge_kutta_step(world, motion, time, h, lasting, loads, pace, tolerance)
            overlap = -world.contacts(after, 0.0).gap.min(initial=0.0)
            stop = share_until_rest(world, after, lasting)
            if overlap > OVERLAP * world.length:
                pace.step, pace.clean = h / 2, 0
                pace.halved += 1
            elif stop < 1.0:
                pace.step = h * stop
                pace.shortened += 1
            else:
                break
            if pace.step < SHORTEST * pace.longest:
                raise Overlapping(
                    f"bodies overlap by {overlap:.2g} m after the shortest step",
                    where=f"time {time:.9g} s",
                    remedy="use method='time-stepping', which removes overlaps",
                )
        time += h
        pace.accepted += 1
        pace.clean += 1
        if pace.clean >= CLEAN_STEPS:
            pace.step, pace.clean = min(2 * pace.step, pace.longest), 0
        forces = contact_forces(rate.contacts, rate.force, rate.acceleration, 1.0)
        motion = gaps_closed(world, after, rate)
    assert forces is not None
    return motion, forces


def runge_kutta_step(
    world: World, motion: Motion, time: float, h: float, lasting: Lasting, loads: Loads | None,
    pace: Pace, tolerance: float,
) -> tuple[Rate, Motion]:  # fmt: skip
    """One classical fourth-order step; returns the rate at its start and the state at its end."""

    def rate_at(part: float, previous: Rate | None) -> Rate:
        stage = motion if previous is None else moved(motion, part * h, [(1.0, previous)])
        pull = None if loads is None else loads(time + part * h, stage)
        return state_rate(world, stage, h, lasting, pull, pace, tolerance)

    first = rate_at(0.0, None)
    second = rate_at(0.5, first)
    third = rate_at(0.5, second)
    fourth = rate_at(1.0, third)
    weights = [(1 / 6, first), (1 / 3, second), (1 / 3, third), (1 / 6, fourth)]
    return first, moved(motion, h, weights)


def moved(motion: Motion, h: float, weights: list[tuple[float, Rate]]) -> Motion:
    """The state moved for ``h`` [s] with a weighted mean of rates."""
    position = motion.position + h * sum(w * rate.position for w, rate in weights)
    angle = motion.angle + h * sum(w * rate.angle for w, rate in weights)
    if motion.dim == 3:
        angle = angle / np.linalg.norm(angle, axis=1)[:, None]
    rates = motion.rates + h * sum(w * rate.rates for w, rate in weights)
    return motion_with_rates(replace(motion, position=position, angle=angle), rates)


def state_rate(
    world: World, motion: Motion, h: float, lasting: Lasting, loads: ArrayLike | None,
    pace: Pace, tolerance: float,
) -> Rate:  # fmt: skip
    """Velocities and accelerations of a state, its lasting contacts taken as closed (eq. 26)."""
    if motion.dim == 3:
        from rigid_lcp.rotations import quaternion_rate

        turning = quaternion_rate(motion.angle, motion.spin)
    else:
        turning = motion.spin
    free = world.accelerations(motion, loads)
    contacts, slip = contacts_again(world, motion, h, lasting)
    if len(contacts) == 0:
        none = np.zeros((0, motion.dim))
        return Rate(motion.velocity, turning, free, contacts, none, none)
    bodies = body_space(contacts, motion.position, world.columns, world.inverse_mass(motion))
    offset = contact_offset(contacts, motion, motion_with_rates(motion, free))
    gravity = float(np.linalg.norm(world.scene.gravity))
    solution, error = forces_found(bodies, offset, contacts.friction, slip, tolerance, gravity)
    pace.worst_residual = max(pace.worst_residual, error)
    change = bodies.inverse_mass @ (bodies.jacobian.T @ solution.r)
    free[world.movable] += np.asarray(change).reshape(-1, world.size)
    shape = (-1, motion.dim)
    return Rate(
        motion.velocity, turning, free, contacts, solution.r.reshape(shape),
        solution.u.reshape(shape),
    )  # fmt: skip


def forces_found(
    bodies: BodySpace, offset: Floats, friction: Floats, slip: Floats, tolerance: float,
    gravity: float,
) -> tuple[FrictionSolution, float]:  # fmt: skip
    """Contact forces (eqs 26, 27), and their error over the forces that ``gravity`` [m/s^2] asks.

    Where ``slip`` (nc, dim - 1) is not zero, friction opposes it: ``f_T = -mu f_N slip/|slip|``;
    elsewhere it opposes the tangential acceleration.  Raises `NoSolution` or `NotConverged`.
    """
    dim = 1 + slip.shape[1]
    if not (slip.any(axis=1) & (friction > 0)).any():
        solution = solve_friction(bodies, offset, friction, dim=dim, tolerance=tolerance)
    elif dim == 2:
        problem = friction_problem(bodies, offset, friction, dim)
        solution = pivoting(problem, None, tolerance, tangential_velocity=slip[:, 0])
    else:
        solution = _sliding_forces(bodies, offset, friction, slip, tolerance)
    if solution.status == "no solution":
        raise NoSolution(
            "no finite contact forces obey Coulomb's law (Painleve)", where="contact forces",
            remedy='use method="time-stepping", whose impulses always exist',
        )  # fmt: skip
    error = forces_error(bodies, solution, gravity)
    if not error <= ACCEPTED:
        raise NotConverged(
            f"the contact forces have a residual of {error:.2g}",
            where=f"{len(friction)} contacts",
            remedy='use method="time-stepping"; ' + solution.message,
        )
    return solution, error


def _sliding_forces(
    bodies: BodySpace, offset: Floats, friction: Floats, slip: Floats, tolerance: float
) -> FrictionSolution:
    """3D: the columns of a sliding contact's normal force take its friction along.

    With ``r = S s``, ``S`` the identity but for ``(1, -mu slip/|slip|)`` in the normal column of
    a sliding contact, s is a friction problem of the matrix ``W S`` without friction there.
    """
    import scipy.sparse as sp

    speed = np.linalg.norm(slip, axis=1)
    sliding = np.flatnonzero(speed > 0)
    dim = 1 + slip.shape[1]
    along = -friction[sliding, None] * slip[sliding] / speed[sliding, None]
    rows = (sliding[:, None] * dim + np.arange(1, dim)).ravel()
    size = len(offset)
    mixing = sp.eye_array(size, format="csr") + sp.csr_array(
        (along.ravel(), (rows, np.repeat(sliding * dim, dim - 1))), shape=(size, size)
    )
    limits = np.where(speed > 0, 0.0, friction)
    solution = solve_friction(
        bodies.matrix @ mixing, offset, limits, dim=dim, tolerance=tolerance
    )
    return replace(solution, r=np.asarray(mixing @ solution.r))


def contacts_again(
    world: World, motion: Motion, h: float, lasting: Lasting
) -> tuple[Contacts, Floats]:
    """The lasting contacts at a stage of the step, and the slip that directs their friction."""
    if len(lasting.contacts) == 0:
        return lasting.contacts, lasting.slip
    travel = h * (
        np.linalg.norm(motion.velocity, axis=1)
        + np.linalg.norm(motion.rates[:, motion.dim :], axis=1) * world.reach
    )
    found = world.contacts(motion, travel + 10 * TOUCH * world.length)
    rows, there = contact_rows(found.key, lasting.contacts.key)
    contacts, slip = found[rows[there]], lasting.slip[there]
    if motion.dim == 3:
        now = relative_velocity(contacts, motion)[:, 1:]
        slip = np.where((slip != 0).any(axis=1)[:, None], now, 0.0)
    return contacts, slip


def speed_scale(world: World, motion: Motion) -> float:
    """``sqrt(g size)`` [m/s]; without gravity the greatest speed there is."""
    gravity = float(np.linalg.norm(world.scene.gravity))
    if gravity > 0:
        return float(np.sqrt(gravity * world.length))
    return float(np.abs(motion.velocity).max(initial=0.0))


def lasting_contacts(world: World, motion: Motion) -> Lasting:
    """Contacts that touch and neither approach nor part; sliding above ``STILL`` is a slip."""
    contacts = world.contacts(motion, 0.5 * TOUCH * world.length)
    velocity = relative_velocity(contacts, motion)
    still = STILL * speed_scale(world, motion)
    stay = velocity[:, 0] <= still
    slip = velocity[stay, 1:]
    slip[np.linalg.norm(slip, axis=1) <= still] = 0.0
    return Lasting(contacts[stay], slip)


def collided(world: World, motion: Motion, pace: Pace, tolerance: float) -> Motion:
    """Velocities after the collisions of all touching bodies that approach (eqs 32-36).

    All at once: excess velocities ``u+ + e u-`` (eq. 34) under Coulomb's law for the impulses.
    """
    contacts = world.contacts(motion, 0.5 * TOUCH * world.length)
    if len(contacts) == 0:
        return motion
    before = relative_velocity(contacts, motion)
    scale = speed_scale(world, motion)
    if before[:, 0].min() >= -STILL * scale:
        return motion
    bounce = before[:, 0] < -REST_SPEED * scale
    excess = before.copy()
    excess[:, 0] += np.where(bounce, contacts.restitution * before[:, 0], 0.0)
    bodies = body_space(contacts, motion.position, world.columns, world.inverse_mass(motion))
    solution = solve_friction(
        bodies, excess.ravel(), contacts.friction, dim=motion.dim, tolerance=tolerance
    )
    error = forces_error(bodies, solution, STILL * scale)
    if not error <= ACCEPTED:
        raise NotConverged(
            f"the impulses of a collision have a residual of {error:.2g}",
            where=f"{len(contacts)} contacts", remedy=solution.message,
        )  # fmt: skip
    pace.collisions += 1
    return _pushed(world, motion, bodies, solution.r)


def share_until_rest(world: World, after: Motion, lasting: Lasting) -> float:
    """Share of the step after which the first sliding contact came to rest; 1 if none did.

    2D only, where friction has two directions; in 3D the direction turns with the velocity.
    """
    if after.dim == 3 or not lasting.sliding.any():
        return 1.0
    found = world.contacts(after, 5 * TOUCH * world.length)
    rows, there = contact_rows(found.key, lasting.contacts.key)
    there &= lasting.sliding & (lasting.contacts.friction > 0)
    if not there.any():
        return 1.0
    now = relative_velocity(found[rows[there]], after)[:, 1]
    then = lasting.slip[there, 0]
    still = STILL * speed_scale(world, after)
    turned = (now * then < 0) & (np.abs(now) > still)
    return float((then[turned] / (then[turned] - now[turned])).min(initial=1.0))


def motion_constrained(world: World, motion: Motion, lasting: Lasting) -> Motion:
    """Velocities with the smallest change that makes those of lasting contacts exactly zero."""
    contacts = lasting.contacts
    if len(contacts) == 0:
        return motion
    velocity = relative_velocity(contacts, motion)
    stick = np.repeat((~lasting.sliding & (contacts.friction > 0))[:, None], motion.dim, axis=1)
    stick[:, 0] = True
    return _constrained(world, motion, contacts, velocity, stick, velocities=True)


def gaps_closed(world: World, motion: Motion, rate: Rate) -> Motion:
    """Positions with the smallest change that closes the contacts that carry a force."""
    carrying = rate.contacts[rate.force[:, 0] > 0] if len(rate.contacts) else rate.contacts
    if len(carrying) == 0:
        return motion
    found = world.contacts(motion, TOUCH * world.length)
    rows, there = contact_rows(found.key, carrying.key)
    contacts = found[rows[there]]
    gap = np.zeros((len(contacts), motion.dim))
    gap[:, 0] = contacts.gap
    normal = np.zeros(gap.shape, dtype=bool)
    normal[:, 0] = True
    return _constrained(world, motion, contacts, gap, normal, velocities=False)


def _constrained(
    world: World, motion: Motion, contacts: Contacts, value: Floats, rows: Bools, *,
    velocities: bool,
) -> Motion:  # fmt: skip
    """``M^-1 J^T lambda`` added to velocities or places, so that ``value`` vanishes in ``rows``."""
    if not value[rows].any():
        return motion
    bodies = body_space(contacts, motion.position, world.columns, world.inverse_mass(motion))
    kept = np.flatnonzero(rows.ravel())
    matrix = bodies.matrix[kept][:, kept].toarray()
    push = np.zeros(value.size)
    push[kept] = np.linalg.lstsq(matrix, -value.ravel()[kept], rcond=1e-12)[0]
    if velocities:
        return _pushed(world, motion, bodies, push)
    move = np.zeros_like(motion.rates)
    move[world.movable] = _response(bodies, push, world.size)
    return motion_displaced(motion, move)


def _pushed(world: World, motion: Motion, bodies: BodySpace, impulse: Floats) -> Motion:
    rates = motion.rates
    rates[world.movable] += _response(bodies, impulse, world.size)
    return motion_with_rates(motion, rates)


def _response(bodies: BodySpace, impulse: Floats, size: int) -> Floats:
    change = bodies.inverse_mass @ (bodies.jacobian.T @ impulse)
    return np.asarray(change).reshape(-1, size)


def _travel_limit(world: World, motion: Motion) -> float:
    speed = np.linalg.norm(motion.velocity, axis=1) + (
        np.linalg.norm(motion.rates[:, motion.dim :], axis=1) * world.reach
    )
    fastest = float(speed.max())
    return TRAVEL * world.length / fastest if fastest > 0 else np.inf
