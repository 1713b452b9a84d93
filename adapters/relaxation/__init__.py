"""Bringing the overlaps of a moved bed back to equilibrium."""

from adapters.relaxation.methods import METHODS, RETIRED, relax

__all__ = [
    "METHODS", "RETIRED", "relax",
]  # fmt: skip
