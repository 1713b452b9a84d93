"""Sweeps through contacts: blocks, local solves, kernels."""

from rigid_lcp.friction.sweeps.blocks import BodyBlocks, lay_out_bodies, lay_out_matrix
from rigid_lcp.friction.sweeps.body_kernel import pack_contacts
from rigid_lcp.friction.sweeps.contact_kernel import (
    MANY_CONTACTS,
    Momentum,
    SweepBlocks,
    residual_of,
    sweep_once,
    sweep_until_small,
)
from rigid_lcp.friction.sweeps.local_contact import NONE, solve_contacts_apart
from rigid_lcp.friction.sweeps.normal_matrices import (
    face_band,
    face_bandwidth,
    face_rows,
    normal_products,
    normal_sweeps,
    pick_rows,
)

__all__ = [
    "MANY_CONTACTS", "NONE", "BodyBlocks", "Momentum", "SweepBlocks", "face_band", "face_bandwidth",
    "face_rows", "lay_out_bodies", "lay_out_matrix", "normal_products", "normal_sweeps",
    "pack_contacts", "pick_rows", "residual_of", "solve_contacts_apart", "sweep_once",
    "sweep_until_small",
]  # fmt: skip
