"""The reduced geometry equations (28) and their inverse, kept up to date pivot by pivot.

The unknowns of eq. 28 are the normal forces of the permanent contacts and the tangential forces of
the static ones; at a sliding contact ``f_T = sigma mu f_N`` is put in, so its column is
``A_N + sigma mu A_T``.  When a contact changes its list the matrix gains or loses one row and
column, or adds a multiple of one column to another.  The inverse follows in O(k^2) and O(k)
(bordering; Golub and Van Loan, Matrix Computations, 4th ed., 2.1.4) where solving afresh takes
O(k^3).  Errors grow with every update, so `refresh_reduced` inverts afresh.

All functions change their arrays in place.  The inverse is dense: k^2 numbers.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats, Ints

LISTS = 6
NEW, BREAKING, STATIC, SLIDING_UP, SLIDING_DOWN, TURNING = range(LISTS)
"""Lists: not yet considered, NC, C_F, C+, C-; and the contact whose tangential force is driven."""


class Geometry(NamedTuple):
    """The geometry equations ``a = b + A f`` (eq. 26), A by rows and by columns (n = rows)."""

    row_start: Ints
    row_index: Ints
    row_value: Floats
    column_start: Ints
    column_index: Ints
    column_value: Floats
    normal: Ints  # (nc,) row of the normal equation of a contact
    tangent: Ints  # (nc,) row of its tangential equation; -1 without friction: nothing to solve for
    contact: Ints  # (n,) contact of a row
    mu: Floats  # (nc,) coefficients of friction [-]
    slip: Ints  # (nc,) sign of f_T where a tangential velocity imposes it, else 0


class Reduced(NamedTuple):
    """The lists, and the inverse of the matrix of eq. 28 that belongs to them."""

    kind: Ints  # (nc,) list of every contact
    place: Ints  # (n,) place of a row in the inverse, -1 where it is not in
    members: Ints  # (n,) rows in the inverse, in order; the first `size` count
    size: Ints  # (1,) number of unknowns k
    inverse: Floats  # (n, n), used up to k: row by unknown, column by equation


def start_reduced(contacts: int, rows: int) -> Reduced:
    """No contact considered yet."""
    return Reduced(
        np.zeros(contacts, dtype=np.int64), np.full(rows, -1, dtype=np.int64),
        np.zeros(rows, dtype=np.int64), np.zeros(1, dtype=np.int64), np.empty((rows, rows)),
    )  # fmt: skip


@njit(cache=True)
def find_slide_sign(kind: int) -> float:
    """Sign sigma of ``f_T = sigma mu f_N`` in a list; 0 where friction is not at its limit."""
    if kind == SLIDING_UP:
        return 1.0
    return -1.0 if kind == SLIDING_DOWN else 0.0


@njit(cache=True)
def extend_inverse(inverse: Floats, size: int, column: Floats, row: Floats, corner: float) -> float:
    """Inverse of ``[[B, column], [row, corner]]`` from that of B; returns its Schur complement.

    ``column``, ``row``: (size,), mostly zeros.  Nothing is changed where the complement is zero to
    round-off, so that the bordered matrix is singular.
    """
    left, right = np.zeros(size), np.zeros(size)
    filled = np.flatnonzero(column)
    for i in range(size):
        for k in range(len(filled)):
            left[i] += inverse[i, filled[k]] * column[filled[k]]
    for i in range(size):
        if row[i] != 0.0:
            right += row[i] * inverse[i, :size]
    complement, terms = corner, abs(corner)
    for i in range(size):
        complement -= row[i] * left[i]
        terms += abs(row[i] * left[i])
    if not abs(complement) > 1e-15 * terms:
        return 0.0
    for i in range(size):
        if left[i] != 0.0:
            share = left[i] / complement
            for j in range(size):
                inverse[i, j] += share * right[j]
            inverse[i, size] = -share
        else:
            inverse[i, size] = 0.0
    inverse[size, :size] = -right / complement
    inverse[size, size] = 1.0 / complement
    return complement


@njit(cache=True)
def shrink_inverse(inverse: Floats, size: int, place: int) -> bool:
    """Inverse of B without row and column ``place``, whose seat the last one takes.

    False, and nothing changed, where the smaller matrix is singular.
    """
    pivot = inverse[place, place]
    if not abs(pivot) > 0.0:
        return False
    across = inverse[place, :size].copy()
    for i in range(size):
        share = inverse[i, place] / pivot
        if i != place and share != 0.0:
            for j in range(size):
                inverse[i, j] -= share * across[j]
    last = size - 1
    if place != last:
        inverse[place, :size] = inverse[last, :size]
        inverse[:last, place] = inverse[:last, last]
    return True


@njit(cache=True)
def scatter_column(geometry: Geometry, row: int, weight: float, into: Floats) -> None:
    """``into += weight A[:, row]``."""
    for k in range(geometry.column_start[row], geometry.column_start[row + 1]):
        into[geometry.column_index[k]] += weight * geometry.column_value[k]


@njit(cache=True)
def multiply_geometry(geometry: Geometry, force: Floats, into: Floats) -> None:
    """``into += A f``."""
    for i in range(len(force)):
        total = 0.0
        for k in range(geometry.row_start[i], geometry.row_start[i + 1]):
            total += geometry.row_value[k] * force[geometry.row_index[k]]
        into[i] += total


@njit(cache=True)
def scatter_reduced_column(geometry: Geometry, kind: Ints, row: int, into: Floats) -> None:
    """Column of the unknown ``row`` in eq. 28, over all rows: ``A_N + sigma mu A_T`` if sliding."""
    scatter_column(geometry, row, 1.0, into)
    c = geometry.contact[row]
    sign = find_slide_sign(kind[c])
    if sign != 0.0 and row == geometry.normal[c] and geometry.tangent[c] >= 0:
        scatter_column(geometry, geometry.tangent[c], sign * geometry.mu[c], into)


@njit(cache=True)
def add_reduced(geometry: Geometry, reduced: Reduced, row: int) -> bool:
    """Add the unknown force and the equation ``a = 0`` of ``row``; False where that is singular."""
    size = reduced.size[0]
    full = np.zeros(len(reduced.place))
    scatter_reduced_column(geometry, reduced.kind, row, full)
    column, across = np.zeros(size), np.zeros(size)
    for i in range(size):
        column[i] = full[reduced.members[i]]
    for k in range(geometry.row_start[row], geometry.row_start[row + 1]):
        other, value = geometry.row_index[k], geometry.row_value[k]
        c = geometry.contact[other]
        if reduced.place[other] >= 0:
            across[reduced.place[other]] += value
        elif other == geometry.tangent[c] and reduced.place[geometry.normal[c]] >= 0:
            share = find_slide_sign(reduced.kind[c]) * geometry.mu[c]
            across[reduced.place[geometry.normal[c]]] += share * value
    if extend_inverse(reduced.inverse, size, column, across, full[row]) == 0.0:
        return False
    reduced.place[row] = size
    reduced.members[size] = row
    reduced.size[0] = size + 1
    return True


@njit(cache=True)
def remove_reduced(reduced: Reduced, row: int) -> bool:
    """Take the unknown force and the equation of ``row`` out; False where that is singular."""
    size, place = reduced.size[0], reduced.place[row]
    if not shrink_inverse(reduced.inverse, size, place):
        return False
    last = reduced.members[size - 1]
    reduced.members[place] = last
    reduced.place[last] = place
    reduced.place[row] = -1
    reduced.size[0] = size - 1
    return True


@njit(cache=True)
def couple_reduced(geometry: Geometry, reduced: Reduced, contact: int, share: float) -> None:
    """Make ``f_T - share f_N`` the unknown instead of f_T: the column of f_N gains share A_T."""
    size = reduced.size[0]
    normal = reduced.place[geometry.normal[contact]]
    tangent = reduced.place[geometry.tangent[contact]]
    for j in range(size):
        reduced.inverse[tangent, j] -= share * reduced.inverse[normal, j]


@njit(cache=True)
def refresh_reduced(geometry: Geometry, reduced: Reduced) -> bool:
    """Invert the matrix of eq. 28 afresh; False, and nothing changed, where it is singular."""
    size = reduced.size[0]
    if size == 0:
        return True
    matrix, full = np.empty((size, size)), np.zeros(len(reduced.place))
    for j in range(size):
        full[:] = 0.0
        scatter_reduced_column(geometry, reduced.kind, reduced.members[j], full)
        for i in range(size):
            matrix[i, j] = full[reduced.members[i]]
    fresh = invert_dense(matrix)
    if not np.all(np.isfinite(fresh)):
        return False
    reduced.inverse[:size, :size] = fresh
    return True


@njit(cache=True)
def invert_dense(matrix: Floats) -> Floats:
    """The inverse, or NaN where LAPACK meets an exact zero pivot."""
    found = np.full(matrix.shape, np.nan)
    try:
        found[:] = np.linalg.inv(matrix)
    except Exception:
        return found
    return found


@njit(cache=True)
def solve_reduced(reduced: Reduced, rate: Floats) -> Floats:
    """Unknowns that cancel ``rate``: eq. 31, ``F = -(A_red)^-1 rate``; (k,) from (n,)."""
    size = reduced.size[0]
    right = np.empty(size)
    for j in range(size):
        right[j] = -rate[reduced.members[j]]
    found = np.zeros(size)
    filled = np.flatnonzero(right)
    if 8 * len(filled) < size:
        for i in range(size):
            for k in range(len(filled)):
                found[i] += reduced.inverse[i, filled[k]] * right[filled[k]]
    else:
        for i in range(size):
            found[i] = np.dot(reduced.inverse[i, :size], right)
    return found
