"""Friction methods, one file each, found by being here."""

from rigid_lcp.friction.methods.dantzig import dantzig
from rigid_lcp.friction.methods.gauss_seidel import Sweeper, gauss_seidel, make_sweeper
from rigid_lcp.friction.methods.interior_point import (
    PATH_ITERATIONS,
    Path,
    PathStep,
    interior_point,
    spring_size,
)
from rigid_lcp.friction.methods.newton import NEWTON_PATIENCE, alart_curnier, newton
from rigid_lcp.friction.methods.pivoting import pivoting

__all__ = [
    "NEWTON_PATIENCE", "PATH_ITERATIONS", "Path", "PathStep", "Sweeper", "alart_curnier", "dantzig",
    "gauss_seidel", "interior_point", "make_sweeper", "newton", "pivoting", "spring_size",
]  # fmt: skip
