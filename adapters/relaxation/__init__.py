"""Bringing the overlaps of a moved bed back to equilibrium."""

from adapters.relaxation.methods import METHODS, RETIRED, relax, relax_bare
from adapters.relaxation.stones import relax_stones

__all__ = [
    "METHODS", "RETIRED", "relax", "relax_bare", "relax_stones",
]  # fmt: skip
