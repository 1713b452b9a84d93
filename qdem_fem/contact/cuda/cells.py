"""Cells of spheres on a GPU: the twin of `qdem_fem.contact.search.cells.fill_cells`, a thread a
sphere.

Spheres are put into the buckets of their hashed cells by a counting sort (Green, "Particle
simulation using CUDA", NVIDIA 2010).  Atomics do it: hardware settles the order within a bucket,
and who reads one must not mind.

A periodic width: sphere i, and its image beyond the upper side as entry c + i, as on the processor;
where there is no such image the entry is empty.
"""

from math import floor
from typing import Any, NamedTuple

import numpy as np

from qdem_fem.contact.search import PeriodicWidth
from qdem_fem.contact.search import cells as contact_cells
from qdem_fem.kernel.cuda import choose_grid, cuda, sum_before

find_cell_bucket: Any = cuda.jit(device=True)(contact_cells.find_cell_bucket.py_func)


class Entries(NamedTuple):
    """What stands in cells: spheres, and behind them in a periodic width their images."""

    at: Any  # (e, 3) where [m]
    turn: Any  # (e,) widths from there to the sphere
    there: Any  # (e,) uint8, whether there is one


class Cells(NamedTuple):
    """Entries by the bucket of their cell."""

    cell: Any  # (e, 3)
    start: Any  # first place in ``order`` of every bucket, and the end, (buckets + 1,)
    order: Any  # (e,) entries by bucket


@cuda.jit
def write_zeros(values: Any) -> None:
    """Whole numbers (n,) become zero."""
    i = cuda.grid(1)
    if i < values.size:
        values[i] = 0


@cuda.jit
def place_entries(
    position: Any, axis: Any, width: Any, near: Any, at: Any, turn: Any, there: Any
) -> None:
    """Entries of spheres as they are; with an ``axis`` wrapped into one width, and images of those
    ``near`` [m] its lower side beyond its upper one."""
    i = cuda.grid(1)
    count = position.shape[0]
    if i >= count:
        return
    there[i] = 1
    turn[i] = 0.0
    for c in range(3):
        at[i, c] = position[i, c]
    if axis < 0:
        return
    turns = floor(position[i, axis] / width)
    at[i, axis] -= turns * width
    turn[i] = turns
    for c in range(3):
        at[count + i, c] = at[i, c]
    at[count + i, axis] += width
    turn[count + i] = turns - 1
    there[count + i] = 1 if at[i, axis] <= near else 0


@cuda.jit
def count_cells(at: Any, there: Any, size: Any, cell: Any, bucket: Any, counts: Any) -> None:
    """Cells of side ``size`` [m] and buckets of entries; how many are in every bucket."""
    e = cuda.grid(1)
    if e < there.size and there[e] != 0:
        for c in range(3):
            cell[e, c] = floor(at[e, c] / size)
        bucket[e] = find_cell_bucket(cell[e, 0], cell[e, 1], cell[e, 2], counts.size)
        cuda.atomic.add(counts, bucket[e], 1)


@cuda.jit
def fill_cells(there: Any, bucket: Any, start: Any, counts: Any, order: Any) -> None:
    """Entries by bucket; ``counts`` go down to zero."""
    e = cuda.grid(1)
    if e < there.size and there[e] != 0:
        left = cuda.atomic.add(counts, bucket[e], -1)
        order[start[bucket[e]] + left - 1] = e


def find_entries(position: Any, near: float, side: PeriodicWidth | None) -> Entries:
    """Entries of spheres at (c, 3) [m], and of the images that lie ``near`` [m] the upper side."""
    count = position.shape[0]
    length = count if side is None else 2 * count
    entries = Entries(
        cuda.device_array((length, 3)), cuda.device_array(length),
        cuda.device_array(length, np.uint8),
    )  # fmt: skip
    axis, width = (-1, 1.0) if side is None else (side.number, side.width)
    place_entries[choose_grid(count)](position, axis, width, near, *entries)
    return entries


def find_cells(entries: Entries, size: float) -> Cells:
    """Cells of side ``size`` [m], at least two buckets to an entry."""
    length = entries.there.size
    cell, bucket = cuda.device_array((length, 3), np.int64), cuda.device_array(length, np.int64)
    counts = cuda.device_array(max(16, 1 << (2 * length - 1).bit_length()), np.int64)
    write_zeros[choose_grid(counts.size)](counts)
    count_cells[choose_grid(length)](entries.at, entries.there, size, cell, bucket, counts)
    start, order = sum_before(counts, counts.size), cuda.device_array(length, np.int64)
    fill_cells[choose_grid(length)](entries.there, bucket, start, counts, order)
    return Cells(cell, start, order)
