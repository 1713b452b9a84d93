"""`solve_friction` answers malformed input by a sentence, and hopeless problems by a status."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from rigid_lcp import solve_friction
from rigid_lcp.errors import ProblemError, UsageError
from rigid_lcp.friction.attempts.frictionless import lcp

W = np.diag([1.0, 2.0, 1.0, 2.0])
Q = np.array([-1.0, 0.5, 1.0, 0.0])


@pytest.mark.parametrize(
    ("w", "q", "mu", "dim", "words"),
    [
        (W, [-1.0, np.nan, 1.0, 0.0], 0.5, 2, "q.*not finite"),
        (np.where(W == 2.0, np.inf, W), Q, 0.5, 2, "W.*not finite"),
        (W, Q, [0.5, -0.1], 2, "contact 1.*negative"),
        (W, Q, [0.5, 0.1, 0.2], 2, "mu has shape"),
        (W[:, :3], Q, 0.5, 2, "W is"),
        (W[:3, :3], Q, 0.5, 2, "W is"),
        (W, Q[:3], 0.5, 2, "not 2 a contact"),
        (W, Q, 0.5, 4, "dim is 4"),
        (W, "no numbers", 0.5, 2, "q is not made of numbers"),
    ],
)
def test_malformed_input_is_named(w, q, mu, dim, words):
    with pytest.raises(ProblemError, match=words):
        solve_friction(w, q, mu, dim)


@pytest.mark.parametrize("mu", [np.inf, np.nan])
def test_error_for_unbounded_friction_says_what_can_be_given(mu):
    with pytest.raises(ProblemError, match=r"mu.*\n.*give 0 to 1e\+06"):
        solve_friction(np.eye(2), [-1.0, 0.0], mu, 2)


def test_a_bad_start_method_or_tolerance_is_named():
    with pytest.raises(ProblemError, match=r"start.*3 numbers"):
        solve_friction(W, Q, 0.5, 2, start=np.zeros(3))
    with pytest.raises(ProblemError, match=r"start.*finite"):
        solve_friction(W, Q, 0.5, 2, start=np.full(4, np.nan))
    with pytest.raises(UsageError, match="no method 'magic'"):
        solve_friction(W, Q, 0.5, 2, method="magic")
    with pytest.raises(UsageError, match="tolerance"):
        solve_friction(W, Q, 0.5, 2, tolerance=0.0)


@pytest.mark.parametrize("method", ["auto", "newton", "interior-point", "gauss-seidel"])
def test_no_contacts_are_solved(method):
    found = solve_friction(np.zeros((0, 0)), [], [], 3, method=method)
    assert found.solved
    assert found.r.shape == found.u.shape == (0,)


@pytest.mark.parametrize("kind", [np.asarray, sp.csr_array, sp.csc_matrix, sp.coo_array])
def test_dense_and_sparse_matrices_of_any_kind(kind):
    # contact 0 sticks: u_T = 0 takes r_T = -0.25, which mu r_N = 0.5 allows; contact 1 is open
    found = solve_friction(kind(W), Q, 0.5, 2)
    assert found.solved
    np.testing.assert_allclose(found.r, [1.0, -0.25, 0.0, 0.0], atol=1e-12)


def test_a_contact_that_bears_on_no_mass_has_no_solution():
    """W = 0 and q_N < 0: no force changes the approach; a linear programme proves it."""
    for tangential in (0.0, 0.5):  # with it forces grew until their size hid the approach
        found = solve_friction(np.zeros((2, 2)), [-1.0, tangential], 0.3, 2)
        assert found.status == "no solution"
        assert "mass" in found.message
        assert found.residual > 0.1
        assert np.abs(found.r).max() < 1e6


def test_a_negative_normal_mass_has_no_solution():
    """W_NN < 0 (no W of real bodies): any force only adds to the approach."""
    found = solve_friction(-np.eye(3), [-1.0, 0.0, 0.0], 0.0, 3)
    assert found.status == "no solution"
    assert np.isfinite(found.r).all()


def test_the_work_of_one_failed_contact_does_not_spoil_the_others():
    """Two islands, one without a solution: the other's forces are those it has alone."""
    w = np.zeros((4, 4))
    w[2:, 2:] = np.eye(2)
    found = solve_friction(w, [-1.0, 0.0, -3.0, 0.0], 0.5, 2)
    assert found.status == "no solution"
    np.testing.assert_allclose(found.r[2:], [3.0, 0.0], atol=1e-9)


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"tolerance": "x"}, UsageError, "the tolerance is 'x'"),
        ({"tolerance": np.nan}, UsageError, "the tolerance is nan"),
        ({"accept": "x"}, UsageError, "the accept is 'x'"),
        ({"accept": -1.0}, UsageError, "zero or more"),
        ({"accept": np.nan}, UsageError, "the accept is nan"),
        ({"start": "x"}, ProblemError, "not made of numbers"),
        ({"start": [1j, 0.0]}, ProblemError, "complex"),
        ({"start": [1e300, 0.0]}, ProblemError, "choose other units"),
    ],
)
def test_options_that_are_no_numbers_get_a_sentence(options, error, words):
    with pytest.raises(error, match=words):
        solve_friction(np.eye(2), [-1.0, 0.0], 0.5, 2, **options)


def test_the_frictionless_problem_refuses_and_proves_as_the_one_with_friction_does():
    with pytest.raises(ProblemError, match="b is not made of numbers"):
        lcp(np.eye(2), "ab")
    with pytest.raises(ProblemError, match="it has 1 numbers and b has 2"):
        lcp(np.eye(2), [-1.0, 1.0], start=[1.0])
    found = lcp(-np.eye(2), [-1.0, -1.0])  # f >= 0 only adds to the approach
    assert found.status == "no solution"
    assert "->" in found.message
