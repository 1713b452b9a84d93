"""Sums on a GPU: of all nodes, and of all numbers before each.

Energy and moment, which a march asks for behind every window: a thread adds every p-th node's
part, p threads in all, and the host adds the p sums: in a fixed order, and with a few of them to be
read in place of two fields.

Where rows of a list begin, from their lengths: a thread adds a chunk of numbers one after the
other; the sums of the chunks are summed in the same way, and a second pass goes through every chunk
from what stands before it.  No memory shared by a block and no barrier: a look for pairs reads more
than this does, and seldom is there one.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from qdem_fem.kernel.cuda.step import choose_grid, cuda

PARTS = 2048
"""Threads, at most."""
NUMBERS_A_THREAD = 64
"""Numbers that one thread adds."""


@cuda.jit
def sum_motion_parts(displacement: Any, velocity: Any, mass: Any, sums: Any) -> None:
    """``sums`` (p, 4) over every p-th node: of m v.v, of m u (3), in double precision.

    ``mass`` (n,) [kg]; fields flat, four numbers a node.
    """
    part = cuda.grid(1)
    if part >= sums.shape[0]:
        return
    energy, ux, uy, uz = 0.0, 0.0, 0.0, 0.0
    for node in range(part, mass.size, sums.shape[0]):
        m, at = mass[node], 4 * node
        px, py, pz = m * velocity[at], m * velocity[at + 1], m * velocity[at + 2]
        energy += px * velocity[at] + py * velocity[at + 1] + pz * velocity[at + 2]
        ux += m * displacement[at]
        uy += m * displacement[at + 1]
        uz += m * displacement[at + 2]
    sums[part, 0] = energy
    sums[part, 1], sums[part, 2], sums[part, 3] = ux, uy, uz


def sum_motion(displacement: Any, velocity: Any, mass: Any) -> NDArray[np.float64]:
    """`sum_motion_parts` of all nodes, (4,), on the host."""
    sums = cuda.device_array((min(PARTS, mass.size), 4))
    sum_motion_parts[choose_grid(sums.shape[0])](displacement, velocity, mass, sums)
    found: NDArray[np.float64] = sums.copy_to_host().sum(axis=0)
    return found


@cuda.jit
def sum_chunks(values: Any, count: Any, sums: Any) -> None:
    """The sum of every chunk of the first ``count`` values."""
    chunk = cuda.grid(1)
    if chunk < sums.size:
        total = 0
        for i in range(chunk * NUMBERS_A_THREAD, min((chunk + 1) * NUMBERS_A_THREAD, count)):
            total += values[i]
        sums[chunk] = total


@cuda.jit
def scan_chunks(values: Any, count: Any, before: Any, first: Any) -> None:
    """``first`` (count + 1,) from the sums ``before`` every chunk."""
    chunk = cuda.grid(1)
    if chunk * NUMBERS_A_THREAD < count:
        total, end = before[chunk], min((chunk + 1) * NUMBERS_A_THREAD, count)
        for i in range(chunk * NUMBERS_A_THREAD, end):
            first[i] = total
            total += values[i]
        if end == count:
            first[count] = total


def sum_before(values: Any, count: int) -> Any:
    """Of ``values`` (at least count,) the sums of all before each, and of all, (count + 1,).

    Both on the GPU, int64; ``count`` is above zero.
    """
    chunks = -(-count // NUMBERS_A_THREAD)
    if chunks == 1:
        before = cuda.to_device(np.zeros(1, np.int64))
    else:
        sums = cuda.device_array(chunks, np.int64)
        sum_chunks[choose_grid(chunks)](values, count, sums)
        before = sum_before(sums, chunks)
    first = cuda.device_array(count + 1, np.int64)
    scan_chunks[choose_grid(chunks)](values, count, before, first)
    return first
