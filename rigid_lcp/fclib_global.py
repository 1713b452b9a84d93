"""Friction problems of FCLIB by masses (``fclib_global``): ``M v = H r + f``, ``u = H^T v + w``.

Acary et al., FCLIB, Inria RT-0444 (2014).  With ``W = H^T M^-1 H`` and ``q = w + H^T M^-1 f`` it is
the problem of `rigid_lcp.friction_problem`, and where M is made of one block a body, the bodies
are known.  ``J = H^T``.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from rigid_lcp.body_matrix import diagonal_blocks
from rigid_lcp.errors import ProblemError
from rigid_lcp.friction_problem import (
    BODY_SIZE,
    BodySpace,
    FrictionProblem,
    friction_problem,
)

Floats = NDArray[np.float64]


def problem_by_masses(
    mass: sp.csr_array, directions: sp.csr_array, force: Floats, velocity: Floats, mu: Floats,
    dim: int,
) -> FrictionProblem:  # fmt: skip
    """The problem of M (ndof, ndof), H (ndof, nc * dim), f (ndof,), w (nc * dim,) and mu (nc,).

    Raises `ProblemError` where sizes do not fit or M is singular.
    """
    freedoms, rows = directions.shape
    if mass.shape != (freedoms, freedoms) or force.shape != (freedoms,):
        raise ProblemError(
            f"M is {mass.shape[0]} x {mass.shape[1]} and f has {force.size} numbers for "
            f"{freedoms} freedoms (rows of H)", where="M, f",
            remedy="give a row of M and a number of f for every row of H",
        )  # fmt: skip
    if velocity.shape != (rows,):
        raise ProblemError(
            f"w has {velocity.size} numbers for {rows} columns of H", where="w",
            remedy="give a number for every column of H",
        )  # fmt: skip
    jacobian = sp.csr_array(directions.T)
    size = BODY_SIZE[dim] if dim in BODY_SIZE and in_blocks(mass, BODY_SIZE[dim]) else 0
    try:
        if size:
            inverse = mass_inverse(mass, size)
            matrix, moved = BodySpace(jacobian, inverse, size), inverse @ force
        else:
            factor = splu(sp.csc_array(mass))
            spread = sp.csr_array(factor.solve(directions.toarray()))
            matrix, moved = sp.csr_array(jacobian @ spread), factor.solve(force)
    except (RuntimeError, ValueError, np.linalg.LinAlgError) as error:
        raise ProblemError(
            f"M can not be inverted: {error}", where="M",
            remedy="look for a body without mass or moment of inertia",
        ) from error  # fmt: skip
    made: FrictionProblem = friction_problem(matrix, velocity + jacobian @ moved, mu, dim)
    return made


def in_blocks(mass: sp.csr_array, size: int) -> bool:
    """Whether M (ndof, ndof) has nothing beside one block of ``size`` freedoms a body."""
    places = mass.tocoo()
    row, column = places.row[places.data != 0.0], places.col[places.data != 0.0]
    return mass.shape[0] % size == 0 and bool((row // size == column // size).all())


def mass_inverse(mass: sp.csr_array, size: int) -> sp.csr_array:
    """M^-1 block by block.  Raises LinAlgError where one is singular."""
    blocks = diagonal_blocks(mass.indptr, mass.indices, mass.data, size)
    number = np.arange(len(blocks))
    rows = (np.linalg.inv(blocks), number, np.arange(len(blocks) + 1))
    inverse = sp.csr_array(sp.bsr_array(rows, shape=mass.shape))
    inverse.eliminate_zeros()
    return inverse
