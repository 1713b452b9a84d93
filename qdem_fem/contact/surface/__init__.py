"""Contact by the surfaces of the elements themselves."""

from qdem_fem.contact.surface import law
from qdem_fem.contact.surface.arrays import Near, Overlaps, Surface, SurfaceTouch, Walls
from qdem_fem.contact.surface.inside import check_inside
from qdem_fem.contact.surface.law import surface_step
from qdem_fem.contact.surface.near import make_near, make_overlaps, renew_near, renew_overlaps
from qdem_fem.contact.surface.options import (
    DEPTH,
    SurfaceContact,
    find_sharp_edges,
    place_face_points,
)

__all__ = [
    "DEPTH", "Near", "Overlaps", "Surface", "SurfaceContact", "SurfaceTouch", "Walls",
    "check_inside", "find_sharp_edges", "law", "make_near", "make_overlaps", "place_face_points",
    "renew_near", "renew_overlaps", "surface_step",
]  # fmt: skip
