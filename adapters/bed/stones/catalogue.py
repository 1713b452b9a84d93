"""Forms by name: small arrangements of spheres that stand for the shapes of crushed stone.

Side views of ballast fall into equant, flaky, elongated and bladed stones (Zingg's classes, which
EN 933-3 and -4 sort by); concave ones interlock.  Their proportions are chosen here, not measured
on a quarry's stone: for that, pack spheres into a scan.
"""

from functools import cache
from itertools import product

import numpy as np

from adapters.bed import FloatArray
from adapters.bed.stones.form import SPHERE, Form, make_form
from adapters.bed.stones.toml import read_form
from adapters.errors import SceneError
from trackbed.scene_files import suggest_word


def lay_rows(along: int, across: int, spacing: float) -> FloatArray:
    """Places of ``along`` x ``across`` spheres in a plane, ``spacing`` apart, shape (m, 3)."""
    grid = [(i, j, 0) for i in range(along) for j in range(across)]
    return spacing * np.array(grid, float)


CORNERS = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)], float)
"""Of a tetrahedron."""
RING = np.array([(np.cos(a), np.sin(a), 0) for a in np.arange(6) * np.pi / 3])
"""Corners of a hexagon."""
CATALOGUE: dict[str, tuple[FloatArray, FloatArray]] = {
    "pair": (lay_rows(2, 1, 1.2), np.ones(2)),
    "triangle": (RING[::2] * 0.8, np.ones(3)),
    "tetrahedron": (0.62 * CORNERS, np.ones(4)),
    "spiked-tetrahedron": (0.85 * CORNERS, np.ones(4)),
    "cube": (0.6 * np.array([*product((-1, 1), repeat=3)], float), np.ones(8)),
    "star": (0.9 * np.vstack([np.eye(3), -np.eye(3)]), np.ones(6)),
    "flaky": (np.vstack([np.zeros((1, 3)), 1.2 * RING]), np.ones(7)),
    "elongated": (lay_rows(4, 1, 1.0), np.ones(4)),
    "bladed": (lay_rows(4, 2, 1.0), np.ones(8)),
    "wedge": (lay_rows(3, 2, 0.9), np.repeat([1.0, 0.8, 0.6], 2)),
}
"""Name -> places (m, 3) and radii (m,) of the spheres; the unit is a radius of the largest.

The tetrahedra are those whose strength is known: peak friction angles of about 45 and 53 degrees at
a friction of 1, where spheres have 24 (YADE, six walls, 30 kPa)."""


def find_form(name: str | None) -> Form:
    """The form of a name of `CATALOGUE` or of a file that ends in .toml; None is `SPHERE`.

    Raises `SceneError` for no such name, and for a file that is no stone.
    """
    if name in (None, SPHERE.name):
        return SPHERE
    if name.endswith(".toml"):
        return read_form(name)
    if name not in CATALOGUE:
        said = f"unknown form {name!r}{suggest_word(name, [*CATALOGUE, SPHERE.name])}"
        raise SceneError(said, remedy="or stone.toml of: trackbed stone MESH --unit mm")
    return make_named_form(name)


@cache
def make_named_form(name: str) -> Form:
    """The form of a name, made once."""
    return make_form(name, *CATALOGUE[name])
