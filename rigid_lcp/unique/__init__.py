"""Unique forces where contacts are more than freedoms (section 8 of the paper)."""

from rigid_lcp.unique.elastic_limit import find_unique_forces

__all__ = ["find_unique_forces"]
