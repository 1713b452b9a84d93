"""Patch test: a uniform gradient on irregular meshes gives its own stress and pulls no inner node.

A linear tetrahedron holds every constant gradient exactly, so both errors are round-off alone.
"""

from __future__ import annotations

import numpy as np
import pytest

from qdem_fem import Body, Material, Simulation
from qdem_fem.mesh.generation import make_box_mesh
from tests.qdem_reference_forces import compute_cauchy_stress, stress_finger
from validation.bench.qdem.meshes import jitter_nodes

SOFT = Material(young=1e6, poisson=0.25, density=1000.0)


@pytest.mark.parametrize("seed", range(5))
def test_a_uniform_gradient_is_exact(seed: int) -> None:
    """Random gradients of 10 % with rotation on random meshes; one short step from rest."""
    generator = np.random.default_rng(seed)
    mesh = jitter_nodes(make_box_mesh((1.0, 0.8, 0.7), (4, 3, 3)), 0.24, seed)
    body = Body(mesh, SOFT)
    run = Simulation([body], threads=1, safety=1e-7)  # so short a step that v = a dt
    gradient = 0.1 * generator.standard_normal((3, 3))
    body.displacement = mesh.nodes @ gradient.T + generator.standard_normal(3)
    nominal = stress_finger(gradient[None], SOFT.lame_first, SOFT.lame_second)
    expected = compute_cauchy_stress(gradient[None], nominal, "finger")
    assert np.abs(body.stress() - expected).max() < 1e-12 * np.abs(expected).max()
    run.advance(run.step)
    acceleration = np.linalg.norm(body.velocity, axis=1)
    surface = np.zeros(len(mesh.nodes), bool)
    surface[body.surface.ravel()] = True
    assert not surface.all()
    assert acceleration[~surface].max() < 1e-10 * acceleration[surface].max()
