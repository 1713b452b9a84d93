"""Friction methods, one file each, found by being here."""

from rigid_lcp.friction.methods.dantzig import solve_dantzig
from rigid_lcp.friction.methods.gauss_seidel import lay_out_sweeps, solve_gauss_seidel
from rigid_lcp.friction.methods.interior_point import (
    Path,
    PathStep,
    find_spring_size,
    solve_interior_point,
)
from rigid_lcp.friction.methods.newton import NEWTON, find_alart_curnier, solve_newton
from rigid_lcp.friction.methods.pivoting import solve_pivoting

__all__ = [
    "NEWTON", "Path", "PathStep", "find_alart_curnier", "find_spring_size", "lay_out_sweeps",
    "solve_dantzig", "solve_gauss_seidel", "solve_interior_point", "solve_newton", "solve_pivoting",
]  # fmt: skip
