"""Contact by the surfaces of the elements themselves."""

from qdem_fem.contact.surface import law
from qdem_fem.contact.surface.arrays import Near, Surface, SurfaceTouch, Walls
from qdem_fem.contact.surface.inside import check_inside, find_overlap
from qdem_fem.contact.surface.law import advance_surfaces
from qdem_fem.contact.surface.near import make_near, renew_near
from qdem_fem.contact.surface.options import (
    DEPTH,
    OVERLAP,
    SurfaceContact,
    find_sharp_edges,
    place_points,
)

__all__ = [
    "DEPTH", "OVERLAP", "Near", "Surface", "SurfaceContact", "SurfaceTouch", "Walls",
    "advance_surfaces", "check_inside", "find_overlap", "find_sharp_edges", "law", "make_near",
    "place_points", "renew_near",
]  # fmt: skip
