"""The judge itself on trial: patch test, order of convergence, closed forms, known figures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import skfem

from validation.bench.qdem import closed_forms as closed
from validation.bench.qdem import judge
from validation.bench.qdem.modes import find_modes

YOUNG, POISSON, DENSITY = 45e9, 0.167, 2350.0
SIZE = (2.4, 0.25, 0.22)

Mesh = tuple[np.ndarray, np.ndarray]


def kuhn(cells: tuple[int, int, int], size: tuple[float, float, float] = SIZE) -> Mesh:
    """A box of six tetrahedra a cell: nodes (n, 3) [m] and elements (m, 4)."""
    mesh = skfem.MeshTet.init_tensor(
        *(np.linspace(0, side, n + 1) for side, n in zip(size, cells, strict=True))
    )
    return mesh.p.T.copy(), mesh.t.T.astype(np.int64)


def end_area(nodes: np.ndarray, elements: np.ndarray, axis: int) -> np.ndarray:
    """Each node's third of the faces around it on the far end along ``axis`` [m^2], (n,)."""
    mesh = skfem.MeshTet(nodes.T.copy(), elements.T.copy())
    far = nodes[:, axis].max()
    facets = mesh.facets[:, mesh.facets_satisfying(lambda x: np.isclose(x[axis], far))]
    a, b, c = nodes[facets]
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    return np.bincount(facets.ravel(), np.tile(area / 3, 3), len(nodes))


def skewed(seed: int = 0) -> Mesh:
    """A box with all nodes displaced at random, elements of either orientation."""
    nodes, elements = kuhn((3, 2, 2), (1.0, 0.8, 0.7))
    generator = np.random.default_rng(seed)
    return nodes + 0.05 * generator.standard_normal(nodes.shape), elements


def cantilever(cells: tuple[int, int, int]) -> tuple[Any, ...]:
    """Section 3.1: nodes, elements, K, mass, free nodes, end load [N], node at the tip."""
    nodes, elements = kuhn(cells)
    end = np.isclose(nodes[:, 0], SIZE[0])
    load = np.zeros_like(nodes)
    load[end, 2] = -200 / end.sum()
    middle = [SIZE[0], SIZE[1] / 2, SIZE[2] / 2]
    return (
        nodes,
        elements,
        judge.build_stiffness(nodes, elements, YOUNG, POISSON),
        judge.lump_mass(nodes, elements, DENSITY),
        nodes[:, 0] > 1e-9,
        load,
        int(np.argmin(np.linalg.norm(nodes - middle, axis=1))),
    )


# --- matrices ---------------------------------------------------------------------------------


def test_stiffness_is_symmetric_and_kills_rigid_motions() -> None:
    """K = K^T and K r = 0 for six rigid motions, to rounding; six zero eigenvalues, no more."""
    nodes, elements = skewed()
    matrix = judge.build_stiffness(nodes, elements, YOUNG, POISSON)
    scale = abs(matrix).max()
    assert abs(matrix - matrix.T).max() < 1e-14 * scale
    assert np.abs(matrix @ judge.make_rigid_motions(nodes)).max() < 1e-13 * scale
    value = np.linalg.eigvalsh(matrix.toarray())
    assert np.abs(value[:6]).max() < 1e-13 * value[-1]
    assert value[6] > 1e-5 * value[-1]


def test_stiffness_of_one_element_by_hand() -> None:
    """V B^T D B in Voigt's notation, written out; the order of the vertices changes nothing."""
    nodes = np.array([[0, 0, 0], [1, 0.1, 0], [0.2, 0.9, 0.1], [0.1, 0.2, 1.2]])
    lam, mu = 3.0, 2.0
    gradient = np.linalg.inv(np.column_stack([np.ones(4), nodes]))[1:]
    b = np.zeros((6, 12))
    for a, (x, y, z) in enumerate(gradient.T):
        b[:, 3 * a : 3 * a + 3] = [[x, 0, 0], [0, y, 0], [0, 0, z], [y, x, 0], [0, z, y], [z, 0, x]]
    d = np.diag([2 * mu] * 3 + [mu] * 3)
    d[:3, :3] += lam
    volume = np.linalg.det(nodes[1:] - nodes[0]) / 6
    expected = volume * b.T @ d @ b
    for order in ([0, 1, 2, 3], [1, 0, 2, 3]):
        found = judge.build_from_lame(nodes, np.array([order]), lam, mu).toarray()
        np.testing.assert_allclose(found, expected, atol=1e-14)


def test_lumped_mass_is_the_whole_mass_about_its_centre() -> None:
    """Eq. 11: the sum is rho V and its first moment that of the body, for any mesh of a box."""
    nodes, elements = kuhn((4, 3, 2))
    mass = judge.lump_mass(nodes, elements, DENSITY)
    assert mass.sum() == pytest.approx(DENSITY * np.prod(SIZE), rel=1e-14)
    assert mass @ nodes / mass.sum() == pytest.approx(np.array(SIZE) / 2, rel=1e-13)


@pytest.mark.parametrize("method", [pytest.param("amg", marks=pytest.mark.peer("pyamg")), "direct"])
def test_patch(method: Any) -> None:
    """Inner nodes follow a linear field on the boundary exactly, with one stress everywhere."""
    nodes, elements = kuhn((4, 3, 3))
    inner = np.all((nodes > 1e-9) & (nodes < np.array(SIZE) - 1e-9), axis=1)
    nodes[inner] += 0.01 * np.random.default_rng(2).standard_normal((inner.sum(), 3))
    slope = 1e-4 * np.random.default_rng(3).standard_normal((3, 3))
    exact = nodes @ slope.T
    matrix = judge.build_stiffness(nodes, elements, YOUNG, POISSON)
    held = np.where(inner[:, None], 0.0, exact)
    answer = judge.solve_static(
        matrix, inner, -(matrix @ held.ravel()).reshape(-1, 3), nodes, method
    )
    np.testing.assert_allclose(answer.displacement + held, exact, atol=1e-13 * np.abs(exact).max())
    strain = (slope + slope.T) / 2
    deviator = YOUNG / (1 + POISSON) * (strain - np.eye(3) * np.trace(strain) / 3)
    stress = judge.find_von_mises(nodes, elements, YOUNG, POISSON, exact)
    assert stress == pytest.approx(np.sqrt(1.5 * np.sum(deviator**2)), rel=1e-11)


# --- statics ----------------------------------------------------------------------------------


@pytest.mark.long
@pytest.mark.peer("pyamg")
def test_linear_elements_converge_at_order_two_to_quadratic_ones() -> None:
    """Linear elements are too stiff, by C h^2 against P2: a ratio near 4 as sides are halved."""
    reference = judge.find_tip_p2((32, 4, 4))
    excess = []
    for n in (1, 2, 4):
        nodes, _, matrix, _, free, load, tip = cantilever((12 * n, 2 * n, 2 * n))
        answer = judge.solve_static(matrix, free, load, nodes)
        excess.append(reference / -answer.displacement[tip, 2] - 1)
    assert min(excess) > 0
    order = np.log2(np.array(excess[:-1]) / excess[1:])
    assert order == pytest.approx(2, abs=0.1)


@pytest.mark.long
@pytest.mark.peer("pyamg")
def test_quadratic_elements_and_beams() -> None:
    """P2 meets Timoshenko to what a clamp's hindered contraction makes, 0.3 %; eq. 12 as printed.

    Shear adds 3 E I / kappa G A L^2 = 0.58 % to eq. 12, so the bound tells the two apart.
    """
    tip = judge.find_tip_p2((32, 4, 4))
    assert tip == pytest.approx(closed.find_timoshenko_tip(200), rel=3e-3)
    assert closed.find_euler_bernoulli_tip(200) == pytest.approx(92.32156e-6, rel=1e-7)
    assert closed.find_timoshenko_tip(200) == pytest.approx(92.858e-6, rel=1e-5)


def test_free_components() -> None:
    """A roller: a mask of components; a bar pulled on rollers has eps = sigma / E, nu eps aside."""
    nodes, elements = kuhn((3, 2, 2))
    free = nodes > 1e-9
    load = np.zeros_like(nodes)
    load[:, 0] = 1e6 * end_area(nodes, elements, 0)
    matrix = judge.build_stiffness(nodes, elements, YOUNG, POISSON)
    answer = judge.solve_static(matrix, free, load, nodes, "direct")
    expected = 1e6 / YOUNG * nodes * [1, -POISSON, -POISSON]
    np.testing.assert_allclose(answer.displacement, expected, atol=1e-12 * 1e6 / YOUNG)


# --- modes ------------------------------------------------------------------------------------


@pytest.mark.peer("pyamg")
def test_modes_by_two_methods() -> None:
    """LOBPCG with multigrid and inversion about zero: the same five modes, M-orthonormal."""
    nodes, _, matrix, mass, free, _, _ = cantilever((24, 4, 4))
    one = find_modes(matrix, mass, free, 5, "amg", nodes)
    other = find_modes(matrix, mass, free, 5)
    assert one.frequency == pytest.approx(other.frequency, rel=1e-7)
    for found in (one, other):
        flat = found.shape.reshape(5, -1)
        gram = flat * np.repeat(mass, 3) @ flat.T
        np.testing.assert_allclose(gram, np.eye(5), atol=1e-5)


@pytest.mark.long
def test_modes_come_down_to_those_of_beams() -> None:
    """Extrapolated to h = 0 from two meshes: Timoshenko's bending, Saint-Venant's torsion.

    omega^2 is too large by C h^2.  Left over: the hindered contraction and warping of the clamp,
    and h^4: 1 % for bending, 3 % for torsion.
    """
    found = []
    for n in (1, 2):
        _, _, matrix, mass, free, _, _ = cantilever((24 * n, 4 * n, 4 * n))
        found.append(find_modes(matrix, mass, free, 5).frequency)
    limit = np.sqrt((4 * found[1] ** 2 - found[0] ** 2) / 3)
    theory = closed.list_beam_frequencies()
    names = ("bending z 1", "bending y 1", "bending z 2", "bending y 2", "torsion 1")
    expected = np.array([theory[name] for name in names])
    assert limit[:4] == pytest.approx(expected[:4], rel=0.01)
    assert limit[4] == pytest.approx(expected[4], rel=0.03)


def test_beam_frequencies() -> None:
    """Eq. 13 gives 27.00 Hz (the paper's text: 27.01); slender beams need no shear."""
    assert closed.find_bending(1) == pytest.approx(27.01, rel=5e-4)
    ratio = closed.find_bending(2) / closed.find_bending(1)
    assert ratio == pytest.approx((4.694091 / 1.875104) ** 2, rel=1e-6)
    slender = closed.Beam(length=240.0)
    for order in (1, 2, 3, 5):
        plain = closed.find_bending(order, slender)
        assert closed.find_bending(order, slender, shear=True) == pytest.approx(plain, rel=1e-4)
    assert closed.Beam(width=1.0, height=1.0).torsion_constant == pytest.approx(0.140577, rel=1e-5)
