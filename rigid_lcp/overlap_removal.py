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
  it began with, `lift_paid` takes the lift from the kinetic energy of the bodies moved.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rigid_lcp.equations import body_space
from rigid_lcp.motion import Motion, motion_displaced, motion_with_rates
from rigid_lcp.scene import World
from rigid_lcp.solver import solve_friction

Floats = NDArray[np.float64]

OVERLAP = 1e-12
"""Overlap that is left alone, as a share of the smallest body's size."""
PROJECTION_TOLERANCE = 1e-9
"""Residual of the displacements that take overlaps out; what is left is seen in the next step."""
PROJECTIONS, OVERLAP_LEFT = 20, 1e-9
"""Most times that overlaps are taken out after a step, and the share of the smallest body's size
below which what a first time left (of second order) is left to the next step."""
GREATEST_TURN = 0.1
"""Turn of a body in one of these [rad]: beyond it the first order of a move means little."""
TURNING, STIFF = 6, 1e-6
"""After so many, turning costs ``1 / STIFF`` times as much: small grains between large ones may
turn to and fro for ever, where the large ones must give way."""


def overlap_removed(world: World, motion: Motion) -> Motion:
    """Bodies moved apart until no two overlap: what turning, and impacts of more speed than the
    contacts were looked for with, leave at the end of a step.  No velocity changes, but that spins
    in space turn along with their bodies."""
    for done in range(PROJECTIONS):
        deepest = -float(world.contacts(motion, 0.0).gap.min(initial=0.0))
        if deepest <= (OVERLAP_LEFT if done else OVERLAP) * world.length:
            break
        found = world.contacts(motion, deepest)  # neighbours that the move may reach stay clear
        inverse_mass = world.inverse_mass(motion)
        if done >= TURNING:
            weight = np.where(np.arange(world.size) < motion.dim, 1.0, STIFF**0.5)
            scale = sp.diags_array(np.tile(weight, inverse_mass.shape[0] // world.size))
            inverse_mass = sp.csr_array(scale @ inverse_mass @ scale)
        bodies = body_space(found, motion.position, world.columns, inverse_mass)
        offset = np.zeros((len(found), motion.dim))
        offset[:, 0] = found.gap
        apart = solve_friction(
            bodies, offset.ravel(), 0.0, dim=motion.dim, tolerance=PROJECTION_TOLERANCE
        )
        move = np.zeros_like(motion.rates)
        change = bodies.inverse_mass @ (bodies.jacobian.T @ apart.r)
        move[world.movable] = np.asarray(change).reshape(-1, world.size)
        turn = float(np.abs(move[:, motion.dim :]).max())
        motion = shifted(motion, move * min(1.0, GREATEST_TURN / max(turn, 1e-300)))
    return motion


def shifted(motion: Motion, move: Floats) -> Motion:
    """Bodies moved by ``move`` (n, 3) or (n, 6), in space with their spins turned along.

    So spins are the same in the bodies' own frames, and kinetic energies stay.
    """
    after = motion_displaced(motion, move)
    if motion.dim == 2:
        return after
    from rigid_lcp.rotations import quaternion_of_rotation, rotate

    return replace(after, spin=rotate(quaternion_of_rotation(move[:, 3:]), motion.spin))


def bodies_parted(
    world: World, start: Motion, end: Motion, loads: Floats | None, h: float
) -> Motion:
    """The end of a step of length ``h`` [s] from ``start``, without overlaps and without the
    energy that taking them out would add; ``loads`` (n, 3) or (n, 6) [N, N m] at its midpoint."""
    parted = overlap_removed(world, end)
    if parted is end:
        return end
    work = 0.0
    if loads is not None:
        way = 0.5 * h * (start.rates + end.rates)[world.movable]
        work = float((np.asarray(loads)[world.movable] * way).sum())
    return lift_paid(world, end, parted, world.energy(start) + work)


def lift_paid(world: World, end: Motion, parted: Motion, budget: float) -> Motion:
    """Bodies that were lifted, slower by as much energy as the step has above ``budget`` [J].

    Not more than the lift from ``end`` to ``parted``, nor than the kinetic energy of the bodies
    moved; all of them slow down by one factor.  Where a fixed body moves it may bring energy in,
    and nothing is taken.
    """
    if parted.rates[~world.movable].any():
        return parted
    energy = world.energy(parted)
    owed = min(energy - world.energy(end), energy - budget)
    moved = world.movable & (parted.position != end.position).any(axis=1)
    slower = parted.rates
    slower[moved] = 0.0
    kinetic = energy - world.energy(motion_with_rates(parted, slower))
    if owed <= 0.0 or kinetic <= 0.0:
        return parted
    rates = parted.rates
    rates[moved] *= max(0.0, 1.0 - owed / kinetic) ** 0.5
    return motion_with_rates(parted, rates)
