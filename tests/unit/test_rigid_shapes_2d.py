"""Shapes of the plane: mass properties against closed forms, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_lcp import HalfSpace, Polygon, Scene
from rigid_lcp.errors import ShapeError
from rigid_lcp.motion.world import make_world

SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]


def test_rectangle() -> None:
    """m = rho a b, J = m (a^2 + b^2) / 12 about the centroid."""
    mass, inertia = Polygon.rectangle(2.0, 0.5).mass_properties(3.0)
    assert mass == pytest.approx(3.0)
    assert inertia == pytest.approx(3.0 * (4.0 + 0.25) / 12, rel=1e-14)


@given(st.integers(3, 12), st.floats(0.1, 10.0))
def test_regular_polygon(corners: int, radius: float) -> None:
    """A = n/2 R^2 sin(2 pi/n), J/m = R^2 (2 + cos(2 pi/n)) / 6."""
    polygon = Polygon.regular(corners, radius)
    turn = 2 * np.pi / corners
    mass, inertia = polygon.mass_properties(2.0)
    assert polygon.area == pytest.approx(corners / 2 * radius**2 * np.sin(turn), rel=1e-12)
    assert inertia == pytest.approx(mass * radius**2 * (2 + np.cos(turn)) / 6, rel=1e-12)
    assert polygon.reach == pytest.approx(radius)
    sides = np.linalg.norm(np.diff(polygon.vertices, axis=0), axis=1)
    np.testing.assert_allclose(sides, 2 * radius * np.sin(turn / 2), rtol=1e-9)


@given(st.integers(0, 2**32 - 1))
def test_far_from_the_origin(seed: int) -> None:
    """Area, inertia and outline do not depend on where the vertices are given."""
    generator = np.random.default_rng(seed)
    angle = np.sort(generator.permutation(24)[:6]) * 2 * np.pi / 24
    outline = np.column_stack([np.cos(angle), np.sin(angle)])
    place = generator.uniform(-1e4, 1e4, 2)
    here, there = Polygon(outline), Polygon(outline + place)
    assert there.mass_properties(1.0) == pytest.approx(here.mass_properties(1.0), rel=1e-9)
    np.testing.assert_allclose(there.vertices, here.vertices, atol=1e-10)
    np.testing.assert_allclose(there.centroid, here.centroid + place, atol=1e-10)


def test_normals_point_outwards() -> None:
    polygon = Polygon([(0, 0), (2, 0), (0, 1)])
    middle = 0.5 * (polygon.vertices + np.roll(polygon.vertices, -1, axis=0))
    assert ((middle * polygon.normals).sum(axis=1) > 0).all()
    np.testing.assert_allclose(np.linalg.norm(polygon.normals, axis=1), 1.0)


@pytest.mark.parametrize(
    ("vertices", "what", "remedy"),
    [
        (SQUARE[::-1], "clockwise", "reverse"),
        ("ab", "not numbers", "metres"),
        ([(0, 0), (1, 1), (1, 0), (0, 1)], "crosses itself", "convex"),
        (np.ma.masked_equal(SQUARE, 1), "masked", "metres"),
        (np.array(SQUARE) * 1j, "complex", "metres"),
        ([(0, 0), (2, 0), (0.5, 0.5), (0, 2)], "not convex", "hull"),
        ([(0, 0), (1, 0), (2, 0), (1, 1)], "on a line", "leave it out"),
        ([(0, 0), (1, 1), (2, 2)], "on a line", "area"),
        ([(0, 0), (1, 0), (1, 0), (0, 1)], "twice", "leave one"),
        ([(0, 0), (1, 0)], "shape", "three vertices"),
        ([(0, 0), (1, 0), (np.nan, 1)], "finite", "metres"),
        ([(0, 0, 0)] * 4, "shape", "two coordinates"),
        ([(np.cos(a), np.sin(a)) for a in 4 * np.pi * np.arange(5) / 5], "crosses", "convex"),
    ],
)
def test_polygon_refused(vertices: object, what: str, remedy: str) -> None:
    with pytest.raises(ShapeError, match=what) as error:
        Polygon(vertices)  # type: ignore[arg-type]
    assert remedy in error.value.remedy


def test_half_space_is_normalised() -> None:
    floor = HalfSpace((0, 3.0), 2.0)
    np.testing.assert_array_equal(floor.normal, [0, 1])
    assert (floor.dim, HalfSpace((0, 0, 1)).dim) == (2, 3)


def test_body_stays_where_its_vertices_were_given() -> None:
    scene = Scene(2)
    scene.add(Polygon(SQUARE), density=1.0)
    scene.add(Polygon(SQUARE), density=1.0, position=(5, 5))
    _, start = make_world(scene)
    np.testing.assert_allclose(start.position, [[0.5, 0.5], [5, 5]])
