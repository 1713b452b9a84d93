"""An element that makes the step short is named; even meshes are not spoken of."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import qdem_fem as q
from qdem_fem.files.errors import StepWarning
from qdem_fem.mesh.generation import make_box_mesh

MATERIAL = q.Material(1e6, 0.2, 1e3)


def flattened(share: float) -> tuple[np.ndarray, np.ndarray]:
    """A box of tetrahedra with an inner node pushed towards a face of one of its elements."""
    mesh = make_box_mesh((1.0, 1.0, 1.0), (3, 3, 3), "kuhn")
    nodes = mesh.nodes.copy()
    inner = int(np.argmin(np.linalg.norm(nodes - 1 / 3, axis=1)))
    element = mesh.elements[(mesh.elements == inner).any(axis=1)][0]
    face = nodes[element[element != inner]]
    normal = np.cross(face[1] - face[0], face[2] - face[0])
    normal /= np.linalg.norm(normal)
    nodes[inner] -= (1 - share) * ((nodes[inner] - face[0]) @ normal) * normal
    return nodes, mesh.elements


def test_a_sliver_that_governs_the_step_is_named_once() -> None:
    body = q.Body(flattened(0.01), MATERIAL, name="stone")
    run = q.Simulation([body], threads=1)
    thin = [int(k) for k in np.flatnonzero(body.gradients[1] < 0.02 * np.median(body.gradients[1]))]
    with pytest.warns(StepWarning, match="of stone makes the critical step") as said:
        run.advance(run.step)
    assert len(said) == 1
    assert run.critical_step.element in thin
    assert f"element {run.critical_step.element} " in str(said[0].message)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run.advance(run.step)


def test_an_even_mesh_and_a_step_of_the_users_own_are_not_spoken_of() -> None:
    even = q.Simulation([q.Body(flattened(1.0), MATERIAL)], threads=1)
    even.advance(even.step)
    assert even.critical_step.remark == ""
    chosen = q.Simulation([q.Body(flattened(0.01), MATERIAL)], threads=1, step=1e-6)
    chosen.advance(chosen.step)
