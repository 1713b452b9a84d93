"""Products with sparse matrices by rows, compiled: scipy's spend more on small ones in calls.

A matrix is given by its arrays as scipy names them: ``indptr``, ``indices``, ``data``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rigid_lcp.arrays import Floats

Integers = NDArray[Any]


@njit(cache=True)
def multiply_csr(start: Integers, index: Integers, value: Floats, x: Floats) -> Floats:
    """``A x``, (rows of A,)."""
    product = np.empty(len(start) - 1)
    for i in range(len(product)):
        total = 0.0
        for k in range(start[i], start[i + 1]):
            total += value[k] * x[index[k]]
        product[i] = total
    return product


@njit(cache=True)
def multiply_transposed(
    start: Integers, index: Integers, value: Floats, columns: int, y: Floats
) -> Floats:
    """``A^T y``, (columns of A,)."""
    product = np.zeros(columns)
    for i in range(len(start) - 1):
        for k in range(start[i], start[i + 1]):
            product[index[k]] += value[k] * y[i]
    return product


@njit(cache=True)
def multiply_factors(
    start: Integers, index: Integers, value: Floats,
    mass_start: Integers, mass_index: Integers, inverse_mass: Floats, force: Floats,
) -> Floats:  # fmt: skip
    """``J M^-1 J^T r``, (rows of J,); both matrices by rows."""
    impulse = multiply_transposed(start, index, value, len(mass_start) - 1, force)
    velocity = multiply_csr(mass_start, mass_index, inverse_mass, impulse)
    return multiply_csr(start, index, value, velocity)


@njit(cache=True)
def find_row_forms(
    start: Integers, index: Integers, value: Floats,
    mass_start: Integers, mass_index: Integers, inverse_mass: Floats, freedoms: int,
) -> Floats:  # fmt: skip
    """``J_i M^-1 J_i^T`` of every row i of J; both matrices by rows, M^-1 symmetric."""
    found, row = np.zeros(len(start) - 1), np.zeros(freedoms)
    for i in range(len(found)):
        single, before = True, -1  # every column once, with an entry on M^-1's diagonal only
        for k in range(start[i], start[i + 1]):
            column = index[k]
            m = mass_start[column]
            single = column > before and mass_start[column + 1] == m + 1 and mass_index[m] == column
            if not single:
                break
            found[i] += value[k] * inverse_mass[m] * value[k]
            before = column
        if single:
            continue
        found[i] = 0.0
        for k in range(start[i], start[i + 1]):
            row[index[k]] += value[k]
        for k in range(start[i], start[i + 1]):
            for m in range(mass_start[index[k]], mass_start[index[k] + 1]):
                found[i] += value[k] * inverse_mass[m] * row[mass_index[m]]
        for k in range(start[i], start[i + 1]):
            row[index[k]] = 0.0
    return found
