"""The four stress laws in NumPy: exact values, objectivity, potentials, scikit-fem, the paper."""

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

from qdem_fem.element.kinematics import FloatArray
from qdem_fem.element.strain_measures import Strain
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


def gradients(scale: float, count: int = 200, seed: int = 0) -> FloatArray:
    """Random H of the given size, with det(I + H) > 0."""
    generator = np.random.default_rng(seed)
    H = scale * generator.uniform(-1, 1, (4 * count, 3, 3))
    return H[np.linalg.det(np.eye(3) + H) > 0.05][:count]


def mesh_elements(nodes: FloatArray, elements: np.ndarray) -> Elements:
    vertices = nodes[elements]
    return Elements(elements, np.linalg.inv(edge_vectors(vertices)), volume(vertices))


def box(refinements: int = 2) -> tuple[skfem.MeshTet, FloatArray, Elements]:
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


def exact(matrix: FloatArray) -> Exact:
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


def inverse(A: Exact) -> Exact:
    C = minors(A)
    determinant = sum(A[0][j] * C[0][j] for j in range(3))
    return [[C[j][i] / determinant for j in range(3)] for i in range(3)]


UNIT = exact(np.eye(3))


def hooke(A: Exact) -> Exact:
    first, second = Fraction(LAMBDA), Fraction(MU)
    return plus(UNIT, A, first * (A[0][0] + A[1][1] + A[2][2]), 2 * second)


def stress_exact(law: Strain, H: FloatArray) -> FloatArray:
    """P of one H by the definitions in rational numbers, rounded once at the end."""
    h = exact(H)
    F = plus(UNIT, h)
    half = Fraction(1, 2)
    green = plus(times(turned(F), F), UNIT, half, -half)
    if law == "finger":
        P = times(hooke(plus(times(F, turned(F)), UNIT, half, -half)), minors(F))
    elif law == "small":
        P = hooke(plus(h, turned(h), half, half))
    elif law == "svk":
        P = times(F, hooke(green))
    else:
        # Newton for Y^2 + 2 Y = 2 E with Y commuting with E; what rounding to 100 decimals takes
        # away from that grows with each step, so it stops as soon as it is there
        Y, residual = green, UNIT
        while max(abs(value) for row in residual for value in row) > Fraction(1, 10**40):
            Y = times(inverse(plus(UNIT, Y, 2, 2)), plus(times(Y, Y), green, 1, 2))
            Y = [[Fraction(round(value * 10**100), 10**100) for value in row] for row in Y]
            residual = plus(plus(times(Y, Y), Y, 1, 2), green, 1, -2)
        P = times(times(F, inverse(plus(UNIT, Y))), hooke(Y))
    return np.array([[float(value) for value in row] for row in P])


@SCALE
@LAW
def test_stress_keeps_its_digits_at_every_scale(law: Strain, scale: float) -> None:
    """P against exact arithmetic: an error of round-off times the stress scale, not times 1.

    Each law sums about 10 products of at most (1 + |H|)^3 (lambda + 2 mu) |H|; the inverse of U
    costs its condition number more.  F F^T - I in floating point would fail below 1e-3.
    """
    H = gradients(scale, 6)
    P = r.STRESS[law](H, LAMBDA, MU)
    for found, h in zip(P, H, strict=True):
        expected = stress_exact(law, h)
        size = (LAMBDA + 2 * MU) * np.linalg.norm(h) * (1 + np.linalg.norm(h)) ** 3
        condition = np.linalg.cond(np.eye(3) + h) if law == "corotational" else 1
        assert np.abs(found - expected).max() <= 10 * ROUND_OFF * size * condition


@SCALE
def test_expanded_finger_stress_is_the_finger_stress(scale: float) -> None:
    """alpha I + beta H + gamma K against exact T cof(F), and against its twin on many H."""
    H = gradients(scale)
    P = r.stress_finger_expanded(H, LAMBDA, MU)
    size = np.linalg.norm(H, axis=(1, 2))
    size = (LAMBDA + 2 * MU) * size * (1 + size) ** 3
    for found, h, limit in zip(P[:10], H, size, strict=False):
        assert np.abs(found - stress_exact("finger", h)).max() <= 10 * ROUND_OFF * limit
    error = np.abs(P - r.stress_finger(H, LAMBDA, MU)).max(axis=(1, 2))
    assert np.all(error <= 20 * ROUND_OFF * size)
    each = np.linspace(0.5, 1.5, len(H))  # constants for each element
    np.testing.assert_allclose(
        r.stress_finger_expanded(H, each, 2 * each),
        r.stress_finger(H, each, 2 * each),
        rtol=0,
        atol=20 * ROUND_OFF * size.max() * 2,
    )


@pytest.mark.parametrize("stretch", [-0.3, 1e-8, 0.5])
def test_uniaxial_stretch(stretch: float) -> None:
    """F = diag(1 + a, 1, 1), M = lambda + 2 mu: P_11 = T_11 in ``finger`` as the area stays,
    M (a + a^2/2), with 1 + a more in ``svk``; M a in ``small`` and ``corotational``."""
    H = np.zeros((1, 3, 3))
    H[0, 0, 0] = a = stretch
    modulus = LAMBDA + 2 * MU
    green = modulus * (a + a * a / 2)
    expected = {
        "finger": green, "svk": green * (1 + a), "small": modulus * a, "corotational": modulus * a
    }  # fmt: skip
    for law, value in expected.items():
        P = r.STRESS[law](H, LAMBDA, MU)
        assert P[0, 0, 0] == pytest.approx(value, rel=1e-14)
        cauchy = r.stress_cauchy(H, P, law)  # type: ignore[arg-type]
        assert cauchy[0, 0, 0] == pytest.approx(value, rel=1e-14)


def test_cauchy_and_von_mises() -> None:
    """T = P F^T/J is the finger T; uniaxial stress s has von Mises |s|, shear t sqrt(3) t."""
    H = gradients(0.3)
    P = r.stress_finger(H, LAMBDA, MU)
    T = r.isotropic(r.strain_finger(H), LAMBDA, MU)
    np.testing.assert_allclose(r.stress_cauchy(H, P, "finger"), T, atol=1e-13)
    for law in ("svk", "corotational"):
        T = r.stress_cauchy(H, r.STRESS[law](H, LAMBDA, MU), law)  # type: ignore[arg-type]
        np.testing.assert_allclose(T, np.swapaxes(T, -1, -2), atol=1e-12)
    pull, shear = np.diag([-7.0, 0, 0]), np.array([[0, 2.0, 0], [2.0, 0, 0], [0, 0, 0]])
    found = r.von_mises(np.stack([pull, shear, 5 * np.eye(3)]))
    np.testing.assert_allclose(found, [7.0, 2 * np.sqrt(3), 0.0], atol=1e-15)


def test_volume_change_and_cofactor() -> None:
    """J - 1 and cof F against det F and det(F) F^-T; j = tr H for the smallest H."""
    H = gradients(0.5)
    F = np.eye(3) + H
    J = np.linalg.det(F)
    np.testing.assert_allclose(r.volume_change(H), J - 1, atol=1e-14)
    adjugate = J[:, None, None] * np.swapaxes(np.linalg.inv(F), -1, -2)
    np.testing.assert_allclose(r.cofactor(F), adjugate, atol=1e-13)
    H = gradients(1e-15)
    np.testing.assert_allclose(r.volume_change(H), r.trace(H)[:, 0, 0], rtol=0, atol=1e-29)


# --- objectivity -------------------------------------------------------------------------------


@pytest.mark.parametrize("law", ["finger", "svk", "corotational"])
def test_objectivity(law: Strain) -> None:
    """P(QF) = Q P(F), and of the viscous part with the spin of Q: P_D(QF, (QF)') = Q P_D(F, F')."""
    H, H_rate = gradients(0.3), gradients(1.0, seed=1)
    Q = Rotation.random(len(H), random_state=2).as_matrix()
    spin = np.cross(np.eye(3)[None], np.random.default_rng(3).standard_normal((len(H), 1, 3)))
    turned_H = Q @ (np.eye(3) + H) - np.eye(3)
    P = r.STRESS[law](H, LAMBDA, MU)
    # round-off of QF, order 1, passes through the stiffness of order 10 and the condition of U
    atol = 200 * ROUND_OFF
    np.testing.assert_allclose(r.STRESS[law](turned_H, LAMBDA, MU), Q @ P, rtol=0, atol=atol)
    turned_rate = Q @ H_rate + Q @ spin @ (np.eye(3) + H)
    P_D = r.stress_viscous(H, H_rate, -0.8, 1.2)
    found = r.stress_viscous(turned_H, turned_rate, -0.8, 1.2)
    np.testing.assert_allclose(found, Q @ P_D, rtol=0, atol=1e-12)


def test_small_strain_is_not_objective() -> None:
    """A pure turn by theta about z: e_xx = cos(theta) - 1, the error that ``small`` makes."""
    H = Rotation.from_rotvec([0, 0, 0.1]).as_matrix()[None] - np.eye(3)
    P = r.stress_small(H, LAMBDA, MU)
    strain = np.cos(0.1) - 1
    assert P[0, 2, 2] == pytest.approx(2 * LAMBDA * strain)
    for law in ("finger", "svk", "corotational"):
        assert np.abs(r.STRESS[law](H, LAMBDA, MU)).max() < 10 * ROUND_OFF


# --- potentials --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("law", "poisson"),
    [("small", 0.3), ("svk", 0.3), ("corotational", 0.3), ("finger", 0.25)],
)
@pytest.mark.parametrize("scale", [1e-6, 0.2])
def test_stress_is_the_gradient_of_the_energy(law: Strain, poisson: float, scale: float) -> None:
    """P = dW/dF, by central differences of fourth order; ``finger`` for lambda = mu only.

    Along one component W is a polynomial of degree 4 at most, for which they are exact; that of
    U - I leaves s^4 W^(5)/30 with s = 0.02 |H| = 0.004: 1e-11 times a derivative of order 100 at
    the shortest stretch.  Round-off is ROUND_OFF W/s, W about |P| |H|/2: 1e-14 |P|.
    """
    H = gradients(scale, 20)
    one = np.ones(len(H))
    step = 0.02 * scale
    P = r.STRESS[law](H, *lame(poisson))

    def energy(moved: FloatArray) -> FloatArray:
        return r.elastic_energy(moved, one, *lame(poisson), law)

    slope = np.empty_like(P)
    for i in range(3):
        for j in range(3):
            way = np.zeros((3, 3))
            way[i, j] = step
            near = energy(H + way) - energy(H - way)
            far = energy(H + 2 * way) - energy(H - 2 * way)
            slope[:, i, j] = (8 * near - far) / (12 * step)
    limit = 1e-8 if law == "corotational" else 1e-12
    np.testing.assert_allclose(slope, P, rtol=0, atol=limit * np.abs(P).max())


def test_finger_energy_is_that_of_linear_elasticity_to_first_order() -> None:
    """For lambda != mu there is no potential: W is positive, and off by the order of the strain."""
    lam, mu = lame(0.167)
    direction = gradients(1.0, 20)
    error = []
    for scale in (1e-3, 1e-4):
        H = scale * direction
        small = r.elastic_energy(H, np.ones(20), lam, mu, "small")
        finger = r.elastic_energy(H, np.ones(20), lam, mu, "finger")
        assert np.all(finger > 0)
        error.append(np.abs(finger / small - 1).max())
    assert np.log10(error[0] / error[1]) == pytest.approx(1, abs=0.05)


def loop_work(stress: Callable[[FloatArray], FloatArray], corners: list[FloatArray]) -> float:
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
    for law in ("small", "svk", "corotational"):
        assert abs(ratio(law, lam, mu)) < 20 * ROUND_OFF  # type: ignore[arg-type]


@pytest.mark.parametrize("law", ["finger", "svk", "corotational"])
def test_all_laws_are_linear_elasticity_to_first_order(law: Strain) -> None:
    """|P - P_small|/|P_small| falls with the strain, order 1."""
    direction = gradients(1.0, 50)
    error = []
    for scale in (1e-3, 1e-4, 1e-5):
        small = r.stress_small(scale * direction, LAMBDA, MU)
        difference = r.STRESS[law](scale * direction, LAMBDA, MU) - small
        error.append(np.linalg.norm(difference) / np.linalg.norm(small))
    orders = np.log10(np.array(error[:-1]) / error[1:])
    np.testing.assert_allclose(orders, 1, atol=0.01)


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


@LAW
def test_momentum_and_units(law: Strain) -> None:
    """No net force; powers of two in the units of length, time and force change no bit."""
    _, nodes, elements = box(1)
    generator = np.random.default_rng(9)
    u, v = 0.05 * generator.standard_normal((2, *nodes.shape))
    force = r.internal_forces(elements, u, v, (LAMBDA, MU), (0.1, 0.2), law)
    assert np.abs(force.sum(axis=0)).max() < 100 * ROUND_OFF * np.abs(force).max()
    long, quick, hard = 1024.0, 0.125, 2.0**30
    scaled = mesh_elements(long * nodes, elements.nodes)
    again = r.internal_forces(
        scaled,
        long * u,
        long / quick * v,
        (hard * LAMBDA, hard * MU),
        (hard * quick * 0.1, hard * quick * 0.2),
        law,
    )
    np.testing.assert_array_equal(again, hard * long**2 * force)


@LAW
def test_translation_leaves_no_force(law: Strain) -> None:
    """A body moved by 2^20 m with the same differences has the same forces, bit for bit."""
    _, nodes, elements = box(1)
    u = np.round(np.random.default_rng(10).uniform(-1, 1, nodes.shape) * 64) / 2**12
    force = r.internal_forces(elements, u, 0 * u, (LAMBDA, MU), strain=law)
    moved = r.internal_forces(elements, u + 2.0**20, 0 * u + 3.0, (LAMBDA, MU), (1.0, 1.0), law)
    np.testing.assert_array_equal(moved, force)


@LAW
def test_viscosity_takes_energy(law: Strain) -> None:
    """The power of the viscous forces is -V0 J D : T_D <= 0 for shear and bulk viscosity >= 0."""
    _, nodes, elements = box(1)
    generator = np.random.default_rng(11)
    for bulk, shear in ((0.0, 1.0), (1.0, 0.0)):
        u, v = 0.03 * generator.standard_normal((2, *nodes.shape))
        viscous = (bulk - 2 / 3 * shear, shear)
        force = r.internal_forces(elements, u, v, (0.0, 0.0), viscous, law)
        H = r.displacement_gradient(elements.gradients, elements.nodes, u)
        H_rate = r.displacement_gradient(elements.gradients, elements.nodes, v)
        L = H_rate if law == "small" else H_rate @ np.linalg.inv(np.eye(3) + H)
        D = (L + np.swapaxes(L, -1, -2)) / 2
        J = 1.0 if law == "small" else 1 + r.volume_change(H)
        deviator = D - r.trace(D) * np.eye(3) / 3
        dissipation = 2 * shear * r.contraction(deviator, deviator)
        dissipation += bulk * r.trace(D)[:, 0, 0] ** 2
        expected = -np.sum(elements.volume * J * dissipation)
        assert np.sum(force * v) == pytest.approx(expected, rel=1e-12)
        assert expected < 0
