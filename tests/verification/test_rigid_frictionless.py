"""Frictionless contacts (eqs 18, 19): against enumeration, OSQP, closed forms; singular A."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.errors import ProblemError
from rigid_lcp.friction_problem import friction_problem
from rigid_lcp.frictionless import Floats, frictionless, lcp, normal_sweeps
from tests.rigid_networks import network, stored, tower

TOLERANCE = 1e-12


def enumerated(a: Floats, b: Floats) -> Floats:
    """The accelerations of eq. 19 by trying all 2^n sets of contacts that carry."""
    for carries in product([False, True], repeat=len(b)):
        inside = np.flatnonzero(carries)
        f = np.zeros(len(b))
        f[inside] = np.linalg.lstsq(a[np.ix_(inside, inside)], -b[inside], rcond=None)[0]
        found = b + a @ f
        small = 1e-9 * (1 + np.abs(b).max())
        if (f >= -small).all() and (found >= -small).all() and abs(f @ found) <= small:
            return found
    raise AssertionError("no set of contacts obeys eq. 19")


@given(st.integers(1, 7), st.integers(1, 7), st.integers(0, 10**6))
@settings(deadline=None, max_examples=60)
def test_against_enumeration(contacts: int, rank: int, seed: int) -> None:
    """A = H H^T of any rank, b in its range: a solution exists, its accelerations are unique."""
    g = np.random.default_rng(seed)
    h = g.normal(size=(contacts, rank))
    a, b = h @ h.T, h @ g.normal(size=rank)
    found = lcp(a, b)
    assert found.solved, found.message
    assert found.u == pytest.approx(enumerated(a, b), abs=1e-8 * (1 + np.abs(b).max()))
    assert (found.r >= 0).all()


@pytest.mark.parametrize("grains", [60, 200, 700])
def test_networks(grains: int) -> None:
    """Hyperstatic networks of up to 1,300 contacts, to 1e-12, in a few factorisations."""
    problem = network(grains, 0.0)
    found = frictionless(problem)
    assert found.solved, found.message
    assert found.work["exchanges"] <= 15
    assert (found.r[1::2] == 0).all()


@pytest.mark.parametrize("grains", [60, 200])
def test_as_good_as_osqp(grains: int) -> None:
    """OSQP, polished, on the same quadratic programme: same accelerations, no worse residual."""
    osqp = pytest.importorskip("osqp")
    problem = network(grains, 0.0, 1)
    a, b = problem.delassus[::2][:, ::2], problem.offset[::2]
    unit, size, n = a.diagonal().mean(), np.abs(b).max(), problem.contacts
    peer = osqp.OSQP()
    peer.setup(
        sp.csc_matrix(sp.triu(a / unit)), b / size, sp.eye(n, format="csc"), np.zeros(n),
        np.full(n, np.inf), verbose=False, polishing=True, eps_abs=1e-7, eps_rel=1e-7,
    )  # fmt: skip
    force = np.zeros(2 * n)
    force[::2] = np.maximum(peer.solve(raise_error=False).x, 0.0) * size / unit
    found = frictionless(problem)
    assert found.residual <= max(problem.residual(force), 1e-14)
    assert found.u[::2] == pytest.approx(problem.velocity(force)[::2], abs=1e-6 * size)


@pytest.mark.parametrize("top", [1.0, 1e4])
def test_towers(top: float) -> None:
    """Two contacts a face share what is above by any part; the sum is the weight."""
    found = frictionless(tower(10, 0.0, top))
    assert found.solved
    weight = 9.81e-3 * (top + np.arange(9, -1, -1.0))
    assert found.r[::2].reshape(10, 2).sum(axis=1) == pytest.approx(weight, rel=1e-9)


def test_redundant_contacts() -> None:
    """The same contact four times: A of rank one; the forces sum to the weight."""
    found = lcp(np.ones((4, 4)), -np.ones(4))
    assert found.solved
    assert found.r.sum() == pytest.approx(1.0, rel=1e-12)
    assert found.u == pytest.approx(np.zeros(4), abs=1e-12)


def test_ties() -> None:
    """b = 0: nothing moves, nothing pushes; one contact at the threshold."""
    assert lcp(np.eye(3), np.zeros(3)).solved
    found = lcp(np.eye(2), [0.0, -1.0])
    assert found.solved
    assert found.r == pytest.approx([0.0, 1.0])


def test_inconsistent_is_said() -> None:
    """A = 0 with b < 0 (a body of infinite mass that approaches) has no solution."""
    found = lcp(np.zeros((1, 1)), [-1.0])
    assert not found.solved
    assert found.message


def test_a_start_is_used() -> None:
    """From the solution the sides are right at once."""
    problem = network(200, 0.0)
    first = frictionless(problem)
    again = frictionless(problem, first.r)
    assert again.solved
    assert again.work["exchanges"] <= first.work["exchanges"]


def test_units_do_not_matter() -> None:
    """Millimetres and grams give the same accelerations, 1e3 times."""
    problem = network(60, 0.0)
    other = friction_problem(problem.delassus * 1e6, problem.offset * 1e3, 0.0, 2)
    one, two = frictionless(problem), frictionless(other)
    assert two.u[::2] == pytest.approx(1e3 * one.u[::2], abs=1e-9 * abs(other.offset).max())


def test_three_dimensions() -> None:
    """A box of mass 1 on four corners, pushed down by 1: each form of it carries 1 in all."""
    corners = np.array([[x, y] for x in (-1.0, 1.0) for y in (-1.0, 1.0)])
    h = np.zeros((12, 3))  # vertical, and two tilts, of inertia 1/2
    h[::3] = np.column_stack([np.ones(4), np.sqrt(2) * corners])
    found = frictionless(friction_problem(h @ h.T, h @ [-1.0, 0.0, 0.0], 0.0, 3))
    assert found.solved
    assert found.r[::3].sum() == pytest.approx(1.0, rel=1e-12)


def test_sweeps_against_numpy() -> None:
    """The kernel's projected Gauss-Seidel against a plain loop."""
    problem = network(30, 0.0)
    a, b = problem.delassus[::2][:, ::2].tocsr(), problem.offset[::2]
    f, plain, dense = np.zeros(len(b)), np.zeros(len(b)), a.toarray()
    normal_sweeps(a.indptr, a.indices, a.data, b, f, 3)
    for sweep in range(3):
        for c in range(len(b))[:: 1 if sweep % 2 == 0 else -1]:
            plain[c] = max(plain[c] - (b[c] + dense[c] @ plain) / dense[c, c], 0.0)
    assert f == pytest.approx(plain, rel=1e-12, abs=1e-15)


def test_what_can_not_be_posed_is_refused() -> None:
    """Friction; a matrix that does not fit; NaN."""
    with pytest.raises(ProblemError, match="friction"):
        frictionless(network(10, 0.3))
    with pytest.raises(ProblemError, match="square"):
        lcp(np.eye(3), [1.0])
    with pytest.raises(ProblemError, match="finite"):
        lcp(np.eye(1), [np.nan])
    assert lcp(np.zeros((0, 0)), []).solved


@pytest.mark.parametrize(
    "name", ["discs_125", "discs_500", "spheres_500", "tower3d_200", "Capsules-i125-1213.hdf5"]
)
def test_real_problems(name: str) -> None:
    """Stored problems with their friction taken away, to 1e-12."""
    found = frictionless(stored(name, 0.0))
    assert found.solved, found.message
