"""Sparse elimination of contact problems, front by front."""

from rigid_lcp.sparse.body_matrix import (
    add_contacts,
    build_dense_delassus,
    find_contact_stiffness,
    find_diagonal_blocks,
    find_row_forms,
    list_body_pairs,
    multiply_blocks,
    multiply_csr,
    multiply_factors,
    push_bodies,
    split_csr,
    split_jacobian,
    subtract_motion,
)
from rigid_lcp.sparse.elimination_tree import EliminationTree, build_tree
from rigid_lcp.sparse.multifrontal import factor_fronts, solve_fronts

__all__ = [
    "EliminationTree", "add_contacts", "build_dense_delassus", "build_tree", "factor_fronts",
    "find_contact_stiffness", "find_diagonal_blocks", "find_row_forms", "list_body_pairs",
    "multiply_blocks", "multiply_csr", "multiply_factors", "push_bodies", "solve_fronts",
    "split_csr", "split_jacobian", "subtract_motion",
]  # fmt: skip
