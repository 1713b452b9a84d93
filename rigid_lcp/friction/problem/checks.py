"""What a friction problem may be made of: numbers and matrices as a caller has them."""

from numbers import Integral
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from rigid_lcp.arrays import Floats
from rigid_lcp.errors import ProblemError, UsageError

LEAST, MOST = 1e-100, 1e100
"""Range of the largest number of W, and of q: squares beyond it are no numbers any more."""
FROM_A_DIVISION = "look for a mass of zero or a division by zero where it was made"
"""What to do about numbers that are not finite."""


def require_finite(values: ArrayLike, name: str, remedy: str = FROM_A_DIVISION) -> Floats:
    """A copy of ``values`` as an array of floats; `ProblemError`, with ``name``, for all else.

    Refused are text, complex numbers, masked ones, numbers that are not finite, for which
    ``remedy`` says what to do.
    """
    if np.ma.is_masked(values):
        raise ProblemError(
            "some of its numbers are masked", where=name,
            remedy="fill them, or leave out their contacts",
        )  # fmt: skip
    try:
        given = np.asarray(values)
        if given.dtype.kind not in "biufO":
            raise TypeError(f"but of {given.dtype}")
        array: Floats = given.astype(float)
    except (TypeError, ValueError) as error:
        raise ProblemError(
            f"{name} is not made of numbers ({error})", where=name, remedy="give real numbers"
        ) from error
    bad = np.flatnonzero(~np.isfinite(array))
    if len(bad):
        raise ProblemError(
            f"{len(bad)} of its numbers are not finite, first number {bad[0]}", where=name,
            remedy=remedy,
        )  # fmt: skip
    return array


def require_by_contact(values: ArrayLike, name: str, dim: int) -> Floats:
    """``values`` (nc * dim,), (nc * dim, 1), (1, nc * dim) or (nc, dim) as (nc * dim,).

    `ProblemError` for other shapes: (dim, nc) would be read in the wrong order.
    """
    array = require_finite(values, name)
    if array.ndim > 1 and len(array) != 1 and array.shape[1:] not in ((dim,), (1,)):
        raise ProblemError(
            f"{name} has shape {array.shape} in {dim} dimensions", where=name,
            remedy=f"give one number a row of W, or (nc, {dim}): a row a contact",
        )  # fmt: skip
    return array.ravel()


def require_one_a_contact(values: ArrayLike, name: str, upper: float, contacts: int) -> Floats:
    """``values`` as (nc,), each from 0 to ``upper``; `ProblemError`, with ``name``, for others."""
    array = require_finite(values, name, f"give 0 to {upper:g}")
    if array.shape not in ((), (contacts,)):
        raise ProblemError(
            f"{name} has shape {array.shape} for {contacts} contacts", where=name,
            remedy="give one number, or one a contact",
        )  # fmt: skip
    array = np.broadcast_to(array, (contacts,)).copy()
    bad = np.flatnonzero((array < 0.0) | (array > upper))
    if len(bad):
        raise ProblemError(
            f"{name} is {array[bad[0]]:g}", where=f"{name}, contact {bad[0]}",
            remedy=f"give 0 to {upper:g}",
        )  # fmt: skip
    return array


def require_number(value: Any, name: str, *, zero: bool = False) -> float:
    """A number above zero, or also zero, as a float; `UsageError`, with ``name``, for all else."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = np.nan
    if not (0.0 < number < np.inf or (zero and number == 0.0)):
        raise UsageError(
            f"the {name} is {value!r}", where=name,
            remedy="give a number " + ("of zero or more" if zero else "above zero"),
        )  # fmt: skip
    return number


def require_whole(value: Any, name: str) -> int:
    """A count of zero or more; `UsageError`, with ``name``, for all else."""
    if isinstance(value, bool) or not isinstance(value, Integral) or value < 0:
        raise UsageError(f"{name} is {value!r}", where=name, remedy="give a count of 0 or more")
    return int(value)


def require_start(start: ArrayLike, numbers: int, dim: int) -> Floats:
    """Forces to begin from as a copy (``numbers``,) = (nc * dim,); `ProblemError` for all else."""
    force = require_by_contact(start, "start", dim)
    if len(force) != numbers:
        raise ProblemError(
            f"it has {len(force)} numbers and q has {numbers}", where="start",
            remedy="give the forces of all contacts, in the order of q",
        )  # fmt: skip
    return force


def require_range(values: Floats, name: str, least: float = LEAST) -> None:
    """Raise `ProblemError` where the largest of the numbers can not be squared in floats."""
    largest = float(np.abs(values).max(initial=0.0))
    if largest and not least <= largest <= MOST:
        raise ProblemError(
            f"its largest number is {largest:.1g}", where=name,
            remedy=f"choose other units: {LEAST:g} to {MOST:g} can be computed with",
        )  # fmt: skip


def require_matrix(matrix: Any, name: str = "W") -> sp.csr_array:
    """W from a dense or sparse matrix; ``name``: what messages call it."""
    given = matrix if sp.issparse(matrix) else require_finite(matrix, name)
    if given.ndim != 2:
        raise ProblemError(
            f"it has {given.ndim} dimensions, not 2", where=name,
            remedy="give a square matrix; for no contacts numpy.zeros((0, 0))",
        )  # fmt: skip
    if not sp.issparse(matrix):
        return sp.csr_array(given)
    rows = sp.csr_array(matrix)
    w = sp.csr_array((require_finite(rows.data, name), rows.indices, rows.indptr), rows.shape)
    if not w.has_canonical_format:
        w = w.copy()  # the caller's indices are not ours to sort
        w.sum_duplicates()
    return w


def check_factors(jacobian: sp.csr_array, inverse: sp.csr_array, size: int) -> None:
    """Raise `ProblemError` where the factors of W (`BodySpace`) do not fit together."""
    where = "BodySpace"
    for name, part in (("jacobian", jacobian), ("inverse_mass", inverse)):
        if not sp.issparse(part) or part.format != "csr":
            raise ProblemError(
                f"{name} is no sparse matrix by rows", where=where,
                remedy="give scipy.sparse.csr_array",
            )  # fmt: skip
        if part.dtype.kind not in "biuf":
            raise ProblemError(
                f"{name} is not made of numbers (but of {part.dtype})", where=where,
                remedy="give real numbers",
            )  # fmt: skip
        if not np.isfinite(part.data).all():
            raise ProblemError(
                f"{name} holds numbers that are not finite", where=where, remedy=FROM_A_DIVISION,
            )  # fmt: skip
        require_range(part.data, f"{where}, {name}")
    freedoms = jacobian.shape[1]
    if inverse.shape != (freedoms, freedoms) or size not in (3, 6) or freedoms % size:
        raise ProblemError(
            f"jacobian has {freedoms} columns, inverse_mass the shape {inverse.shape}, and a body "
            f"{size} freedoms", where=where,
            remedy="give 3 freedoms a body in 2D and 6 in 3D, all bodies' in both",
        )  # fmt: skip
    if not (inverse.diagonal() > 0).all():
        raise ProblemError(
            "a mass is negative or infinite", where=f"{where}, inverse_mass",
            remedy="leave out the columns of bodies that can not move",
        )  # fmt: skip
