"""What a closed surface of triangles encloses: volume, sphericity, roundness of corners.

``nodes`` (n, 3) [m] and ``faces`` (k, 3), each seen counter-clockwise from outside, throughout.
Volume and centroid are exact for the polyhedron, to rounding.
"""

from dataclasses import dataclass

import numpy as np

from qdem_fem.files import Floats, Integers
from qdem_fem.mesh import find_area_vectors


@dataclass(frozen=True)
class InscribedNumbers:
    """Search for the largest inscribed sphere; lengths are over the extent of the body."""

    first_planes: float = 1e3  # distance of the planes that it starts from [-]
    pivots: int = 500  # at most [-]
    outside: float = 1e-12  # by which a plane may be violated at the end [-]
    least_share: float = 1e-12  # of a plane in the one that enters, for which it may leave [-]


INSCRIBED = InscribedNumbers()


def integrate_polyhedron(nodes: Floats, faces: Integers) -> tuple[float, Floats]:
    """Volume V [m^3], negative where the faces are seen clockwise from outside, and centroid [m],
    (3,), by integrals over the cones from one node to every face, which is exact.

    With D = det(a, b, c) of a cone's face: volume D/6, first moment D (a + b + c)/24.
    """
    origin = nodes[0]
    a, b, c = (nodes[faces] - origin).transpose(1, 0, 2)
    sixfold = np.einsum("fi,fi->f", a, np.cross(b, c))
    volume = sixfold.sum() / 6
    first = sixfold @ (a + b + c) / 24
    return float(volume), origin + first / volume


def find_surface_area(nodes: Floats, faces: Integers) -> float:
    """Area of the surface [m^2]."""
    return float(np.linalg.norm(find_area_vectors(nodes, faces), axis=1).sum())


def find_sphericity(volume: float, area: float) -> float:
    """psi = pi^(1/3) (6 V)^(2/3) / A [-]: Wadell's true sphericity (J. Geol. 40, 1932, 443-451).

    Area of the sphere of the same volume ``volume`` [m^3] over that of the body [m^2]: 1 for a
    sphere, (pi/6)^(1/3) = 0.806 for a cube, (pi/(6 sqrt 3))^(1/3) = 0.671 for a regular
    tetrahedron.
    """
    return float(np.cbrt(np.pi) * np.cbrt(6 * volume) ** 2 / area)


@dataclass(frozen=True)
class Edges:
    """Edges of a closed surface; of its connectivity only."""

    nodes: Integers
    """The two nodes of each edge, (e, 2), as the first of its faces runs through them."""
    faces: Integers  # the two faces of each edge, (e, 2)
    opposite: Integers  # the third node of each of these faces, (e, 2)
    number: Integers  # of the edges 0-1, 1-2, 2-0 of each face, (k, 3)


def find_surface_edges(faces: Integers) -> Edges:
    """Edges of a closed surface whose faces all run the same way round."""
    start, end = faces.reshape(-1), np.roll(faces, -1, axis=1).reshape(-1)
    third, owner = np.roll(faces, -2, axis=1).reshape(-1), np.repeat(np.arange(len(faces)), 3)
    size = int(faces.max()) + 1
    key, back = start * size + end, end * size + start
    order = np.argsort(key)
    twin = order[np.searchsorted(key, back, sorter=order)]
    one = np.flatnonzero(start < end)
    pair = np.stack([one, twin[one]], axis=1)
    number = np.empty(len(start), np.int64)
    number[pair] = np.arange(len(one))[:, None]
    nodes = np.stack([start[one], end[one]], axis=1)
    return Edges(nodes, owner[pair], third[pair], number.reshape(-1, 3))


def quarter_faces(faces: Integers, edges: Edges) -> Integers:
    """Each triangle (k, 3) cut into four at the middles of its edges, (4 k, 3).

    The middle of edge e is node n + e, behind the n nodes of ``faces``.
    """
    a, b, c = faces.T
    ab, bc, ca = edges.number.T + int(faces.max()) + 1
    four = [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
    return np.concatenate([np.stack(one, axis=1) for one in four])


def find_edge_angles(nodes: Floats, faces: Integers, edges: Edges) -> tuple[Floats, Floats]:
    """Lengths [m] and angles between the outward normals [rad], (e,); negative where concave."""
    normal = find_area_vectors(nodes, faces)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    along = nodes[edges.nodes[:, 1]] - nodes[edges.nodes[:, 0]]
    length = np.sqrt((along * along).sum(axis=1))
    one, other = normal[edges.faces[:, 0]], normal[edges.faces[:, 1]]
    sine = (np.cross(one, other) * along).sum(axis=1) / length
    return length, np.arctan2(sine, (one * other).sum(axis=1))


def find_node_areas(nodes: Floats, faces: Integers) -> Floats:
    """Area of the surface that is nearest to each node [m^2], (n,); they add up to the whole.

    Voronoi regions, of obtuse triangles half to the obtuse corner and a quarter to each other one
    (the mixed area of Meyer, Desbrun, Schroeder, Barr 2003, in Visualization and Mathematics III).
    """
    p = nodes[faces]
    following, previous = np.roll(p, -1, axis=1) - p, np.roll(p, -2, axis=1) - p
    twice = 2 * np.linalg.norm(find_area_vectors(nodes, faces), axis=1)[:, None]
    cotangent = (following * previous).sum(axis=2) / twice
    facing = ((previous - following) ** 2).sum(axis=2) * cotangent
    share = (np.roll(facing, -1, axis=1) + np.roll(facing, -2, axis=1)) / 8
    obtuse = cotangent < 0
    cut = np.where(obtuse, twice / 4, twice / 8)
    share = np.where(obtuse.any(axis=1)[:, None], cut, share)
    return np.asarray(np.bincount(faces.reshape(-1), share.reshape(-1), len(nodes)), float)


def find_greatest_curvatures(nodes: Floats, faces: Integers, edges: Edges) -> Floats:
    """Larger principal curvature at each node [1/m], (n,): H + sqrt(H^2 - K).

    With the area A of `find_node_areas`: H = sum(L theta)/(4 A) over its edges, K = (2 pi - sum
    of the angles around it)/A, with no root where H^2 < K (Meyer et al. 2003). Curvature is
    smeared over that area: no edge is sharper than the mesh shows.
    """
    count = len(nodes)
    own = find_node_areas(nodes, faces)
    length, angle = find_edge_angles(nodes, faces, edges)
    mean = np.bincount(edges.nodes.reshape(-1), np.repeat(length * angle / 4, 2), count) / own
    p = nodes[faces]
    u, v = np.roll(p, -1, axis=1) - p, np.roll(p, -2, axis=1) - p
    twice = 2 * np.linalg.norm(find_area_vectors(nodes, faces), axis=1)[:, None]
    around = np.arctan2(twice, (u * v).sum(axis=2))
    gauss = (2 * np.pi - np.bincount(faces.reshape(-1), around.reshape(-1), count)) / own
    return np.asarray(mean + np.sqrt(np.maximum(mean**2 - gauss, 0.0)))


def find_roundness(nodes: Floats, faces: Integers, edges: Edges | None = None) -> float:
    """Mean radius of curvature of corners and ridges over that of the inscribed sphere [-].

    Wadell's roundness (J. Geol. 40, 1932) taken to space as by Bullard and Garboczi (Powder
    Technol. 249, 2013, 241-252) and Zheng, He, Alimohammadi (Acta Geotech. 16, 2021, 133-149):
    corners and ridges are the nodes that are more curved than the largest inscribed sphere.
    1 for a sphere, where no node or only round-off is; a body with edges tends to 0 as its mesh
    is refined, in proportion to the mesh size.  Two bodies are compared at like mesh size only.
    """
    _, radius = find_inscribed_sphere(nodes, faces)
    relative = radius * find_greatest_curvatures(nodes, faces, edges or find_surface_edges(faces))
    sharp = relative > 1
    return float(np.mean(1 / relative[sharp])) if sharp.any() else 1.0


def find_inscribed_sphere(nodes: Floats, faces: Integers) -> tuple[Floats, float]:
    """Centre [m], (3,), and radius [m] of the largest sphere inside the planes of all faces.

    The largest inscribed sphere of a convex body; of one that is not convex a smaller one, and
    a negative radius where the planes have no point in common.

    A linear programme in four unknowns, max r with n.x + r <= d, by the dual simplex: of four
    planes that hold a sphere between them the multipliers say which leaves, and the
    plane that cuts deepest into the sphere enters.
    """
    normal = find_area_vectors(nodes, faces)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    origin = nodes.mean(axis=0)
    extent = float(np.ptp(nodes, axis=0).max())
    reach = ((nodes[faces[:, 0]] - origin) * normal).sum(axis=1)
    start = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) / np.sqrt(3)
    rows = np.column_stack([np.vstack([start, normal]), np.ones(len(normal) + 4)])
    bound = np.concatenate([np.full(4, INSCRIBED.first_planes * extent), reach])
    basis = np.arange(4)
    for _ in range(INSCRIBED.pivots):
        inverse = np.linalg.inv(rows[basis])
        x = inverse @ bound[basis]
        slack = bound - rows @ x
        enters = int(np.argmin(slack))
        if slack[enters] >= -INSCRIBED.outside * extent:
            break
        weight = inverse.T @ np.array([0.0, 0.0, 0.0, 1.0])
        share = inverse.T @ rows[enters]
        may_leave = share > INSCRIBED.least_share
        ratio = np.where(may_leave, weight / np.where(may_leave, share, 1.0), np.inf)
        basis[int(np.argmin(ratio))] = enters
    return origin + x[:3], float(x[3])
