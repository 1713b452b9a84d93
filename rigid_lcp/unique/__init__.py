"""Unique forces where contacts are more than freedoms (section 8 of the paper)."""

from rigid_lcp.unique.forces import unique_forces

__all__ = ["unique_forces"]
