"""Contact of spheres on a GPU: the twin of `qdem_fem.contact_kernel`, a thread a sphere.

A step of contact is three launches behind those of the elements and the motion, four with walls:
positions, pairs, walls, reactions; one before them adds the forces found to the nodes.  A sphere's
force is summed over its own row, then over the pairs in which it is the second, in their order, as
on the processor: no atomics but where the forces reach the nodes.  A vertex that leaves the skin
ends the window (`ANEW`) before any force of its step is computed; the host looks for pairs, and
computes that one step.  Contact is in double precision.
"""

from __future__ import annotations

from functools import cache
from math import sqrt
from typing import Any

import numpy as np

from qdem_fem import contact_kernel, cuda_step
from qdem_fem.contact_kernel import DEEPEST, GO_ON, LOOK_ANEW, TOO_DEEP, Contact
from qdem_fem.cuda_step import ANEW, DEEP, LIMIT, cuda

slider: Any = cuda.jit(device=True)(contact_kernel.slider.py_func)
series: Any = cuda.jit(device=True)(contact_kernel.series.py_func)


@cuda.jit
def forces_push(
    count: Any, acting: Any, place: Any, force: Any, forces: Any, status: Any, k: Any
) -> None:
    """Add the force on each of the ``count`` acting spheres to its node's."""
    q = cuda.grid(1)
    if q < count and k < status[LIMIT]:
        i = acting[q]
        for c in range(3):
            cuda.atomic.add(forces, place[i] + c, force[i, c])


@cuda.jit
def spheres_move(
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
        status[ANEW] = 1
        status[LIMIT] = k + 1  # of this step nothing else is computed, and no other one


@cache
def pairs_forces_kernel(periodic: bool) -> Any:
    """The kernel of the pairs; images are not in its code where nothing is periodic."""

    @cuda.jit
    def pairs_forces(
        count: Any, acting: Any, first: Any, second: Any, touching: Any, spring: Any, pull: Any,
        image: Any, position: Any, radius: Any, normal: Any, tangential: Any, place: Any,
        velocity: Any, friction: Any, force: Any, slid: Any, status: Any, step: Any, k: Any,
    ) -> None:  # fmt: skip
        """`qdem_fem.contact_kernel.pairs_forces`, of one sphere."""
        q = cuda.grid(1)
        if q >= count or k >= status[LIMIT] or status[ANEW] > 0:
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

    return pairs_forces


@cuda.jit
def walls_forces(
    count: Any, acting: Any, wall_first: Any, wall: Any, point: Any, across: Any, friction: Any,
    spring: Any, pull: Any, position: Any, radius: Any, normal: Any, tangential: Any, place: Any,
    velocity: Any, force: Any, slid: Any, status: Any, step: Any, k: Any,
) -> None:  # fmt: skip
    """`qdem_fem.contact_kernel.planes_forces`, of one sphere."""
    q = cuda.grid(1)
    if q >= count or k >= status[LIMIT] or status[ANEW] > 0:
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
def reactions_add(
    count: Any, acting: Any, back_first: Any, back_pair: Any, touching: Any, pull: Any, force: Any,
    status: Any, k: Any,
) -> None:  # fmt: skip
    """Take from each acting sphere what its pairs did to the first one of them."""
    q = cuda.grid(1)
    if q >= count or k >= status[LIMIT] or status[ANEW] > 0:
        return
    j = acting[q]
    for entry in range(back_first[j], back_first[j + 1]):
        p = back_pair[entry]
        if touching[p] != 0:
            for c in range(3):
                force[j, c] -= pull[p, c]


def device_array(array: Any) -> Any:
    """An array on the GPU, with one row of zeros in place of none: it had better not be empty."""
    shape = tuple(max(length, 1) for length in array.shape)
    full = array if array.size else np.zeros(shape, array.dtype)
    return cuda.to_device(np.ascontiguousarray(full))


class DeviceContact:
    """The arrays of a `Contact` on the GPU, and the launches of a step."""

    def __init__(self, c: Contact) -> None:
        self.arrays = {
            name: {field: device_array(array) for field, array in part._asdict().items()}
            for name, part in (("spheres", c.spheres), ("pairs", c.pairs), ("planes", c.planes))
        }
        self.moving = {
            name: device_array(getattr(c, name)) for name in ("start", "position", "force", "slid")
        }
        self.friction, self.half_skin = float(c.friction), float(c.half_skin)
        self.periodic, self.walls = c.pairs.image.ndim > 1, len(c.planes.point) > 0
        self.count, self.size = len(c.pairs.acting), len(c.position)
        self.said = GO_ON

    def grid(self, count: int) -> tuple[int, int]:
        """Blocks and threads of a launch for so many spheres."""
        return max(1, -(-count // cuda_step.BLOCK)), cuda_step.BLOCK

    def launch_push(self, forces: Any, status: Any, k: int) -> None:
        """Forces found in the step before reach the nodes."""
        spheres, pairs = self.arrays["spheres"], self.arrays["pairs"]
        forces_push[self.grid(self.count)](
            self.count, pairs["acting"], spheres["place"], self.moving["force"], forces, status, k
        )

    def launch_step(
        self, displacement: Any, velocity: Any, status: Any, step: float, k: int
    ) -> None:
        """Contact at the new displacement, as `qdem_fem.contact_kernel.advance_build`'s."""
        s, p, w, m = (*self.arrays.values(), self.moving)
        few = self.grid(self.count)
        spheres_move[self.grid(self.size)](
            s["reference"], s["place"], displacement, m["start"], self.half_skin, m["position"],
            status, k,
        )  # fmt: skip
        pairs_forces_kernel(self.periodic)[few](
            self.count, p["acting"], p["first"], p["second"], p["touching"], p["spring"],
            p["pull"], p["image"], m["position"], s["radius"], s["normal"], s["tangential"],
            s["place"], velocity, self.friction, m["force"], m["slid"], status, step, k,
        )  # fmt: skip
        if self.walls:
            walls_forces[few](
                self.count, p["acting"], p["wall_first"], p["wall"], w["point"], w["normal"],
                w["friction"], w["spring"], w["force"], m["position"], s["radius"], s["normal"],
                s["tangential"], s["place"], velocity, m["force"], m["slid"], status, step, k,
            )  # fmt: skip
        reactions_add[few](
            self.count, p["acting"], p["back_first"], p["back_pair"], p["touching"], p["pull"],
            m["force"], status, k,
        )  # fmt: skip

    def end(self, status: list[int]) -> None:
        """What the last step of a window said, from its status."""
        self.said = TOO_DEEP if status[DEEP] else LOOK_ANEW if status[ANEW] else GO_ON

    def fetch(self, c: Contact) -> None:
        """Write what steps have changed into the host's arrays."""
        changed = [
            (self.arrays["pairs"], c.pairs, ("touching", "spring", "pull")),
            (self.arrays["planes"], c.planes, ("spring", "force")),
            (self.moving, c, ("position", "force", "slid")),
        ]
        for there, here, names in changed:
            for name in names:
                array = getattr(here, name)
                if array.size:
                    array[:] = there[name].copy_to_host()
