"""Friction problems in Siconos's own text files (``.dat``), as its test suite keeps them.

``frictionContactProblem_newFromFile``: dim, nc, W as a ``NumericsMatrix``, q (dim nc), mu (nc).
W is, by the number before it (``NumericsMatrix.h``),

    0   dense: rows, columns, again rows and columns, values by columns
    1   blocks (``SparseBlockStructuredMatrix``): numbers of blocks, the row and column where each
        line of blocks ends, where each row of blocks begins in the list of blocks, the column of
        each, and then each block with its number before it, values by columns
    2   sparse: columns as CSparse prints them (``cs_print``); values have six digits

Problems by masses (GFC3D) and with rolling (RFC3D) have other layouts and are refused: their first
numbers are not those of a dim of 2 or 3 and of a W that fits.
"""

import re
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.friction.files.damaged import describe_damage, refuse_damage
from rigid_lcp.friction.problem import FrictionProblem, make_problem

DENSE, BLOCKS, SPARSE = 0, 1, 2
"""Kinds of storage of a ``NumericsMatrix``."""
COLUMN = re.compile(r"col (\d+) : locations (-?\d+) to (-?\d+)")


class _Numbers:
    """The numbers of a text, taken from its beginning."""

    def __init__(self, text: str) -> None:
        self.words = text.split()
        self.at = 0

    def take(self, count: int, what: str) -> Floats:
        """The next ``count`` numbers.  Raises ValueError that names ``what`` they are."""
        words = self.words[self.at : self.at + max(count, 0)]
        if count < 0 or len(words) < count:
            raise ValueError(f"it ends within {what}: {len(words)} of {count} numbers")
        self.at += count
        try:
            return np.array(words, dtype=float)
        except ValueError as error:
            raise ValueError(f"{what}: {error}") from error

    def take_whole(self, count: int, what: str) -> Ints:
        """The next ``count`` whole numbers, none of them negative."""
        numbers = self.take(count, what)
        found = numbers.astype(np.int64) if np.isfinite(numbers).all() else np.full(count, -1)
        if (found != numbers).any() or (found < 0).any():
            raise ValueError(f"{what} are not all whole numbers from zero on")
        return found


def read_siconos_problem(path: Path) -> FrictionProblem:
    """The problem of a ``.dat`` file, in the units that it has.  Raises `ProblemError`, which says
    which part of the file is wrong."""
    remedy = (
        "give dim, number of contacts, W, q and mu as frictionContact_printInFile does; "
        "global (GFC3D) and rolling (RFC3D) problems are not known"
    )
    with refuse_damage("it can not be read as a friction problem of Siconos", str(path), remedy):
        matrix, q, mu, dim = _read_parts(path.read_text(encoding="utf-8"))
    with describe_damage(path):
        problem: FrictionProblem = make_problem(matrix, q, mu, dim)
    return problem


def _read_parts(text: str) -> tuple[sp.csr_array, Floats, Floats, int]:
    """W, q, mu and dim.  Raises ValueError."""
    begin = _Numbers(text[:200])
    dim, contacts, storage, rows, columns = (
        int(each) for each in begin.take_whole(5, "dim, contacts, storage and size of W")
    )
    if dim not in (2, 3):
        raise ValueError(f"dim is {dim}, not 2 or 3" + " (rolling friction)" * (dim == 5))
    size = dim * contacts
    if (rows, columns) != (size, size):
        raise ValueError(
            f"W is {rows} x {columns} where {contacts} contacts in {dim}D need {size} x {size}"
        )
    if storage == SPARSE:
        matrix, rest = _read_sparse(text, size)
    elif storage in (DENSE, BLOCKS):
        rest = _Numbers(text)
        rest.at = begin.at
        matrix = _read_dense(rest, size) if storage == DENSE else _read_blocks(rest, size)
    else:
        raise ValueError(f"storage of W is {storage}, not 0 (dense), 1 (blocks) or 2 (sparse)")
    q, mu = rest.take(size, "q"), rest.take(contacts, "mu")
    if (left := len(rest.words) - rest.at) > 1:  # some files end with a number more
        raise ValueError(f"{left} numbers are left over behind mu, so it is no such problem")
    return matrix, q, mu, dim


def _read_dense(numbers: _Numbers, size: int) -> sp.csr_array:
    """W by columns, its size before it once more."""
    if numbers.take_whole(2, "size of W").tolist() != [size, size]:
        raise ValueError("the two sizes of W differ")
    return sp.csr_array(numbers.take(size * size, "W").reshape(size, size).T)


def _read_blocks(numbers: _Numbers, size: int) -> sp.csr_array:
    """W of blocks in rows."""
    count, lines, across = (int(each) for each in numbers.take_whole(3, "numbers of blocks"))
    ends = [
        np.concatenate([[0], numbers.take_whole(each, "ends of the blocks")])
        for each in (lines, across)
    ]
    starts, filled = (int(each) for each in numbers.take_whole(2, "lengths of the lists of blocks"))
    begin = numbers.take_whole(starts, "where rows of blocks begin")
    column = numbers.take_whole(filled, "columns of the blocks")
    sized = all(each[-1] == size and (np.diff(each) >= 0).all() for each in ends)
    listed = filled == count and starts >= 1 and (np.diff(begin) >= 0).all()
    if not (sized and listed and starts <= lines + 1 and begin[-1] == count):
        raise ValueError("the lists of its blocks contradict each other")
    if count and column.max() >= across:
        raise ValueError(f"a block stands in column {column.max()} of {across}")
    row = np.repeat(np.arange(starts - 1), np.diff(begin))
    parts = []
    for i, j in zip(row, column, strict=True):
        high, wide = (int(end[k + 1] - end[k]) for end, k in zip(ends, (i, j), strict=True))
        numbers.take(1, "the number of a block")
        values = numbers.take(high * wide, "a block of W")
        across_it, down = np.divmod(np.arange(high * wide), max(high, 1))
        parts.append((values, ends[0][i] + down, ends[1][j] + across_it))
    if not parts:
        return sp.csr_array((size, size))
    filling, down, along = (np.concatenate(each) for each in zip(*parts, strict=True))
    return sp.csr_array(sp.coo_array((filling, (down, along)), shape=(size, size)))


def _read_sparse(text: str, size: int) -> tuple[sp.csr_array, _Numbers]:
    """W of columns as printed, and the numbers after it."""
    columns = list(COLUMN.finditer(text))
    if len(columns) != size or any(int(each[1]) != k for k, each in enumerate(columns)):
        raise ValueError(f"it prints {len(columns)} columns of W, not 0 to {size - 1} in order")
    entries = [np.zeros((0, 2))]
    for k, each in enumerate(columns):
        count = int(each[3]) - int(each[2]) + 1
        until = columns[k + 1].start() if k + 1 < size else len(text)
        inside = _Numbers(text[each.end() : until].replace(":", " "))
        entries.append(inside.take(2 * max(count, 0), f"column {k} of W").reshape(-1, 2))
    column = np.repeat(np.arange(size), [len(each) for each in entries[1:]])
    row, value = np.concatenate(entries).T
    if len(row) and (row.min() < 0 or row.max() >= size):
        raise ValueError(f"W has a value in row {row.max():.0f} of {size}")
    matrix = sp.coo_array((value, (row.astype(np.int64), column)), shape=(size, size))
    rest = inside if columns else _Numbers("")
    return sp.csr_array(matrix), rest
