"""Sweeps through contacts: blocks, local solves, kernels."""

from rigid_lcp.friction.sweeps.blocks import add_impulses, lay_out_bodies, lay_out_matrix
from rigid_lcp.friction.sweeps.body_kernel import pack_contacts
from rigid_lcp.friction.sweeps.contact_kernel import Momentum, SweepBlocks, sweep_until_small
from rigid_lcp.friction.sweeps.local_contact import NONE, solve_contacts_apart
from rigid_lcp.friction.sweeps.normal_matrices import (
    build_band,
    find_bandwidth,
    multiply_normals,
    sweep_normals,
)

__all__ = [
    "NONE", "Momentum", "SweepBlocks", "add_impulses", "build_band", "find_bandwidth",
    "lay_out_bodies", "lay_out_matrix", "multiply_normals", "pack_contacts", "solve_contacts_apart",
    "sweep_normals", "sweep_until_small",
]  # fmt: skip
