"""Sums of all numbers before each, on a GPU: where rows of a list begin, from their lengths.

A thread adds a chunk of numbers one after the other; the sums of the chunks are summed in the same
way, and a second pass goes through every chunk from what stands before it.  No memory shared by a
block and no barrier: a look for pairs reads more than this does, and seldom is there one.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from qdem_fem.kernel.cuda.step import cuda, grid

NUMBERS_A_THREAD = 64
"""Numbers that one thread adds."""


@cuda.jit
def chunks_sum(values: Any, count: Any, sums: Any) -> None:
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


def sums_before(values: Any, count: int) -> Any:
    """Of ``values`` (at least count,) the sums of all before each, and of all, (count + 1,).

    Both on the GPU, int64; ``count`` is above zero.
    """
    chunks = -(-count // NUMBERS_A_THREAD)
    if chunks == 1:
        before = cuda.to_device(np.zeros(1, np.int64))
    else:
        sums = cuda.device_array(chunks, np.int64)
        chunks_sum[grid(chunks)](values, count, sums)
        before = sums_before(sums, chunks)
    first = cuda.device_array(count + 1, np.int64)
    scan_chunks[grid(chunks)](values, count, before, first)
    return first
