"""What `Polygon`, `Scene.add` and breaks refuse is named."""

from __future__ import annotations

import numpy as np
import pytest

from rigid_lcp import Polygon, Scene, box
from rigid_lcp.errors import SceneError, ShapeError
from rigid_lcp.shapes.stones import cut, fragments
from rigid_lcp.wear.fragmentation import split_polygon

SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]


@pytest.mark.parametrize(
    ("vertices", "words"),
    [
        (SQUARE[::-1], "clockwise"), ("ab", "not numbers"), (SQUARE[:2], "shape"),
        ([(0, 0), (1, 1), (1, 0), (0, 1)], "crosses itself"),
        ([(0, 0), (2, 0), (1, 0.5), (2, 2), (0, 2)], "not convex"),
        (np.ma.masked_equal(SQUARE, 1), "masked"), (np.array(SQUARE) * 1j, "complex"),
    ],
)  # fmt: skip
def test_outlines_that_are_none_are_named(vertices, words):
    """Clockwise ones gave parts of negative mass, crossing ones a division by zero."""
    with pytest.raises(ShapeError, match=words):
        Polygon(vertices)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        *(({"density": bad}, "the density is") for bad in (-1, 0, np.nan, "a", None, 1e300)),
        *(({"velocity": bad}, "velocity is") for bad in ((np.nan, 0), (1, 0, 0), "a", (1e200, 0))),
        *(({"spin": bad}, "spin is") for bad in (np.nan, (1, 2), "a", 1j, 1e200)),
    ],
)  # fmt: skip
def test_motions_and_densities_that_are_none_are_named(given, words):
    """NaN became masses and velocities of NaN, without a word."""
    with pytest.raises(SceneError, match=words):
        Scene().add(Polygon(SQUARE), **({"density": 1.0} | given))


@pytest.mark.parametrize("point", [(0.5, 0.5, 0), 0.5])
def test_a_point_of_another_space_splits_nothing(point):
    with pytest.raises(ShapeError, match=r"split: .*point"):
        split_polygon(SQUARE, point, (0, 1))


def test_the_remedy_of_a_density_names_both_bounds():
    """The message for 1e300 asked for a positive number."""
    with pytest.raises(SceneError, match=r"is 1e\+300\n  -> .*above zero, 1e\+50 at most.*fixed"):
        Scene().add(Polygon(SQUARE), density=1e300)


BREAK = {
    "position": (0, 0, 0), "quaternion": (1, 0, 0, 0), "velocity": (1, 0, 0), "spin": (0, 1, 0),
    "normal": (0, 0, 1), "point": (0, 0, 0),
}  # fmt: skip


@pytest.mark.parametrize("name", BREAK)
@pytest.mark.parametrize("bad", [(np.nan, 0, 0), (1, 0), "a", 1j, None, (np.inf, 0, 0, 0)])
def test_breaks_in_space_that_are_none_are_named(name, bad):
    """NaN became the place and the velocity of the parts."""
    with pytest.raises(SceneError, match=f"^fragments: the {name} is .*\n  -> give"):
        fragments(box(1, 1, 1), **(BREAK | {name: bad}))


def test_breaks_in_space_want_a_unit_quaternion_and_a_normal():
    with pytest.raises(SceneError, match=r"fragments: the quaternion is .*not of unit length"):
        fragments(box(1, 1, 1), **(BREAK | {"quaternion": (1, 1, 0, 0)}))
    with pytest.raises(ShapeError, match="cut: the normal of the plane"):
        fragments(box(1, 1, 1), **(BREAK | {"normal": (0, 0, 0)}))
    for offset in (np.nan, "a", None):
        with pytest.raises(SceneError, match="cut: the offset is"):
            cut(box(1, 1, 1), (0, 0, 1), offset)
