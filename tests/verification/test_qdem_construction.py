"""QDEM's construction: the cells tile, the printed force is a linear finite element's, its sign."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from qdem_fem.element.kinematics import cofactor
from qdem_fem.files import Floats
from tests import qdem_construction as c

ROUND_OFF = np.finfo(float).eps


def tetrahedra(flatness: float = 1.0, count: int = 2000, seed: int = 0) -> Floats:
    """Random tetrahedra of positive volume; ``flatness`` squeezes them along a random axis."""
    generator = np.random.default_rng(seed)
    x = generator.standard_normal((count, 4, 3))
    axis = generator.standard_normal((count, 1, 3))
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
    x -= (1 - flatness) * np.sum(x * axis, axis=-1, keepdims=True) * axis
    negative = c.volume(x) < 0
    x[negative] = x[negative][:, [0, 1, 3, 2]]
    return x


def size(vertices: Floats) -> Floats:
    """Longest edge [m], (m,)."""
    return np.linalg.norm(vertices[:, :, None] - vertices[:, None], axis=-1).max(axis=(1, 2))


def stress(count: int = 2000, seed: int = 1) -> Floats:
    """Random symmetric stresses of order one [Pa]."""
    raw = np.random.default_rng(seed).standard_normal((count, 3, 3))
    return raw + np.swapaxes(raw, -1, -2)


FLATNESS = pytest.mark.parametrize("flatness", [1.0, 1e-2, 1e-5])


@FLATNESS
def test_every_cell_is_a_quarter(flatness: float) -> None:
    """Processes 1 to 3: the four cells have V/4 each.

    Areas are off by ROUND_OFF h^2, arms by ROUND_OFF h; 24 such products make 4 cells.
    """
    x = tetrahedra(flatness)
    error = np.abs(c.cell_volumes(x) - c.volume(x)[:, None] / 4).max(axis=1)
    assert np.all(error <= 24 * ROUND_OFF * size(x) ** 3)
    assert np.all(c.volume(x) > 0)


def test_interior_triangles_are_those_of_the_paper() -> None:
    """Every two vertices share <ec, fc, fc> and <vc, fc, fc>, in one plane, normal towards j."""
    x = tetrahedra(count=50)
    triangles = c.interior_triangles(x)
    assert triangles.shape == (50, 6, 2, 3, 3)
    normals = c.area_vector(triangles)
    vc = x.mean(axis=1)
    for interface, (i, j, k, l) in enumerate(c.INTERFACES):  # noqa: E741
        assert sorted((i, j, k, l)) == [0, 1, 2, 3]
        ec = x[:, [i, j]].mean(axis=1)
        fc_k, fc_l = x[:, [i, j, k]].mean(axis=1), x[:, [i, j, l]].mean(axis=1)
        for corners, expected in zip(
            triangles[:, interface].transpose(1, 0, 2, 3),
            ([ec, fc_k, fc_l], [vc, fc_l, fc_k]),
            strict=True,
        ):
            np.testing.assert_allclose(corners, np.stack(expected, axis=1), atol=1e-14)
        outer, inner = normals[:, interface, 0], normals[:, interface, 1]
        # the kite: <vc, fc, fc> has half the area of <ec, fc, fc>, and the same plane
        np.testing.assert_allclose(inner, outer / 2, atol=1e-14)
        assert np.all(np.sum(outer * (x[:, j] - ec), axis=-1) > 0)
        assert np.all(np.sum(outer * (x[:, i] - ec), axis=-1) < 0)
    assert {frozenset(pair[:2]) for pair in c.INTERFACES} == {
        frozenset(pair) for pair in permutations(range(4), 2)
    }


@FLATNESS
def test_force_is_that_of_a_linear_finite_element(flatness: float) -> None:
    """Eq. 10 with the outward normal is f_a = -V0 T cof(F) grad_X N_a, for any F.

    V0 grad_X N comes from the inverse of dX, which loses cond(dX) ROUND_OFF of its |dX|^2.
    """
    reference = tetrahedra(flatness)
    current = reference + 0.1 * flatness * np.random.default_rng(2).standard_normal((2000, 4, 3))
    T = stress()
    edges = c.edge_vectors(reference)
    gradients = np.linalg.inv(edges)
    F = c.deformation_gradient(reference, current)
    force = -c.volume(reference)[:, None, None] * (gradients @ np.swapaxes(T @ cofactor(F), -1, -2))
    expected = np.concatenate([-force.sum(axis=1, keepdims=True), force], axis=1)
    error = np.abs(c.cell_forces(current, T) - expected).max(axis=(1, 2))
    scale = np.abs(T).max(axis=(1, 2)) * np.maximum(size(current), size(reference)) ** 2
    condition = np.linalg.cond(edges)
    assert np.all(error <= 4 * ROUND_OFF * condition * scale)
    if flatness == 1.0:
        well = condition < 10
        assert well.sum() > 1000
        assert np.all(error[well] < 1e-13 * scale[well])


@FLATNESS
def test_equal_thirds_of_the_outer_faces_give_the_same(flatness: float) -> None:
    """The paper's simpler alternative to eq. 10, slivers included: only areas enter, no inverse."""
    x, T = tetrahedra(flatness), stress()
    error = np.abs(c.cell_forces(x, T) - c.cell_forces_from_faces(x, T)).max(axis=(1, 2))
    assert np.all(error <= 20 * ROUND_OFF * np.abs(T).max(axis=(1, 2)) * size(x) ** 2)


@FLATNESS
def test_forces_and_moments_balance(flatness: float) -> None:
    """sum f_a = 0, and sum x_a x f_a = 0, as T is symmetric (Boltzmann's axiom)."""
    x, T = tetrahedra(flatness), stress()
    force = c.cell_forces(x, T)
    scale = np.abs(T).max(axis=(1, 2)) * size(x) ** 2
    assert np.all(np.abs(force.sum(axis=1)).max(axis=1) <= 4 * ROUND_OFF * scale)
    arm = x - x.mean(axis=1, keepdims=True)
    moment = np.cross(arm, force).sum(axis=1)
    assert np.all(np.abs(moment).max(axis=1) <= 20 * ROUND_OFF * scale * size(x))
    # an unsymmetric stress does turn the tetrahedron: the check can fail
    turned = T + np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 0]])
    moment = np.cross(arm, c.cell_forces(x, turned)).sum(axis=1)
    assert np.all(np.abs(moment[:, 2]) > 0.9 * 2 * c.volume(x))


def test_printed_sign_pushes_a_stretched_tetrahedron_apart() -> None:
    """Printed eqs 9, 10 are minus the restoring force, exactly."""
    x, T = tetrahedra(count=100), stress(100)
    printed = c.cell_forces(x, T, as_printed=True)
    np.testing.assert_array_equal(printed, -c.cell_forces(x, T))
    stretched = 1.01 * x[0]
    eps = c.strain_finger(c.deformation_gradient(x[0], stretched))
    tension = c.stress_elastic(eps, 1.0, 1.0)
    outwards = stretched - stretched.mean(axis=0)
    for as_printed, sign in ((False, -1), (True, 1)):
        force = c.cell_forces(stretched, tension, as_printed=as_printed)
        # the virial, sum x_a . f_a = -V tr T
        virial = sign * c.volume(stretched) * np.trace(tension)
        assert np.sum(outwards * force) == pytest.approx(virial, rel=1e-13)


def test_five_triangles_of_the_printed_list_are_not_enough() -> None:
    """Without <vc, fc_124, fc_134> cells 1 and 4 of the paper are open: their forces are off."""
    x, T = tetrahedra(count=100), stress(100)
    missing = c.INTERFACES.index((0, 3, 1, 2))
    f = c.force_on_triangle(T[:, None], c.area_vector(c.interior_triangles(x))[:, missing])
    # a third of what cells 1 and 4 exchange, and not nothing
    np.testing.assert_allclose(f[:, 1], f.sum(axis=1) / 3, atol=1e-13)
    assert np.all(np.abs(f[:, 1]).max(axis=1) > 0)
