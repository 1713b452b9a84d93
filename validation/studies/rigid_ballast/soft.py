"""The rival: soft grains (Molecular Dynamics) of the same polygons, contacts and loads.

Geometry and contact points are those of `rigid_lcp.contact.detection_plane`; only the law differs.
At every
contact point with overlap ``d = -gap`` and velocity u of body a over body b

    f_N = max(0, k d - c u_N)        spring and dashpot, no tension
    f_T = k_t s - c_t u_T            spring s with history, s' = -u_T, |f_T| <= mu f_N

(Cundall and Strack, Geotechnique 29 (1979) 47), advanced by the explicit symplectic Euler method.
The step is a stated share of ``2 sqrt(m / k)`` of the lightest stone.  Neighbours are kept in a
list that is rebuilt when a body has moved by its skin.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numba import njit

from rigid_lcp.arrays import Bools, Floats, Ints
from rigid_lcp.contact.detection_plane import (
    Shapes2D,
    find_pair_contacts,
    find_widest_face,
    pack_shapes_2d,
)
from rigid_lcp.contact.near_pairs import (
    HALF_SPACE,
    POLYGON,
    bound_shapes,
    find_near_pairs,
    place_shapes,
)
from rigid_lcp.motion.state import Motion
from rigid_lcp.motion.world import World

TANGENTIAL = 0.8
"""Tangential over normal stiffness [-], near Mindlin's ratio 2 (1 - nu) / (2 - nu)."""
DAMPING = 0.5
"""Share of critical damping of a contact [-], of the mass that moves at it in its direction."""
STEP_SHARE = 0.05
"""Step over ``2 sqrt(m / k)`` of the lightest stone [-].  Four blocks upon each other on a slope
rest at this and at twice this step; at four times it they slide, as the dashpots grow unstable."""
SKIN = 0.02
"""Width of the neighbour list's skin, as a share of the smallest body's size [-]."""


@dataclass
class Springs:
    """Tangential springs of the contacts of the last step: what makes the history."""

    pair: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    """Pair of bodies, one number, ascending, (nc,)."""
    key: Ints = field(default_factory=lambda: np.zeros(0, np.int64))
    point: Floats = field(default_factory=lambda: np.zeros((0, 2)))
    """Contact points [m], (nc, 2)."""
    force: Floats = field(default_factory=lambda: np.zeros(0))
    """Force of the tangential spring [N], (nc,), along (-n_y, n_x) on a: the same if a and b swap.
    """


@dataclass
class SoftGrains:
    """State of a run of soft grains; `advance_grains` goes on with it."""

    world: World
    motion: Motion
    stiffness: float
    """Normal stiffness k of a contact point [N/m]."""
    friction: float
    """Coulomb's coefficient of every contact [-]."""
    shapes: Shapes2D
    springs: Springs
    step: float
    """[s]"""
    contacts: tuple[Ints, Floats, Floats]
    """Bodies (nc, 2), numbers (nc, 7) as in `find_pair_contacts`, last forces (nc, 2) [N]."""
    damping: float = DAMPING
    """Share of critical damping of a contact [-]."""
    work: float = 0.0
    """Work of the loads so far [J]."""
    steps: int = 0


def soften_grains(
    world: World, motion: Motion, stiffness: float, friction: float, share: float = STEP_SHARE
) -> SoftGrains:
    """Soft grains in the state of rigid ones: they still have to sink into each other."""
    shapes = pack_shapes_2d([body.shape for body in world.scene.bodies], world.movable)
    lightest = float(world.mass[world.movable].min())
    step = share * 2.0 * float(np.sqrt(lightest / stiffness))
    none = (np.zeros((0, 2), np.int64), np.zeros((0, 7)), np.zeros((0, 2)))
    return SoftGrains(world, motion, stiffness, friction, shapes, Springs(), step, none)


def advance_grains(run: SoftGrains, body: int, forces: Floats, seconds: float) -> None:
    """Go on for ``seconds`` [s] in equal steps, a force on one body.

    ``forces`` (m, 2) [N]: at m equal times from now to the end; linear in between.
    """
    world, shapes = run.world, run.shapes
    steps = max(1, int(np.ceil(seconds / run.step - 1e-9)))
    place = np.column_stack([run.motion.position, run.motion.angle])
    rates = np.ascontiguousarray(run.motion.rates)
    inverse = np.zeros_like(place)
    moving = world.movable
    inverse[moving, 0] = inverse[moving, 1] = 1.0 / world.mass[moving]
    inverse[moving, 2] = 1.0 / world.inertia[moving]
    law = np.array([run.stiffness, TANGENTIAL * run.stiffness, run.damping, run.friction])
    springs = run.springs
    done = march_grains(
        shapes.kind, shapes.first, shapes.vertices, shapes.normals, shapes.radius, shapes.movable,
        world.reach, place, rates, inverse, world.scene.gravity, law, SKIN * world.length,
        seconds / steps, steps, body, np.ascontiguousarray(forces, dtype=float),
        springs.pair, springs.key, springs.point, springs.force,
    )  # fmt: skip
    work, run.contacts = done[0], done[1:4]
    run.springs = Springs(*done[4:])
    run.motion = Motion(
        place[:, :2].copy(), place[:, 2].copy(), rates[:, :2].copy(), rates[:, 2].copy()
    )
    run.work += work
    run.steps += steps


@njit(cache=True)
def list_pairs(
    kind: Ints, first: Ints, vertices: Floats, normals: Floats, radius: Floats, position: Floats,
    movable: Bools, skin: float,
) -> Ints:  # fmt: skip
    """Pairs of bodies that are nearer than ``skin`` [m], a lower bound of their distance taken."""
    margin = np.full(len(kind), 0.5 * skin)
    boxes = bound_shapes(first, vertices, radius, position, margin)
    pairs = find_near_pairs(kind, boxes, movable)
    near = np.zeros(len(pairs), dtype=np.bool_)
    for row in range(len(pairs)):
        i, j = pairs[row]
        if kind[j] == HALF_SPACE:
            n = normals[first[j]]
            low = n[0] * position[i, 0] + n[1] * position[i, 1] - radius[i]
            for v in range(first[i], first[i + 1]):
                x = n[0] * vertices[v, 0] + n[1] * vertices[v, 1]
                low = x if v == first[i] else min(low, x)
            near[row] = low - radius[j] <= skin
        elif kind[i] == POLYGON and kind[j] == POLYGON:
            vi, ni = vertices[first[i] : first[i + 1]], normals[first[i] : first[i + 1]]
            vj, nj = vertices[first[j] : first[j + 1]], normals[first[j] : first[j + 1]]
            near[row] = (
                find_widest_face(vi, ni, vj)[1] <= skin and find_widest_face(vj, nj, vi)[1] <= skin
            )
        else:
            near[row] = True
    return pairs[near]


@njit(cache=True)
def keep_springs(
    pair: Ints, key: Ints, point: Floats, old_pair: Ints, old_key: Ints, old_point: Floats,
    old_force: Floats,
) -> Floats:  # fmt: skip
    """Spring forces that the contacts had in the last step, (nc,) [N].

    Of the contact with the same key; a contact between other features of the same two bodies takes
    over the spring of the nearest one that is gone.  ``pair`` and ``old_pair`` ascend.
    """
    force = np.zeros(len(pair))
    low = 0
    for c in range(len(pair)):
        while low < len(old_pair) and old_pair[low] < pair[c]:
            low += 1
        best, nearest = -1, np.inf
        row = low
        while row < len(old_pair) and old_pair[row] == pair[c]:
            if old_key[row] == key[c]:
                best = row
                break
            lives = False
            other = c
            while other >= 0 and pair[other] == pair[c]:
                lives = lives or key[other] == old_key[row]
                other -= 1
            other = c + 1
            while other < len(pair) and pair[other] == pair[c]:
                lives = lives or key[other] == old_key[row]
                other += 1
            apart = np.hypot(point[c, 0] - old_point[row, 0], point[c, 1] - old_point[row, 1])
            if not lives and apart < nearest:
                best, nearest = row, apart
            row += 1
        if best >= 0:
            force[c] = old_force[best]
    return force


@njit(cache=True)
def apply_law(
    law: Floats, gap: float, normal_rate: float, tangential_rate: float, spring: float,
    normal_mass: float, tangential_mass: float, h: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Normal and tangential force on a [N], and the spring's part of the latter.

    ``law``: k, k_t [N/m], share of critical damping, mu; masses [kg] that move at the point in the
    two directions (inverse diagonal of the Delassus matrix).
    """
    k, k_t, damping, friction = law
    normal = max(0.0, -k * gap - 2.0 * damping * np.sqrt(k * normal_mass) * normal_rate)
    spring -= k_t * tangential_rate * h
    dashpot = -2.0 * damping * np.sqrt(k_t * tangential_mass) * tangential_rate
    limit = friction * normal
    spring = min(max(spring, -limit), limit)
    return normal, min(max(spring + dashpot, -limit), limit), spring


@njit(cache=True)
def march_grains(
    kind: Ints, first: Ints, vertices: Floats, normals: Floats, radius: Floats,
    movable: Bools, reach: Floats, place: Floats, rates: Floats, inverse: Floats,
    gravity: Floats, law: Floats, skin: float, h: float, steps: int, loaded: int, forces: Floats,
    pair: Ints, key: Ints, point: Floats, spring: Floats,
) -> tuple[float, Ints, Floats, Floats, Ints, Ints, Floats, Floats]:  # fmt: skip
    """``steps`` steps; changes ``place`` and ``rates`` (n, 3) in place.

    Returns the work of the load, bodies, numbers and forces of the last contacts, their springs.
    """
    count = len(kind)
    none = np.zeros(count)
    listed_at = place.copy()
    listed_at[0, 0] = np.inf  # no list yet
    pairs = np.zeros((0, 2), dtype=np.int64)
    bodies, numbers = np.zeros((0, 2), dtype=np.int64), np.zeros((0, 7))
    carried, still = np.zeros((0, 2)), np.zeros((count, 3))
    work = 0.0
    for step in range(steps):
        position = place[:, :2].copy()
        world_vertices, world_normals = place_shapes(
            kind, first, vertices, normals, position, place[:, 2]
        )
        furthest = 0.0
        for b in range(count):
            moved = np.hypot(place[b, 0] - listed_at[b, 0], place[b, 1] - listed_at[b, 1])
            furthest = max(furthest, moved + reach[b] * abs(place[b, 2] - listed_at[b, 2]))
        if not furthest <= 0.5 * skin:
            listed_at = place.copy()
            pairs = list_pairs(kind, first, world_vertices, world_normals, radius, position,
                                 movable, skin)  # fmt: skip
        bodies, numbers, new_key = find_pair_contacts(
            pairs, kind, first, world_vertices, world_normals, radius, position, none, still
        )
        new_pair = np.empty(len(bodies), dtype=np.int64)
        for c in range(len(bodies)):
            a, b = bodies[c]
            if kind[b] == HALF_SPACE:  # as `find_near_pairs` orders them
                new_pair[c] = a * count + b
            else:
                new_pair[c] = min(a, b) * count + max(a, b)
        order = np.argsort(new_pair, kind="mergesort")
        new_pair, new_key, numbers = new_pair[order], new_key[order], numbers[order]
        bodies = bodies[order]
        spring = keep_springs(new_pair, new_key, numbers[:, :2], pair, key, point, spring)
        pair, key, point = new_pair, new_key, numbers[:, :2].copy()
        at = (step + 0.5) / steps * (len(forces) - 1)
        low = min(int(at), len(forces) - 2)
        load = forces[low] + (at - low) * (forces[low + 1] - forces[low])
        push = np.zeros((count, 3))
        push[loaded, :2] = load
        carried = np.empty((len(bodies), 2))
        for c in range(len(bodies)):
            a, b = bodies[c]
            n0, n1 = numbers[c, 2], numbers[c, 3]
            ax, ay = point[c, 0] - place[a, 0], point[c, 1] - place[a, 1]
            bx, by = point[c, 0] - place[b, 0], point[c, 1] - place[b, 1]
            if inverse[b, 0] == 0.0:
                bx = by = 0.0
            ux = rates[a, 0] - ay * rates[a, 2] - rates[b, 0] + by * rates[b, 2]
            uy = rates[a, 1] + ax * rates[a, 2] - rates[b, 1] - bx * rates[b, 2]
            mass = inverse[a, 0] + inverse[b, 0]
            arm_a, arm_b = ax * n1 - ay * n0, bx * n1 - by * n0
            normal_mass = 1.0 / (mass + arm_a**2 * inverse[a, 2] + arm_b**2 * inverse[b, 2])
            arm_a, arm_b = ax * n0 + ay * n1, bx * n0 + by * n1
            tangential_mass = 1.0 / (mass + arm_a**2 * inverse[a, 2] + arm_b**2 * inverse[b, 2])
            normal, tangential, spring[c] = apply_law(
                law, numbers[c, 4], ux * n0 + uy * n1, -ux * n1 + uy * n0, spring[c],
                normal_mass, tangential_mass, h,
            )  # fmt: skip
            carried[c, 0], carried[c, 1] = normal, tangential
            fx, fy = normal * n0 - tangential * n1, normal * n1 + tangential * n0
            push[a, 0] += fx
            push[a, 1] += fy
            push[a, 2] += ax * fy - ay * fx
            push[b, 0] -= fx
            push[b, 1] -= fy
            push[b, 2] -= bx * fy - by * fx
        for b in range(count):
            if inverse[b, 0] == 0.0:
                continue
            for axis in range(3):
                rates[b, axis] += h * inverse[b, axis] * push[b, axis]
                if axis < 2:
                    rates[b, axis] += h * gravity[axis]
                place[b, axis] += h * rates[b, axis]
        work += h * (load[0] * rates[loaded, 0] + load[1] * rates[loaded, 1])
    return work, bodies, numbers, carried, pair, key, point, spring
