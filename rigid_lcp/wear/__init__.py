"""Wear and breakage of grains."""

from rigid_lcp.wear.abrasion import Wear, WearState, split_wear, start_wear, step_wear, swap_worn
from rigid_lcp.wear.breakage import Breakage, Broken, break_scene, find_breaks, refuse_dust
from rigid_lcp.wear.cuts import WornShape
from rigid_lcp.wear.fragmentation import split_body

__all__ = [
    "Breakage", "Broken", "Wear", "WearState", "WornShape", "break_scene", "find_breaks",
    "refuse_dust", "split_body", "split_wear", "start_wear", "step_wear", "swap_worn",
]  # fmt: skip
