"""The look for pairs of spheres on a GPU beside that on the processor: the same lists."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from qdem_fem.contact.search.pairs import Pairs, find_near_walls, renew_pairs
from qdem_fem.contact.search.periodic import PeriodicWidth
from qdem_fem.contact.spheres.law import Contact, Planes, Spheres

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


def draw_cloud(
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


def make_contact(given: Cloud, seed: int) -> Contact:
    """Contact of a cloud where it was; some pairs and walls touch, and hold springs at random."""
    random, count, walls = np.random.default_rng(seed), len(given.radius), len(given.point)
    number, stiffness = np.arange(count), 1 + given.radius
    near = find_near_walls(given.before, given.radius, given.point, given.normal, given.skin)
    old = renew_pairs(None, given.before, given.radius, given.body, given.skin, near, given.side)
    old.touching[:] = random.random(len(old.second)) < 0.6
    springs = random.normal(size=(2, len(old.second), 3))
    held = random.normal(size=(2, walls, count, 3)) * (random.random((walls, count, 1)) < 0.3)
    return Contact(
        Spheres(given.before, 4 * number, 4 * number, given.body, given.radius, *(stiffness,) * 2),
        old._replace(spring=springs[0], pull=springs[1]),
        Planes(given.point, given.normal, np.ones(walls), *held), 0.5, given.skin / 2,
        given.before, given.before.copy(), np.zeros((count, 3)), np.zeros(count),
    )  # fmt: skip


def find_pairs_cpu(given: Cloud, seed: int) -> Pairs:
    """The list of a cloud where it is, with the history of the old one."""
    near = find_near_walls(given.position, given.radius, given.point, given.normal, given.skin)
    return renew_pairs(
        make_contact(given, seed).pairs, given.position, given.radius, given.body, given.skin, near,
        given.side,
    )  # fmt: skip


def find_pairs_gpu(given: Cloud, seed: int) -> Pairs:
    """`find_pairs_cpu`, found on a GPU."""
    from qdem_fem.contact.cuda.arrays import DeviceContact
    from qdem_fem.kernel.cuda.step import cuda

    contact = make_contact(given, seed)
    there = DeviceContact(contact, given.side)
    there.renew_lists(cuda.to_device(given.position), given.skin, given.skin / 2)
    found: Pairs = there.fetch(contact).pairs
    return found


def compare_lists(one: Pairs, other: Pairs) -> list[str]:
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


def compare_searches() -> dict[str, float]:
    """For every cloud zero where the lists are the same, infinity where they are not."""
    found = {}
    for seed, (name, asked) in enumerate(CLOUDS.items()):
        given = draw_cloud(seed, **asked)
        apart = compare_lists(find_pairs_cpu(given, seed), find_pairs_gpu(given, seed))
        found[f"pairs: {name}"] = float("inf") if apart else 0.0
    return found
