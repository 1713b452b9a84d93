"""Velocity-level time stepping (Moreau and Jean): impulses instead of forces.

One step of length h, with the geometry of the midpoint ``q_m = q + h/2 v``:

    M (v+ - v) = h f + J^T p        K* contains u + mu |u_T| n, orthogonal to p in K   (eq. 27)
    q+ = q_m + h/2 v+

where u is J v+ at the end of the step, ``J(q_m) v+ + h/2 J' v`` (the inertial terms of eq. 24),
with the normal part shifted by the contact's own law: Newton's restitution ``u_N+ + e u_N-`` where
two bodies are about to collide, else ``u_N+ + 2 g / h`` for a contact that is open at the midpoint,
by ``g = g_m - h^2/8 J' v``: it may close within the step, not more (Moreau, Eur. J. Mech. 13 (1994)
93; Jean, CMAME 177 (1999) 235).  Without friction no step adds energy: the mean of ``J v`` and
``J v+`` is never positive where p_N is not zero (to the second order in h where J turns).  With
restitution 1 a bounce keeps it to round-off, and so do chains of collisions within the step
(`rigid_lcp.collision.passing`).  An approach no faster than what gravity gives in a step, ``g h``,
does not bounce.  With friction a body that comes to rest within a
step may gain up to ``m (h |f/m|)^2 / 8``, and restitution is scaled down where it would make more
(`rigid_lcp.collision.passing`).  Overlaps that are left are taken out by moving the
bodies apart (`rigid_lcp.motion.overlap_removal`).

Use it where forces do not exist (Painleve) or where events are too many to be met one by one; it
is of first order in h where contacts open and close, of second order in between.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from rigid_lcp.arrays import Floats
from rigid_lcp.collision import (
    Closing,
    Impulses,
    Share,
    find_bouncing,
    find_contact_shift,
    find_hit_by_others,
    find_impulses_in_turn,
    gains_energy,
)
from rigid_lcp.contact import ContactForces, Contacts, build_frames, match_keys
from rigid_lcp.errors import NotConverged
from rigid_lcp.friction.auto import solve_problem
from rigid_lcp.friction.problem import SHARE_LEFT, BodySpace, FrictionSolution, make_problem
from rigid_lcp.motion.equations import (
    find_inertial_acceleration,
    find_relative_velocity,
    find_response,
    make_body_space,
)
from rigid_lcp.motion.overlap_removal import OVERLAPS, Restitution, separate_bodies
from rigid_lcp.motion.state import Motion, replace_rates
from rigid_lcp.motion.struck_bodies import find_contacts_of_struck, find_margin, find_missed
from rigid_lcp.motion.world import World

SolveFrom = Callable[..., tuple[FrictionSolution, float]]
"""Impulses and their error [-] from the contacts' `BodySpace`, q (nc, dim), friction (nc,) and, if
known, a start (nc * dim,)."""


@dataclass(frozen=True)
class MoreauNumbers:
    """When a step is made again, and what it takes for sliding."""

    retried_error: float = 1e-4
    """Of forces [-] that are looked for once more, from nothing, and without the inertial terms
    that ask bodies to part: those are of the velocities before the step."""
    widenings: int = 10
    """Most times that a step is made again [-] as bodies were struck that then struck others; what
    is left are overlaps, taken out, and collisions of the next step."""
    turn_of_a_step: float = np.pi
    """Of a body [rad], at most: beyond it midpoint geometry means nothing."""
    at_limit: float = 1e-9  # part of its limit by which friction below it still slides [-]
    no_slip: float = 1e-9  # sliding velocity over the greatest that is none [-]


MOREAU = MoreauNumbers()
STATUS = np.array(["open", "stick", "slide"])


@dataclass(frozen=True)
class Step:
    """A step that was made: the state after it, the forces in it, how well they were found."""

    motion: Motion
    contacts: ContactForces
    residual: float  # error of the impulses (scale-free natural residual), `find_forces_error` [-]
    message: str = ""  # what the solver has to say of impulses that it did not find
    scaled: bool = False  # whether restitution was scaled down (`rigid_lcp.collision.passing`)
    cut_off: bool = False
    """Whether collisions were closed without restitution (`rigid_lcp.collision.passing`)."""


def step_moreau(
    world: World, motion: Motion, loads: ArrayLike | None, h: float,
    known: ContactForces | None, tolerance: float, accept: float = 0.0,
) -> Step:  # fmt: skip
    """One step of length ``h`` [s].

    ``loads`` (n, 3) or (n, 6) [N, N m] at the midpoint, or None; ``known``: contacts of the last
    step, whose forces the solver starts from; ``tolerance``: scale-free residual, and
    ``accept``, as `solve_friction` has them.  Raises `NotConverged` for a body that turns by more
    than half a turn within the step.
    """
    pull = None if loads is None else np.asarray(loads, dtype=float)
    middle, free, margin, contacts = begin_step(world, motion, pull, h)
    if len(contacts) == 0:
        end = separate_bodies(world, motion, world.move_freely(free, 0.5 * h), pull, h)
        return Step(end, make_contact_forces(contacts, np.zeros((0, motion.dim)), None, h), 0.0)
    slow = float(np.linalg.norm(world.scene.gravity)) * h
    solve = partial(judge_impulses, slow=slow, tolerance=tolerance, accept=accept)
    for turn in range(MOREAU.widenings + 1):
        found, after, scaled, restitution = solve_step_contacts(
            world, contacts, middle, free, h, solve, known
        )
        end = world.move_freely(after, 0.5 * h)
        touching = world.contacts(end, 0.0)
        struck = find_missed(world, contacts, end, touching, slow)
        if turn == MOREAU.widenings or not struck.any():
            break
        wider, margin = find_contacts_of_struck(world, middle, margin, struck, end, h)
        if len(wider) == len(contacts):
            break
        contacts = wider
    end = separate_bodies(world, motion, end, pull, h, touching, restitution)
    forces = make_contact_forces(contacts, found.impulse, found.velocity, h)
    return Step(end, forces, found.error, found.message, scaled, found.cut_off)


def begin_step(
    world: World, motion: Motion, loads: ArrayLike | None, h: float
) -> tuple[Motion, Motion, Floats, Contacts]:
    """The bodies at the midpoint with the rates of the start, and with those of the end without
    impulses; how far each can get [m], (n,), and the contacts so near.  Raises as `step_moreau`."""
    _refuse_fast_spin(world, motion, h)
    middle = world.move_freely(motion, 0.5 * h)
    accelerations = world.accelerations(middle, loads, gyroscopic=False)
    free = replace_rates(middle, middle.rates + h * accelerations)
    margin = find_margin(world, motion, accelerations, h)
    return middle, free, margin, world.contacts(middle, margin, 0.5 * h)


def solve_step_contacts(
    world: World, contacts: Contacts, middle: Motion, free: Motion, h: float, solve: SolveFrom,
    known: ContactForces | None,
) -> tuple[Impulses, Motion, bool, Restitution | None]:  # fmt: skip
    """Impulses of the contacts of a step, with as much restitution as makes no energy, and the
    bodies at the midpoint with the rates they leave; whether restitution was scaled down; what it
    did, None where nothing bounced.  ``middle`` and ``free`` as `find_closing_contacts` has them.
    """
    bodies = make_body_space(contacts, middle.position, world.columns, world.inverse_mass(middle))
    closing = find_closing_contacts(world, contacts, middle, free, h)
    found = find_step_impulses(bodies, closing, solve, carry_impulses(contacts, known, h))
    share, full = Share(len(contacts)), closing.restitution
    while (bounce := find_bouncing(closing)).any():
        if found.error > MOREAU.retried_error:  # wedged bodies may have no impulses to bounce with
            share.leave_out()
        else:
            before, alone = (find_relative_velocity(contacts, each) for each in (middle, free))
            gained = (free.rates - middle.rates)[world.movable]
            if not share.bisect(
                gains_energy(bodies, closing, before, alone, gained, found, bounce)
            ):
                break
        closing = replace(closing, restitution=share.now * full)
        found = find_step_impulses(bodies, closing, solve, None)
    restitution = None
    if bounce.any():
        restitution = Restitution(
            contacts.body_a, contacts.body_b,
            partial(_take_out_restitution, world, bodies, closing, found, solve),
        )  # fmt: skip
    rates = free.rates
    rates[world.movable] += find_response(bodies, found.impulse)
    after = replace_rates(middle, rates)
    return found, after, bool((share.now < 1.0).any()), restitution


def _take_out_restitution(
    world: World, bodies: BodySpace, closing: Closing, found: Impulses, solve: SolveFrom
) -> Floats:
    """What the rates (n, 3) or (n, 6) would be without restitution, less what they are."""
    inelastic = replace(closing, restitution=np.zeros_like(closing.restitution))
    calm = find_impulses_at_once(bodies, inelastic, solve, None)
    change = np.zeros((len(world.mass), world.size))
    change[world.movable] = find_response(bodies, calm.impulse - found.impulse)
    return change


def find_closing_contacts(
    world: World, contacts: Contacts, middle: Motion, free: Motion, h: float
) -> Closing:
    """Gaps and relative velocities that the law of a step asks for (eq. 24).

    ``middle``: the bodies at the midpoint with the rates of the start, ``free`` with those that
    they would have at the end without impulses.
    """
    turning = 0.5 * h * find_inertial_acceleration(contacts, middle, corners_round=False)
    if middle.dim == 3:  # spins change also while no force acts
        coasting = replace_rates(middle, world.free_accelerations(middle))
        turning += 0.5 * h * find_relative_velocity(contacts, coasting)
    return Closing(
        restitution=contacts.restitution,
        friction=contacts.friction,
        gap=contacts.gap - 0.25 * h * turning[:, 0],
        before=find_relative_velocity(contacts, middle)[:, 0] - turning[:, 0],
        offset=find_relative_velocity(contacts, free) + turning,
        turning=turning[:, 0],
        slow=float(np.linalg.norm(world.scene.gravity)) * h,
        h=h,
        touching=OVERLAPS.allowed * world.length,
    )


def find_step_impulses(
    bodies: BodySpace, closing: Closing, solve: SolveFrom,
    start: Floats | None,
) -> Impulses:  # fmt: skip
    """Impulses of all contacts together, or in turn where collisions are passed on."""
    found = find_impulses_at_once(bodies, closing, solve, start)
    bounce = find_bouncing(closing)
    if bounce.any():
        diagonal = bodies.diagonal[:: closing.offset.shape[1]]
        if find_hit_by_others(closing, bounce, found, diagonal).any():
            found = find_impulses_in_turn(bodies, closing, solve)
    return found


def find_impulses_at_once(
    bodies: BodySpace, closing: Closing, solve: SolveFrom,
    start: Floats | None,
) -> Impulses:  # fmt: skip
    """Impulses that answer to all contacts together (eq. 27), looked for from ``start``."""
    bounce = find_bouncing(closing)
    shift = find_contact_shift(closing, bounce)
    solution, error = solve(bodies, closing.offset + shift, closing.friction, start)
    if error > MOREAU.retried_error:  # jammed bodies may have no forces to part them as they turned
        shift = find_contact_shift(closing, bounce, closing.turning)
        solution, error = solve(bodies, closing.offset + shift, closing.friction)
    velocity = solution.u.reshape(shift.shape) - shift
    return Impulses(solution.r.reshape(shift.shape), velocity, error, solution.message)


def judge_impulses(
    bodies: BodySpace, offset: Floats, friction: Floats, start: Floats | None = None, *,
    slow: float, tolerance: float, accept: float,
) -> tuple[FrictionSolution, float]:  # fmt: skip
    """Impulses and their `find_forces_error`, ``slow`` the velocity that gravity gives in a
    step.
    """
    problem = make_problem(bodies, offset, friction, offset.shape[1])
    found = solve_problem(problem, start, tolerance, accept=accept)
    return found, find_forces_error(bodies, found, slow, offset)


def find_forces_error(
    bodies: BodySpace, solution: FrictionSolution, free: float, offset: Floats | None = None
) -> float:
    """The residual of a solution over the forces that matter [-].

    The natural map over ``|r|``, or over what the velocities (accelerations) ``free`` of gravity
    would need at every contact where r is smaller: contacts that carry next to nothing have no
    scale of their own.  Self-stress without bound would hide any error behind ``|r|``: where the
    map leaves more than `SHARE_LEFT` of the velocities in ``offset`` q (if given), that share is
    the error.
    """
    if len(solution.r) == 0 or solution.residual == 0.0:
        return 0.0
    rho = 1.0 / float(bodies.diagonal.mean())
    size = float(np.linalg.norm(solution.r))
    own = size or rho * float(np.linalg.norm(solution.u))
    least = rho * free * len(solution.r) ** 0.5
    left = solution.residual * own
    error = left / max(size, least, 1e-300)
    if offset is None:
        return error
    share = left / max(rho * float(np.linalg.norm(offset)), least, 1e-300)
    return share if share > SHARE_LEFT else error


def carry_impulses(contacts: Contacts, known: ContactForces | None, h: float) -> Floats | None:
    """Impulses (nc * dim,) that the contacts of the last step had, zero for new ones [N s]."""
    if known is None or len(known) == 0:
        return None
    rows, there = match_keys(known.key, contacts.key)
    force = np.where(there[:, None], known.force[rows], 0.0)
    return np.einsum("cij,cj->ci", build_frames(contacts.normal), h * force).ravel()


def make_contact_forces(
    contacts: Contacts, impulse: Floats, velocity: Floats | None, h: float
) -> ContactForces:
    """Contacts with the mean forces of a step of length ``h``: impulse (nc, dim) [N s] over h."""
    force = impulse / h
    normal, tangential = force[:, 0], force[:, 1:]
    amount = np.linalg.norm(tangential, axis=1)
    sliding = amount >= contacts.friction * normal * (1 - MOREAU.at_limit)
    if velocity is not None:
        slip = np.linalg.norm(velocity[:, 1:], axis=1)
        sliding &= slip > MOREAU.no_slip * np.abs(velocity).max(initial=0.0)
    status = STATUS[np.where(normal <= 0, 0, 1 + sliding)]
    if contacts.dim == 3:
        frames = build_frames(contacts.normal)
        tangential = np.einsum("ci,cij->cj", tangential, frames[:, 1:])
    else:
        tangential = tangential[:, 0]
    return ContactForces(
        **vars(contacts), normal_force=normal, tangential_force=tangential, status=status
    )


def _refuse_fast_spin(world: World, motion: Motion, h: float) -> None:
    spin = np.abs(motion.spin) if motion.dim == 2 else np.linalg.norm(motion.spin, axis=1)
    if (h * spin > MOREAU.turn_of_a_step).any():
        worst = int(np.argmax(spin))
        raise NotConverged(
            f"it turns by {h * spin[worst]:.3g} rad within a step",
            where=world.scene.name_body(worst),
            remedy=f"take a step shorter than {MOREAU.turn_of_a_step / spin[worst]:.3g} s",
        )  # fmt: skip
