"""Which bodies touch, where and in which direction."""

from rigid_lcp.contact.arrays import (
    FEATURE_BITS,
    ContactForces,
    Contacts,
    choose_tangents,
    contact_frames,
    contact_rows,
)
from rigid_lcp.contact.detection_plane import detect_2d, shapes_2d
from rigid_lcp.contact.detection_space import detect_3d
from rigid_lcp.contact.placed_solids import MOST_EDGES, shapes_3d

__all__ = [
    "FEATURE_BITS", "MOST_EDGES", "ContactForces", "Contacts", "choose_tangents",
    "contact_frames", "contact_rows", "detect_2d", "detect_3d", "shapes_2d", "shapes_3d",
]  # fmt: skip
