"""Overlaps at the end of a time step, taken out by moving bodies apart (split impulse).

Each round moves by the smallest displacement weighted with mass, ``M^-1 J_N^T lambda`` with
``lambda >= 0``, exact to the first order in it.  Velocities stay, so that nothing bounces off what
was an error of the step.  What that changes:

* Momentum and the centre of mass of bodies in flight: nothing.
* Their angular momentum: by ``sum m dx x v``, dx the moves, v about the common centre of mass: at
  most overlap times momentum; in space also by the turn of what spins.  (It could be put back by a
  turn of all, but that would change their energy.)
* Energy: bodies that lie on what is fixed are lifted, by at most their weight times the overlap.  A
  body that comes to rest lost more in the same step.  Where a step would end with more energy than
  it began with, `remove_lift` takes the lift from what restitution gave, or else from the kinetic
  energy of the bodies moved.

Who pays: a disc that lands on a floor is by ``v h / 2`` too deep at the midpoint, and does not come
out again if it hands its velocity on to a disc above it.  It is then lifted, at rest, and what the
lift costs is in the disc above.  Both got their velocities from impulses with restitution; so much
less of it acts among the bodies that push each other as makes the energy that of the start.  That
keeps momentum, and lets no pair approach that would not without restitution.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from rigid_lcp.arrays import Bools, Floats, Ints
from rigid_lcp.contact import Contacts
from rigid_lcp.friction.auto import solve_friction
from rigid_lcp.motion.equations import find_response, make_body_space
from rigid_lcp.motion.state import Motion, displace_motion, replace_rates
from rigid_lcp.motion.world import World
from rigid_lcp.shapes import make_quaternion, rotate


@dataclass(frozen=True)
class OverlapNumbers:
    """Moves that take overlaps out, which are measured by the size of the smallest body."""

    allowed: float = 1e-12  # overlap that is left alone [-]
    tolerance: float = 1e-9  # residual of a move [-]; what is left is seen in the next step
    moves: int = 20  # after a step, at most [-]
    left: float = 1e-9  # overlap (of second order) that moves leave to the next step [-]
    turn_of_a_move: float = 0.1  # of a body [rad]: beyond it the first order means little
    turning_moves: int = 6
    """Moves after which turning is dear [-]: small grains between large ones may turn to and fro
    for ever, where the large ones must give way."""
    turning_ease: float = 1e-6  # after these, over that before [-]
    least_cost: float = 1e-15  # part of the energy up to which a lift costs nothing [-]


OVERLAPS = OverlapNumbers()


@dataclass(frozen=True)
class Restitution:
    """What restitution did in a step."""

    body_a: Ints
    body_b: Ints  # bodies that pushed each other in the step, (nc,)
    taken_out: Callable[[], Floats]
    """What velocities would be without it, less what they are, (n, 3) or (n, 6) [m/s, 1/s]."""


def remove_overlap(world: World, motion: Motion, touching: Contacts | None = None) -> Motion:
    """Bodies moved apart until no two overlap: what turning, and impacts of more speed than the
    contacts were looked for with, leave at the end of a step.  No velocity changes, but that spins
    in space turn along with their bodies.  ``touching``: contacts without margin, where known."""
    for done in range(OVERLAPS.moves):
        if touching is None or done:
            touching = world.contacts(motion, 0.0)
        deepest = -float(touching.gap.min(initial=0.0))
        if deepest <= (OVERLAPS.left if done else OVERLAPS.allowed) * world.length:
            break
        found = world.contacts(motion, deepest)  # neighbours that the move may reach stay clear
        inverse_mass = world.inverse_mass(motion)
        if done >= OVERLAPS.turning_moves:
            weight = np.where(np.arange(world.size) < motion.dim, 1.0, OVERLAPS.turning_ease**0.5)
            scale = sp.diags_array(np.tile(weight, inverse_mass.shape[0] // world.size))
            inverse_mass = sp.csr_array(scale @ inverse_mass @ scale)
        bodies = make_body_space(found, motion.position, world.columns, inverse_mass)
        offset = np.zeros((len(found), motion.dim))
        offset[:, 0] = found.gap
        apart = solve_friction(
            bodies, offset.ravel(), 0.0, dim=motion.dim, tolerance=OVERLAPS.tolerance
        )
        move = np.zeros_like(motion.rates)
        move[world.movable] = find_response(bodies, apart.r)
        turn = float(np.abs(move[:, motion.dim :]).max())
        move *= min(1.0, OVERLAPS.turn_of_a_move / max(turn, 1e-300))
        motion = displace_motion(motion, move)
        if motion.dim == 3:  # spins turn along: so they, and kinetic energies, stay in the bodies
            turned = rotate(make_quaternion(move[:, 3:]), motion.spin)
            motion = replace(motion, spin=turned)
    return motion


def separate_bodies(
    world: World, start: Motion, end: Motion, loads: Floats | None, h: float,
    touching: Contacts | None = None, restitution: Restitution | None = None,
) -> Motion:  # fmt: skip
    """The end of a step of length ``h`` [s] from ``start``, without overlaps and without the
    energy that taking them out would add; ``loads`` (n, 3) or (n, 6) [N, N m] at its midpoint.

    ``touching``: contacts of ``end`` without margin, where known; ``restitution``: None where
    nothing bounced.
    """
    parted = remove_overlap(world, end, touching)
    if parted is end:
        return end
    work = 0.0
    if loads is not None:
        way = 0.5 * h * (start.rates + end.rates)[world.movable]
        work = float((np.asarray(loads)[world.movable] * way).sum())
    return remove_lift(world, end, parted, world.energy(start) + work, restitution)


def remove_lift(
    world: World, end: Motion, parted: Motion, budget: float,
    restitution: Restitution | None = None,
) -> Motion:  # fmt: skip
    """Bodies slower by as much energy as the step has above ``budget`` [J], not more than the lift
    from ``end`` to ``parted``.

    First ``restitution`` pays among the bodies moved and those that touch them; then the bodies
    moved, all slower by one factor; then those that touch them.  Where a fixed body moves it may
    bring energy in, and nothing is taken.
    """
    if parted.rates[~world.movable].any():
        return parted
    energy = world.energy(parted)
    owed = min(energy - world.energy(end), energy - budget)
    none = OVERLAPS.least_cost * abs(energy)
    if owed <= none:
        return parted
    moved = world.movable & (parted.position != end.position).any(axis=1)
    payers = [moved]
    if restitution is not None:
        near = join_bodies(world, moved, restitution)
        parted = take_energy(world, parted, near, restitution.taken_out(), owed)
        payers.append(near)
    for bodies in payers:
        owed -= energy - world.energy(parted)
        energy = world.energy(parted)
        if owed > none:
            parted = take_energy(world, parted, bodies, -parted.rates, owed)
    return parted


def join_bodies(world: World, moved: Bools, restitution: Restitution) -> Bools:
    """``moved`` bodies, and those that movable ones join to them by pushing each other, (n,)."""
    a, b = restitution.body_a, restitution.body_b
    both = world.movable[a] & world.movable[b]
    count = len(moved)
    pairs = sp.coo_array((np.ones(both.sum()), (a[both], b[both])), shape=(count, count))
    _, label = connected_components(pairs, directed=False)
    joined: Bools = world.movable & np.isin(label, label[moved])
    return joined


def take_energy(world: World, motion: Motion, bodies: Bools, change: Floats, owed: float) -> Motion:
    """``motion`` with as small a part of ``change`` (n, 3) or (n, 6) [m/s, 1/s] in the velocities
    of ``bodies`` (n,) as takes ``owed`` [J] of energy, or the part that takes most, at most all."""
    rates, change = motion.rates, np.where(bodies[:, None], change, 0.0)
    moving = replace(motion, position=np.zeros_like(motion.position))  # kinetic energies alone
    here = world.energy(moving)
    half = world.energy(replace_rates(moving, rates + 0.5 * change)) - here
    whole = world.energy(replace_rates(moving, rates + change)) - here
    square, slope = 2.0 * whole - 4.0 * half, 4.0 * half - whole  # of the parabola in the part
    if slope >= 0.0:
        return motion
    root = slope**2 - 4.0 * square * owed
    part = 2.0 * owed / (root**0.5 - slope) if root > 0.0 else -slope / (2.0 * square)
    return replace_rates(motion, rates + min(part, 1.0) * change)
