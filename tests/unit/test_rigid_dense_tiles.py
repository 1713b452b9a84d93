"""The dense tile of the block factorisation, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.sparse.dense_tiles import TERMS_AT_ONCE, divide_rows, subtract_product

ROUND_OFF = np.finfo(float).eps


@settings(max_examples=60)
@given(
    st.integers(0, 2**32 - 1), st.integers(1, 9), st.integers(1, 9),
    st.sampled_from([0, 1, 3, 12, TERMS_AT_ONCE, TERMS_AT_ONCE + 1, 2 * TERMS_AT_ONCE + 5]),
)  # fmt: skip
def test_a_product_is_that_of_numpy_and_nothing_else_is_touched(seed, high, wide, depth):
    """Bound: a sum of n products has an error of n round-offs of the sum of their sizes (Higham,
    Accuracy and Stability of Numerical Algorithms, section 3.1)."""
    g = np.random.default_rng(seed)
    rows, columns = 4 * high, 4 * wide
    left, right = g.standard_normal((depth + 1, rows + 3)), g.standard_normal((depth + 1, 40))
    source = g.standard_normal((rows + 2, columns + 5))
    out = np.full(source.size, 7.0)
    stride = source.shape[1]
    subtract_product(
        out, stride + 2, source.ravel(), 3, stride, left.ravel(), 1, left.shape[1],
        right.ravel(), 2, 40, depth, rows, columns,
    )  # fmt: skip
    a, b = left.ravel()[1:], right.ravel()[2:]
    a = np.array([a[k * left.shape[1] :][:rows] for k in range(depth)]).reshape(depth, rows)
    b = np.array([b[k * 40 :][:columns] for k in range(depth)]).reshape(depth, columns)
    s = np.array([source.ravel()[3 + i * stride :][:columns] for i in range(rows)])
    expected = np.full(source.size, 7.0)
    error = np.zeros(source.size)
    for i in range(rows):
        part = slice(stride + 2 + i * stride, stride + 2 + i * stride + columns)
        expected[part] = s[i] - a[:, i] @ b
        error[part] = (depth + 2) * ROUND_OFF * (np.abs(s[i]) + np.abs(a[:, i]) @ np.abs(b))
    assert (np.abs(out - expected) <= error).all()


@pytest.mark.parametrize("columns", [4, 8, 12, 16, 20, 24, 44])
@pytest.mark.parametrize("depth", [0, 1, 7])
def test_rows_are_divided_by_a_triangle(columns, depth):
    """``T X + A B = S``, put in again."""
    g = np.random.default_rng(columns + depth)
    stride = columns + 4
    numbers = g.standard_normal((depth + 4, stride))
    left = g.standard_normal((max(depth, 1), stride))
    triangle = np.tril(g.standard_normal((4, 4)), -1) + np.diag(g.uniform(1.0, 2.0, 4))
    given_ = triangle - np.diag(np.diag(triangle)) + np.diag(1.0 / np.diag(triangle))
    made = numbers.ravel().copy()
    divide_rows(
        made, depth * stride + 4, stride, left.ravel(), 2, numbers.ravel(), 4, depth, columns,
        given_.ravel(),
    )  # fmt: skip
    made = made.reshape(numbers.shape)
    again = triangle @ made[depth:, 4:] + left[:depth, 2:6].T @ numbers[:depth, 4:]
    np.testing.assert_allclose(again, numbers[depth:, 4:], atol=1e-13)
    np.testing.assert_array_equal(made[:, :4], numbers[:, :4])
