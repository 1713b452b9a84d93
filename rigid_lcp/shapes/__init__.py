"""Grain shapes, one file each; a file that sets ``SHAPE`` draws the stones of a scene.

``SHAPE(random, diameter, corners, dim)`` returns a `Polygon` (``dim`` 2) or a `Polyhedron` (3)
whose points, as they are given, are within ``diameter / 2`` [m] of the origin.
"""

from collections.abc import Callable

from numpy.random import Generator

from rigid_lcp.shapes import vectors
from rigid_lcp.shapes.half_space import HalfSpace
from rigid_lcp.shapes.numbers import require_real, require_vector
from rigid_lcp.shapes.polygon import Polygon
from rigid_lcp.shapes.polyhedron import FLATNESS, Polyhedron, make_box
from rigid_lcp.shapes.rotations import (
    extract_quaternion,
    find_quaternion_rate,
    make_quaternion,
    make_rotation,
    multiply_quaternions,
    normalise,
    rotate,
    rotate_back,
)
from rigid_lcp.shapes.round_grains import Disc, Sphere
from rigid_lcp.shapes.scan import Scan, read_scan
from trackbed.choices import find_choice

__all__ = [
    "FLATNESS", "Disc", "HalfSpace", "Polygon", "Polyhedron", "Scan", "Sphere",
    "extract_quaternion", "find_quaternion_rate", "get_shape", "make_box", "make_quaternion",
    "make_rotation", "multiply_quaternions", "normalise", "read_scan", "require_real",
    "require_vector", "rotate", "rotate_back", "vectors",
]  # fmt: skip


def get_shape(name: str) -> Callable[[Generator, float, int, int], Polygon | Polyhedron]:
    """What draws stones of a shape; raises `UsageError` with the nearest name where none does."""
    draw: Callable[[Generator, float, int, int], Polygon | Polyhedron]
    draw = find_choice(__name__, "SHAPE", name, "there is no grain shape")
    return draw
