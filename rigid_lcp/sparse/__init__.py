"""Sparse elimination of contact problems, front by front."""

from rigid_lcp.sparse.body_matrix import (
    add_contacts,
    body_pairs,
    contact_stiffness,
    csr_arrays,
    dense_delassus,
    diagonal_blocks,
    find_row_forms,
    multiply_blocks,
    multiply_csr,
    multiply_factors,
    push_bodies,
    split_jacobian,
    subtract_motion,
)
from rigid_lcp.sparse.elimination_tree import EliminationTree, elimination_tree
from rigid_lcp.sparse.multifrontal import factor_fronts, solve_fronts

__all__ = [
    "EliminationTree", "add_contacts", "body_pairs", "contact_stiffness", "csr_arrays",
    "dense_delassus", "diagonal_blocks", "elimination_tree", "factor_fronts", "find_row_forms",
    "multiply_blocks", "multiply_csr", "multiply_factors", "push_bodies", "solve_fronts",
    "split_jacobian", "subtract_motion",
]  # fmt: skip
