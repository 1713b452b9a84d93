"""Which bodies touch, where and in which direction."""

from rigid_lcp.contact.arrays import (
    ContactForces,
    Contacts,
    choose_tangents,
    contact_frames,
    contact_rows,
)
from rigid_lcp.contact.detection_plane import FACE_BITS, detect_2d, shapes_2d
from rigid_lcp.contact.detection_space import detect_3d
from rigid_lcp.contact.placed_solids import FEATURE_BITS, MOST_EDGES, shapes_3d

__all__ = [
    "FACE_BITS", "FEATURE_BITS", "MOST_EDGES", "ContactForces", "Contacts", "choose_tangents",
    "contact_frames", "contact_rows", "detect_2d", "detect_3d", "shapes_2d", "shapes_3d",
]  # fmt: skip
