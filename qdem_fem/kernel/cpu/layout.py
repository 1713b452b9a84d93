"""From a mesh to the kernel's arrays: order, chunks, windows of forces, pieces of the motion."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import DTypeLike, NDArray

from qdem_fem.files import Integers
from qdem_fem.kernel.cpu.arrays import Layout
from qdem_fem.kernel.cpu.lanes import count_lane
from qdem_fem.kernel.cpu.ordering import order_for_locality

ALIGNMENT = 64  # bytes of a cache line: a node's four numbers never straddle two of them
LARGE_PAGE = 1 << 21  # bytes of a large page of memory
Floats = NDArray[np.floating]


@dataclass(frozen=True)
class LayoutNumbers:
    """Sizes of what threads share, and the order of elements."""

    parallel_elements: int = 2_048  # fewer make one chunk [-]
    chunk_elements: int = 32_768  # of a chunk [-],
    least_chunks: int = 4  # but so many chunks at least
    most_chunks: int = 256  # and at most
    piece_nodes: int = 2_048  # of a piece of the motion, at most [-]
    interleave: int = 16  # a block's elements stand so far apart in order: few share a node [-]


LAYOUT = LayoutNumbers()


def make_aligned_zeros(count: int, dtype: DTypeLike) -> Floats:
    """Zeros that begin on a cache line, or, if there are many, on a large page.

    NumPy asks the system for large pages where it does not clear the memory itself; they spare
    translations of addresses.
    """
    kind = np.dtype(dtype)
    size = count * kind.itemsize
    alignment = ALIGNMENT if size < LARGE_PAGE // 2 else LARGE_PAGE
    raw = np.empty(size + 2 * alignment, dtype=np.uint8)
    start = -raw.ctypes.data % alignment
    zeros = raw[start : start + size].view(kind)
    zeros[:] = 0
    return zeros


def count_chunks(n_elements: int) -> int:
    """Chunks of a mesh: a number of the mesh alone, so that results do not depend on threads."""
    if n_elements < LAYOUT.parallel_elements:
        return 1
    wanted = max(LAYOUT.least_chunks, min(LAYOUT.most_chunks, n_elements // LAYOUT.chunk_elements))
    return 1 << (wanted.bit_length() - 1)


@dataclass(frozen=True)
class Packed:
    """A mesh in the kernel's order."""

    layout: Layout
    node_order: Integers  # user's number of every kernel node, (n,)
    node_place: Integers  # kernel's number of every user node, (n,)
    window_count: int  # numbers in the windows of forces
    node_window: Integers
    """A shift of a window that holds the node, by kernel number, (n,); -1 for unused nodes."""


def build_layout(
    elements: Integers, n_nodes: int, element_rows: Floats, dtype: DTypeLike,
    loose: Integers | None = None,
) -> Packed:  # fmt: skip
    """Order a mesh for locality and lay its data out in blocks of lanes.

    ``loose``: nodes of no element that forces act on all the same, in a window of their own
    that no piece of the motion looks at.

    ``elements`` (m, 4), or a multiple of four; ``element_rows`` (m, 11 or 13): gradients of
    corners 1 to 3 [1/m], then Lame constants and viscosities times volume.  The last block is
    filled up with copies of the last element that have no stiffness.
    """
    node_order, element_order = order_for_locality(elements, n_nodes)
    node_place = np.empty(n_nodes, dtype=np.int64)
    node_place[node_order] = np.arange(n_nodes)
    lanes = count_lane(np.dtype(dtype))
    element_order = _interleave(element_order, lanes)
    m = len(element_order)
    if not m:
        return _add_loose(_make_empty_layout(node_order, node_place, element_rows), loose)
    blocks = -(-m // lanes)
    filled = np.concatenate([element_order, np.full(blocks * lanes - m, element_order[-1])])

    corners = node_place[elements[filled]].reshape(blocks, lanes, -1)
    width = element_rows.shape[1]
    rows = make_aligned_zeros(blocks * width * lanes, dtype)
    by_block = rows.reshape(blocks, width, lanes)
    by_block[:] = element_rows[filled].reshape(blocks, lanes, width).transpose(0, 2, 1)
    by_block[-1, 9:, lanes - (blocks * lanes - m) :] = 0.0

    chunks = min(count_chunks(m), blocks)
    chunk_block = blocks * np.arange(chunks + 1) // chunks
    window_low = np.minimum.reduceat(corners.min(axis=(1, 2)), chunk_block[:-1])
    window_stop = np.maximum.reduceat(corners.max(axis=(1, 2)), chunk_block[:-1]) + 1
    # a cache line between the windows keeps two threads from writing to the same one
    sizes = 4 * (window_stop - window_low) + ALIGNMENT // 4
    sizes += -sizes % (ALIGNMENT // 4)
    starts = np.concatenate([[0], np.cumsum(sizes)])
    chunk_shift = starts[:-1] - 4 * window_low

    used = int(window_stop.max())
    cuts = np.unique(
        np.concatenate([window_low, window_stop, np.arange(0, used, LAYOUT.piece_nodes), [0, used]])
    )
    holds = (window_low <= cuts[:-1, None]) & (window_stop >= cuts[1:, None])
    chunk_of = np.where(holds.sum(axis=1) == 1, np.argmax(holds, axis=1), chunks)
    held = np.flatnonzero(holds.any(axis=1))  # a node between two windows is in no element
    order = held[np.argsort(chunk_of[held], kind="stable")]
    piece, window = np.nonzero(holds[order])
    node_window = np.full(n_nodes, -1, dtype=np.int64)
    for k in held:
        node_window[cuts[k] : cuts[k + 1]] = chunk_shift[np.argmax(holds[k])]
    layout = Layout(
        corners=np.ascontiguousarray(4 * corners.transpose(0, 2, 1)).astype(np.int32).ravel(),
        rows=rows,
        chunk_block=chunk_block.astype(np.int64),
        chunk_shift=chunk_shift.astype(np.int64),
        piece_first=cuts[:-1][order].astype(np.int64),
        piece_stop=cuts[1:][order].astype(np.int64),
        chunk_piece=np.searchsorted(chunk_of[order], np.arange(chunks + 1)).astype(np.int64),
        piece_window=np.searchsorted(piece, np.arange(len(order) + 1)).astype(np.int64),
        window_shift=chunk_shift[window].astype(np.int64),
    )
    packed = Packed(layout, node_order, node_place, int(starts[-1]), node_window)
    return _add_loose(packed, loose)


def _make_empty_layout(node_order: Integers, node_place: Integers, element_rows: Floats) -> Packed:
    """The layout without any element: no chunk, no piece."""
    none, end = np.zeros(0, np.int64), np.zeros(1, np.int64)
    corners = np.zeros(0, np.int32)
    layout = Layout(corners, element_rows.ravel(), end, none, none, none, end, end.copy(), none)
    return Packed(layout, node_order, node_place, 0, np.full(len(node_order), -1))


def _add_loose(packed: Packed, loose: Integers | None) -> Packed:
    """A window more, for the forces on ``loose`` nodes."""
    if loose is None or not len(loose):
        return packed
    place, start = packed.node_place[loose], packed.window_count
    window = packed.node_window.copy()
    window[place] = start + 4 * (np.arange(len(place)) - place)
    return replace(packed, window_count=start + 4 * len(place), node_window=window)


def _interleave(order: Integers, lanes: int) -> Integers:
    """Take the lanes of a block from `LAYOUT.interleave` elements apart."""
    tile = lanes * LAYOUT.interleave
    whole = len(order) // tile * tile
    tiles = order[:whole].reshape(-1, lanes, LAYOUT.interleave).transpose(0, 2, 1)
    return np.concatenate([tiles.ravel(), order[whole:]])
