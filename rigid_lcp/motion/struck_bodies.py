"""Bodies that are struck within a time step: how far they get, and what they may strike in turn.

Contacts of a step are looked for as far as bodies get within it by the velocities that they begin
it with (`find_margin`).  A body at rest that is struck gets further.  What it then meets shows as
an overlap at the end of the step, at a pair that had no contact in it (`find_missed`).
A pair without restitution is moved apart and comes to rest in the next step, as it would have done
in this one.  With restitution the step is made again, with more contacts
(`find_contacts_of_struck`).

A body of mass m_a at speed v leaves one at rest, of mass m_b, at most with
``(1 + e) m_a / (m_a + m_b) v``, and that the next one.  In a ring of bodies the product of these
factors is at most 1 (each is at most ``m_a / sqrt(m_a m_b)``), so speeds passed on come to an end.
"""

import numpy as np

from rigid_lcp.arrays import Bools, Floats, Ints
from rigid_lcp.contact import Contacts
from rigid_lcp.motion.equations import find_relative_velocity
from rigid_lcp.motion.overlap_removal import OVERLAPS
from rigid_lcp.motion.state import Motion
from rigid_lcp.motion.world import World

LEAST_GAIN = 1e-6
"""Part by which a speed has to be greater than one that was taken into account [-]."""


def find_margin(world: World, motion: Motion, accelerations: Floats, h: float) -> Floats:
    """How far each body's points can get within a step that nothing strikes them in [m], (n,)."""
    rates = np.abs(motion.rates) + h * np.abs(accelerations)
    return h * world.speeds(rates) + OVERLAPS.allowed * world.length


def find_missed(
    world: World, contacts: Contacts, end: Motion, touching: Contacts, slow: float
) -> Bools:
    """Bodies (n,) of pairs that overlap at the ``end`` of a step, have restitution, approach faster
    than ``slow`` [m/s], and were no ``contacts`` of the step.

    ``touching``: contacts of ``end`` without margin.
    """
    missed = np.zeros(len(world.mass), dtype=bool)
    deep = touching.gap < -OVERLAPS.allowed * world.length
    found = touching[deep & (touching.restitution > 0.0)]
    if len(found) == 0:
        return missed
    known = np.isin(_number_pairs(world, found), _number_pairs(world, contacts))
    found = found[~known]
    if len(found):
        found = found[find_relative_velocity(found, end)[:, 0] < -slow]
        missed[found.body_a] = missed[found.body_b] = True
    return missed


def find_contacts_of_struck(
    world: World, middle: Motion, margin: Floats, struck: Bools, end: Motion, h: float
) -> tuple[Contacts, Floats]:
    """Contacts at the midpoint of a step, and their margins (n,) [m], with those that ``struck``
    bodies (n,) may get to by their velocities at its ``end``, and so on to what they strike."""
    reaching = np.where(struck, np.maximum(margin, h * world.speeds(end.rates)), margin)
    while True:
        contacts = world.contacts(middle, reaching, 0.5 * h)
        further = _pass_on(world, contacts, reaching, struck)
        faster = further > reaching * (1.0 + LEAST_GAIN)
        if not faster.any():
            return contacts, reaching
        reaching, struck = np.where(faster, further, reaching), struck | faster


def _pass_on(world: World, contacts: Contacts, margin: Floats, struck: Bools) -> Floats:
    """Margins (n,) [m] with those that ``struck`` bodies pass on to bodies that they may hit."""
    further = margin.copy()
    bounces = contacts.restitution > 0.0
    for a, b in ((contacts.body_a, contacts.body_b), (contacts.body_b, contacts.body_a)):
        hits = bounces & struck[a] & world.movable[b]
        lighter = 1.0 / (1.0 + world.mass[b[hits]] / world.mass[a[hits]])
        passed = (1.0 + contacts.restitution[hits]) * lighter * margin[a[hits]]
        np.maximum.at(further, b[hits], passed)
    return further


def _number_pairs(world: World, contacts: Contacts) -> Ints:
    """One number for the two bodies of each contact, (nc,)."""
    a, b = contacts.body_a, contacts.body_b
    return np.minimum(a, b) * len(world.mass) + np.maximum(a, b)
