"""Springs and sliders: slopes and energies of the force law by differences."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.elastic_network import slider_energy, slider_forces, slider_slope
from rigid_lcp.micro_displacements import coulomb_spring


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), dim=st.sampled_from([2, 3]))
def test_slider_slope_and_energy_by_differences(seed, dim):
    rng = np.random.default_rng(seed)
    k = rng.uniform(0.5, 2.0, (5, 1)) * np.ones((1, dim))
    xi, mu = rng.normal(size=(5, dim)), rng.uniform(0, 1, 5)
    limits = rng.uniform(0, 1, 5)
    e = 1e-6
    coulomb = slider_slope(k * xi, k, mu * np.maximum((k * xi)[:, 0], 0), mu)
    tresca = slider_slope(k * xi, k, limits)
    force = slider_forces(k * xi, limits)
    for j in range(dim):
        up, down = xi.copy(), xi.copy()
        up[:, j] += e
        down[:, j] -= e
        slope = coulomb_spring(up, 0 * xi, k, mu)[0] - coulomb_spring(down, 0 * xi, k, mu)[0]
        assert coulomb[:, :, j] == pytest.approx(slope / (2 * e), abs=1e-7)
        slope = slider_forces(k * up, limits) - slider_forces(k * down, limits)
        assert tresca[:, :, j] == pytest.approx(slope / (2 * e), abs=1e-7)
        for c in range(5):
            one = xi.copy()
            one[c, j] += e
            gain = slider_energy(k * one, k, limits) - slider_energy(k * xi, k, limits)
            assert gain / e == pytest.approx(force[c, j], abs=1e-5)
