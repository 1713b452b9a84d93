"""The surface of a mesh: its outward triangles, their areas, and what pressure does to them."""

import numpy as np

from qdem_fem.files import Floats, Integers, MeshError
from qdem_fem.mesh.checks import BoolArray

_OWNERS_SHOWN = 4
_PACKED = 1 << 20
"""Most nodes of which three fit into one number, which sorts faster than three."""
_OUTWARD = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
"""Faces of a right-handed element, seen from outside, by the nodes within it."""


def find_surface_faces(elements: Integers, where: str = "mesh") -> Integers:
    """Triangles of the boundary (k, 3): faces of one element only, seen from outside.

    ``elements`` (m, 4) are right-handed, as `read_mesh` leaves them; (X1 - X0) x (X2 - X0) of a
    face (0, 1, 2) points outward.  The faces come sorted by their nodes, whatever the order of
    the elements, and begin with their smallest node.  ``where``: what a message calls the mesh.

    Raises `MeshError` naming the elements if three or more share a face, or if two lie on the
    same side of the face they share: the mesh overlaps itself, as it does around an element
    that was turned inside out before it was read.
    """
    corners = elements.T[_OUTWARD.T].reshape(3, -1)
    lead = corners.argmin(axis=0)
    first, second, third = (np.choose((lead + k) % 3, corners) for k in range(3))
    nodes = np.stack([first, np.minimum(second, third), np.maximum(second, third)], axis=1)
    count = int(elements.max(initial=0)) + 1
    if count <= _PACKED:
        order = np.argsort(nodes @ np.array([count**2, count, 1]))
    else:
        order = np.lexsort(nodes.T[::-1])
    nodes, sense = nodes[order], (second < third)[order]
    same = (nodes[1:] == nodes[:-1]).all(axis=1)

    # A sound face has two elements at most, and those see it in opposite senses.
    clash = same & (sense[1:] == sense[:-1])
    clash[1:] |= same[1:] & same[:-1]
    if clash.any():
        _raise_overlap(nodes[np.flatnonzero(clash)[0]], elements, where)
    alone = np.ones(len(nodes), bool)
    alone[1:] &= ~same
    alone[:-1] &= ~same
    at = order[alone]
    return np.stack([first[at], second[at], third[at]], axis=1)


def _raise_overlap(face: Integers, elements: Integers, where: str) -> None:
    owners = np.flatnonzero(np.isin(elements, face).sum(axis=1) == 3)
    shown = ", ".join(map(str, owners[:_OWNERS_SHOWN])) + ", ..." * (len(owners) > _OWNERS_SHOWN)
    if len(owners) > 2:
        what = f"{len(owners)} elements ({shown}) share the face of nodes {face.tolist()}"
        remedy = "remove the elements that are one too many"
    else:
        what = f"elements {shown} lie on the same side of the face of nodes {face.tolist()} "
        what += "that they share: they overlap"
        remedy = "one of them was turned inside out: mesh again there, or move its nodes back"
    raise MeshError(what, where=where, remedy=remedy)


def find_area_vectors(nodes: Floats, faces: Integers) -> Floats:
    """Area times unit normal of each face [m^2], (k, 3): (X1 - X0) x (X2 - X0) / 2.

    ``nodes`` (n, 3) [m], ``faces`` (k, 3); outward where the faces are `find_surface_faces`.
    """
    first = nodes[faces[:, 0]]
    return np.cross(nodes[faces[:, 1]] - first, nodes[faces[:, 2]] - first) / 2


def find_faces_within(faces: Integers, node_mask: BoolArray) -> Integers:
    """The faces (k, 3) whose three nodes are all named by ``node_mask`` (n,)."""
    return faces[node_mask[faces].all(axis=1)]


def find_pressure_forces(nodes: Floats, faces: Integers, n_nodes: int) -> Floats:
    """Force on each node for a pressure of 1 Pa on outward ``faces`` (k, 3) [N/Pa = m^2], (n, 3).

    A uniform pressure acts along the inward normal, and the linear shape functions give a third
    of the force on a face to each of its nodes.  Not for a pressure that follows the deformed
    surface: ``nodes`` (n, 3) [m] are the reference configuration.
    """
    third = -find_area_vectors(nodes, faces) / 3
    return np.stack(
        [
            sum(np.bincount(corner, weights=column, minlength=n_nodes) for corner in faces.T)
            for column in third.T
        ],
        axis=1,
    )
