"""Bringing the overlaps of a moved bed back to equilibrium."""

from adapters.relaxation.methods import METHODS, RETIRED, relax, relax_bare

__all__ = [
    "METHODS", "RETIRED", "relax", "relax_bare",
]  # fmt: skip
