"""Acceleration level: contact forces at every stage of a fourth-order Runge-Kutta step (section 9).

A step, as in section 4 of the paper: contacts; collisions, where touching bodies approach (section
7); the geometry equations (26) with Coulomb's law (27); integration.  A step that ends in an
overlap is taken back and halved; after three clean steps the step is doubled, up to the longest
one.  Four things are added to the paper:

* Halving alone takes some twenty halvings to come down to a gap of 5e-10 of a body, and as many
  doublings to get away from it.  So the step that is tried for the one taken back ends where the
  gap closes, by the cubic through gap and approach at its two ends; the half is tried where these
  are not known (`find_share_until_touch`).
* Bounces that get shorter without end (Zeno) are cut off: an approach slower than 1e-4 of
  the free-fall speed over a body's size (``rest_speed``) is a collision without restitution.
  Collisions are those of `rigid_lcp.collision.collide`.
* A sliding contact keeps the direction of its friction during a step.  A step in which it comes
  to rest is taken back and shortened to end there; from then on it may stick.
* Gaps and velocities of lasting contacts are put back to zero after each step, as the second
  derivative of a gap alone would let them drift (by the fifth power of the step).

Use it for few bodies and where order counts; where forces do not exist (Painleve) it raises
`NoSolution`, and velocity-level time stepping goes on.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.contact import ContactForces, Contacts
from rigid_lcp.errors import NoSolution, NotConverged, Overlapping, ProblemError, RigidError
from rigid_lcp.motion import lasting_contacts
from rigid_lcp.motion.acceleration_forces import find_forces
from rigid_lcp.motion.checks import Loads
from rigid_lcp.motion.equations import find_contact_offset, find_response, make_body_space
from rigid_lcp.motion.finite_states import explain_overflow, is_finite
from rigid_lcp.motion.state import Motion, replace_rates
from rigid_lcp.motion.time_stepping import MOREAU, make_contact_forces
from rigid_lcp.motion.world import World
from rigid_lcp.shapes import find_quaternion_rate


@dataclass(frozen=True)
class RungeKuttaNumbers:
    """Control of the step; its lengths are shares of the longest one."""

    steps_before_doubling: int = 3  # without an overlap [-] (section 9)
    shortest_step: float = 1e-12  # below which a step is not taken back any more [-]
    steps_of_a_call: int = 10_000_000  # at most [-]: too fast a motion would never end
    located_ends: int = 8  # of a step that overlaps [-]; then it is halved as in section 9
    step_without_forces: float = 1e-6  # at which a state without forces is taken for one [-]
    way_of_a_step: float = 0.25  # in sizes of the smallest body [-]: none jumps over another


RUNGE_KUTTA = RungeKuttaNumbers()


@dataclass
class Pace:
    """The step control's memory, and what it has counted."""

    longest: float  # longest step [s]
    step: float  # step that is tried next [s]
    clean: int = 0  # steps since the last overlap
    accepted: int = 0
    halved: int = 0  # steps taken back because bodies overlapped
    shortened: int = 0
    """Steps taken back because a sliding contact came to rest within them, bodies went too far, or
    a stage had no forces."""
    collisions: int = 0
    scaled: int = 0
    """Collisions whose restitution was scaled down (`rigid_lcp.collision.restitution_scale`)."""
    cut_off: int = 0  # collisions that ran out of rounds (`rigid_lcp.collision.impulses`)
    worst_residual: float = 0.0
    steps_above: int = 0  # steps with a stage whose forces were found no better than the tolerance


@dataclass(frozen=True)
class Rate:
    """Time derivative of a state, and the contact forces behind it."""

    position: Floats
    angle: Floats
    rates: Floats
    contacts: Contacts
    force: Floats  # (nc, dim) [N]
    acceleration: Floats  # relative, (nc, dim) [m/s^2]
    residual: float = 0.0  # error of the forces (`find_forces_error`) [-]


def advance_runge_kutta(
    world: World, motion: Motion, time: float, seconds: float, pace: Pace, loads: Loads | None,
    tolerance: float,
) -> tuple[Motion, ContactForces]:  # fmt: skip
    """The state ``seconds`` [s] later, and the forces at the start of the last step.

    Raises `NoSolution` (Painleve), `NotConverged` or `Overlapping` where no step is short enough,
    `SceneError` where a state would not be finite.
    """
    end, forces = time + seconds, None
    loads = loads or (lambda *_: None)
    fastest = _find_travel_limit(world, motion)
    if seconds > RUNGE_KUTTA.steps_of_a_call * fastest:
        raise NotConverged(
            f"{seconds:g} s take more than {RUNGE_KUTTA.steps_of_a_call:.0e} steps,"
            " so fast do bodies go or turn",
            where=f"time {time:.9g} s", remedy="use method='time-stepping'",
        )  # fmt: skip
    while end - time > RUNGE_KUTTA.shortest_step * pace.longest or forces is None:
        motion, collision = lasting_contacts.collide_bodies(world, motion, tolerance)
        pace.collisions += collision is not None
        pace.scaled += collision is not None and collision.restitution_scale < 1.0
        pace.cut_off += collision is not None and collision.cut_off
        lasting = lasting_contacts.find_lasting(world, motion)
        tried, located = pace.step, 0
        while True:
            h = min(tried, end - time, _find_travel_limit(world, motion))
            try:
                rates, after = step_runge_kutta(world, motion, time, h, lasting, loads, tolerance)
            except NoSolution:  # of a stage, perhaps, that the motion does not come to
                if h < RUNGE_KUTTA.step_without_forces * pace.longest:
                    raise
                tried = h / 2
                pace.shortened += 1
                continue
            except ProblemError as error:
                raise explain_overflow(
                    world, motion, loads(time, motion), h, time, error
                ) from error
            if not is_finite(world, after):  # speeds so great leave no step that is long enough
                raise explain_overflow(world, motion, loads(time, motion), h, time)
            first, last = rates[0], rates[-1]
            pressed, stuck = list_lasting_keys(first, last)
            overlap = lasting_contacts.find_excess_overlap(world, after, pressed)
            stop = lasting_contacts.find_share_until_rest(world, motion, after, h, lasting)
            far = _find_travel_limit(world, after)
            if overlap > lasting_contacts.TOUCHING.overlap * world.length:
                share = None
                if located < RUNGE_KUTTA.located_ends:
                    share = lasting_contacts.find_share_until_touch(
                        world, motion, after, h, pressed
                    )
                if share is None or located == 0:
                    pace.step, pace.clean = h / 2, 0
                tried, located = h * (0.5 if share is None else share), located + 1
                pace.halved += 1
            elif stop < 1.0:
                tried = h * stop
                pace.shortened += 1
            elif far < 0.5 * h:  # by even acceleration the way is half of what the end's speed has
                tried = min(0.5, np.sqrt(2 * far / h)) * h
                pace.shortened += 1
            else:
                break
            if tried < RUNGE_KUTTA.shortest_step * pace.longest:
                raise _explain_failure(world, after, overlap, time)
        time += h
        pace.accepted += 1
        pace.clean += 1
        residual = max(rate.residual for rate in rates)
        pace.worst_residual = max(pace.worst_residual, residual)
        pace.steps_above += residual > tolerance
        if pace.clean >= RUNGE_KUTTA.steps_before_doubling:
            pace.step, pace.clean = min(2 * pace.step, pace.longest), 0
        forces = make_contact_forces(first.contacts, first.force, first.acceleration, 1.0)
        motion = lasting_contacts.remove_drift(world, after, pressed, stuck)
    assert forces is not None
    return motion, forces


def step_runge_kutta(
    world: World, motion: Motion, time: float, h: float, lasting: lasting_contacts.Lasting,
    loads: Loads, tolerance: float,
) -> tuple[list[Rate], Motion]:  # fmt: skip
    """One classical fourth-order step: the rates of its four stages, and its end."""

    def find_rate(part: float, previous: Rate | None) -> Rate:
        stage = motion if previous is None else move_state(motion, part * h, [(1.0, previous)])
        pull = loads(time + part * h, stage)
        return find_state_rate(world, stage, h, lasting, pull, tolerance)

    first = find_rate(0.0, None)
    second = find_rate(0.5, first)
    third = find_rate(0.5, second)
    fourth = find_rate(1.0, third)
    weights = [(1 / 6, first), (1 / 3, second), (1 / 3, third), (1 / 6, fourth)]
    return [first, second, third, fourth], move_state(motion, h, weights)


def move_state(motion: Motion, h: float, weights: list[tuple[float, Rate]]) -> Motion:
    """The state moved for ``h`` [s] with a weighted mean of rates."""
    position = motion.position + h * sum(w * rate.position for w, rate in weights)
    angle = motion.angle + h * sum(w * rate.angle for w, rate in weights)
    if motion.dim == 3:
        angle = angle / np.linalg.norm(angle, axis=1)[:, None]
    rates = motion.rates + h * sum(w * rate.rates for w, rate in weights)
    return replace_rates(replace(motion, position=position, angle=angle), rates)


def find_state_rate(
    world: World, motion: Motion, h: float, lasting: lasting_contacts.Lasting,
    loads: ArrayLike | None, tolerance: float,
) -> Rate:  # fmt: skip
    """Velocities and accelerations of a state, its lasting contacts taken as closed (eq. 26)."""
    turning = motion.spin if motion.dim == 2 else find_quaternion_rate(motion.angle, motion.spin)
    free = world.accelerations(motion, loads)
    contacts, slip = lasting_contacts.redetect_contacts(world, motion, h, lasting)
    if len(contacts) == 0:
        none = np.zeros((0, motion.dim))
        return Rate(motion.velocity, turning, free, contacts, none, none)
    bodies = make_body_space(contacts, motion.position, world.columns, world.inverse_mass(motion))
    offset = find_contact_offset(contacts, motion, replace_rates(motion, free))
    gravity = float(np.linalg.norm(world.scene.gravity))
    solution, error = find_forces(bodies, offset, contacts.friction, slip, tolerance, gravity)
    free[world.movable] += find_response(bodies, solution.r)
    shape = (-1, motion.dim)
    return Rate(
        motion.velocity, turning, free, contacts, solution.r.reshape(shape),
        solution.u.reshape(shape), error,
    )  # fmt: skip


def _explain_failure(world: World, motion: Motion, overlap: float, time: float) -> RigidError:
    """What is wrong with the end ``motion`` of the shortest step, which may have an ``overlap``."""
    where, remedy = f"time {time:.9g} s", "use method='time-stepping'"
    if overlap > lasting_contacts.TOUCHING.overlap * world.length:
        return Overlapping(
            f"bodies overlap by {overlap:.2g} m after the shortest step", where=where,
            remedy=f"{remedy}, which removes overlaps",
        )  # fmt: skip
    speed = world.speeds(motion.rates)
    body = int(np.argmax(speed))
    return NotConverged(
        f"the shortest step is too long for it; its points go at {speed[body]:.3g} m/s",
        where=f"{world.scene.name_body(body)}, {where}",
        remedy=f"look at its loads and at gravity, or {remedy}",
    )


def _find_travel_limit(world: World, motion: Motion) -> float:
    fastest = float(world.speeds(motion.rates).max())
    return RUNGE_KUTTA.way_of_a_step * world.length / fastest if fastest > 0 else np.inf


def list_lasting_keys(first: Rate, last: Rate) -> tuple[Ints, Ints]:
    """Keys of contacts that press at the first and last stage; of those that stick at both.

    Contacts that took the place of others on the way (`find_successors`) have no first stage.
    """
    pressed, stuck = [], []
    for rate in (first, last):
        normal, tangential = rate.force[:, 0], np.linalg.norm(rate.force[:, 1:], axis=1)
        below = tangential < rate.contacts.friction * normal * (1 - MOREAU.at_limit)
        pressed.append(rate.contacts.key[normal > 0])
        stuck.append(rate.contacts.key[(normal > 0) & below])
    new = np.setdiff1d(last.contacts.key, first.contacts.key)
    return (
        np.intersect1d(np.union1d(pressed[0], new), pressed[1]),
        np.intersect1d(np.union1d(stuck[0], new), stuck[1]),
    )
