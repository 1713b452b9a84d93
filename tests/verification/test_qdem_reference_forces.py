"""The stress laws in NumPy: exact values, potentials, scikit-fem, the paper.

What every law satisfies is in `tests.contracts.test_strain_measures`.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from itertools import pairwise
from typing import get_args

import numpy as np
import pytest
import skfem
from scipy.spatial.transform import Rotation
from skfem.models.elasticity import linear_elasticity

from qdem_fem.element.strain_measures import MEASURES, Strain
from qdem_fem.files import Floats
from tests import qdem_reference_forces as r
from tests.qdem_construction import edge_vectors, internal_forces_constructed, volume
from tests.qdem_reference_forces import Elements

ROUND_OFF = np.finfo(float).eps
LAWS: tuple[Strain, ...] = get_args(Strain)
LAW = pytest.mark.parametrize("law", LAWS)
SCALE = pytest.mark.parametrize("scale", [1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0])
LAMBDA, MU = 0.6, 1.2


def lame(poisson: float) -> tuple[float, float]:
    """lambda, mu for E = 1 Pa."""
    return poisson / ((1 + poisson) * (1 - 2 * poisson)), 1 / (2 * (1 + poisson))


def gradients(scale: float, count: int = 200, seed: int = 0) -> Floats:
    """Random H of the given size, with det(I + H) > 0."""
    generator = np.random.default_rng(seed)
    H = scale * generator.uniform(-1, 1, (4 * count, 3, 3))
    return H[np.linalg.det(np.eye(3) + H) > 0.05][:count]


def mesh_elements(nodes: Floats, elements: np.ndarray) -> Elements:
    vertices = nodes[elements]
    return Elements(elements, np.linalg.inv(edge_vectors(vertices)), volume(vertices))


def box(refinements: int = 2) -> tuple[skfem.MeshTet, Floats, Elements]:
    """A cube with disturbed inner nodes, elements of positive volume."""
    mesh = skfem.MeshTet().refined(refinements)
    nodes = mesh.p.T.copy()
    inner = mesh.interior_nodes()
    nodes[inner] += 0.03 * np.random.default_rng(5).uniform(-1, 1, (len(inner), 3))
    elements = mesh.t.T.astype(np.int64)
    negative = volume(nodes[elements]) < 0
    elements[negative] = elements[negative][:, [0, 1, 3, 2]]
    disturbed = skfem.MeshTet(nodes.T.copy(), elements.T.copy())
    return disturbed, nodes, mesh_elements(nodes, elements)


# --- exact values ------------------------------------------------------------------------------

Exact = list[list[Fraction]]


def exact(matrix: Floats) -> Exact:
    return [[Fraction(float(value)) for value in row] for row in matrix]


def plus(A: Exact, B: Exact, a: Fraction | int = 1, b: Fraction | int = 1) -> Exact:
    return [[a * A[i][j] + b * B[i][j] for j in range(3)] for i in range(3)]


def times(A: Exact, B: Exact) -> Exact:
    return [[sum(A[i][k] * B[k][j] for k in range(3)) for j in range(3)] for i in range(3)]  # type: ignore[misc]


def turned(A: Exact) -> Exact:
    return [list(row) for row in zip(*A, strict=True)]


def minors(A: Exact) -> Exact:
    return [
        [
            A[(i + 1) % 3][(j + 1) % 3] * A[(i + 2) % 3][(j + 2) % 3]
            - A[(i + 1) % 3][(j + 2) % 3] * A[(i + 2) % 3][(j + 1) % 3]
            for j in range(3)
        ]
        for i in range(3)
    ]


UNIT = exact(np.eye(3))


def hooke(A: Exact) -> Exact:
    first, second = Fraction(LAMBDA), Fraction(MU)
    return plus(UNIT, A, first * (A[0][0] + A[1][1] + A[2][2]), 2 * second)


def stress_exact(law: Strain, H: Floats) -> Floats:
    """P of one H by the definitions in rational numbers, rounded once at the end."""
    h = exact(H)
    F = plus(UNIT, h)
    half = Fraction(1, 2)
    green = plus(times(turned(F), F), UNIT, half, -half)
    if law == "finger":
        P = times(hooke(plus(times(F, turned(F)), UNIT, half, -half)), minors(F))
    elif law == "small":
        P = hooke(plus(h, turned(h), half, half))
    else:
        P = times(F, hooke(green))
    return np.array([[float(value) for value in row] for row in P])


@SCALE
@LAW
def test_stress_keeps_its_digits_at_every_scale(law: Strain, scale: float) -> None:
    """P against exact arithmetic: an error of round-off times the stress scale, not times 1.

    Each law sums about 10 products of at most (1 + |H|)^3 (lambda + 2 mu) |H|, on arrays and as the
    kernels do it.  F F^T - I in floating point would fail below 1e-3.
    """
    H = gradients(scale, 10)
    P = r.STRESS[law](H, LAMBDA, MU)
    numbers, _ = MEASURES[law].find_stress_numbers(tuple(H.reshape(-1, 9).T), LAMBDA, MU, 0.5)
    for found, other, h in zip(P, np.stack(numbers, -1).reshape(-1, 3, 3), H, strict=True):
        expected = stress_exact(law, h)
        size = (LAMBDA + 2 * MU) * np.linalg.norm(h) * (1 + np.linalg.norm(h)) ** 3
        assert np.abs(found - expected).max() <= 10 * ROUND_OFF * size
        assert np.abs(other - expected).max() <= 10 * ROUND_OFF * size


@pytest.mark.parametrize("stretch", [-0.3, 1e-8, 0.5])
def test_uniaxial_stretch(stretch: float) -> None:
    """F = diag(1 + a, 1, 1), M = lambda + 2 mu: P_11 = T_11 in ``finger`` as the area stays,
    M (a + a^2/2), with 1 + a more in ``svk``; M a in ``small``."""
    H = np.zeros((1, 3, 3))
    H[0, 0, 0] = a = stretch
    modulus = LAMBDA + 2 * MU
    green = modulus * (a + a * a / 2)
    expected = {"finger": green, "svk": green * (1 + a), "small": modulus * a}
    for law, value in expected.items():
        P = r.STRESS[law](H, LAMBDA, MU)
        assert P[0, 0, 0] == pytest.approx(value, rel=1e-14)
        cauchy = r.compute_cauchy_stress(H, P, law)  # type: ignore[arg-type]
        assert cauchy[0, 0, 0] == pytest.approx(value, rel=1e-14)


def test_cauchy_and_von_mises() -> None:
    """T = P F^T/J is the finger T; uniaxial stress s has von Mises |s|, shear t sqrt(3) t."""
    H = gradients(0.3)
    P = r.stress_finger(H, LAMBDA, MU)
    T = r.apply_hooke(r.strain_finger(H), LAMBDA, MU)
    np.testing.assert_allclose(r.compute_cauchy_stress(H, P, "finger"), T, atol=1e-13)
    T = r.compute_cauchy_stress(H, r.STRESS["svk"](H, LAMBDA, MU), "svk")
    np.testing.assert_allclose(T, np.swapaxes(T, -1, -2), atol=1e-12)
    pull, shear = np.diag([-7.0, 0, 0]), np.array([[0, 2.0, 0], [2.0, 0, 0], [0, 0, 0]])
    found = r.find_von_mises(np.stack([pull, shear, 5 * np.eye(3)]))
    np.testing.assert_allclose(found, [7.0, 2 * np.sqrt(3), 0.0], atol=1e-15)


def test_volume_change_and_cofactor() -> None:
    """J - 1 and cof F against det F and det(F) F^-T; j = tr H for the smallest H."""
    H = gradients(0.5)
    F = np.eye(3) + H
    J = np.linalg.det(F)
    np.testing.assert_allclose(r.find_volume_change(H), J - 1, atol=1e-14)
    adjugate = J[:, None, None] * np.swapaxes(np.linalg.inv(F), -1, -2)
    np.testing.assert_allclose(r.find_cofactor(F), adjugate, atol=1e-13)
    H = gradients(1e-15)
    np.testing.assert_allclose(
        r.find_volume_change(H), r.find_trace(H)[:, 0, 0], rtol=0, atol=1e-29
    )


# --- objectivity -------------------------------------------------------------------------------


def test_viscous_stress_is_objective() -> None:
    """Of a motion with the spin of Q on top: P_D(QF, (QF)') = Q P_D(F, F')."""
    H, H_rate = gradients(0.3), gradients(1.0, seed=1)
    Q = Rotation.random(len(H), random_state=2).as_matrix()
    spin = np.cross(np.eye(3)[None], np.random.default_rng(3).standard_normal((len(H), 1, 3)))
    turned_H = Q @ (np.eye(3) + H) - np.eye(3)
    turned_rate = Q @ H_rate + Q @ spin @ (np.eye(3) + H)
    P_D = r.stress_viscous(H, H_rate, -0.8, 1.2)
    found = r.stress_viscous(turned_H, turned_rate, -0.8, 1.2)
    np.testing.assert_allclose(found, Q @ P_D, rtol=0, atol=1e-12)


def test_small_strain_is_not_objective() -> None:
    """A pure turn by theta about z: e_xx = cos(theta) - 1, the error that ``small`` makes."""
    H = Rotation.from_rotvec([0, 0, 0.1]).as_matrix()[None] - np.eye(3)
    P = r.stress_small(H, LAMBDA, MU)
    assert P[0, 2, 2] == pytest.approx(2 * LAMBDA * (np.cos(0.1) - 1))


# --- potentials --------------------------------------------------------------------------------


@pytest.mark.parametrize("law", ["small", "svk"])
def test_stress_is_the_slope_of_the_energy_at_any_poisson(law: Strain) -> None:
    """dW = P : dH along random ways at nu = 0.3; the contract has all components at lambda = mu."""
    H, way, one = gradients(0.2, 20), 1e-4 * gradients(1.0, 20, seed=1), np.ones(20)
    ahead, behind = (r.compute_elastic_energy(H + k * way, one, *lame(0.3), law) for k in (1, -1))
    P = r.STRESS[law](H, *lame(0.3))
    np.testing.assert_allclose((ahead - behind) / 2, r.contract(P, way), rtol=0, atol=1e-10)


def test_finger_energy_is_that_of_linear_elasticity_to_first_order() -> None:
    """For lambda != mu there is no potential: W is positive, and off by the order of the strain."""
    lam, mu = lame(0.167)
    direction = gradients(1.0, 20)
    error = []
    for scale in (1e-3, 1e-4):
        H = scale * direction
        small = r.compute_elastic_energy(H, np.ones(20), lam, mu, "small")
        finger = r.compute_elastic_energy(H, np.ones(20), lam, mu, "finger")
        assert np.all(finger > 0)
        error.append(np.abs(finger / small - 1).max())
    assert np.log10(error[0] / error[1]) == pytest.approx(1, abs=0.05)


def loop_work(stress: Callable[[Floats], Floats], corners: list[Floats]) -> float:
    """Work of P along straight lines in H, by Gauss points: exact for polynomials to degree 9."""
    point, weight = np.polynomial.legendre.leggauss(5)
    total = 0.0
    for start, end in pairwise(corners):
        H = start + (end - start) * ((1 + point) / 2)[:, None, None]
        total += np.sum(weight / 2 * np.einsum("gij,ij->g", stress(H), end - start))
    return total


@pytest.mark.parametrize("strain", [1e-5, 1e-3])
def test_closed_loops(strain: float) -> None:
    """Swell by a, shear by a, shrink, unshear: work over stored energy.

    Only (lambda - mu) tr(eps) dJ of the finger law has no potential.  With tr(eps) = 3 s + 3/2 s^2
    + t^2, J = (1 + s)((1 + s)^2 - t^2), Green's theorem gives -6 (lambda - mu) a^3 to first
    order, over (9/2 lambda + 3 mu + 2 mu) a^2: 4.1e-6 at a = 1e-5 and nu = 0.167.
    """
    swell = strain * np.eye(3)
    shear = strain * np.array([[0, 1, 0], [1, 0, 0], [0, 0, 0.0]])
    loop = [np.zeros((3, 3)), swell, swell + shear, shear, np.zeros((3, 3))]
    lam, mu = lame(0.167)
    stored = (4.5 * lam + 5 * mu) * strain**2

    def ratio(law: Strain, first: float, second: float) -> float:
        return loop_work(lambda H: r.STRESS[law](H, first, second), loop) / stored

    expected = -6 * (lam - mu) * strain / (4.5 * lam + 5 * mu)
    assert ratio("finger", lam, mu) == pytest.approx(expected, rel=3 * strain + 1e-8)
    if strain == 1e-5:
        assert ratio("finger", lam, mu) == pytest.approx(4.1e-6, rel=0.01)
    assert abs(ratio("finger", mu, mu)) < 20 * ROUND_OFF
    for law in ("small", "svk"):
        assert abs(ratio(law, lam, mu)) < 20 * ROUND_OFF  # type: ignore[arg-type]


# --- on meshes ---------------------------------------------------------------------------------


def test_small_is_scikit_fem() -> None:
    """Forces are -K u - C v of linear finite elements assembled by scikit-fem."""
    mesh, nodes, elements = box()
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTetP1()), intorder=0)
    K = skfem.asm(linear_elasticity(LAMBDA, MU), basis)
    C = skfem.asm(linear_elasticity(-MU, MU), basis)  # the dashpot of eq. 14: lambda_D = -mu_D
    generator = np.random.default_rng(7)
    u, v = 1e-6 * generator.standard_normal((2, *nodes.shape))
    order = basis.nodal_dofs.T
    force = r.internal_forces(elements, u, v, (LAMBDA, MU), (-MU, MU), "small")
    state_u, state_v = np.zeros((2, K.shape[0]))
    state_u[order], state_v[order] = u, v
    expected = -(K @ state_u + C @ state_v)[order]
    assert np.abs(force - expected).max() < 1e-12 * np.abs(expected).max()


@pytest.mark.parametrize("viscous", [(0.0, 0.0), (-0.8, 1.2)])
def test_finger_is_the_construction_of_the_paper(viscous: tuple[float, float]) -> None:
    """Closed form and twelve triangles: the same forces on every particle, large strains too."""
    _, nodes, elements = box(1)
    generator = np.random.default_rng(8)
    u, v = 0.05 * generator.standard_normal((2, *nodes.shape))
    each = np.linspace(0.5, 1.5, len(elements.nodes))
    force = r.internal_forces(elements, u, v, (each, MU), viscous)
    expected = internal_forces_constructed(nodes, elements.nodes, u, v, (each, MU), viscous)
    np.testing.assert_allclose(force, expected, rtol=0, atol=1e-14 * 10)
    assert np.abs(force).max() > 0.01
