"""The look for pairs of spheres on a GPU beside that on the processor: the same lists."""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray

from qdem_fem.contact_kernel import Contact, Planes, Spheres
from qdem_fem.contact_search import Pairs, pairs_renew, walls_near
from qdem_fem.contact_spheres import pair_stiffness
from qdem_fem.contact_step import network_bound
from qdem_fem.periodic import PeriodicWidth, extents

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Cloud(NamedTuple):
    """Spheres that have moved since their list was made, and walls."""

    before: Floats
    """(c, 3) where the old list was made [m]"""
    position: Floats
    """(c, 3) [m]"""
    radius: Floats
    """(c,) [m]"""
    body: Integers
    """(c,)"""
    point: Floats
    """(w, 3) of walls [m]"""
    normal: Floats
    """(w, 3)"""
    skin: float
    """[m]"""
    side: PeriodicWidth | None = None


def cloud(
    seed: int, count: int, *, room: float = 3.0, ratio: float = 2.0, bodies: int = 4,
    walls: int = 2, skin: float = 0.3, axis: str = "", same: float = 0.0,
) -> Cloud:  # fmt: skip
    """Spheres at random within ``room`` [m] in each direction, about a point that is not zero.

    Radii are 0.5 m to ``ratio`` times less; a share ``same`` of the spheres is where others are.
    Along a periodic ``axis`` they are as far as three widths, of just above two reaches, away.
    """
    random = np.random.default_rng(seed)
    position = random.uniform(-3.0, 0.0, 3) + random.uniform(0.0, room, (count, 3))
    twins = random.random(count) < same
    position[twins] = position[random.integers(0, count, twins.sum())]
    side = None
    if axis:
        side = PeriodicWidth(axis, 2.01 * (1 + skin) + room)  # type: ignore[arg-type]
        position[:, side.number] += side.width * random.integers(-3, 4, count)
    normal = random.normal(size=(walls, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    return Cloud(
        position + random.normal(0.0, 0.2 * skin, (count, 3)),
        position,
        random.uniform(0.5 / ratio, 0.5, count),
        random.integers(0, bodies, count),
        position[random.integers(0, count, walls)] - 0.5 * normal,
        normal,
        skin,
        side,
    )


def contact_of(given: Cloud, seed: int) -> Contact:
    """Contact of a cloud where it was; some pairs and walls touch, and hold springs at random."""
    random, count, walls = np.random.default_rng(seed), len(given.radius), len(given.point)
    number, stiffness = np.arange(count), 1 + given.radius
    near = walls_near(given.before, given.radius, given.point, given.normal, given.skin)
    old = pairs_renew(None, given.before, given.radius, given.body, given.skin, near, given.side)
    old.touching[:] = random.random(len(old.second)) < 0.6
    springs = random.normal(size=(2, len(old.second), 3))
    held = random.normal(size=(2, walls, count, 3)) * (random.random((walls, count, 1)) < 0.3)
    return Contact(
        Spheres(given.before, 4 * number, 4 * number, given.body, given.radius, *(stiffness,) * 2),
        old._replace(spring=springs[0], pull=springs[1]),
        Planes(given.point, given.normal, np.ones(walls), *held), 0.5, given.skin / 2,
        given.before, given.before.copy(), np.zeros((count, 3)), np.zeros(count),
    )  # fmt: skip


def lists_processor(given: Cloud, seed: int) -> Pairs:
    """The list of a cloud where it is, with the history of the old one."""
    near = walls_near(given.position, given.radius, given.point, given.normal, given.skin)
    return pairs_renew(
        contact_of(given, seed).pairs, given.position, given.radius, given.body, given.skin, near,
        given.side,
    )  # fmt: skip


def lists_gpu(given: Cloud, seed: int) -> Pairs:
    """`lists_processor`, found on a GPU."""
    from qdem_fem.cuda_contact_state import DeviceContact
    from qdem_fem.cuda_step import cuda

    contact = contact_of(given, seed)
    there = DeviceContact(contact, given.side)
    there.lists_renew(cuda.to_device(given.position), given.skin, given.skin / 2)
    found: Pairs = there.fetch(contact).pairs
    return found


def lists_gpu_shuffled(given: Cloud, seed: int) -> Pairs:
    """`lists_gpu` with every bucket of cells in another order, as hardware may leave it."""
    from qdem_fem import cuda_cells, cuda_search

    random, in_order = np.random.default_rng(seed), cuda_cells.cells_of

    def shuffled(*asked: Any) -> Any:
        cells = in_order(*asked)
        start, order = cells.start.copy_to_host(), cells.order.copy_to_host()
        for low, high in pairwise(start):
            order[low:high] = random.permutation(order[low:high])
        cells.order.copy_to_device(order)
        return cells

    with patch.object(cuda_search, "cells_of", shuffled):
        return lists_gpu(given, seed)


class Sums(NamedTuple):
    """What a march asks between its steps."""

    gap: float
    """Greatest of what touched [m]."""
    bound: float
    """On omega^2 of what touches [1/s^2]."""
    extents: Floats
    """(b,) of bodies along y [m]"""
    finite: bool
    """Whether all spheres are at numbers."""


def sums_gpu(given: Cloud, seed: int, first: Integers, lost: bool) -> Sums:
    """`Sums` on a GPU of bodies that begin at ``first`` (b + 1,); one vertex may be ``lost``."""
    from qdem_fem.cuda_contact_state import DeviceContact
    from qdem_fem.cuda_contact_sums import extents_of
    from qdem_fem.cuda_step import cuda

    there = DeviceContact(contact_of(given, seed), given.side)
    moved = np.zeros((len(given.radius), 4))
    moved[:, :3] = given.position - given.before
    moved[len(moved) // 2, 1] += np.inf if lost else 0.0
    position, own = cuda.to_device(given.position), np.arange(len(given.radius)) % 3 != 0
    return Sums(
        there.gap(position),
        there.bound(cuda.to_device(1 + given.radius)),
        extents_of(position, 1, cuda.to_device(own), cuda.to_device(first)),
        there.positions(cuda.to_device(moved.ravel())) is not None,
    )


def sums_processor(given: Cloud, seed: int, first: Integers) -> Sums:
    """`sums_gpu`, of no lost vertex, by array."""
    contact, x = contact_of(given, seed), given.position
    pairs, walls = contact.pairs, contact.planes.force.any(axis=2)
    row = np.repeat(np.arange(len(x)), np.diff(pairs.first))
    ends = np.column_stack([row, pairs.second])[pairs.touching.astype(bool)]
    between = x[ends[:, 0]] - x[ends[:, 1]]
    if given.side is not None:
        between -= pairs.image[pairs.touching.astype(bool)]
    gaps = [np.linalg.norm(between, axis=1) - given.radius[ends].sum(axis=1)]
    for held, point, normal in zip(walls, given.point, given.normal, strict=True):
        gaps.append((x[held] - point) @ normal - given.radius[held])
    stiffness = contact.spheres.normal
    return Sums(
        np.concatenate(gaps).max(initial=0.0),
        network_bound(
            ends, pair_stiffness(*stiffness[ends.T]), 2 * stiffness * walls.sum(axis=0),
            1 + given.radius,
        ),
        extents(x[:, 1], np.arange(len(x)) % 3 != 0, first),
        True,
    )  # fmt: skip


def sums_before(values: Integers) -> Integers:
    """`qdem_fem.cuda_scan.sums_before` of (n,) on a GPU."""
    from qdem_fem import cuda_scan
    from qdem_fem.cuda_step import cuda

    found: Integers = cuda_scan.sums_before(cuda.to_device(values), len(values)).copy_to_host()
    return found


def motion_summed(displacement: Floats, velocity: Floats, mass: Floats, parts: int) -> Floats:
    """`qdem_fem.cuda_sums.motion_summed` of fields (n, 4) by so many threads on a GPU."""
    from qdem_fem import cuda_sums
    from qdem_fem.cuda_step import cuda

    with patch.object(cuda_sums, "PARTS", parts):
        return cuda_sums.motion_summed(
            *(cuda.to_device(array.ravel()) for array in (displacement, velocity, mass))
        )


def simulator_begin() -> None:
    """Small blocks: in numba's simulator every thread of a block costs, at work or not."""
    from qdem_fem import cuda_step

    cuda_step.BLOCK = 8


def differing(one: Pairs, other: Pairs) -> list[str]:
    """Names of the arrays of two lists that are not the same, number by number."""
    return [
        name
        for name in Pairs._fields
        if not np.array_equal(getattr(one, name), getattr(other, name))
        or getattr(one, name).dtype != getattr(other, name).dtype
    ]


CLOUDS: dict[str, dict[str, Any]] = {
    "a cloud": {"count": 40},
    "radii of one to ten": {"count": 60, "ratio": 10.0},
    "spheres in one place": {"count": 30, "same": 0.5},
    "one sphere": {"count": 1},
    "no pairs": {"count": 20, "room": 1e4},
    "one body": {"count": 20, "bodies": 1},
    "no walls": {"count": 20, "walls": 0},
    "a width along x": {"count": 40, "axis": "x"},
    "a width along z, no walls": {"count": 40, "axis": "z", "walls": 0},
}
"""Clouds by name, as `cloud` takes them."""


def searches_compare() -> dict[str, float]:
    """For every cloud zero where the lists are the same, infinity where they are not."""
    found = {}
    for seed, (name, asked) in enumerate(CLOUDS.items()):
        given = cloud(seed, **asked)
        apart = differing(lists_processor(given, seed), lists_gpu(given, seed))
        found[f"pairs: {name}"] = float("inf") if apart else 0.0
    return found
