"""Shapes of all bodies in space as flat arrays, in their body frames and placed in the world."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit

from rigid_lcp.arrays import Bools, Floats, Ints
from rigid_lcp.contact.arrays import FEATURE_BITS
from rigid_lcp.contact.near_pairs import HALF_SPACE
from rigid_lcp.contact.separation import POLYHEDRA, Solids
from rigid_lcp.errors import SceneError, ShapeError
from rigid_lcp.shapes import HalfSpace, Polyhedron, Sphere, vectors

POLYHEDRON, SPHERE = 0, 1
"""Kinds of shapes as the kernels know them, with `HALF_SPACE`."""
MOST_EDGES = 1 << (FEATURE_BITS - 1)
"""Edges a polyhedron may have, so that the names of its contacts stay apart."""


@dataclass(frozen=True)
class Shapes3D:
    """Shapes of all bodies in flat arrays, in their own frames: what the kernels read."""

    kind: Ints
    reach: Floats  # radius of a sphere, offset of a half-space, farthest corner of a polyhedron [m]
    solids: Solids  # polyhedra in their body frames; a half-space has its normal as its only face
    movable: Bools  # pairs of bodies that can not move are never looked at


def pack_shapes_3d(
    shapes: Sequence[object], movable: Bools, called: Callable[[int], str] = "body {}".format
) -> Shapes3D:
    """Flat arrays of polyhedra, spheres and half-spaces; `SceneError` for any other shape.

    ``called``: the name of a body for messages, by its number.  Raises `ShapeError` for a
    polyhedron whose faces do not meet edge to edge.
    """
    kind, reach, parts = [], [], []
    for number, shape in enumerate(shapes):
        where = called(number)
        if isinstance(shape, Polyhedron):
            kind.append(POLYHEDRON)
            reach.append(shape.reach)
            try:
                edges = len(shape.edges)
            except ShapeError as error:
                raise error.relocate(where) from error
            if edges + 2 > MOST_EDGES:  # as many faces and corners together
                raise SceneError(
                    f"it has {edges} edges", where=where,
                    remedy=f"use at most {MOST_EDGES - 2}, or a sphere",
                )  # fmt: skip
            parts.append(_pack_solid(shape))
        elif isinstance(shape, Sphere):
            kind.append(SPHERE)
            reach.append(shape.radius)
            parts.append(_pack_bare(np.zeros((0, 3)), np.zeros(0)))
        elif isinstance(shape, HalfSpace) and shape.dim == 3:
            kind.append(HALF_SPACE)
            reach.append(shape.offset)
            parts.append(_pack_bare(shape.normal[None], np.array([shape.offset])))
        else:
            raise SceneError(
                f"it is no shape in space ({type(shape).__name__})", where=where,
                remedy="use Polyhedron, Sphere or HalfSpace with a normal of three numbers",
            )  # fmt: skip
    return Shapes3D(
        np.array(kind, dtype=np.int64), np.array(reach, dtype=float), _join_solids(parts),
        np.asarray(movable, dtype=bool),
    )  # fmt: skip


def _pack_bare(normals: Floats, offsets: Floats) -> Solids:
    """No corners and no edges."""
    none, no_vectors = np.zeros(0, dtype=np.int64), np.zeros((0, 3))
    return Solids(
        np.array([0, 0]), no_vectors, np.array([0, len(normals)]), normals, offsets,
        np.zeros(len(normals), dtype=np.int64), none, np.array([0, 0]),
        np.zeros((0, 2), dtype=np.int64), no_vectors, np.zeros(0), np.zeros(0),
    )  # fmt: skip


def _pack_solid(shape: Polyhedron) -> Solids:
    edges = shape.edges
    first, second = shape.normals[edges[:, 2]], shape.normals[edges[:, 3]]
    bisector = first + second
    bisector /= np.linalg.norm(bisector, axis=1)[:, None]
    sine = np.linalg.norm(np.cross(first, bisector), axis=1)
    opening = np.arctan2(sine, (first * bisector).sum(axis=1))
    return Solids(
        np.array([0, len(shape.vertices)]), shape.vertices,
        np.array([0, len(shape.faces)]), shape.normals, shape.distances,
        np.cumsum([len(loop) for loop in shape.faces]), np.concatenate(shape.faces),
        np.array([0, len(edges)]), np.ascontiguousarray(edges[:, :2]), bisector,
        np.cos(opening + POLYHEDRA.tilt), np.cos(opening + POLYHEDRA.nearly_opposite),
    )  # fmt: skip


def _join_solids(parts: Sequence[Solids]) -> Solids:
    """The parts one after the other; their ``first_corner`` hold where each face's loop ends."""
    arrays = [np.concatenate(part) for part in zip(*parts, strict=True)]
    firsts = [
        np.concatenate([[0], np.cumsum([getattr(part, name)[1] for part in parts])])
        for name in ("first_vertex", "first_face", "first_edge")
    ]
    loops = np.cumsum([0, *(len(part.loop) for part in parts)])
    ends = np.concatenate(
        [part.first_corner + start for part, start in zip(parts, loops[:-1], strict=True)]
    )
    joined = Solids(*(np.ascontiguousarray(array) for array in arrays))
    return joined._replace(
        first_vertex=firsts[0].astype(np.int64), first_face=firsts[1].astype(np.int64),
        first_edge=firsts[2].astype(np.int64),
        first_corner=np.concatenate([[0], ends]).astype(np.int64),
    )  # fmt: skip


def place_solids(shapes: Shapes3D, position: Floats, quaternion: Floats) -> Solids:
    """Polyhedra in the world frame; half-spaces are there already."""
    vertex, normal, offset, bisector = _place_features(
        shapes.solids, shapes.kind == HALF_SPACE, position, quaternion
    )
    return shapes.solids._replace(vertex=vertex, normal=normal, offset=offset, bisector=bisector)


@njit(cache=True)
def _place_features(
    solids: Solids, still: Bools, position: Floats, quaternion: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """Corners, normals and offsets of faces, and bisectors of edges, in the world frame."""
    vertex, normal = solids.vertex.copy(), solids.normal.copy()
    offset, bisector = solids.offset.copy(), solids.bisector.copy()
    for body in range(len(still)):
        if still[body]:
            continue
        turn = vectors.make_rotation(vectors.read_turn(quaternion, body))
        x = vectors.read(position, body)
        for v in range(solids.first_vertex[body], solids.first_vertex[body + 1]):
            corner = vectors.rotate(turn, vectors.read(solids.vertex, v))
            vertex[v] = vectors.add(corner, 1.0, x)
        for f in range(solids.first_face[body], solids.first_face[body + 1]):
            n = vectors.rotate(turn, vectors.read(solids.normal, f))
            normal[f] = n
            offset[f] += vectors.dot(n, x)
        for e in range(solids.first_edge[body], solids.first_edge[body + 1]):
            bisector[e] = vectors.rotate(turn, vectors.read(solids.bisector, e))
    return vertex, normal, offset, bisector
