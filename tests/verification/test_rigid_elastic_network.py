"""Springs and sliders: slopes by differences, and the implicit step."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.unique.elastic_network import ElasticNetwork, find_slider_slope, find_spring_forces
from rigid_lcp.unique.micro_displacements import find_free_motion, scale_jacobian
from tests.rigid_static_problems import pyramid


@settings(max_examples=40)
@given(seed=st.integers(0, 10**6), dim=st.sampled_from([2, 3]))
def test_slider_slope_by_differences(seed, dim):
    rng = np.random.default_rng(seed)
    k = rng.uniform(0.5, 2.0, (5, 1)) * np.ones((1, dim))
    xi, mu = rng.normal(size=(5, dim)), rng.uniform(0, 1, 5)
    e = 1e-6
    coulomb = find_slider_slope(k * xi, k, mu)
    for j in range(dim):
        up, down = xi.copy(), xi.copy()
        up[:, j] += e
        down[:, j] -= e
        slope = find_spring_forces(up, k, mu) - find_spring_forces(down, k, mu)
        assert coulomb[:, :, j] == pytest.approx(slope / (2 * e), abs=1e-7)


def test_implicit_step_is_a_friction_problem():
    """`find_friction_step` balances ``d / h = Q + J^T f(xi - J d)``, the equation of
    `find_coulomb_step`, from deformations as well as from nothing; where Newton finds the move too,
    it is the same.
    """
    problem = pyramid(4, 0.3, across=2.0)
    jacobian, _ = scale_jacobian(problem.bodies)
    shape = (problem.contacts, 2)
    free = find_free_motion(jacobian, problem.offset)
    network = ElasticNetwork(jacobian, free, np.full(shape, 0.05), problem.friction)
    rng = np.random.default_rng(2)
    for deformation in (np.zeros(shape), rng.normal(size=shape) * 30):
        for h in (3.0, 100.0):
            move, found = network.find_friction_step(deformation, h)
            assert found
            _, _, left = network.find_imbalance(deformation, move, h)
            assert left < 1e-11 * network.load
            newton, converged = network.find_coulomb_step(deformation, np.zeros_like(move), h, 50)
            if converged and h == 3.0:
                assert move == pytest.approx(newton, rel=1e-8, abs=1e-9)
