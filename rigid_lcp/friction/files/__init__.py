"""Friction problems as files: npz, FCLIB, Siconos."""

from rigid_lcp.friction.files.damaged import DAMAGED
from rigid_lcp.friction.files.formats import read_forces, read_problem, write_problem

__all__ = ["DAMAGED", "read_forces", "read_problem", "write_problem"]
