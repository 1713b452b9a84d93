"""Friction problems as files: npz, FCLIB, Siconos."""

from rigid_lcp.friction.files.damaged import DAMAGED

__all__ = ["DAMAGED"]
