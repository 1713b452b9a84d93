"""Friction methods, one file each, found by being here."""

from rigid_lcp.friction.methods.dantzig import dantzig
from rigid_lcp.friction.methods.gauss_seidel import gauss_seidel, lay_out_sweeps
from rigid_lcp.friction.methods.interior_point import (
    Path,
    PathStep,
    interior_point,
    spring_size,
)
from rigid_lcp.friction.methods.newton import NEWTON, alart_curnier, newton
from rigid_lcp.friction.methods.pivoting import pivoting

__all__ = [
    "NEWTON", "Path", "PathStep", "alart_curnier", "dantzig", "gauss_seidel", "interior_point",
    "lay_out_sweeps", "newton", "pivoting", "spring_size",
]  # fmt: skip
