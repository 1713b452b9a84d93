"""Bringing the overlaps of a moved bed back to equilibrium."""

from adapters.relaxation.methods import METHODS, RETIRED, relax, relax_bare
from adapters.relaxation.rearranged import rearrange

__all__ = [
    "METHODS", "RETIRED", "rearrange", "relax", "relax_bare",
]  # fmt: skip
