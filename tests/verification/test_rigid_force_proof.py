"""The proof that no forces suffice: jammed wedges, masses of nothing, and no false proofs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.friction.problem.definition import friction_problem
from rigid_lcp.friction.problem.force_proof import prove_forces_insufficient


@pytest.mark.parametrize("dim", [2, 3])
def test_a_contact_on_no_mass_that_approaches(dim: int) -> None:
    q = np.zeros(dim)
    q[0] = -1.0
    assert prove_forces_insufficient(friction_problem(np.zeros((dim, dim)), q, 0.5, dim))
    assert not prove_forces_insufficient(friction_problem(np.zeros((dim, dim)), -q, 0.5, dim))


@pytest.mark.parametrize("mu", [0.5, 2.4, 2.6, 5.0])
def test_only_enough_friction_reaches_a_contact(mu: float) -> None:
    """``u_1N = r_1N - 1``, ``u_2N = r_1T - 2.5 r_1N - 1``: forces exist for ``mu > 2.5`` only."""
    w = np.zeros((4, 4))
    w[0, 0], w[1, 1] = 1.0, 1.0
    w[2, 0], w[2, 1] = -2.5, 1.0
    q = np.array([-1.0, 0.0, -1.0, 0.0])
    assert prove_forces_insufficient(friction_problem(w, q, mu, 2)) == (mu < 2.5)


@pytest.mark.parametrize("scale", [1e-12, 1e-6, 1.0, 1e12])
def test_small_entries_are_no_zeros(scale: float) -> None:
    """Two contacts that feel no other, one on a heavy body: r_N = 1 / W_NN stops each."""
    w = np.diag([1.0, 1.0, scale, scale])
    assert not prove_forces_insufficient(friction_problem(w, np.array([-1, 0.3, -1, 0]), 0.3, 2))


@pytest.mark.parametrize("mu", [0.0, 0.3])
@pytest.mark.parametrize("light", [1e-9, 1e-10, 1e-11])
def test_a_light_body_between_heavy_ones_has_a_mass(light: float, mu: float) -> None:
    """1, m, 1 in a row that close: normal forces stop them as one, ``W_NN`` is regular."""
    mass = np.array([1.0, light, 1.0])
    apart = np.array([[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]])
    normal = (apart / mass) @ apart.T
    w = np.kron(normal, np.eye(2))
    problem = friction_problem(w, np.kron(apart @ [1.0, 0.3, -0.7], [1.0, 0.4]), mu, 2)
    assert not prove_forces_insufficient(problem)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10**6), dim=st.sampled_from([2, 3]), contacts=st.integers(1, 12))
def test_no_proof_where_all_can_be_stopped(seed: int, dim: int, contacts: int) -> None:
    """``q = J v``: friction without bound would stop every contact, and W r = -q has an answer in
    the cones for mu large enough."""
    g = np.random.default_rng(seed)
    jacobian = g.standard_normal((contacts * dim, contacts * dim))
    force = g.standard_normal((contacts, dim))
    force[:, 0] = np.linalg.norm(force[:, 1:], axis=1) + 0.1
    w = jacobian @ jacobian.T
    assert not prove_forces_insufficient(friction_problem(w, -w @ force.ravel(), 1.0, dim))
