"""Contact of element surfaces: vertex on face and edge on edge, weighted by area.

What the paper lists as its first disadvantage, repaired: bodies touch where their meshes do.  A
point of a surface that is inside another body by a depth ``g`` presses with ``p A g`` along the
normal n of the nearest face: the gradient of

    W = sum over points  1/2 (p/2) A g^2  +  sum over crossing edges  1/2 p A_e g^2

with ``p`` [Pa/m], so that a pressure is ``p g`` whatever the mesh, half of it (``p/2``) from each
of two surfaces.  Points are ``points**2`` within every face, each with its share ``A`` of the area
as the contact sees it, ``A (-n_f n)``; and the vertices, which bear where they are pointed: a third
of the faces around them, less what is flat, ``1 - max(-n_f n)^50``, where points within the
faces bear already.  Sharp edges bear across one another in the same way, and fade to their ends.
All these areas are taken when a contact begins, and kept while it lasts; so ``W`` is a potential of
the depth, and a force acts on the nodes of the face beneath as its gradient says, which keeps
momentum and moment.  Friction is a spring with a slider, as of spheres, of
``p_t = p / (2 (1 + nu))`` for the same area; it acts at the point, and at the depth below the face
by a couple on the face's nodes.

Not for bodies or faces narrower than ``depth``, or faces that bend back on themselves within it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from qdem_fem.contact import spheres
from qdem_fem.files import Floats, Integers
from qdem_fem.mesh import find_area_vectors

DEPTH = 0.1  # greatest one, over the median edge of the surfaces [-]
OVERLAP = 0.02  # at the start, over the greatest depth, that is named: a strain of 2e-3 [-]
SHARP_COSINE = 0.9  # between two faces' normals: below, their edge may cross others [-]


@dataclass(frozen=True)
class SurfaceContact:
    """Contact of the surfaces of all bodies; what ``[contact]`` of a scene says.

    Raises `ConditionError`.
    """

    modulus: float | Mapping[str, float]
    """p of two surfaces of the body's material [Pa/m]; a number, or by the name of the body"""
    friction: float
    """Coulomb's coefficient mu"""
    planes: Sequence[spheres.ContactPlane] = ()
    points: int = 2
    """A face has that many points squared within it."""
    depth: float | None = None
    """Greatest depth [m]; a tenth of the median edge by default."""
    contacts: int = 2
    """Coverings of a vertex's area by contact that the time step allows for."""
    periodic: ClassVar[None] = None
    """Surfaces touch within a width, not across its sides; spheres do."""

    def __post_init__(self) -> None:
        values = self.modulus.values() if isinstance(self.modulus, Mapping) else [self.modulus]
        for each in values:
            spheres.check_contact_number(each, "modulus", above=True)
        if self.depth is not None:
            spheres.check_contact_number(self.depth, "depth", above=True)
        spheres.check_contact_number(self.friction, "friction", above=False)
        spheres.check_contact_number(self.contacts, "contacts", above=True)
        spheres.check_contact_number(self.points, "points", above=True)
        spheres.check_contact_planes(self.planes)

    def find_value(self, name: str, quantity: str) -> float:
        """``modulus`` of a body; `ConditionError` where it has none."""
        return spheres.find_body_value(getattr(self, quantity), name, quantity)


def place_points(parts: int) -> Floats:
    """Points of a triangle in barycentric coordinates, (parts**2, 3), of equal shares of its area.

    The centroids of ``parts**2`` equal triangles: with them linear functions are integrated
    exactly, and none lies on an edge, where a body ends.
    """
    thirds = []
    for i in range(parts):
        for j in range(parts - i):
            thirds.append((3 * i + 1, 3 * j + 1))
            if j < parts - i - 1:
                thirds.append((3 * i + 2, 3 * j + 2))
    first, second = np.array(thirds, dtype=float).reshape(-1, 2).T / (3 * parts)
    return np.column_stack([1 - first - second, first, second])


def find_sharp_edges(nodes: Floats, faces: Integers) -> tuple[Integers, Integers]:
    """Edges (e, 2) where a surface turns sharply outward (`SHARP_COSINE`), and what is across them.

    ``nodes`` (n, 3) [m], ``faces`` (f, 3) outward.  The second is (e, 2): the nodes opposite of
    each edge in its two faces.
    """
    across = find_area_vectors(nodes, faces)
    normal = across / np.linalg.norm(across, axis=1, keepdims=True)
    seen: dict[tuple[int, int], tuple[int, int]] = {}
    edges, opposite = [], []
    for face, corners in enumerate(faces.tolist()):
        for k in range(3):
            one, other, third = corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]
            key = (min(one, other), max(one, other))
            if key not in seen:
                seen[key] = (face, third)
                continue
            before, there = seen[key]
            convex = normal[before] @ (nodes[third] - nodes[one]) < 0
            if convex and normal[before] @ normal[face] < SHARP_COSINE:
                edges.append(key)
                opposite.append((there, third))
    return (
        np.array(edges, dtype=np.int64).reshape(-1, 2),
        np.array(opposite, dtype=np.int64).reshape(-1, 2),
    )
