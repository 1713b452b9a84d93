"""Frictionless contacts (eqs 18, 19): against enumeration, OSQP, closed forms; singular A."""

from __future__ import annotations

import sys
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.arrays import Floats
from rigid_lcp.errors import ProblemError
from rigid_lcp.friction.attempts.frictionless import (
    build_face_solver,
    build_normal_matrix,
    solve_frictionless,
)
from rigid_lcp.friction.problem.definition import BodySpace, FrictionSolution, make_problem
from rigid_lcp.friction.sweeps.normal_matrices import sweep_normals
from tests.rigid_networks import network, network_bodies, stored, tower
from validation.bench.rigid.packings import build_packing


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


def normals_alone(a: Floats, b: Floats) -> tuple[FrictionSolution, Floats, Floats]:
    """Eq. 19 with tangents on which nothing acts: the solution, its f and its a."""
    wide, offset = np.kron(a, np.diag([1.0, 0.0])), np.kron(b, [1.0, 0.0])
    found = solve_frictionless(make_problem(wide, offset, 0.0, 2))
    return found, found.r[::2], found.u[::2]


@given(st.integers(1, 7), st.integers(1, 7), st.integers(0, 10**6))
@settings(max_examples=60)
def test_against_enumeration(contacts: int, rank: int, seed: int) -> None:
    """A = H H^T of any rank, b in its range: a solution exists, its accelerations are unique."""
    g = np.random.default_rng(seed)
    h = g.normal(size=(contacts, rank))
    a, b = h @ h.T, h @ g.normal(size=rank)
    found, force, acceleration = normals_alone(a, b)
    assert found.solved, found.message
    assert acceleration == pytest.approx(enumerated(a, b), abs=1e-8 * (1 + np.abs(b).max()))
    assert (force >= 0).all()


@pytest.mark.parametrize("grains", [60, 200, 700])
def test_networks(grains: int) -> None:
    """Hyperstatic networks of up to 1,300 contacts, to 1e-12, in a few factorisations."""
    problem = network(grains, 0.0)
    found = solve_frictionless(problem)
    assert found.solved, found.message
    assert found.work["exchanges"] <= 15
    assert (found.r[1::2] == 0).all()


@pytest.mark.parametrize("grains", [60, 200])
@pytest.mark.peer("osqp")
def test_as_good_as_osqp(grains: int) -> None:
    """OSQP, polished, on the same quadratic programme: same accelerations, no worse residual."""
    import osqp

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
    found = solve_frictionless(problem)
    assert found.residual <= max(problem.residual(force), 1e-14)
    assert found.u[::2] == pytest.approx(problem.velocity(force)[::2], abs=1e-6 * size)


@pytest.mark.parametrize("top", [1.0, 1e4])
def test_towers(top: float) -> None:
    """Two contacts a face share what is above by any part; the sum is the weight."""
    found = solve_frictionless(tower(10, 0.0, top))
    assert found.solved
    weight = 9.81e-3 * (top + np.arange(9, -1, -1.0))
    assert found.r[::2].reshape(10, 2).sum(axis=1) == pytest.approx(weight, rel=1e-9)


def test_redundant_contacts() -> None:
    """The same contact four times: A of rank one; the forces sum to the weight."""
    found, force, acceleration = normals_alone(np.ones((4, 4)), -np.ones(4))
    assert found.solved
    assert force.sum() == pytest.approx(1.0, rel=1e-12)
    assert acceleration == pytest.approx(np.zeros(4), abs=1e-12)


def test_ties() -> None:
    """b = 0: nothing moves, nothing pushes; one contact at the threshold."""
    assert normals_alone(np.eye(3), np.zeros(3))[0].solved
    found, force, _ = normals_alone(np.eye(2), np.array([0.0, -1.0]))
    assert found.solved
    assert force == pytest.approx([0.0, 1.0])


def test_inconsistent_is_said() -> None:
    """A = 0 with b < 0 (a body of infinite mass that approaches) has no solution."""
    found, _, _ = normals_alone(np.zeros((1, 1)), np.array([-1.0]))
    assert not found.solved
    assert found.message


def test_exchanges_do_not_go_round() -> None:
    """A bed on which exchanges alone came back to the same sides: 36 of them, with sweeps three."""
    made = build_packing(90, 2, seed=11)
    assert made.bodies is not None
    problem = make_problem(made.bodies, made.offset, 0.0, 2)
    found = solve_frictionless(problem)
    assert found.solved
    assert found.work["exchanges"] <= 6


def test_a_start_is_used() -> None:
    """From the solution the sides are right at once."""
    problem = network(200, 0.0)
    first = solve_frictionless(problem)
    again = solve_frictionless(problem, first.r)
    assert again.solved
    assert again.work["exchanges"] <= first.work["exchanges"]


def test_three_dimensions() -> None:
    """A box of mass 1 on four corners, pushed down by 1: each form of it carries 1 in all."""
    corners = np.array([[x, y] for x in (-1.0, 1.0) for y in (-1.0, 1.0)])
    h = np.zeros((12, 3))  # vertical, and two tilts, of inertia 1/2
    h[::3] = np.column_stack([np.ones(4), np.sqrt(2) * corners])
    found = solve_frictionless(make_problem(h @ h.T, h @ [-1.0, 0.0, 0.0], 0.0, 3))
    assert found.solved
    assert found.r[::3].sum() == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(("grains", "sweeps"), [(30, 3), (30, 40), (200, 120)])
def test_sweeps_against_numpy(grains: int, sweeps: int) -> None:
    """The kernel against plain loops: projected Gauss-Seidel, Nesterov's momentum, restarts."""
    problem = network(grains, 0.0)
    a, b = problem.delassus[::2][:, ::2].tocsr(), problem.offset[::2]
    f, dense = np.zeros(len(b)), a.toarray()
    assert sweep_normals(a.indptr, a.indices, a.data, b, f, sweeps, sweeps, -1) == sweeps
    weight = dense.diagonal()
    x, last, time, least = np.zeros(len(b)), np.zeros(len(b)), 1.0, np.inf
    for _ in range(sweeps):
        later = (1 + np.sqrt(1 + 4 * time**2)) / 2
        y = x + (time - 1) / later * (x - last)
        last, x, time = x, y.copy(), later
        for c in range(len(b)):
            x[c] = max(x[c] - (b[c] + dense[c] @ x) / dense[c, c], 0.0)
        least = min(least, weight @ (x - y) ** 2)
        if weight @ ((y - x) * (x - last)) > 0 or weight @ (x - y) ** 2 > 1.5**2 * least:
            time, least = 1.0, np.inf
    assert f == pytest.approx(x, rel=1e-6, abs=1e-9 * x.max())


def test_sweeps_end_when_sides_settle() -> None:
    """Contacts apart from each other are solved by one sweep: two rounds show it."""
    a = sp.eye_array(4, format="csr")
    f = np.zeros(4)
    done = sweep_normals(a.indptr, a.indices, a.data, np.array([1.0, -1, -2, 3]), f, 100, 5, 0)
    assert done == 10
    assert f == pytest.approx([0, 1, 2, 0])


def test_normal_part_of_w() -> None:
    """By bodies and by W itself: rows and columns of the normals, whatever the mass matrix."""
    bodies, velocity = network_bodies(40, 3)
    skew = sp.csr_array(np.kron(np.eye(40), np.array([[2.0, 0.3, 0.1], [0.3, 1, 0], [0.1, 0, 3]])))
    for space in (bodies, BodySpace(bodies.jacobian, skew, 3)):
        offset = space.jacobian @ velocity
        expected = space.matrix.toarray()[::2, ::2]
        for w in (space, space.matrix):
            found = build_normal_matrix(make_problem(w, offset, 0.0, 2))
            assert found.toarray() == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("most", [0.0, 1e9])
@pytest.mark.parametrize("skew", [0.0, 1e-3])
def test_faces(most: float, skew: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """``A + shift`` of some contacts in any order, by a band and by sparse LU, against numpy."""
    module = sys.modules[solve_frictionless.__module__]
    monkeypatch.setattr(module, "NUMBERS", replace(module.NUMBERS, band_most=most))
    g = np.random.default_rng(5)
    a = network(40, 0.0).delassus[::2][:, ::2].tocsr()
    a.data *= 1 + skew * g.normal(size=a.nnz)
    inside = g.permutation(a.shape[0])[:25].astype(np.int32)
    right = g.normal(size=25)
    expected = np.linalg.solve(a.toarray()[np.ix_(inside, inside)] + 0.1 * np.eye(25), right)
    assert build_face_solver(a, inside, 0.1)(right) == pytest.approx(expected, rel=1e-10)
    assert build_face_solver(a, inside[:0], 0.1)(right[:0]).shape == (0,)


def test_what_can_not_be_posed_is_refused() -> None:
    """Friction; no contacts are none to refuse."""
    with pytest.raises(ProblemError, match="friction"):
        solve_frictionless(network(10, 0.3))
    assert solve_frictionless(make_problem(np.zeros((0, 0)), [], 0.0, 2)).solved


@pytest.mark.parametrize(
    "name", ["discs_125", "discs_500", "spheres_500", "tower3d_200", "Capsules-i125-1213.hdf5"]
)
def test_real_problems(name: str) -> None:
    """Stored problems with their friction taken away, to 1e-12."""
    found = solve_frictionless(stored(name, 0.0))
    assert found.solved, found.message
