"""What happens to contacts between two Runge-Kutta steps: they last, collide, stop sliding, drift.

Lengths are measured by the size of the smallest movable body, velocities by ``sqrt(g size)``.
"""

from dataclasses import dataclass

import numpy as np

from rigid_lcp.arrays import Bools, Floats, Ints
from rigid_lcp.collision import Collision, collide
from rigid_lcp.contact import Contacts, build_frames, match_keys
from rigid_lcp.errors import NotConverged
from rigid_lcp.motion.acceleration_forces import LASTING
from rigid_lcp.motion.equations import find_relative_velocity, find_response, make_body_space
from rigid_lcp.motion.state import Motion, displace_motion, replace_rates
from rigid_lcp.motion.world import World


@dataclass(frozen=True)
class TouchNumbers:
    """When bodies touch and rest: gaps over `World.length`, speeds over `find_speed_scale`."""

    gap: float = 1e-9  # below which two bodies touch [-]
    aimed_gap: float = 0.25  # where a step that would end in an overlap is to end, in touches [-]
    overlap: float = 1e-11  # that makes a step too long [-]
    pressed_overlap: float = 1e-3  # that contacts which press all the time may have [-]
    rest_speed: float = 1e-4  # of an approach that ends without a bounce [-]
    no_speed: float = 1e-9  # normal or tangential velocity that counts as none [-]


TOUCHING = TouchNumbers()


@dataclass(frozen=True)
class Lasting:
    """The contacts that touch and do not part, as a step takes them to be."""

    contacts: Contacts
    slip: Floats  # tangential velocities (nc, dim - 1) [m/s], zero for contacts that may stick

    @property
    def sliding(self) -> Bools:
        """Contacts whose friction has its direction from the velocity, (nc,)."""
        return (self.slip != 0).any(axis=1)


def find_speed_scale(world: World, motion: Motion) -> float:
    """``sqrt(g size)`` [m/s]; without gravity the greatest speed there is."""
    gravity = float(np.linalg.norm(world.scene.gravity))
    if gravity > 0:
        return float(np.sqrt(gravity * world.length))
    return float(np.abs(motion.velocity).max(initial=0.0))


def find_lasting(world: World, motion: Motion) -> Lasting:
    """Contacts that touch and neither approach nor part; sliding above `TOUCHING`'s is a slip."""
    contacts = world.contacts(motion, 0.5 * TOUCHING.gap * world.length)
    velocity = find_relative_velocity(contacts, motion)
    still = TOUCHING.no_speed * find_speed_scale(world, motion)
    stay = velocity[:, 0] <= still
    slip = velocity[stay, 1:]
    slip[np.linalg.norm(slip, axis=1) <= still] = 0.0
    return Lasting(contacts[stay], slip)


def redetect_contacts(
    world: World, motion: Motion, h: float, lasting: Lasting
) -> tuple[Contacts, Floats]:
    """The lasting contacts at a stage of the step, and the slip that directs their friction."""
    if len(lasting.contacts) == 0:
        return lasting.contacts, lasting.slip
    way = h * world.speeds(motion.rates)
    found = world.contacts(motion, way + 10 * TOUCHING.gap * world.length)
    rows, there = match_keys(found.key, lasting.contacts.key)
    now, before = rows[there], np.flatnonzero(there)
    if not there.all():
        within = TOUCHING.pressed_overlap * world.length
        closing = -h * find_relative_velocity(found, motion)[:, 0]
        bearing = (found.gap <= within) & (closing <= within)
        taken, lost = find_successors(found, lasting.contacts, there, bearing)
        now, before = np.concatenate([now, taken]), np.concatenate([before, lost])
    contacts = found[now]
    slip = carry_slip(lasting, before, contacts)
    if motion.dim == 3:  # the direction turns with the velocity, until that has reversed
        now_slip = find_relative_velocity(contacts, motion)[:, 1:]
        slip = np.where(((now_slip * slip).sum(axis=1) > 0)[:, None], now_slip, slip)
    return contacts, slip


def find_successors(
    found: Contacts, contacts: Contacts, there: Bools, bearing: Bools
) -> tuple[Ints, Ints]:
    """Rows of ``found`` that bear what ``contacts`` not ``there`` any more bore, and rows of those.

    Where a corner slides off a face, the corner of that face comes to bear on the other: new
    contacts of the same two bodies, of those ``bearing``: one that closes fast is a collision.
    Their forces go on as they were.
    """
    new = np.flatnonzero(bearing & ~np.isin(found.key, contacts.key))
    lost = np.flatnonzero(~there)
    pairs = [
        np.sort(np.column_stack([each.body_a, each.body_b])[rows], axis=1)
        for each, rows in ((found, new), (contacts, lost))
    ]
    same = (pairs[0][:, None] == pairs[1][None]).all(axis=2)
    takes = same.any(axis=1)
    return new[takes], lost[np.argmax(same[takes], axis=1)]


def carry_slip(lasting: Lasting, rows: Bools | Ints, contacts: Contacts) -> Floats:
    """Slips of the lasting contacts ``rows`` in the tangents of the same ``contacts`` now.

    The tangents of a contact jump where its normal passes the axis they are made from, and where
    its two bodies have changed places.
    """
    then = build_frames(lasting.contacts.normal[rows])[:, 1:]
    vector = np.einsum("cij,ci->cj", then, lasting.slip[rows])
    vector[contacts.body_a != lasting.contacts.body_a[rows]] *= -1.0
    return np.einsum("cij,cj->ci", build_frames(contacts.normal)[:, 1:], vector)


def collide_bodies(
    world: World, motion: Motion, tolerance: float
) -> tuple[Motion, Collision | None]:
    """Velocities after the collisions of touching bodies (eqs 32-36), and what they were if any.

    `rigid_lcp.collision.collide`, restitution on normal velocities, as time stepping has it, but
    scaled down where energy would grow.  Raises `NotConverged`.
    """
    contacts = world.contacts(motion, 0.5 * TOUCHING.gap * world.length)
    if len(contacts) == 0:
        return motion, None
    scale, velocity = find_speed_scale(world, motion), find_relative_velocity(contacts, motion)
    still = TOUCHING.no_speed * scale
    if velocity[:, 0].min() >= -still:
        return motion, None
    bodies = make_body_space(contacts, motion.position, world.columns, world.inverse_mass(motion))
    moving = motion.rates[world.movable].ravel()
    found = collide(
        bodies, moving, contacts.restitution, contacts.friction, law="newton",
        tolerance=tolerance, still=still, rest_speed=TOUCHING.rest_speed * scale,
        drive=velocity.ravel() - bodies.jacobian @ moving,
    )  # fmt: skip
    if not (found.solved or found.residual <= LASTING.most_error):
        raise NotConverged(
            f"the impulses of a collision have a residual of {found.residual:.2g}",
            where=f"{len(contacts)} contacts", remedy=found.message,
        )  # fmt: skip
    rates = motion.rates
    rates[world.movable] = found.velocity.reshape(-1, world.size)
    return replace_rates(motion, rates), found


def find_share_until_rest(
    world: World, motion: Motion, after: Motion, h: float, lasting: Lasting
) -> float:
    """Share of a step of ``h`` [s], from ``motion`` to ``after``, at which a first sliding contact
    came to rest; 1 if none did.

    Those that have opened since are looked at too: near Painleve's limit friction that went on
    beyond rest would throw the bodies apart.
    """
    if not lasting.sliding.any():
        return 1.0
    way = h * world.speeds(motion.rates) + h * world.speeds(after.rates)
    found = world.contacts(after, way + TOUCHING.pressed_overlap * world.length)
    rows, there = match_keys(found.key, lasting.contacts.key)
    there &= lasting.sliding & (lasting.contacts.friction > 0)
    if not there.any():
        return 1.0
    contacts = found[rows[there]]
    now, then = find_relative_velocity(contacts, after)[:, 1:], carry_slip(lasting, there, contacts)
    along, before = (now * then).sum(axis=1), (then * then).sum(axis=1)
    still = TOUCHING.no_speed * find_speed_scale(world, after)
    turned = (along < 0) & (np.linalg.norm(now, axis=1) > still)
    return float((before[turned] / (before[turned] - along[turned])).min(initial=1.0))


def find_excess_overlap(world: World, motion: Motion, pressed: Ints) -> float:
    """Overlap that makes the step too long [m]: of contacts not ``pressed`` all the time (keys).

    That of lasting contacts is an error of the integration, which `remove_drift` takes out; it
    counts above ``pressed_overlap`` only.
    """
    found = world.contacts(motion, 0.0)
    lasting = np.isin(found.key, pressed)
    overlap = -found.gap
    overlap[lasting & (overlap < TOUCHING.pressed_overlap * world.length)] = 0.0
    return float(overlap.max(initial=0.0))


def find_share_until_touch(
    world: World, motion: Motion, after: Motion, h: float, pressed: Ints
) -> float | None:
    """Share of a step of ``h`` [s], from ``motion`` to ``after``, at which a first gap closes.

    By the cubic through gap and normal velocity at both ends, of every contact not ``pressed``
    (keys) that overlaps in the end; closed is ``aimed_gap``, as a touch is what the collision
    needs.  None where none of these contacts was in sight at the start.
    """
    found = world.contacts(after, 0.0)
    found = found[(found.gap < -TOUCHING.overlap * world.length) & ~np.isin(found.key, pressed)]
    start = world.contacts(motion, h * world.speeds(motion.rates) + h * world.speeds(after.rates))
    rows, there = match_keys(start.key, found.key)
    found, start = found[there], start[rows[there]]
    aim = TOUCHING.aimed_gap * TOUCHING.gap * world.length
    ends = zip(
        start.gap - aim, h * find_relative_velocity(start, motion)[:, 0], found.gap - aim,
        h * find_relative_velocity(found, after)[:, 0], strict=True,
    )  # fmt: skip
    shares = [share for each in ends if (share := find_first_fall(*map(float, each))) is not None]
    return min(shares, default=None)


def find_first_fall(start: float, slope: float, end: float, slope_end: float) -> float | None:
    """Where in (0, 1) the cubic of these values and slopes at 0 and 1 first falls through zero."""
    cubic = [
        2 * (start - end) + slope + slope_end, 3 * (end - start) - 2 * slope - slope_end, slope,
        start,
    ]  # fmt: skip
    roots = np.roots(cubic)
    real = np.sort(roots.real[np.abs(roots.imag) <= 1e-9 * np.abs(roots)])
    falls = [x for x in real if 0.0 < x < 1.0 and np.polyval(np.polyder(cubic), x) < 0.0]
    return float(falls[0]) if falls else None


def remove_drift(world: World, motion: Motion, pressed: Ints, stuck: Ints) -> Motion:
    """The smallest change after which lasting contacts are closed and at rest.

    Keys ``pressed``: contacts that pressed all through the step; ``stuck``: those whose friction
    was below its limit as well, so that their tangential velocities vanish too.
    """
    if len(pressed) == 0:
        return motion
    found = world.contacts(motion, TOUCHING.pressed_overlap * world.length)
    contacts = found[np.isin(found.key, pressed)]
    if len(contacts) == 0:
        return motion
    wanted = np.repeat(np.isin(contacts.key, stuck)[:, None], motion.dim, axis=1)
    closing = np.zeros(wanted.shape, dtype=bool)
    closing[:, 0] = wanted[:, 0] = True
    gaps = np.zeros(wanted.shape)
    gaps[:, 0] = contacts.gap
    motion = _constrain(world, motion, contacts, gaps, closing, velocities=False)
    velocity = find_relative_velocity(contacts, motion)
    return _constrain(world, motion, contacts, velocity, wanted, velocities=True)


def _constrain(
    world: World, motion: Motion, contacts: Contacts, value: Floats, rows: Bools, *,
    velocities: bool,
) -> Motion:  # fmt: skip
    """``M^-1 J^T lambda`` added to velocities or places, so that ``value`` vanishes in ``rows``."""
    if not value[rows].any():
        return motion
    bodies = make_body_space(contacts, motion.position, world.columns, world.inverse_mass(motion))
    kept = np.flatnonzero(rows.ravel())
    matrix = bodies.matrix[kept][:, kept].toarray()
    push = np.zeros(value.size)
    push[kept] = np.linalg.lstsq(matrix, -value.ravel()[kept], rcond=1e-12)[0]
    change = np.zeros_like(motion.rates)
    change[world.movable] = find_response(bodies, push)
    if velocities:
        return replace_rates(motion, motion.rates + change)
    return displace_motion(motion, change)
