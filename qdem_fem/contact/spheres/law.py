"""The compiled contact of spheres: forces, sliders and their history, one time step at a time.

Rows of pairs are worked on in blocks of spheres; a sphere's force is the sum over its own row,
then over the pairs in which it is the second, in their order.  So the bits do not depend on the
threads, and what a pair does to one sphere it does to the other with the opposite sign.
No fast mathematics here: a force and its reaction are the same number.
"""

from math import sqrt
from typing import Any, NamedTuple

import numpy as np
from numba import njit, prange
from numba.extending import overload

from qdem_fem import kernel as compiling
from qdem_fem.contact.search import Pairs
from qdem_fem.kernel import digest_sources, exact, inlined, read_row

SPHERES_AT_ONCE = 512
"""Spheres that one thread takes at a time."""
GO_ON, LOOK_AGAIN, TOO_DEEP = 0, 1, 2
"""What a step says: go on; a vertex has left the skin, so that its forces wait for new pairs; two
spheres are too deep in each other."""
DEEPEST = 1.0
"""Overlap over the smaller radius at which the model ends: a centre lies in the other sphere."""


class Spheres(NamedTuple):
    """Spheres at surface vertices, by their own numbers."""

    reference: Any  # (c, 3) reference position of the vertex [m]
    place: Any  # (c,) of its first component in the displacement
    force_at: Any  # (c,) of its first component in the windows of forces
    body: Any  # (c,)
    radius: Any  # (c,) [m]
    normal: Any  # (c,) k_n [N/m]
    tangential: Any  # (c,) k_t [N/m]


class Planes(NamedTuple):
    """Rigid walls, and what each sphere remembers of each."""

    point: Any  # (w, 3) [m]
    normal: Any  # (w, 3), unit
    friction: Any  # (w,)
    spring: Any  # (w, c, 3) tangential spring [m]
    force: Any  # (w, c, 3) force on the sphere [N]


class Contact(NamedTuple):
    """All that a step of contact reads and writes."""

    spheres: Any
    pairs: Any
    planes: Any
    friction: Any  # Coulomb's coefficient between bodies
    half_skin: Any  # way of a vertex after which pairs are looked for again [m]
    start: Any  # (c, 3) positions when pairs were last looked for [m]
    position: Any  # (c, 3) [m]
    force: Any  # (c, 3) [N]
    slid: Any  # (c,) work that sliders took since the start, by the pair's first sphere [J]


@inlined
def slide_spring(
    spring: Any, normal: Any, way: Any, stiffness: float, limit: float
) -> Any:  # pragma: no cover
    """The spring after a relative ``way`` [m] under a ``limit`` mu F_n [N]: ``(s, loss [J])``.

    The old spring turns into the plane of the new normal at its old length, takes up the
    tangential way, and slips where ``k_t |s|`` exceeds the limit.  The loss is the mean of the
    force before and after times the slip, so that energies close as the trapezoidal rule does.
    """
    sx, sy, sz = spring
    nx, ny, nz = normal
    wx, wy, wz = way
    before = sx * sx + sy * sy + sz * sz
    if before > 0.0:
        across = sx * nx + sy * ny + sz * nz
        sx, sy, sz = sx - across * nx, sy - across * ny, sz - across * nz
        within = sx * sx + sy * sy + sz * sz
        scale = sqrt(before / within) if within > 0.0 else 0.0
        sx, sy, sz = scale * sx, scale * sy, scale * sz
    across = wx * nx + wy * ny + wz * nz
    tx, ty, tz = sx + wx - across * nx, sy + wy - across * ny, sz + wz - across * nz
    pull = stiffness * sqrt(tx * tx + ty * ty + tz * tz)
    if pull <= limit:
        return (tx, ty, tz), 0.0
    share = limit / pull
    ux, uy, uz = share * tx, share * ty, share * tz
    loss = (sx + ux) * (tx - ux) + (sy + uy) * (ty - uy) + (sz + uz) * (tz - uz)
    return (ux, uy, uz), 0.5 * stiffness * loss


@inlined
def subtract_rows(a: Any, i: int, b: Any, j: int) -> Any:  # pragma: no cover
    """Row i of ``a`` less row j of ``b``."""
    return a[i, 0] - b[j, 0], a[i, 1] - b[j, 1], a[i, 2] - b[j, 2]


@inlined
def write_row(a: Any, i: int, values: Any) -> None:  # pragma: no cover
    """Row i of ``a`` becomes ``values``."""
    a[i, 0], a[i, 1], a[i, 2] = values


def subtract_image(d: Any, image: Any, p: int) -> Any:
    """``d`` [m] less row p of ``image``; as it is where ``image`` is (0,): nothing is periodic."""
    return d if image.ndim == 1 else subtract_row(d, image, p)


@inlined
def subtract_row(d: Any, image: Any, p: int) -> Any:  # pragma: no cover
    """``d`` less row p of ``image``."""
    return d[0] - image[p, 0], d[1] - image[p, 1], d[2] - image[p, 2]


@overload(subtract_image, strict=False, jit_options={"error_model": "numpy", "forceinline": True})
def _choose_subtraction(d: Any, image: Any, p: int) -> Any:
    if image.ndim == 1:
        return lambda d, image, p: d
    return lambda d, image, p: subtract_row(d, image, p)


@exact
def move_spheres(c: Any, low: int, high: int, displacement: Any) -> float:  # pragma: no cover
    """Positions of the spheres ``low`` to ``high``; their greatest square way [m^2]."""
    far = 0.0
    for i in range(low, high):
        at, moved = c.spheres.place[i], 0.0
        for k in range(3):
            c.position[i, k] = c.spheres.reference[i, k] + displacement[at + k]
            moved += (c.position[i, k] - c.start[i, k]) ** 2
        far = max(far, moved)
    return far


@exact
def compute_pairs_forces(
    c: Any, low: int, high: int, velocity: Any, step: float
) -> float:  # pragma: no cover
    """Forces of the pairs of acting spheres on the first; deepest overlap over radius."""
    deepest = 0.0
    pairs, sphere = c.pairs, c.spheres
    for i in pairs.acting[low:high]:
        fx, fy, fz = 0.0, 0.0, 0.0
        for p in range(pairs.first[i], pairs.first[i + 1]):
            j = pairs.second[p]
            d = subtract_image(subtract_rows(c.position, i, c.position, j), pairs.image, p)
            square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2]
            reach = sphere.radius[i] + sphere.radius[j]
            open_now = square >= reach * reach
            if open_now and not pairs.touching[p]:
                continue
            apart = np.sqrt(square)
            overlap = max(reach - apart, 0.0)
            deepest = max(deepest, overlap / min(sphere.radius[i], sphere.radius[j]))
            inverse = 1.0 / apart if apart > 0.0 else 0.0  # no distance is too deep in any case
            n = d[0] * inverse, d[1] * inverse, d[2] * inverse
            push = add_in_series(sphere.normal[i], sphere.normal[j]) * overlap
            k_t = add_in_series(sphere.tangential[i], sphere.tangential[j])
            v, at, there = velocity, sphere.place[i], sphere.place[j]
            way = (
                step * (v[at] - v[there]), step * (v[at + 1] - v[there + 1]),
                step * (v[at + 2] - v[there + 2]),
            )  # fmt: skip
            s, loss = slide_spring(read_row(pairs.spring, p), n, way, k_t, c.friction * push)
            f = push * n[0] - k_t * s[0], push * n[1] - k_t * s[1], push * n[2] - k_t * s[2]
            c.slid[i] += loss
            pairs.touching[p] = not open_now  # where spheres part, nothing is left of the spring
            write_row(pairs.spring, p, s)
            write_row(pairs.pull, p, f)
            fx, fy, fz = fx + f[0], fy + f[1], fz + f[2]
        write_row(c.force, i, (fx, fy, fz))
    return deepest


@inlined
def add_in_series(one: float, other: float) -> float:  # pragma: no cover
    """`qdem_fem.contact.spheres.find_pair_stiffness`"""
    return 2.0 * one * other / (one + other)


@exact
def compute_planes_forces(
    c: Any, low: int, high: int, velocity: Any, step: float
) -> float:  # pragma: no cover
    """Add the forces of the walls on acting spheres near them; greatest overlap over radius."""
    planes, pairs, deepest = c.planes, c.pairs, 0.0
    for i in pairs.acting[low:high]:
        for entry in range(pairs.wall_first[i], pairs.wall_first[i + 1]):
            w = pairs.wall[entry]
            n, spring, force = read_row(planes.normal, w), planes.spring[w], planes.force[w]
            d, radius = subtract_rows(c.position, i, planes.point, w), c.spheres.radius[i]
            overlap = radius - (d[0] * n[0] + d[1] * n[1] + d[2] * n[2])
            if overlap <= 0.0 and force[i, 0] == 0.0 and force[i, 1] == 0.0 and force[i, 2] == 0.0:
                continue
            deepest = max(deepest, overlap / radius)
            push = 2.0 * c.spheres.normal[i] * max(overlap, 0.0)
            k_t = 2.0 * c.spheres.tangential[i]
            at = c.spheres.place[i]
            way = step * velocity[at], step * velocity[at + 1], step * velocity[at + 2]
            s, loss = slide_spring(read_row(spring, i), n, way, k_t, planes.friction[w] * push)
            f = push * n[0] - k_t * s[0], push * n[1] - k_t * s[1], push * n[2] - k_t * s[2]
            c.slid[i] += loss
            write_row(spring, i, s)
            write_row(force, i, f)
            for k in range(3):
                c.force[i, k] += f[k]
    return deepest


@exact
def add_reactions(c: Any, low: int, high: int) -> None:  # pragma: no cover
    """Take from each acting sphere what its pairs did to the first one of them."""
    pairs = c.pairs
    for j in pairs.acting[low:high]:
        for q in range(pairs.back_first[j], pairs.back_first[j + 1]):
            p = pairs.back_pair[q]
            if pairs.touching[p]:
                for k in range(3):
                    c.force[j, k] -= pairs.pull[p, k]


def build_advance(threads: bool) -> Any:
    """A step of contact for one thread, or for as many as numba is set to."""
    made_from = f"{threads} {digest_sources(compiling)}"

    @njit(error_model="numpy", cache=True, parallel=threads)
    def advance(c: Any, displacement: Any, velocity: Any, step: float) -> int:  # pragma: no cover
        """Contact at the new displacement; ``velocity`` times ``step`` [s] is the way to it.

        Writes forces, springs and losses of ``c``, a `Contact`.  ``step`` zero gives the forces
        of a state that no step led to.  Returns `GO_ON`, `TOO_DEEP`, or `LOOK_AGAIN` and has then
        moved the spheres and nothing else: it is to be called again with new pairs.
        """
        stamp = made_from  # noqa: F841  (makes it a part of the key: the two are one source)
        # a parallel loop of numba takes arrays only: tuples are taken apart, and made again within
        (a0, a1, a2, a3, a4, a5, a6), pairs, (w0, w1, w2, w3, w4) = c[:3]
        p0, p1, p2, p3, p4, p5, p6, p7, p8, p9, p10 = pairs
        friction, half_skin, start, position, force, slid = c[3:]
        count, acting = position.shape[0], p7.shape[0]
        blocks = (count + SPHERES_AT_ONCE - 1) // SPHERES_AT_ONCE
        far, deep = np.zeros(blocks), np.zeros(blocks)
        for stage in range(3):  # all spheres pass one stage before any begins the next
            for b in prange(blocks):
                own = Contact(
                    Spheres(a0, a1, a2, a3, a4, a5, a6),
                    Pairs(p0, p1, p2, p3, p4, p5, p6, p7, p8, p9, p10),
                    Planes(w0, w1, w2, w3, w4), friction, half_skin, start, position, force, slid,
                )  # fmt: skip
                size = count if stage == 0 else acting  # few act, or all: as many in every block
                low, high = size * b // blocks, size * (b + 1) // blocks
                if stage == 0:
                    far[b] = move_spheres(own, low, high, displacement)
                elif stage == 1:
                    deep[b] = max(
                        compute_pairs_forces(own, low, high, velocity, step),
                        compute_planes_forces(own, low, high, velocity, step),
                    )
                else:
                    add_reactions(own, low, high)
            if stage == 0 and far.max() > half_skin**2:
                return LOOK_AGAIN
        return TOO_DEEP if deep.max() >= DEEPEST else GO_ON

    return advance


advance_one: Any = build_advance(threads=False)
advance_threads: Any = build_advance(threads=True)
