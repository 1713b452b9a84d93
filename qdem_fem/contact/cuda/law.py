"""Contact of spheres on a GPU: the twin of `qdem_fem.contact.spheres.law`, a thread a sphere.

A step of contact is three launches behind those of the elements and the motion, four with walls:
positions, pairs, walls, reactions; one before them adds the forces found to the nodes.  A sphere's
force is summed over its own row, then over the pairs in which it is the second, in their order, as
on the processor: no atomics but where the forces reach the nodes.  A vertex that leaves the skin
ends the window (`AGAIN`) before any force of its step is computed; pairs are looked for, and then
that one step is computed (`qdem_fem.contact.cuda.arrays`).  Contact is in double precision.
"""

from functools import cache
from math import sqrt
from typing import Any

from qdem_fem.contact.spheres import DEEPEST
from qdem_fem.contact.spheres import law as contact_kernel
from qdem_fem.kernel.cuda import AGAIN, DEEP, LIMIT, cuda

slider: Any = cuda.jit(device=True)(contact_kernel.slide_spring.py_func)
series: Any = cuda.jit(device=True)(contact_kernel.add_in_series.py_func)


@cuda.jit
def push_forces(
    count: Any, acting: Any, place: Any, force: Any, forces: Any, status: Any, k: Any
) -> None:
    """Add the force on each of the ``count`` acting spheres to its node's."""
    q = cuda.grid(1)
    if q < count and k < status[LIMIT]:
        i = acting[q]
        for c in range(3):
            cuda.atomic.add(forces, place[i] + c, force[i, c])


@cuda.jit
def move_spheres(
    reference: Any, place: Any, displacement: Any, start: Any, half_skin: Any, position: Any,
    status: Any, k: Any,
) -> None:  # fmt: skip
    """Positions of the spheres; one that is beyond half the skin ends the window behind step k."""
    i = cuda.grid(1)
    if i >= place.size or k >= status[LIMIT]:
        return
    moved = 0.0
    for c in range(3):
        position[i, c] = reference[i, c] + displacement[place[i] + c]
        moved += (position[i, c] - start[i, c]) ** 2
    if moved > half_skin * half_skin:
        status[AGAIN] = 1
        status[LIMIT] = k + 1  # of this step nothing else is computed, and no other one


@cache
def build_pairs_forces(periodic: bool) -> Any:
    """The kernel of the pairs; images are not in its code where nothing is periodic."""

    @cuda.jit
    def compute_pairs_forces(
        count: Any, acting: Any, first: Any, second: Any, touching: Any, spring: Any, pull: Any,
        image: Any, position: Any, radius: Any, normal: Any, tangential: Any, place: Any,
        velocity: Any, friction: Any, force: Any, slid: Any, status: Any, step: Any, k: Any,
    ) -> None:  # fmt: skip
        """`qdem_fem.contact.spheres.law.compute_pairs_forces`, of one sphere."""
        q = cuda.grid(1)
        if q >= count or k >= status[LIMIT] or status[AGAIN] > 0:
            return
        i = acting[q]
        fx, fy, fz = 0.0, 0.0, 0.0
        for p in range(first[i], first[i + 1]):
            j = second[p]
            dx = position[i, 0] - position[j, 0]
            dy = position[i, 1] - position[j, 1]
            dz = position[i, 2] - position[j, 2]
            if periodic:
                dx, dy, dz = dx - image[p, 0], dy - image[p, 1], dz - image[p, 2]
            square = dx * dx + dy * dy + dz * dz
            reach = radius[i] + radius[j]
            open_now = square >= reach * reach
            if open_now and touching[p] == 0:
                continue
            apart = sqrt(square)
            overlap = max(reach - apart, 0.0)
            if overlap >= DEEPEST * min(radius[i], radius[j]):
                status[DEEP] = 1
                status[LIMIT] = k + 1
            inverse = 1.0 / apart if apart > 0.0 else 0.0
            n = dx * inverse, dy * inverse, dz * inverse
            push = series(normal[i], normal[j]) * overlap
            k_t = series(tangential[i], tangential[j])
            at, there = place[i], place[j]
            way = (
                step * (velocity[at] - velocity[there]),
                step * (velocity[at + 1] - velocity[there + 1]),
                step * (velocity[at + 2] - velocity[there + 2]),
            )
            old = spring[p, 0], spring[p, 1], spring[p, 2]
            s, loss = slider(old, n, way, k_t, friction * push)
            slid[i] += loss
            touching[p] = 0 if open_now else 1
            for c in range(3):
                spring[p, c] = s[c]
                pull[p, c] = push * n[c] - k_t * s[c]
            fx, fy, fz = fx + pull[p, 0], fy + pull[p, 1], fz + pull[p, 2]
        force[i, 0], force[i, 1], force[i, 2] = fx, fy, fz

    return compute_pairs_forces


@cuda.jit
def compute_walls_forces(
    count: Any, acting: Any, wall_first: Any, wall: Any, point: Any, across: Any, friction: Any,
    spring: Any, pull: Any, position: Any, radius: Any, normal: Any, tangential: Any, place: Any,
    velocity: Any, force: Any, slid: Any, status: Any, step: Any, k: Any,
) -> None:  # fmt: skip
    """`qdem_fem.contact.spheres.law.compute_planes_forces`, of one sphere."""
    q = cuda.grid(1)
    if q >= count or k >= status[LIMIT] or status[AGAIN] > 0:
        return
    i = acting[q]
    for entry in range(wall_first[i], wall_first[i + 1]):
        w = wall[entry]
        n = across[w, 0], across[w, 1], across[w, 2]
        overlap = radius[i]
        for c in range(3):
            overlap -= (position[i, c] - point[w, c]) * n[c]
        touched = pull[w, i, 0] != 0.0 or pull[w, i, 1] != 0.0 or pull[w, i, 2] != 0.0
        if overlap <= 0.0 and not touched:
            continue
        if overlap >= DEEPEST * radius[i]:
            status[DEEP] = 1
            status[LIMIT] = k + 1
        push = 2.0 * normal[i] * max(overlap, 0.0)
        k_t = 2.0 * tangential[i]
        at = place[i]
        way = step * velocity[at], step * velocity[at + 1], step * velocity[at + 2]
        old = spring[w, i, 0], spring[w, i, 1], spring[w, i, 2]
        s, loss = slider(old, n, way, k_t, friction[w] * push)
        slid[i] += loss
        for c in range(3):
            spring[w, i, c] = s[c]
            pull[w, i, c] = push * n[c] - k_t * s[c]
            force[i, c] += pull[w, i, c]


@cuda.jit
def add_reactions(
    count: Any, acting: Any, back_first: Any, back_pair: Any, touching: Any, pull: Any, force: Any,
    status: Any, k: Any,
) -> None:  # fmt: skip
    """Take from each acting sphere what its pairs did to the first one of them."""
    q = cuda.grid(1)
    if q >= count or k >= status[LIMIT] or status[AGAIN] > 0:
        return
    j = acting[q]
    for entry in range(back_first[j], back_first[j + 1]):
        p = back_pair[entry]
        if touching[p] != 0:
            for c in range(3):
                force[j, c] -= pull[p, c]
