"""Which bodies touch, where and in which direction."""

from rigid_lcp.contact.arrays import (
    FEATURE_BITS,
    ContactForces,
    Contacts,
    build_frames,
    find_frame,
    match_keys,
)
from rigid_lcp.contact.detection_plane import detect_2d, pack_shapes_2d
from rigid_lcp.contact.detection_space import detect_3d
from rigid_lcp.contact.placed_solids import MOST_EDGES, pack_shapes_3d

__all__ = [
    "FEATURE_BITS", "MOST_EDGES", "ContactForces", "Contacts", "build_frames", "detect_2d",
    "detect_3d", "find_frame", "match_keys", "pack_shapes_2d", "pack_shapes_3d",
]  # fmt: skip
