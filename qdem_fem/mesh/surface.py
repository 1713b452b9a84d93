"""The surface of a mesh: its outward triangles, their areas, and what pressure does to them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from qdem_fem.files import MeshError
from qdem_fem.mesh.checks import BoolArray, FloatArray, IntArray

_BITS = 21
"""Bits of a node number in a packed face: three of them and one for its sense fill 64."""
_FACED_AT_ONCE = 1 << 16
_OWNERS_SHOWN = 4

_UIntArray = npt.NDArray[np.uint64]


def find_surface_faces(elements: IntArray, where: str = "mesh") -> IntArray:
    """Triangles of the boundary (k, 3): faces of one element only, seen from outside.

    ``elements`` (m, 4) are right-handed, as `read_mesh` leaves them; (X1 - X0) x (X2 - X0) of a
    face (0, 1, 2) points outward.  The faces come sorted by their nodes, whatever the order of
    the elements, and begin with their smallest node.  ``where``: what a message calls the mesh.

    Raises `MeshError` naming the elements if three or more share a face, or if two lie on the
    same side of the face they share: the mesh overlaps itself, as it does around an element
    that was turned inside out before it was read.
    """
    packed = len(elements) == 0 or int(elements.max()) < 1 << _BITS
    faces, reverse = _faces_packed(elements) if packed else _faces_unpacked(elements)
    same = (faces[0][1:] == faces[0][:-1]) & (faces[-1][1:] == faces[-1][:-1])
    if len(faces) == 3:
        same &= faces[1][1:] == faces[1][:-1]
    edge = np.ones(1, bool)
    first = np.concatenate((edge, ~same))[: len(reverse)]
    last = np.concatenate((~same, edge))[: len(reverse)]

    # A sound face has two elements at most, and those see it in opposite senses.
    clash = same & (reverse[1:] == reverse[:-1])
    clash[1:] |= same[1:] & same[:-1]
    if clash.any():
        at = np.flatnonzero(clash)[0]
        _raise_overlap(_faces_corners(faces, np.array([at]))[0], elements, where)
    alone = np.flatnonzero(first & last)
    corners = _faces_corners(faces, alone)
    turned = reverse[alone]
    corners[turned, 1:] = corners[turned, :0:-1]
    return corners


def _faces_of(elements: IntArray) -> tuple[list[npt.NDArray[Any]], BoolArray]:
    """Sorted nodes a < b < c < d of each element (m,), and whether sorting changed its sense."""
    node = [np.ascontiguousarray(corner) for corner in elements.T]
    odd = np.zeros(len(elements), bool)
    for left, right in ((0, 1), (2, 3), (0, 2), (1, 3), (1, 2)):  # a network that sorts four
        swap = node[left] > node[right]
        odd ^= swap
        node[left], node[right] = (
            np.minimum(node[left], node[right]),
            np.maximum(node[left], node[right]),
        )
    return node, odd


_OPPOSITE = ((1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2))
"""Faces of an element of sorted nodes.  Outward, those opposite node 0 and 2 are seen as they
stand, the others reversed; and all the other way round if sorting changed the element's sense."""


def _faces_packed(elements: IntArray) -> tuple[tuple[_UIntArray, ...], BoolArray]:
    """All faces in order, as one number each, and whether each has to be reversed, (4 m,).

    The sense of a face is the lowest bit of what is sorted, so that nothing has to be carried
    along, and sorting plain numbers is the fastest there is.
    """
    keys = np.empty((4, len(elements)), np.uint64)
    for start in range(0, len(elements), _FACED_AT_ONCE):
        part = slice(start, start + _FACED_AT_ONCE)
        node, odd = _faces_of(elements[part])
        node = [n.astype(np.uint64) for n in node]
        for face, (a, b, c) in enumerate(_OPPOSITE):
            key = (node[a] << (2 * _BITS)) | (node[b] << _BITS) | node[c]
            keys[face, part] = (key << 1) | (odd ^ bool(face % 2))
    flat = keys.reshape(-1)
    flat.sort()
    reverse = (flat & np.uint64(1)).astype(bool)
    flat >>= np.uint64(1)
    return (flat,), reverse


def _faces_unpacked(elements: IntArray) -> tuple[tuple[IntArray, ...], BoolArray]:
    """The same for more nodes than fit into a packed face: three numbers each, (4 m,)."""
    node, odd = _faces_of(elements)
    a, b, c = (np.concatenate([node[face[k]] for face in _OPPOSITE]) for k in range(3))
    reverse = np.concatenate([odd ^ bool(face % 2) for face in range(4)])
    order = np.lexsort((c, b, a))
    return (a[order], b[order], c[order]), reverse[order]


def _faces_corners(faces: tuple[npt.NDArray[Any], ...], chosen: IntArray) -> IntArray:
    """Nodes (k, 3) of the chosen faces, packed or not."""
    if len(faces) == 3:
        return np.stack([column[chosen] for column in faces], axis=1)
    key, mask = faces[0][chosen], np.uint64((1 << _BITS) - 1)
    columns = (key >> np.uint64(2 * _BITS), (key >> np.uint64(_BITS)) & mask, key & mask)
    return np.stack(columns, axis=1).astype(np.int64)


def _raise_overlap(face: IntArray, elements: IntArray, where: str) -> None:
    owners = np.flatnonzero(np.isin(elements, face).sum(axis=1) == 3)
    shown = ", ".join(map(str, owners[:_OWNERS_SHOWN])) + (
        ", ..." if len(owners) > _OWNERS_SHOWN else ""
    )
    many = len(owners) > 2
    raise MeshError(
        f"{len(owners)} elements ({shown}) share the face of nodes {face.tolist()}"
        if many
        else f"elements {shown} lie on the same side of the face of nodes {face.tolist()} "
        "that they share: they overlap",
        where=where,
        remedy="remove the elements that are one too many"
        if many
        else "one of them was turned inside out: mesh again there, or move its nodes back",
    )


def face_area_vectors(nodes: FloatArray, faces: IntArray) -> FloatArray:
    """Area times unit normal of each face [m^2], (k, 3): (X1 - X0) x (X2 - X0) / 2.

    ``nodes`` (n, 3) [m], ``faces`` (k, 3); outward where the faces are `find_surface_faces`.
    """
    first = nodes[faces[:, 0]]
    return np.cross(nodes[faces[:, 1]] - first, nodes[faces[:, 2]] - first) / 2


def find_faces_within(faces: IntArray, node_mask: BoolArray) -> IntArray:
    """The faces (k, 3) whose three nodes are all named by ``node_mask`` (n,)."""
    return faces[node_mask[faces].all(axis=1)]


def pressure_forces(nodes: FloatArray, faces: IntArray, n_nodes: int) -> FloatArray:
    """Force on each node for a pressure of 1 Pa on outward ``faces`` (k, 3) [N/Pa = m^2], (n, 3).

    A uniform pressure acts along the inward normal, and the linear shape functions give a third
    of the force on a face to each of its nodes.  Not for a pressure that follows the deformed
    surface: ``nodes`` (n, 3) [m] are the reference configuration.
    """
    third = -face_area_vectors(nodes, faces) / 3
    return np.stack(
        [
            sum(np.bincount(corner, weights=column, minlength=n_nodes) for corner in faces.T)
            for column in third.T
        ],
        axis=1,
    )
