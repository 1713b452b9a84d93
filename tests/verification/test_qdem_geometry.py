"""Geometry of meshes against closed forms: volumes, gradients, surfaces, numbering."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qdem_fem import Body, Material, Simulation
from qdem_fem.files.errors import MeshError
from qdem_fem.kernel.cpu.ordering import order_for_locality
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.mesh.surface import (
    find_area_vectors,
    find_faces_within,
    find_pressure_forces,
    find_surface_faces,
)
from qdem_fem.mesh.tetrahedra import TetMesh, find_altitudes, find_gradients, read_mesh
from tests.qdem_rings import make_ring_mesh
from validation.bench.qdem.meshes import jitter_nodes

EPS = float(np.finfo(np.float64).eps)
EXTENDED = float(np.finfo(np.longdouble).eps)
SIZE = (0.5, 0.3, 0.2)
KUHN = make_box_mesh(SIZE, (5, 4, 3), origin=(1.0, -2.0, 0.5))
FIVE = make_box_mesh(SIZE, (3, 4, 5), "five")
RING = make_ring_mesh(0.3, 0.5, 0.2, (2, 11, 3))
POLYGON = 11 / 2 * np.sin(2 * np.pi / 11) * (0.5**2 - 0.3**2) * 0.2
"""Volume of the ring with its circles as polygons of eleven sides [m^3]."""
MESHES = {
    "kuhn": (KUHN, 0.03, 1),
    "five": (FIVE, 0.03, 1),
    "ring": (RING, POLYGON, 0),
    "kuhn jittered": (jitter_nodes(KUHN, 0.24, 1), 0.03, 1),
    "ring jittered": (jitter_nodes(RING, 0.24, 2), POLYGON, 0),
}
"""Mesh, volume [m^3], Euler characteristic of the solid (ring: a handle)."""


def shuffled(mesh: TetMesh, seed: int) -> TetMesh:
    """The same body with nodes, elements and corners in random order, half of it left-handed."""
    generator = np.random.default_rng(seed)
    name = generator.permutation(len(mesh.nodes))
    nodes = np.empty_like(mesh.nodes)
    nodes[name] = mesh.nodes
    elements = name[mesh.elements][generator.permutation(len(mesh.elements))]
    return read_mesh((nodes, generator.permuted(elements, axis=1)))


@pytest.fixture(params=MESHES)
def body(request: pytest.FixtureRequest) -> tuple[TetMesh, float, int]:
    """Each mesh, shuffled: nothing may depend on how a mesh is numbered."""
    mesh, volume, euler = MESHES[request.param]
    return shuffled(mesh, 5), volume, euler


def divergence_volume(nodes: np.ndarray, faces: np.ndarray) -> float:
    """V = 1/3 sum x . A: divergence theorem for the field x, exact on planar faces."""
    middle = nodes[faces].mean(axis=1)
    return float((middle * find_area_vectors(nodes, faces)).sum() / 3)


def test_volumes_fill_the_body_and_agree_with_its_surface(body: tuple[TetMesh, float, int]) -> None:
    mesh, volume, _ = body
    _, volumes = find_gradients(mesh.nodes, mesh.elements)
    faces = find_surface_faces(mesh.elements)
    assert volumes.sum() == pytest.approx(volume, rel=1e-13)
    assert divergence_volume(mesh.nodes, faces) == pytest.approx(volume, rel=1e-13)
    assert np.abs(find_area_vectors(mesh.nodes, faces).sum(axis=0)).max() < 1e-14


def test_euler_characteristic(body: tuple[TetMesh, float, int]) -> None:
    """V - E + F - T of the solid; its closed surface has twice that."""
    mesh, _, euler = body
    counts = [
        len({frozenset(s) for row in mesh.elements.tolist() for s in combinations(row, k)})
        for k in (1, 2, 3, 4)
    ]
    assert counts[0] - counts[1] + counts[2] - counts[3] == euler
    faces = find_surface_faces(mesh.elements).tolist()
    counts = [len({frozenset(s) for row in faces for s in combinations(row, k)}) for k in (1, 2, 3)]
    assert counts[0] - counts[1] + counts[2] == 2 * euler


def test_surface_is_every_face_of_one_element_only(body: tuple[TetMesh, float, int]) -> None:
    """Against a dictionary of all faces; every edge is walked once each way."""
    mesh = body[0]
    count = Counter(frozenset(f) for row in mesh.elements.tolist() for f in combinations(row, 3))
    faces = find_surface_faces(mesh.elements)
    assert {f for f, n in count.items() if n == 1} == {frozenset(f) for f in faces.tolist()}
    walked = Counter((a, b) for f in faces.tolist() for a, b in zip(f, f[1:] + f[:1], strict=True))
    assert set(walked.values()) == {1}
    assert all((b, a) in walked for a, b in walked)


def test_surface_does_not_depend_on_the_order_of_elements(body: tuple[TetMesh, float, int]) -> None:
    elements = body[0].elements
    faces = find_surface_faces(elements)
    np.testing.assert_array_equal(faces, find_surface_faces(elements[::-1]))
    np.testing.assert_array_equal(faces, find_surface_faces(elements + (1 << 40)) - (1 << 40))


@pytest.mark.filterwarnings("ignore::qdem_fem.files.SceneWarning")  # its parts are meant
def test_surface_that_overlaps_itself_is_refused() -> None:
    three = np.array([[0, 1, 2, 3], [0, 2, 1, 4], [5, 6, 7, 8], [0, 1, 2, 9]])
    with pytest.raises(MeshError, match=r"3 elements \(0, 1, 3\) share the face .*\[0, 1, 2\]"):
        find_surface_faces(three)
    with pytest.raises(MeshError, match=r"elements 0, 1 lie on the same side .*\[0, 1, 2\]"):
        find_surface_faces(three[[0, 3]])
    with pytest.raises(MeshError, match="3 elements"):
        find_surface_faces(three + (1 << 30))
    nodes = KUHN.nodes.copy()
    inside = np.setdiff1d(np.arange(len(nodes)), find_surface_faces(KUHN.elements))[0]
    nodes[inside] += [0.3, 0, 0]  # three cells on: elements around it are turned inside out
    folded = read_mesh((nodes, KUHN.elements))
    assert len(folded.flipped) > 0
    with pytest.raises(MeshError, match="same side"):
        find_surface_faces(folded.elements)


def test_no_elements_have_no_surface() -> None:
    assert find_surface_faces(np.zeros((0, 4), np.int64)).shape == (0, 3)
    assert find_pressure_forces(KUHN.nodes, np.zeros((0, 3), np.int64), 120).shape == (120, 3)


def gradients_exact(x: np.ndarray) -> tuple[np.ndarray, float]:
    """Gradients (3, 3) and volume of one element (4, 3) in rational arithmetic, rounded once."""
    points = [[Fraction(float(c)) for c in point] for point in x]
    e = [[points[a][c] - points[0][c] for c in range(3)] for a in (1, 2, 3)]
    minors = [
        [e[a - 2][c - 2] * e[a - 1][c - 1] - e[a - 2][c - 1] * e[a - 1][c - 2] for c in range(3)]
        for a in range(3)
    ]
    sixfold = sum((e[0][c] * minors[0][c] for c in range(3)), Fraction(0))
    return np.array([[float(m / sixfold) for m in row] for row in minors]), float(sixfold / 6)


@given(seed=st.integers(0, 2**32 - 1), digits=st.floats(0, 9))
@settings(max_examples=150)
def test_gradients_of_slivers(seed: int, digits: float) -> None:
    """Against rational arithmetic, for elements flattened by up to nine digits.

    Relative error of a determinant: its round-off over its flatness kappa, the product of the
    edges over six volumes.  Slivers are worked out in extended precision and rounded once, the
    others lose two digits at most.
    """
    generator = np.random.default_rng(seed)
    x = generator.uniform(-1, 1, (4, 3))
    normal = generator.standard_normal(3)
    normal /= np.linalg.norm(normal)
    x += np.outer(x @ normal, normal) * (10**-digits - 1) + generator.uniform(-1, 1, 3)
    element = [0, 1, 2, 3] if gradients_exact(x)[1] > 0 else [0, 1, 3, 2]
    exact, volume = gradients_exact(x[element])
    edges = np.linalg.norm(x[element[1:]] - x[element[0]], axis=1)
    kappa = edges.prod() / (6 * volume)
    gradients, volumes = find_gradients(x, np.array([element]))
    bound = 4 * EPS + 30 * kappa * (EXTENDED if kappa > 100 else EPS)
    assert np.abs(gradients[0] - exact).max() <= bound * np.abs(exact).max()
    assert abs(volumes[0] - volume) <= bound * volume


@pytest.mark.parametrize("flatness", [1.0, 1e-3, 1e-6])
def test_gradients_reproduce_linear_fields(flatness: float) -> None:
    """H = sum u_a x grad N_a of u = A x; error |A| L max|grad N| round-offs, slivers too."""
    mesh = jitter_nodes(KUHN, 0.24, 3)
    nodes = mesh.nodes * [1, 1, flatness]
    slope = np.random.default_rng(4).standard_normal((3, 3))
    gradients, _ = find_gradients(nodes, mesh.elements)
    u = (nodes @ slope.T)[mesh.elements]
    found = np.einsum("mai,maj->mij", u[:, 1:] - u[:, :1], gradients)
    reach = np.abs(nodes).max() * np.abs(slope).max()
    bound = 20 * EPS * reach * np.abs(gradients).max(axis=(1, 2))
    assert (np.abs(found - slope).max(axis=(1, 2)) <= bound).all()


def test_gradients_follow_the_unit_of_length_exactly() -> None:
    """A power of two as the new unit changes no digit: 1/m, m^3, m."""
    mesh = MESHES["kuhn jittered"][0]
    gradients, volumes = find_gradients(mesh.nodes, mesh.elements)
    scaled, scaled_volumes = find_gradients(mesh.nodes * 1024, mesh.elements)
    np.testing.assert_array_equal(scaled * 1024, gradients)
    np.testing.assert_array_equal(scaled_volumes, volumes * 1024**3)
    np.testing.assert_array_equal(find_altitudes(scaled), find_altitudes(gradients) * 1024)


def test_gradients_refuse_elements_without_volume() -> None:
    nodes = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0]])
    for bad in ([0, 1, 3, 2], [0, 1, 2, 4]):
        with pytest.raises(MeshError, match="element 1 has"):
            find_gradients(nodes, np.array([[0, 1, 2, 3], bad]))


def test_altitudes_are_three_volumes_over_the_largest_face() -> None:
    mesh = MESHES["ring jittered"][0]
    gradients, volumes = find_gradients(mesh.nodes, mesh.elements)
    areas = [
        np.linalg.norm(find_area_vectors(mesh.nodes, mesh.elements[:, list(face)]), axis=1)
        for face in combinations(range(4), 3)
    ]
    np.testing.assert_allclose(find_altitudes(gradients), 3 * volumes / np.max(areas, 0), 1e-12)


def test_lumped_mass_keeps_mass_and_centre_of_mass(body: tuple[TetMesh, float, int]) -> None:
    """Quarters at the corners have the element's mass and, by symmetry, its centre of mass."""
    mesh, volume, _ = body
    _, volumes = find_gradients(mesh.nodes, mesh.elements)
    mass = Simulation([Body(mesh, Material(1e9, 0.2, 2350.0))]).assembly.mass
    assert mass.sum() == pytest.approx(2350 * volume, rel=1e-13)
    assert mass.min() > 0
    moment = volumes @ mesh.nodes[mesh.elements].mean(axis=1) * 2350
    np.testing.assert_allclose(mass @ mesh.nodes, moment, rtol=1e-13, atol=1e-11)


def test_pressure_on_a_closed_surface_is_in_balance(body: tuple[TetMesh, float, int]) -> None:
    """No force, no moment; and sum f x X = -V I, Gauss's theorem for the field X."""
    mesh, volume, _ = body
    force = find_pressure_forces(mesh.nodes, find_surface_faces(mesh.elements), len(mesh.nodes))
    assert np.abs(force.sum(axis=0)).max() < 1e-14
    assert np.abs(np.cross(mesh.nodes, force).sum(axis=0)).max() < 1e-14
    np.testing.assert_allclose(force.T @ mesh.nodes, -volume * np.eye(3), atol=1e-14)


def test_pressure_on_one_side_pushes_inward_at_its_middle() -> None:
    """1 Pa on x-max of the box: force ly lz towards -x, moment as if at the side's centre."""
    side = np.zeros(len(KUHN.nodes), bool)
    side[KUHN.node_sets["x-max"]] = True
    faces = find_faces_within(find_surface_faces(KUHN.elements), side)
    assert len(faces) == 2 * 4 * 3
    force = find_pressure_forces(KUHN.nodes, faces, len(KUHN.nodes))
    total = np.array([-0.3 * 0.2, 0, 0])
    np.testing.assert_allclose(force.sum(axis=0), total, atol=1e-15)
    np.testing.assert_array_equal(force[~side], 0)
    middle = np.array([1.5, -2 + 0.15, 0.5 + 0.1])
    moment = np.cross(KUHN.nodes, force).sum(axis=0)
    np.testing.assert_allclose(moment, np.cross(middle, total), atol=1e-15)


def test_node_sets_of_boxes_lie_where_their_names_say() -> None:
    low, high = np.array([1.0, -2.0, 0.5]), np.array([1.5, -1.7, 0.7])
    for axis, letter in enumerate("xyz"):
        x = KUHN.nodes[:, axis]
        for name, place in (("min", low[axis]), ("max", high[axis])):
            expected = np.flatnonzero(np.abs(x - place) < 1e-12)
            np.testing.assert_array_equal(KUHN.node_sets[f"{letter}-{name}"], expected)


@given(
    cells=st.tuples(st.integers(1, 4), st.integers(1, 4), st.integers(1, 4)),
    around=st.integers(3, 7),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=40)
def test_generated_meshes_are_sound(cells: tuple[int, int, int], around: int, seed: int) -> None:
    """Any number of cells: read without a change, conforming, and right after a jitter < 1/4."""
    ring = make_ring_mesh(1, 2, 0.7, (cells[0], around, cells[2]))
    for mesh in (make_box_mesh((1, 2, 3), cells), make_box_mesh((1, 2, 3), cells, "five"), ring):
        moved = jitter_nodes(mesh, 0.249, seed)
        for each in (mesh, moved):
            read = read_mesh(each)
            assert len(read.flipped) == len(read.unused) == 0
            np.testing.assert_array_equal(read.elements, mesh.elements)
        faces = find_surface_faces(mesh.elements)
        volume = find_gradients(moved.nodes, moved.elements)[1].sum()
        assert divergence_volume(mesh.nodes, faces) == pytest.approx(volume, rel=1e-12)
        surface = np.unique(faces)
        np.testing.assert_array_equal(moved.nodes[surface], mesh.nodes[surface])


def test_jitter_moves_every_interior_node_and_repeats() -> None:
    moved = jitter_nodes(KUHN, 0.2, 8)
    inside = np.setdiff1d(np.arange(len(KUHN.nodes)), find_surface_faces(KUHN.elements))
    distance = np.linalg.norm(moved.nodes - KUHN.nodes, axis=1)
    assert distance[inside].min() > 0
    gradients, _ = find_gradients(KUHN.nodes, KUHN.elements)
    assert distance.max() <= 0.2 * find_altitudes(gradients).max()
    np.testing.assert_array_equal(moved.nodes, jitter_nodes(KUHN, 0.2, 8).nodes)
    assert moved.node_sets is KUHN.node_sets


def bandwidth(elements: np.ndarray) -> int:
    """Largest distance of two numbers in an element."""
    return int((elements.max(axis=1) - elements.min(axis=1)).max())


def test_order_brings_neighbours_together() -> None:
    """A bar: the breadth-first levels of Cuthill and McKee hold about a cross-section each.

    An element spans two levels at most, so its numbers differ by less than two levels' nodes; a
    level of the Kuhn mesh is no larger than the cross-section is in nodes.
    """
    bar = make_box_mesh((30, 2, 2), (60, 4, 4))
    mesh = shuffled(bar, 6)
    nodes = np.concatenate([mesh.nodes, [[9, 9, 9]]])
    elements = np.where(mesh.elements >= 100, mesh.elements + 1, mesh.elements)  # 100: unused
    node_order, element_order = order_for_locality(elements, len(nodes))
    np.testing.assert_array_equal(np.sort(node_order), np.arange(len(nodes)))
    np.testing.assert_array_equal(np.sort(element_order), np.arange(len(elements)))
    assert node_order[-1] == 100
    name = np.argsort(node_order)
    ordered = name[elements][element_order]
    assert bandwidth(elements) > 1000
    assert bandwidth(ordered) < 2 * 25
    key = np.stack([ordered.min(axis=1), ordered.max(axis=1)], axis=1).tolist()
    assert key == sorted(key)


def test_order_of_bodies_in_pieces_and_of_none() -> None:
    """Two bodies that share no node, one element, and nodes only."""
    two = np.concatenate([FIVE.elements, FIVE.elements + len(FIVE.nodes)])
    node_order, _ = order_for_locality(two, 2 * len(FIVE.nodes))
    np.testing.assert_array_equal(np.sort(node_order), np.arange(2 * len(FIVE.nodes)))
    for elements in (np.array([[3, 1, 0, 5]]), np.zeros((0, 4), np.int64)):
        node_order, element_order = order_for_locality(elements, 6)
        assert len(element_order) == len(elements)
        unused = np.setdiff1d(np.arange(6), elements)
        np.testing.assert_array_equal(node_order[elements.size :], unused)
