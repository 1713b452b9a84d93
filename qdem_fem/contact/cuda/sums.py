"""What a march asks of contact on a GPU between its steps: one number each, found there.

Greatest values are taken by atomics, which no order changes; the sums of springs are in no order.
"""

from math import isinf, isnan, sqrt
from typing import Any

import numpy as np

from qdem_fem.contact.cuda.law import series
from qdem_fem.contact.spheres import Contact
from qdem_fem.kernel.cuda import choose_grid, cuda


@cuda.jit
def write_positions(
    reference: Any, place: Any, displacement: Any, position: Any, astray: Any
) -> None:
    """Positions of the spheres; ``astray`` (1,) is one where one is no number."""
    i = cuda.grid(1)
    if i < place.size:
        for c in range(3):
            x = reference[i, c] + displacement[place[i] + c]
            position[i, c] = x
            if isnan(x) or isinf(x):
                astray[0] = 1


@cuda.jit
def write_extents(position: Any, axis: Any, first: Any, size: Any) -> None:
    """`qdem_fem.contact.search.find_extents`, a thread a body."""
    b = cuda.grid(1)
    if b >= size.size:
        return
    low, high = np.inf, -np.inf
    for i in range(first[b], first[b + 1]):
        low, high = min(low, position[i, axis]), max(high, position[i, axis])
    size[b] = max(high - low, 0.0)


@cuda.jit
def find_greatest_gap(
    position: Any, radius: Any, first: Any, second: Any, touching: Any, image: Any, periodic: Any,
    point: Any, normal: Any, force: Any, walls: Any, greatest: Any,
) -> None:  # fmt: skip
    """The greatest gap of what touched in the last step, of each sphere."""
    i = cuda.grid(1)
    if i >= radius.size:
        return
    gap = 0.0
    for p in range(first[i], first[i + 1]):
        if touching[p] != 0:
            square = 0.0
            for c in range(3):
                d = position[i, c] - position[second[p], c]
                if periodic:
                    d -= image[p, c]
                square += d * d
            gap = max(gap, sqrt(square) - (radius[i] + radius[second[p]]))
    for w in range(walls):
        if force[w, i, 0] != 0.0 or force[w, i, 1] != 0.0 or force[w, i, 2] != 0.0:
            apart = 0.0
            for c in range(3):
                apart += (position[i, c] - point[w, c]) * normal[w, c]
            gap = max(gap, apart - radius[i])
    if gap > 0.0:
        cuda.atomic.max(greatest, 0, gap)


@cuda.jit
def add_idle(first: Any, touching: Any, count: Any) -> None:
    """Add to ``count`` (1,) the pairs of each sphere that do not touch."""
    i = cuda.grid(1)
    if i < first.size - 1:
        idle = 0
        for p in range(first[i], first[i + 1]):
            if touching[p] == 0:
                idle += 1
        if idle > 0:
            cuda.atomic.add(count, 0, idle)


@cuda.jit
def sum_springs(
    first: Any, second: Any, touching: Any, stiffness: Any, force: Any, walls: Any, total: Any,
    walled: Any,
) -> None:  # fmt: skip
    """Add the ``k_n`` [N/m] of all contacts at each sphere; ``walled``: whether walls are there."""
    i = cuda.grid(1)
    if i >= walled.size:
        return
    own = 0.0
    for w in range(walls):
        if force[w, i, 0] != 0.0 or force[w, i, 1] != 0.0 or force[w, i, 2] != 0.0:
            own += 2.0 * stiffness[i]
    walled[i] = 1 if own > 0.0 else 0
    for p in range(first[i], first[i + 1]):
        if touching[p] != 0:
            j = second[p]
            k = series(stiffness[i], stiffness[j])
            own += k
            cuda.atomic.add(total, j, k)
    if own > 0.0:
        cuda.atomic.add(total, i, own)


@cuda.jit
def bound_greatest(
    first: Any, second: Any, touching: Any, total: Any, walled: Any, inverse_mass: Any,
    greatest: Any,
) -> None:  # fmt: skip
    """`qdem_fem.contact.bounds.bound_spring_network` of the springs summed at each sphere."""
    i = cuda.grid(1)
    if i >= walled.size:
        return
    own = total[i] * inverse_mass[i]
    bound = own if walled[i] != 0 else 0.0
    for p in range(first[i], first[i + 1]):
        if touching[p] != 0:
            j = second[p]
            bound = max(bound, own + total[j] * inverse_mass[j])
    if bound > 0.0:
        cuda.atomic.max(greatest, 0, bound)


def find_positions(c: Contact, displacement: Any) -> bool:
    """Write the spheres' positions; whether all are numbers."""
    astray = cuda.to_device(np.zeros(1, np.int32))
    count = c.spheres.place.size
    write_positions[choose_grid(count)](
        c.spheres.reference, c.spheres.place, displacement, c.position, astray
    )
    return not astray.copy_to_host()[0]


def find_device_extents(position: Any, axis: int, first: Any) -> Any:
    """`qdem_fem.contact.search.find_extents` of bodies along an axis [m], (bodies,), on the host.

    ``position`` (c, 3) [m] and ``first`` (bodies + 1,) on the GPU.
    """
    bodies = first.size - 1
    size = cuda.device_array(bodies)
    write_extents[choose_grid(bodies)](position, axis, first, size)
    return size.copy_to_host()


def find_gap(c: Contact, position: Any, walls: int) -> float:
    """By how much what touched in the last step is apart at (c, 3) [m]; at least nothing."""
    greatest, count = cuda.to_device(np.zeros(1)), c.spheres.radius.size
    pairs, planes = c.pairs, c.planes
    periodic = pairs.image.ndim > 1
    image = pairs.image if periodic else position  # not looked at
    find_greatest_gap[choose_grid(count)](
        position, c.spheres.radius, pairs.first, pairs.second, pairs.touching, image, periodic,
        planes.point, planes.normal, planes.force, walls, greatest,
    )  # fmt: skip
    return float(greatest.copy_to_host()[0])


def count_idle(c: Contact) -> int:
    """Pairs of the list that do not touch."""
    count = cuda.to_device(np.zeros(1, np.int64))
    add_idle[choose_grid(c.spheres.radius.size)](c.pairs.first, c.pairs.touching, count)
    return int(count.copy_to_host()[0])


def bound_present(c: Contact, walls: int, inverse_mass: Any) -> float:
    """`qdem_fem.contact.bounds.bound_spring_network` of all that touches [1/s^2], no body rigid.

    ``inverse_mass`` (c,) [1/kg], on the GPU.
    """
    count, pairs = c.spheres.radius.size, c.pairs
    greatest, total = cuda.to_device(np.zeros(1)), cuda.to_device(np.zeros(count))
    walled = cuda.device_array(count, np.uint8)
    listed = pairs.first, pairs.second, pairs.touching
    sum_springs[choose_grid(count)](*listed, c.spheres.normal, c.planes.force, walls, total, walled)
    bound_greatest[choose_grid(count)](*listed, total, walled, inverse_mass, greatest)
    return float(greatest.copy_to_host()[0])
