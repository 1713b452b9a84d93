"""The arrays of the contact of surfaces: what there is, what is near, what touches.

See `qdem_fem.contact.surface.options` for the law.
"""

from typing import Any, NamedTuple


class Surface(NamedTuple):
    """Nodes, faces, points and sharp edges of all surfaces."""

    reference: Any  # (c, 3) reference position of the vertices [m]
    place: Any  # (c,) of its first component in the displacement
    force_at: Any  # (c,) of its first component in the windows of forces
    face: Any  # (f, 3) vertices, outward
    face_area: Any  # (f,) [m^2]
    fan_first: Any  # (c + 1,) first entry of a vertex in ``fan_face``
    fan_face: Any  # the faces around every vertex
    point_node: Any  # (q, 3) vertices of its face, or three times the vertex that it is
    point_share: Any  # (q, 3) barycentric coordinates between them
    point_face: Any  # (q,) its face; -1 for a vertex
    point_area: Any  # (q,) [m^2]
    point_body: Any  # (q,)
    edge: Any  # (e, 2) vertices
    edge_opposite: Any  # (e, 2) what is across the edge in its two faces
    edge_area: Any  # (e,) [m^2]
    edge_body: Any  # (e,)
    modulus: Any  # (b,) p [Pa/m]
    shear: Any  # (b,) p_t [Pa/m]


class Near(NamedTuple):
    """What may touch, and what it remembers."""

    point: Any  # (n,) point
    body: Any  # (n,) the body it is near to
    first: Any  # (n + 1,) its first entry in ``face``
    face: Any  # faces of that body near to it
    free: Any  # (n,) way of all vertices from ``start`` up to which the point can not get in [m]
    weight: Any
    """(n,) area as the contact sees it, kept while it lasts [m^2]; negative: does not touch"""
    spring: Any  # (n, 3) [m]
    edges: Any  # (m, 2) pairs of edges
    edge_free: Any
    """(m,) way of all vertices from ``start`` up to which the edges can not touch [m]"""
    edge_weight: Any  # (m,) [m^2]
    edge_start: Any  # (m,) depth at which it began [m]
    edge_spring: Any  # (m, 3) [m]


class Walls(NamedTuple):
    """Rigid walls, and what each point remembers of each."""

    point: Any  # (w, 3) [m]
    normal: Any  # (w, 3)
    friction: Any  # (w,)
    weight: Any  # (w, q) [m^2]; negative: does not touch
    spring: Any  # (w, q, 3) [m]
    force: Any  # (w, 3) of the bodies on the wall [N]


class SurfaceTouch(NamedTuple):
    """All that a step of contact reads and writes."""

    surface: Any
    near: Any
    walls: Any
    friction: Any
    half_skin: Any
    depth: Any  # greatest depth [m]
    start: Any  # (c, 3) positions when it was last looked what is near [m]
    position: Any  # (c, 3) [m]
    force: Any  # (c, 3) [N]
    account: Any
    """Energy in the springs now, and work that sliders took since the start [J]; looks in vain."""
    acting: Any  # (c,) all vertices
