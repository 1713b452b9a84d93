"""Hard geometry in space: needles, plates, slivers, coincident features; distances as coal's."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rigid_lcp import Polyhedron, make_box
from rigid_lcp.contact.manifold import MOST_KEPT
from rigid_lcp.contact.separation import PARALLEL_EDGES
from rigid_lcp.shapes.rotations import (
    Floats,
    make_quaternion,
    multiply_quaternions,
    normalise,
    rotate,
)
from tests.rigid_solids import CUBE, FLOOR, UPRIGHT, coal_distance, contacts, make_stone


def placed_corners(shapes: list[Polyhedron], position: Floats, turns: Floats) -> list[Floats]:
    return [x + rotate(q, s.vertices) for s, x, q in zip(shapes, position, turns, strict=True)]


def separating_axes(shapes: list[Polyhedron], turns: Floats) -> Floats:
    """Normals of all faces of both and across all pairs of edges, both ways, (k, 3)."""
    normals = [rotate(q, s.normals) for s, q in zip(shapes, turns, strict=True)]
    edges = []
    for shape, turn in zip(shapes, turns, strict=True):
        ends = shape.vertices[shape.edges[:, :2]]
        along = rotate(turn, ends[:, 1] - ends[:, 0])
        edges.append(along / np.linalg.norm(along, axis=1)[:, None])
    across = np.cross(edges[0][:, None], edges[1]).reshape(-1, 3)
    sine = np.linalg.norm(across, axis=1)
    axes = np.vstack([*normals, across[sine > PARALLEL_EDGES] / sine[sine > PARALLEL_EDGES, None]])
    return np.vstack([axes, -axes])


def separation(shapes: list[Polyhedron], position: Floats, turns: Floats, axes: Floats) -> float:
    """Plain twin of `rigid_lcp.contact.separation`: the widest gap between both along any axis [m].

    For bodies that overlap it is the depth exactly, negative; else a lower bound of the distance.
    """
    first, second = placed_corners(shapes, position, turns)
    return float(((second @ axes.T).min(axis=0) - (first @ axes.T).max(axis=0)).max())


def family(name: str, generator: np.random.Generator) -> list[Polyhedron]:
    """Two solids of a kind."""

    def stone(size: float = 1.0, squeezed: tuple[float, float, float] = (1, 1, 1)) -> Polyhedron:
        return Polyhedron(make_stone(generator, size, 12).vertices * squeezed)

    def tetrahedron() -> Polyhedron:
        return Polyhedron(generator.normal(size=(4, 3)))

    sliver = Polyhedron([[0, 0, 0], [1, 0, 0], [0.3, 1e-3, 0], [0.4, 0.4, 0.2]])
    return {
        "stones": lambda: [stone(), stone(0.7)],
        "tetrahedra": lambda: [tetrahedron(), tetrahedron()],
        "boxes": lambda: [
            make_box(*generator.uniform(0.2, 1, 3)),
            make_box(*generator.uniform(0.2, 1, 3)),
        ],
        "sliver": lambda: [sliver, stone(0.6)],
        "needle": lambda: [stone(1.0, (1, 1e-3, 1e-3)), stone(0.5)],
        "needles": lambda: [stone(1.0, (1, 1e-3, 1e-3)), stone(1.0, (1, 1e-3, 1e-3))],
        "plate": lambda: [stone(1.0, (1, 1, 1e-3)), stone(0.7)],
        "plates": lambda: [stone(1.0, (1, 1, 1e-3)), stone(1.0, (1, 1, 1e-3))],
        "size ratio": lambda: [stone(), stone(1e-3)],
    }[name]()


FAMILIES = [
    "stones", "tetrahedra", "boxes", "sliver", "needle", "needles", "plate", "plates", "size ratio",
]  # fmt: skip
Pair = tuple[list[Polyhedron], Floats, Floats, Floats]


def touching(name: str, seed: int, share: float) -> Pair:
    """Two solids with a separation of ``share`` of the thinner one's width: shapes, positions,
    turns, axes."""
    generator = np.random.default_rng(seed)
    shapes = family(name, generator)
    turns = normalise(generator.normal(size=(2, 4)))
    axes = separating_axes(shapes, turns)
    direction = generator.normal(size=3)
    direction /= np.linalg.norm(direction)
    inside = rotate(turns[0], 0.7 * shapes[0].vertices[0])
    wanted = share * min(shape.width for shape in shapes)
    near, far = 0.0, 10.0
    for _ in range(60):
        middle = 0.5 * (near + far)
        place = np.array([np.zeros(3), inside + middle * direction])
        near, far = (
            (middle, far)
            if separation(shapes, place, turns, axes) < wanted
            else (near, middle)
        )  # fmt: skip
    return shapes, np.array([np.zeros(3), inside + far * direction]), turns, axes


@pytest.mark.long
@settings(max_examples=40)
@given(st.sampled_from(FAMILIES), st.integers(0, 10_000), st.sampled_from([1e-6, 1e-3, 3e-2]))
@example("tetrahedra", 14, 1e-6)
def test_an_overlap_has_a_contact_with_its_depth(name: str, seed: int, share: float) -> None:
    """Whatever the shapes: some contact has the depth for its gap, normal to its axis."""
    shapes, position, turns, axes = touching(name, seed, -share)
    width = min(shape.width for shape in shapes)
    depth = separation(shapes, position, turns, axes)
    assert depth == pytest.approx(-share * width, rel=1e-6)
    found = contacts(shapes, position, turns, margin=1e-3 * width)
    assert len(found) > 0
    least = np.argmin(np.abs(found.gap - depth))
    # lengths tell apart what differs by more than 1e-9 of the size (`LENGTH_TIE`)
    tie = 2e-9 * min(shape.reach for shape in shapes)
    assert found.gap[least] == pytest.approx(depth, abs=tie)
    away = 1.0 if found.body_a[least] == 1 else -1.0
    first, second = placed_corners(shapes, position, turns)
    along = away * found.normal[least]
    assert (second @ along).min() - (first @ along).max() == pytest.approx(depth, abs=tie)


@settings(max_examples=40)
@given(st.sampled_from(FAMILIES), st.integers(0, 10_000), st.sampled_from([1e-6, 1e-3, 3e-2]))
@pytest.mark.peer("coal")
def test_the_least_gap_is_the_distance_that_coal_finds(name: str, seed: int, share: float) -> None:
    """No contact is nearer than the distance, and none is missing; the separation along faces and
    pairs of edges bounds it from below."""
    shapes, position, turns, axes = touching(name, seed, share)
    result = coal_distance(shapes, position, turns)
    lower = separation(shapes, position, turns, axes)
    found = contacts(shapes, position, turns, margin=result.min_distance + 1e-5)
    accuracy = 2e-6  # GJK's tolerance is 1e-6
    assert found.gap.min() == pytest.approx(result.min_distance, abs=accuracy)
    assert found.gap.min() > lower - 2e-9 * min(shape.reach for shape in shapes)


# --- coincident features ---


def on_corner(shape: Polyhedron, way: Floats) -> tuple[Floats, Floats]:
    """Quaternion that turns the corner farthest along ``way`` to the top, and its height [m]."""
    corner = shape.vertices[np.argmax(shape.vertices @ way)]
    high = float(np.linalg.norm(corner))
    axis = np.cross(corner / high, [0.0, 0.0, 1.0])
    sine = np.linalg.norm(axis)
    return make_quaternion(axis / sine * np.arctan2(sine, corner[2] / high)), high


@pytest.mark.parametrize("overlap", [1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("offset", [0.0, 1e-12, 1e-7])
def test_corner_on_corner(overlap: float, offset: float) -> None:
    """Corner exactly upon corner: a contact before they overlap, and then one no deeper than it."""
    up = np.array([1.0, 1.0, 1.0])
    turn, high = on_corner(CUBE, up)
    below, low = on_corner(CUBE, -up)
    upside = multiply_quaternions(make_quaternion([np.pi, 0.0, 0.0]), below)
    assert high == low
    apart = contacts([CUBE, CUBE], [[0, 0, 0], [offset, 0, 2 * high + 1e-6]], [turn, upside])
    assert apart.gap == pytest.approx([np.hypot(offset, 1e-6)], abs=1e-14)
    found = contacts([CUBE, CUBE], [[0, 0, 0], [offset, 0, 2 * high - overlap]], [turn, upside])
    assert len(found) > 0
    assert np.isfinite(found.normal).all()
    assert -overlap <= found.gap.min() <= offset


@pytest.mark.parametrize("corners", [3, 5, 8])
def test_a_shared_face_gives_its_own_corners(corners: int) -> None:
    """A prism on its mirror image, all corners of the face shared: each of them, once."""
    around = 2 * np.pi * np.arange(corners) / corners
    ring = np.column_stack([np.cos(around), np.sin(around)])
    prism = Polyhedron(np.vstack([np.column_stack([ring, np.full(corners, z)]) for z in (0, 1)]))
    found = contacts([prism, prism], [[0, 0, 0], [0, 0, 1.0]])
    assert len(found) == corners
    assert np.allclose(found.gap, 0.0, atol=1e-15)
    assert np.allclose(np.abs(found.normal), [0, 0, 1])
    nearest = np.linalg.norm(found.point[:, None, :2] - ring, axis=2).min(axis=1)
    assert np.allclose(nearest, 0.0, atol=1e-12)
    assert len(np.unique(np.round(found.point, 9), axis=0)) == len(found)


# --- needles, drums, boxes that just miss ---


def test_needles_touch_where_they_cross() -> None:
    """Bars a thousand times longer than thick, at any angle to each other."""
    needle = make_box(1.0, 1e-3, 1e-3)
    for angle in (1e-3, 0.1, 1.0, np.pi / 2):
        turned = make_quaternion([0.0, 0.0, angle])
        found = contacts([needle, needle], [[0, 0, 0], [0, 0, 1e-3]], [UPRIGHT, turned], 1e-6)
        assert 2 <= len(found) <= 4
        assert np.allclose(found.gap, 0.0, atol=1e-16)
        assert np.allclose(np.abs(found.normal), [0, 0, 1], atol=1e-12)
        if angle > 2e-3:  # the rhombus of the overlap: its far corners, sin and cos of half angle
            reach = 0.5e-3 * np.array([1 / np.sin(angle / 2), 1 / np.cos(angle / 2)])
            extent = np.linalg.norm(found.point[:, :2], axis=1)
            assert np.allclose(np.unique(np.round(extent, 9)), np.unique(np.round(reach, 9)))


@pytest.mark.parametrize("overlap", [0.0, 1e-6])
def test_coincident_edges(overlap: float) -> None:
    """Cubes edge upon edge: contacts at the ends of the edge, with finite normals; once they
    overlap, at the corners of the sliver that their faces share."""
    tilted = make_quaternion([np.pi / 4, 0, 0])
    found = contacts([CUBE, CUBE], [[0, 0, 0], [0, 0, 2**0.5 - overlap]], [tilted, tilted])
    assert len(found) == (4 if overlap else 2)
    assert np.allclose(np.abs(found.point[:, 0]), 0.5)
    assert np.allclose(np.linalg.norm(found.normal, axis=1), 1.0)
    assert np.allclose(found.gap, -overlap / 2**0.5, atol=1e-15)


def test_a_box_passes_a_box_that_it_just_misses() -> None:
    """A box that falls along another's side, a hair away, finds nothing to stand on."""
    found = contacts([CUBE, CUBE], [[0, 0, 0], [1.0 + 1e-4, 0, 0.9995]])
    assert np.allclose(np.abs(found.normal), [1, 0, 0])


def test_deep_overlap_leaves_by_the_nearest_face() -> None:
    found = contacts([CUBE, CUBE], [[0, 0, 0], [0.05, 0.02, 0.9]])
    assert np.allclose(found.gap, -0.1, atol=1e-15)
    assert np.allclose(np.abs(found.normal), [0, 0, 1])


def test_many_sided_grains_keep_the_outer_contacts_and_the_deepest() -> None:
    angle = 2 * np.pi * np.arange(30) / 30
    ring = np.column_stack([np.cos(angle), np.sin(angle)])
    drum = Polyhedron(np.vstack([np.column_stack([ring, np.full(30, z)]) for z in (-0.5, 0.5)]))
    tilt = make_quaternion([1e-3, 0.0, 0.0])
    for shapes, places in (
        ([drum, FLOOR], [[0, 0, 0.5], [0, 0, 0]]),
        ([drum, make_box(4.0, 4.0, 1.0)], [[0, 0, 0.5], [0, 0, -0.5]]),
    ):
        found = contacts(shapes, places, [tilt, UPRIGHT], margin=0.1)
        assert len(found) == MOST_KEPT
        lowest = rotate(tilt, drum.vertices)[:, 2].min() + 0.5
        assert found.gap.min() == pytest.approx(lowest, abs=1e-15)
        assert np.ptp(found.point[:, 0]) > 1.9
        assert np.ptp(found.point[:, 1]) > 1.9
