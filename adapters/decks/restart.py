"""What LIGGGHTS keeps of a fix in its restart file: bodies of several spheres, corners of meshes.

Read and written in place, as a record of doubles behind the fix's name and style; found by
experiment in Debian's LIGGGHTS 3.8.0 and in its sources (``fix_multisphere.cpp``,
``multi_node_mesh_I.h``).
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from adapters.bed import FloatArray
from adapters.errors import EngineFailed

STONE_LENGTH, STONE_ID, CENTRE, VELOCITY, SPIN = 0, 4, slice(5, 8), slice(8, 11), slice(14, 17)
"""Columns of a body of several spheres: length of its record, identifier, centre [m], ..."""
ANGULAR, BOUND = slice(11, 14), slice(1, 4)
"""Its angular momentum, and the centre of the sphere around it [m]."""


def find_record(restart: bytearray, fix: str, style: str) -> FloatArray:
    """The doubles that a fix left in a restart file, a view that writes through, shape (d,).

    Raises `EngineFailed` where there is none of this name and style.
    """
    key = b"".join(struct.pack("<i", len(s) + 1) + s.encode() + b"\0" for s in (fix, style))
    start = restart.find(key) + len(key)
    if start < len(key) or start + 4 > len(restart):
        raise EngineFailed(f"the restart file holds nothing of fix {fix} {style}")
    size = struct.unpack_from("<i", restart, start)[0]
    if size < 0 or start + 4 + size > len(restart):
        raise EngineFailed(f"the restart file is cut inside of fix {fix} {style}")
    return np.frombuffer(restart, "<f8", size // 8, start + 4)


def find_corners(record: FloatArray) -> FloatArray:
    """Corners of a mesh's triangles in its record [m], a view of shape (t, 3, 3).

    Raises `EngineFailed` for a record whose triangles are not all of one length.
    """
    count, length = int(record[0]), int(record[3])
    end = 3 + count * length
    if count < 1 or length < 10 or end > len(record) or (record[3:end:length] != length).any():
        raise EngineFailed("the restart file keeps this mesh in a way that trackbed does not know")
    return record[3:end].reshape(count, length)[:, 1:10].reshape(count, 3, 3)


def measure_height(restart: Path, fix: str, style: str) -> float:
    """Mean height of a mesh's corners in a restart file [m]."""
    return float(
        find_corners(find_record(bytearray(restart.read_bytes()), fix, style))[..., 2].mean()
    )


def move_mesh(restart: bytearray, fix: str, style: str, rise: float) -> None:
    """Move a mesh by ``rise`` [m] along z: its corners and its points of reference."""
    record = find_record(restart, fix, style)
    count, length = int(record[0]), int(record[3])
    find_corners(record)
    rows = record[3 : 3 + count * length].reshape(count, length)
    rows[:, 3:10:3] += rise
    behind = 3 + count * length
    record[behind + 3] += rise
    record[behind + 7] += rise


def find_stones(restart: bytearray, fix: str) -> FloatArray:
    """Bodies of several spheres in the record of ``fix multisphere``, a view of shape (s, 55)."""
    record = find_record(restart, fix, "multisphere")
    return record[1:].reshape(int(record[0]), -1)


def move_stones(restart: bytearray, fix: str, identifier: FloatArray, shift: FloatArray) -> None:
    """Move whole bodies by ``shift`` (s, 3) [m], rotations left alone, and bring them to rest.

    ``identifier`` (s,) says whose each shift is.  The engine sets the spheres from the bodies.
    """
    stones = find_stones(restart, fix)
    rows = np.searchsorted(identifier, stones[:, STONE_ID])
    stones[:, CENTRE] += shift[rows]
    stones[:, BOUND] += shift[rows]
    for still in (VELOCITY, ANGULAR, SPIN):
        stones[:, still] = 0.0
