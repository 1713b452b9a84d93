"""Grains, bodies of several spheres and meshes moved in a restart file; springs stay as they are.

A sphere is known by its place, identifier and velocity, in this order as doubles, in LIGGGHTS and
LAMMPS.  What a fix of LIGGGHTS keeps is a record of doubles behind its name and style (Debian's
3.8.0: ``fix_multisphere.cpp``, ``multi_node_mesh_I.h``).
"""

import struct

import numpy as np
from scipy.spatial.transform import Rotation

from adapters.bed import FloatArray, IntArray
from adapters.errors import EngineFailed

STONE_ID, MASS = 4, 24
BOUND, CENTRE, VELOCITY = slice(1, 4), slice(5, 8), slice(8, 11)
MOMENTUM, SPIN = slice(11, 14), slice(14, 17)
QUATERNION, AXES = slice(17, 21), slice(28, 37)
"""Columns of a body of several spheres: centre of the sphere around it [m], its own centre [m],
velocity [m/s], angular momentum, angular velocity [rad/s], quaternion, principal axes."""
IMAGE, TURN = 6, np.array([1, 1 << 10, 1 << 20])
"""Where a sphere's periods are counted, and what one of each axis adds there."""


def find_record(restart: bytearray, fix: str, style: str) -> FloatArray:
    """The doubles that a fix left in a restart file, a view that writes through, shape (d,).

    Raises `EngineFailed` where there is no whole record of this name and style.
    """
    key = b"".join(struct.pack("<i", len(s) + 1) + s.encode() + b"\0" for s in (fix, style))
    start = restart.find(key) + len(key)
    size = 0 if start < len(key) else int.from_bytes(restart[start : start + 4], "little")
    if not 8 <= size <= len(restart) - start - 4:
        raise EngineFailed(f"the restart file holds no whole record of fix {fix} {style}")
    return np.frombuffer(restart, "<f8", size // 8, start + 4)


def find_mesh(restart: bytearray, fix: str, style: str) -> tuple[FloatArray, ...]:
    """Heights of a mesh's corners (t, 3) and of its points of reference [m], as views.

    ``mesh/surface`` has none of these, ``/stress`` two and ``/servo`` four.  Raises `EngineFailed`
    for no record, or one of a kind that is not known.
    """
    record = find_record(restart, fix, style)
    count, length = (int(x) for x in record[:4:3]) if len(record) > 3 else (0, 0)
    end = 3 + count * length
    if count < 1 or length < 10 or end > len(record) or (record[3:end:length] != length).any():
        raise EngineFailed("the restart file keeps this mesh in a way that trackbed does not know")
    corners, behind = record[3:end].reshape(count, length), record[end:]
    return corners[:, 3:10:3], behind[3:8:4], behind[13:18:4]


def find_stones(restart: bytearray, fix: str) -> FloatArray:
    """Bodies of several spheres in the record of ``fix multisphere``, a view of shape (s, 55)."""
    record = find_record(restart, fix, "multisphere")
    return record[1:].reshape(int(record[0]), -1)


def move_stones(
    restart: bytearray, fix: str, identifier: IntArray, shift: FloatArray,
    orientation: FloatArray | None = None,
) -> None:  # fmt: skip
    """Move whole bodies by ``shift`` (s, 3) [m] and bring them to rest; turn those that have
    another ``orientation``, quaternions (s, 4) with the real part first.

    ``identifier`` (s,), ascending, says whose each is.  The engine sets spheres from the bodies.
    """
    stones = find_stones(restart, fix)
    rows = np.searchsorted(identifier, stones[:, STONE_ID])
    for place in (CENTRE, BOUND):
        stones[:, place] += shift[rows]
    for still in (VELOCITY, MOMENTUM, SPIN):
        stones[:, still] = 0.0
    if orientation is not None:
        turned = np.flatnonzero((stones[:, QUATERNION] != orientation[rows]).any(axis=1))
        stones[turned, QUATERNION] = new = orientation[rows[turned]]
        axes = Rotation.from_quat(np.roll(new, -1, axis=1)).as_matrix().transpose(0, 2, 1)
        stones[turned, AXES] = axes.reshape(-1, 9)


def move_grains(
    restart: bytearray, identifier: IntArray, place: FloatArray, velocity: FloatArray,
    shift: FloatArray, period: FloatArray,
) -> None:  # fmt: skip
    """Move spheres by ``shift`` (n, 3) and bring them to rest; their spins go on.

    ``identifier`` (n,), ascending, ``place`` (n, 3) as folded into the box and ``velocity`` (n, 3)
    are those of the file in its units, to the last bit.  ``period``: low and high side of the box
    (3, 2), nan where it has no period; who leaves at one side comes in at the other, and the file
    counts it.  Raises `EngineFailed` unless each sphere is found there, once.
    """
    low, edge = period[:, 0], period[:, 1] - period[:, 0]
    turns = np.nan_to_num(np.floor((place + shift - low) / edge)).astype(int)
    shift = shift - turns * np.nan_to_num(edge)
    found = np.zeros(len(identifier), int)
    for offset in range(8):  # the engines align nothing
        doubles = np.frombuffer(restart, "<f8", (len(restart) - offset) // 8, offset)
        at = np.flatnonzero(np.isin(doubles[:-9], place[:, 0]))
        for tags in (doubles, doubles.view("<i8")):  # LIGGGHTS and LAMMPS write them so
            row = np.searchsorted(identifier, tags[at + 3]).clip(max=len(identifier) - 1)
            known = np.column_stack([identifier[row], place[row], velocity[row]])
            read = [tags[at + 3], *(doubles[at + k] for k in (0, 1, 2, 7, 8, 9))]
            same = (known == np.column_stack(read)).all(axis=1)
            for k in range(3):
                doubles[at[same] + k] += shift[row[same], k]
                doubles[at[same] + 7 + k] = 0.0
            tags[at[same] + IMAGE] += turns[row[same]] @ TURN
            found += np.bincount(row[same], minlength=len(found))
    if (found != 1).any():
        raise EngineFailed("the restart file keeps grains in a way that trackbed does not know")
