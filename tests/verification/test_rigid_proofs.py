"""Whether W gives energy, and what the solver says then; whether no forces suffice."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp import BodySpace, solve_friction
from rigid_lcp.friction.problem.definition import make_problem
from rigid_lcp.friction.problem.proofs import (
    PROOFS,
    find_least_energy,
    gives_energy,
    prove_forces_insufficient,
)
from validation.bench.rigid.packings import build_packing


def one_contact(coupling: float, mu: float):
    """W = [1, -c; -c, 1]: on r = (1, s), |s| <= mu, ``r . W r = 1 - 2 c s + s^2``."""
    return make_problem([[1.0, -coupling], [-coupling, 1.0]], [1.0, 0.0], mu, 2)


@pytest.mark.parametrize("mu", [0.0, 0.1, 0.3])
def test_least_energy_of_one_contact_is_the_closed_form(mu):
    """(1 - 3 s + s^2) / (1 + s^2) falls as s grows from 0 to 1, so its least is at the edge s = mu;
    W itself has the eigenvalue -0.5, outside the cone."""
    energy, force = find_least_energy(one_contact(1.5, mu))
    assert energy == pytest.approx((1 - 3 * mu + mu**2) / (1 + mu**2), rel=1e-6)
    assert force[1] == pytest.approx(mu * force[0], abs=1e-6)


@pytest.mark.parametrize(("mu", "given"), [(0.38, False), (0.39, True)])
def test_energy_is_given_from_the_friction_that_reaches_where_it_is_negative(mu, given):
    """1 - 3 s + s^2 is negative from s = (3 - 5^(1/2)) / 2 = 0.38197 on."""
    problem = one_contact(1.5, mu)
    assert gives_energy(problem) is given
    energy, force = find_least_energy(problem)
    assert np.sign(force @ problem.delassus @ force) == np.sign(energy)
    assert abs(force[1]) <= mu * force[0] * (1 + 1e-12)


@settings(max_examples=25)
@given(st.integers(0, 10**6), st.sampled_from([2, 3]), st.floats(0.0, 2.0))
def test_a_w_of_bodies_never_gives_energy(seed, dim, mu):
    """``r . J M^-1 J^T r = |M^-1/2 J^T r|^2``, whatever its null space."""
    generator = np.random.default_rng(seed)
    contacts = int(generator.integers(1, 8))
    jacobian = generator.standard_normal((contacts * dim, 3)) * 10.0 ** generator.integers(-6, 6)
    problem = make_problem(jacobian @ jacobian.T, np.ones(contacts * dim), mu, dim)
    assert find_least_energy(problem)[0] >= -1e-12 > -PROOFS.certain_energy


def test_the_proof_is_not_asked_of_bodies():
    """Their W is exact: nothing to look for."""
    space = BodySpace(sp.csr_array(np.eye(2, 3)), sp.csr_array(np.eye(3)), 3)
    assert not gives_energy(make_problem(space, [-1.0, 0.0], 0.5, 2))


def noisy(friction: float):
    """A settled bed of spheres, each entry of its W changed by 1e-3 of itself."""
    problem = build_packing(40, 3, seed=5, friction=friction, settle=60)
    w = problem.delassus.copy()
    w.data *= 1.0 + 1e-3 * np.random.default_rng(1).standard_normal(len(w.data))
    return make_problem(w, problem.offset, friction, 3)


def test_a_wedged_packing_with_noise_on_w_says_that_no_solution_need_exist():
    """Forces of the packing balance each other: without noise ``r . W r = 0`` on them, so noise of
    1e-3 decides the sign; the solver ends with its best point and says why."""
    problem = noisy(0.9)
    assert gives_energy(problem)
    found = solve_friction(problem.delassus, problem.offset, problem.friction, 3)
    assert found.status == "not converged"
    assert "r . W r < 0" in found.message
    assert "->" in found.message
    assert np.isfinite(found.residual)
    assert found.residual < 1e-2


def test_noise_on_w_of_a_packing_that_can_not_wedge_is_accepted():
    """At friction 0.06 no forces balance each other: W takes energy, and the answer is exact."""
    problem = noisy(0.06)
    assert not gives_energy(problem)
    assert solve_friction(problem.delassus, problem.offset, problem.friction, 3).solved


# --- no forces suffice ------------------------------------------------------------------------


@pytest.mark.parametrize("dim", [2, 3])
def test_a_contact_on_no_mass_that_approaches(dim: int) -> None:
    q = np.zeros(dim)
    q[0] = -1.0
    assert prove_forces_insufficient(make_problem(np.zeros((dim, dim)), q, 0.5, dim))
    assert not prove_forces_insufficient(make_problem(np.zeros((dim, dim)), -q, 0.5, dim))


@pytest.mark.parametrize("mu", [0.5, 2.4, 2.6, 5.0])
def test_only_enough_friction_reaches_a_contact(mu: float) -> None:
    """``u_1N = r_1N - 1``, ``u_2N = r_1T - 2.5 r_1N - 1``: forces exist for ``mu > 2.5`` only."""
    w = np.zeros((4, 4))
    w[0, 0], w[1, 1] = 1.0, 1.0
    w[2, 0], w[2, 1] = -2.5, 1.0
    q = np.array([-1.0, 0.0, -1.0, 0.0])
    assert prove_forces_insufficient(make_problem(w, q, mu, 2)) == (mu < 2.5)


@pytest.mark.parametrize("scale", [1e-12, 1e-6, 1.0, 1e12])
def test_small_entries_are_no_zeros(scale: float) -> None:
    """Two contacts that feel no other, one on a heavy body: r_N = 1 / W_NN stops each."""
    w = np.diag([1.0, 1.0, scale, scale])
    assert not prove_forces_insufficient(make_problem(w, np.array([-1, 0.3, -1, 0]), 0.3, 2))


@pytest.mark.parametrize("mu", [0.0, 0.3])
@pytest.mark.parametrize("light", [1e-9, 1e-10, 1e-11])
def test_a_light_body_between_heavy_ones_has_a_mass(light: float, mu: float) -> None:
    """1, m, 1 in a row that close: normal forces stop them as one, ``W_NN`` is regular."""
    mass = np.array([1.0, light, 1.0])
    apart = np.array([[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]])
    normal = (apart / mass) @ apart.T
    w = np.kron(normal, np.eye(2))
    problem = make_problem(w, np.kron(apart @ [1.0, 0.3, -0.7], [1.0, 0.4]), mu, 2)
    assert not prove_forces_insufficient(problem)


@settings(max_examples=40, derandomize=True)
@given(seed=st.integers(0, 10**6), dim=st.sampled_from([2, 3]), contacts=st.integers(1, 12))
def test_no_proof_where_all_can_be_stopped(seed: int, dim: int, contacts: int) -> None:
    """``q = J v``: friction without bound would stop every contact, and W r = -q has an answer in
    the cones for mu large enough."""
    g = np.random.default_rng(seed)
    jacobian = g.standard_normal((contacts * dim, contacts * dim))
    force = g.standard_normal((contacts, dim))
    force[:, 0] = np.linalg.norm(force[:, 1:], axis=1) + 0.1
    w = jacobian @ jacobian.T
    assert not prove_forces_insufficient(make_problem(w, -w @ force.ravel(), 1.0, dim))
