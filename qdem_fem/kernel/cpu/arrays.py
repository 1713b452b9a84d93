"""The arrays that the compiled time step reads and writes: layout, state, loads, constraints."""

from typing import Any, NamedTuple


class Layout(NamedTuple):
    """Where the elements' data lie (`qdem_fem.kernel.cpu.build_layout`); integers are int64."""

    corners: Any  # 4 x node number of an element's nodes, (blocks x nodes x lanes,) int32
    rows: Any  # gradients [1/m] and Lame constants times volume [N m], (blocks x rows x lanes,)
    chunk_block: Any  # first block of every chunk, and the end, (chunks + 1,)
    chunk_shift: Any
    """Place of a node's force in the chunk's window, less 4 x its number, (chunks,)."""
    piece_first: Any  # first node of every piece of the motion, (pieces,)
    piece_stop: Any  # the node after its last, (pieces,)
    chunk_piece: Any
    """First of the pieces whose forces are in this chunk's window alone, (chunks + 1,); the
    pieces from the last entry on are in several windows."""
    piece_window: Any
    """First of the piece's entries in ``window_shift``, and the end, (pieces + 1,)."""
    window_shift: Any  # shifts of the windows that hold the piece's nodes


class QuadraticLayout(Layout):
    """`Layout` of quadratic elements; by the type of it their forces are chosen."""

    __slots__ = ()


class Fields(NamedTuple):
    """What moves: flat arrays of four numbers a node, in the kernel's precision."""

    displacement: Any  # [m]
    velocity: Any  # half a step behind the displacement [m/s]
    forces: Any  # the windows of the chunks, zero between steps [N]
    inverse_mass: Any  # (n,) [1/kg]


class Loads(NamedTuple):
    """Nodal forces: ``weight x table[k, series]`` [N] at one place of ``Fields.forces``."""

    force_at: Any  # (L,) int64, in the windows
    node_at: Any  # (L,) int64, in ``Fields.velocity``
    series: Any
    weight: Any


class Constraints(NamedTuple):
    """Components whose displacement is ``weight x table[k, series]`` [m]."""

    node_at: Any  # (C,) int64, in ``Fields.displacement``
    series: Any
    weight: Any
    previous: Any  # (C,) velocity given in the last step [m/s], to count the work of the motion
    roller_at: Any  # (R,) 4 x number of the nodes that stay in an oblique plane
    roller_normal: Any  # (R, 3) unit normals


class Probes(NamedTuple):
    """Nodes whose displacement is recorded every ``stride`` steps."""

    node_at: Any  # (Q,) 4 x node number
    record: Any  # (samples, Q, 3) [m]
    stride: int
    first: int  # steps of the window before its first sample
