"""What callers give that numpy would read without a word, or break at: one of our own sentences."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import aslinearoperator

from rigid_lcp import BodySpace, Disc, Polygon, Polyhedron, Scene, collide, solve_friction
from rigid_lcp.errors import ProblemError, SceneError, ShapeError, UsageError
from rigid_lcp.friction.problem.definition import make_problem

SQUARE = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
W = np.diag([1.0, 2.0, 1.0, 2.0])
Q = np.array([-1.0, 0.5, 1.0, 0.0])
R = np.array([1.0, -0.25, 0.0, 0.0])
"""Contact 0 sticks: ``r_T = -q_T / W_TT``, less than mu r_N = 0.5; contact 1 parts."""


# --- shapes and bodies ----------------------------------------------------------------------------


def test_masked_numbers_are_not_taken_for_what_they_hide():
    """The mask was left out: a polygon had the corners that its owner had struck out."""
    masked = np.ma.masked_equal
    with pytest.raises(ShapeError, match="masked"):
        Polyhedron(masked(np.vstack([np.zeros(3), np.eye(3)]), 1.0))
    for what in ("position", "velocity"):
        with pytest.raises(SceneError, match=what):
            Scene().add(Disc(1.0), density=1.0, **{what: masked([0.0, 5.0], 5.0)})
    scene = Scene()
    scene.add(Polygon(np.ma.array(SQUARE)), density=1.0, position=np.ma.array([0.0, 5.0]))
    assert scene.bodies[0].position[1] == 5.0  # an array without a mask is one like any other


# --- friction problems ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("w", "q", "mu", "dim", "words"),
    [
        (np.ma.masked_array(W, mask=W == 2.0), Q, 0.5, 2, "W.*masked"),
        (W, np.ma.masked_array(Q, mask=[1, 0, 0, 0]), 0.5, 2, "q.*masked"),
        (W * (1 + 1j), Q, 0.5, 2, "W is not made of numbers.*complex"),
        (sp.csr_array(W * (1 + 1j)), Q, 0.5, 2, "W is not made of numbers.*complex"),
        (aslinearoperator(W), Q, 0.5, 2, "W is not made of numbers"),
        (np.where(W == 2.0, np.inf, W), Q, 0.5, 2, "W.*not finite"),
        (W * 1e-200, Q, 0.5, 2, "W: its largest"),
        (W * 1e200, Q, 0.5, 2, "W: its largest"),
        ([], [], 0.5, 2, "1 dimensions"),
        (sp.coo_array(Q), Q, 0.5, 2, "W: it has 1 dimensions"),
        (W[:, :3], Q, 0.5, 2, "W is"),
        (W[:3, :3], Q, 0.5, 2, "W is"),
        (W, [-1.0, np.nan, 1.0, 0.0], 0.5, 2, "q.*not finite"),
        (W, Q * 1j, 0.5, 2, "q is not made of numbers"),
        (W, "no numbers", 0.5, 2, "q is not made of numbers"),
        (W, Q * 1e200, 0.5, 2, "q: its largest"),
        (W, Q[:3], 0.5, 2, "not 2 a contact"),
        (np.eye(6), np.ones((2, 3)), 0.5, 2, r"q has shape \(2, 3\)"),
        (W, Q, "0.5", 2, "mu is not made of numbers"),
        (W, Q, np.nan, 2, r"mu.*not finite.*\n.*give 0 to 1e\+06"),
        (W, Q, np.inf, 2, r"mu.*not finite.*\n.*give 0 to 1e\+06"),
        (W, Q, 1e20, 2, "contact 0: mu is 1e"),
        (W, Q, [0.5, -0.1], 2, "contact 1: mu is -0.1"),
        (W, Q, [0.5, 0.1, 0.2], 2, "mu has shape"),
        (W, Q, 0.5, 4, "dim is 4"),
        (W, Q, 0.5, 2.0, "dim is 2.0"),
        (W, Q, 0.5, np.array([2, 3]), "dim is array"),
    ],
)
def test_what_can_not_be_computed_with_is_named(w, q, mu, dim, words):
    with pytest.raises(ProblemError, match=words):
        solve_friction(w, q, mu, dim)


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"tolerance": "x"}, UsageError, "the tolerance is 'x'"),
        ({"tolerance": 0.0}, UsageError, "tolerance"),
        ({"tolerance": np.nan}, UsageError, "the tolerance is nan"),
        ({"accept": "x"}, UsageError, "the accept is 'x'"),
        ({"accept": -1.0}, UsageError, "zero or more"),
        ({"accept": np.nan}, UsageError, "the accept is nan"),
        ({"method": "magic"}, UsageError, "no method 'magic'"),
        ({"start": "x"}, ProblemError, "not made of numbers"),
        ({"start": Q * 1j}, ProblemError, "complex"),
        ({"start": Q * np.nan}, ProblemError, "start.*finite"),
        ({"start": np.zeros(3)}, ProblemError, "start.*3 numbers"),
        ({"start": Q * 1e300}, ProblemError, "choose other units"),
    ],
)
def test_options_that_are_none_get_a_sentence(options, error, words):
    with pytest.raises(error, match=words):
        solve_friction(W, Q, 0.5, 2, **options)


def test_a_start_by_components_is_not_read_by_contacts():
    """(dim, nc) holds the right count of numbers in the wrong order; (nc, dim) is right."""
    start = np.array([[1.0, 0.1], [2.0, 0.2], [3.0, 0.3]])
    assert solve_friction(np.eye(6), np.ones((3, 2)), 0.5, 2, start=start).solved
    with pytest.raises(ProblemError, match=r"start has shape \(2, 3\)"):
        solve_friction(np.eye(6), np.ones((3, 2)), 0.5, 2, start=start.T)


def bodies_of(**changed: object) -> BodySpace:
    parts = {
        "jacobian": sp.csr_array(np.eye(2, 3)), "inverse_mass": sp.csr_array(np.eye(3)),
        "body_size": 3,
    }  # fmt: skip
    return BodySpace(**(parts | changed))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"jacobian": np.eye(2, 3)}, "jacobian is no sparse matrix by rows"),
        ({"inverse_mass": sp.csc_array(np.eye(3))}, "inverse_mass is no sparse matrix by rows"),
        ({"jacobian": sp.csr_array(np.full((2, 3), np.nan))}, "jacobian holds .* not finite"),
        ({"inverse_mass": sp.csr_array(np.diag(3 * [np.nan]))}, "inverse_mass holds .* not finite"),
        ({"inverse_mass": sp.csr_array(np.diag([1.0, -1.0, 1.0]))}, "negative"),
        ({"inverse_mass": sp.csr_array(np.eye(6))}, "3 columns"),
        ({"body_size": 2}, "a body 2 freedoms"),
    ],
)
def test_factors_that_do_not_fit_are_named(changed, words):
    with pytest.raises(ProblemError, match=words):
        solve_friction(bodies_of(**changed), [-1.0, 0.0], 0.5, 2)
    assert solve_friction(bodies_of(), [-1.0, 0.0], 0.5, 2).solved


@pytest.mark.parametrize("part", [0, 1])
@pytest.mark.parametrize("kind", [complex, object])
def test_factors_that_are_not_real_are_named(part, kind):
    """Complex ones were an error of the compiler, objects one of numpy."""
    given = [sp.csr_array(np.eye(2, 3)), sp.csr_array(np.eye(3))]
    rows = given[part]
    data = rows.data.astype(kind)
    given[part] = sp.csr_array((data, rows.indices, rows.indptr), shape=rows.shape)
    bodies = BodySpace(given[0], given[1], 3)
    name = ("jacobian", "inverse_mass")[part]
    for call in (
        lambda: solve_friction(bodies, [-1.0, 0.8], 0.3, 2),
        lambda: collide(bodies, [-1.0, 0, 0], 0.5),
    ):
        with pytest.raises(ProblemError, match=f"BodySpace: {name} is not made of numbers"):
            call()


# --- what is one --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "matrix",
    [
        np.asfortranarray(W), W.astype(int), W.astype(np.float32), W.astype(object), W.tolist(),
        sp.dok_array(W), sp.lil_matrix(W), sp.csr_array(W.astype(int)), sp.csc_matrix(W),
        sp.coo_array(W),
    ],
)  # fmt: skip
def test_matrices_of_any_kind_are_the_same_problem(matrix):
    np.testing.assert_allclose(solve_friction(matrix, Q, 0.5, 2).r, R, atol=1e-14)


def test_what_the_caller_owns_stays_as_it_was():
    """W with entries twice and out of order is added up in a copy; q and mu are no views."""
    rows = sp.csr_array((np.array([1.0, 1.0, 2.0]), np.array([0, 0, 1]), np.array([0, 2, 3])))
    q, mu = np.array([-1.0, 0.5]), np.array([0.5])
    kept = rows.data.copy(), rows.indices.copy(), rows.indptr.copy()
    problem = make_problem(rows, q, mu, 2)
    for before, after in zip(kept, (rows.data, rows.indices, rows.indptr), strict=True):
        np.testing.assert_array_equal(before, after)
    np.testing.assert_array_equal(problem.delassus.toarray(), [[2.0, 0.0], [0.0, 2.0]])
    q[0], mu[0] = 7.0, 7.0
    assert problem.offset[0] == -1.0
    assert problem.friction[0] == 0.5


def test_arrays_that_can_not_be_written_are_read():
    w, q = W.copy(), Q.copy()
    w.flags.writeable = q.flags.writeable = False
    np.testing.assert_allclose(solve_friction(w, q, 0.5, 2).r, R, atol=1e-14)


@pytest.mark.parametrize("method", ["auto", "newton", "interior-point", "gauss-seidel"])
def test_no_contacts_are_solved(method):
    found = solve_friction(np.zeros((0, 0)), [], [], 3, method=method)
    assert found.solved
    assert found.r.shape == found.u.shape == (0,)


# --- what has no solution -----------------------------------------------------------------------


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
