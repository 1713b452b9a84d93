"""Wear and breakage of grains."""

from rigid_lcp.wear.breakage import Breakage, Broken, break_scene, breaks, refuse_dust
from rigid_lcp.wear.corners import (
    Wear,
    WearState,
    contact_stiffness_worn,
    replace_worn,
    start_wear,
    step_wear,
    wear_on_after_break,
)
from rigid_lcp.wear.fragmentation import split_body
from rigid_lcp.wear.polygons import WornPolygon
from rigid_lcp.wear.polyhedra import WornPolyhedron
from rigid_lcp.wear.solids import SolidWear

__all__ = [
    "Breakage", "Broken", "SolidWear", "Wear", "WearState", "WornPolygon", "WornPolyhedron",
    "break_scene", "breaks", "contact_stiffness_worn", "refuse_dust", "replace_worn", "split_body",
    "start_wear", "step_wear", "wear_on_after_break",
]  # fmt: skip
