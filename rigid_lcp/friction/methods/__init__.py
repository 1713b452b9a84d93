"""Friction methods, one file each, found by being here."""

from rigid_lcp.friction.methods.dantzig import dantzig
from rigid_lcp.friction.methods.gauss_seidel import Sweeper, gauss_seidel
from rigid_lcp.friction.methods.interior_point import (
    Path,
    PathStep,
    interior_point,
    spring_size,
)
from rigid_lcp.friction.methods.newton import NEWTON, alart_curnier, newton
from rigid_lcp.friction.methods.pivoting import pivoting

__all__ = [
    "NEWTON", "Path", "PathStep", "Sweeper", "alart_curnier", "dantzig",
    "gauss_seidel", "interior_point", "newton", "pivoting", "spring_size",
]  # fmt: skip
