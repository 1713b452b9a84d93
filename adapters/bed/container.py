"""The container of a sample: its walls as planes and one cylinder, and its horizontal section."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil, pi, sqrt

import numpy as np

from adapters.bed.state import FloatArray

GOLDEN_ANGLE = 2.399963229728653
"""Golden angle [rad]: its multiples are spread evenly over a circle."""
WHOLE = (-np.inf, np.inf, -np.inf, np.inf)
"""Edges of a face that covers all: its ends along x, then along y [m]."""
SIDES_GAP = 0.01
"""Greatest gap between a cylinder and the polygon around it, over the mean grain radius."""


@dataclass(frozen=True)
class Walls:
    """Walls that grains may touch: ``p`` planes, and a vertical cylinder around the z axis."""

    plane_name: tuple[str, ...]  # names, such as ``floor``, ``symmetry_x``, ``piston``; p of them
    plane_point: FloatArray  # a point of each plane [m], shape (p, 3)
    plane_normal: FloatArray  # unit normal of each plane, pointing at the grains, shape (p, 3)
    plane_frictionless: tuple[bool, ...]  # true for symmetry planes; p of them
    plane_reach: FloatArray
    """Distance from the z axis beyond which a plane ends [m], shape (p,); inf for whole planes."""
    cylinder_radius: float = np.inf  # inner radius of the cylinder [m]; inf without one
    piston_edges: tuple[float, float, float, float] = WHOLE
    """Ends along x and along y of the last plane where that is a rectangular piston [m]."""

    @property
    def geometry(self) -> tuple[FloatArray, FloatArray, FloatArray, float, FloatArray]:
        """Points, normals and reaches of the planes, the cylinder's radius, edges of planes."""
        edges = np.tile(WHOLE, (len(self.plane_reach), 1))
        edges[-1] = self.piston_edges
        return self.plane_point, self.plane_normal, self.plane_reach, self.cylinder_radius, edges

    def planes(self) -> Iterator[tuple[str, bool, int, float, int]]:
        """Of each plane across an axis name, whether frictionless, axis, place on it [m], sense."""
        for name, frictionless, point, normal in zip(
            self.plane_name, self.plane_frictionless, self.plane_point, self.plane_normal,
            strict=True,
        ):  # fmt: skip
            axis = int(np.argmax(np.abs(normal)))
            yield name, frictionless, axis, float(point[axis]), int(np.sign(normal[axis]))


@dataclass(frozen=True)
class Container:
    """A vertical cylinder around the z axis, or a box from the origin; floor at z = 0.

    ``symmetry`` names the axes whose plane through the origin is a frictionless mirror:
    ("x", "y") leaves a quarter cylinder, ("x",) a half.  A box has corners (0, 0) and
    (size_x, size_y); its wall x = 0 is a mirror when "x" is in ``symmetry``, else a wall.
    """

    shape: str  # "cylinder" or "box"
    symmetry: tuple[str, ...] = ()
    radius: float = np.nan  # radius of the cylinder [m]
    size_x: float = np.nan  # length of the box along x [m]
    size_y: float = np.nan  # length of the box along y [m]
    sides: int = 0
    """Planes that stand for a whole cylinder, tangent to it, in an engine that has none; a
    multiple of 4, so that mirror planes pass through corners.  0: a true cylinder."""

    @property
    def area(self) -> float:
        """Horizontal section [m^2]; that of the cylinder where ``sides`` stand for it."""
        if self.shape == "box":
            return self.size_x * self.size_y
        return np.pi * self.radius**2 / 2 ** len(self.symmetry)

    def walls(
        self, piston_height: float = np.nan, piston_reach: float = np.inf,
        piston_edges: tuple[float, float, float, float] = WHOLE,
    ) -> Walls:  # fmt: skip
        """All walls; with a piston [m] at ``piston_height`` when that is finite.

        Of a piston that covers a part of the section ``piston_reach`` [m] is the radius, or
        ``piston_edges`` [m] are the ends along x and y.
        """
        planes: list[tuple[str, tuple[float, ...], tuple[float, ...], bool, float]] = [
            ("floor", (0, 0, 0), (0, 0, 1), False, np.inf)
        ]
        for axis, name in enumerate("xy"):
            inward = tuple(float(axis == i) for i in range(3))
            if name in self.symmetry:
                planes.append((f"symmetry_{name}", (0, 0, 0), inward, True, np.inf))
            elif self.shape == "box":
                planes.append((f"wall_{name}_low", (0, 0, 0), inward, False, np.inf))
            if self.shape == "box":
                far = tuple((self.size_x, self.size_y)[axis] * c for c in inward)
                outward = tuple(-c for c in inward)
                planes.append((f"wall_{name}_high", far, outward, False, np.inf))
        for number, angle in enumerate(self.side_angles(), 1):
            outward = (np.cos(angle), np.sin(angle), 0.0)
            side = tuple(self.radius * c for c in outward)
            planes.append((f"cylinder_{number}", side, tuple(-c for c in outward), False, np.inf))
        if np.isfinite(piston_height):
            planes.append(("piston", (0, 0, piston_height), (0, 0, -1), False, piston_reach))
        name_, point, normal, frictionless, reach = zip(*planes, strict=True)
        return Walls(
            name_, np.array(point, float), np.array(normal, float), frictionless,
            np.array(reach, float),
            self.radius if self.shape == "cylinder" and not self.sides else np.inf, piston_edges,
        )  # fmt: skip

    def place_footprint(self, size: tuple[float, float]) -> tuple[float, float, float, float]:
        """Ends along x and y [m] of a rectangle of ``size`` [m] in a box: from a mirror plane on,
        which it crosses, or in the middle."""
        (left, right), (front, back) = (
            (-np.inf, length) if axis in self.symmetry else (0.5 * (w - length), 0.5 * (w + length))
            for axis, length, w in zip("xy", size, (self.size_x, self.size_y), strict=True)
        )
        return left, right, front, back

    def side_angles(self) -> FloatArray:
        """Direction of each side's outward normal from the x axis [rad]; none without ``sides``."""
        angle = (np.arange(self.sides) + 0.5) * 2 * np.pi / max(self.sides, 1)
        inside = np.ones(self.sides, bool)
        for axis in self.symmetry:
            inside &= (np.cos(angle) if axis == "x" else np.sin(angle)) > 0
        return angle[inside]


def count_sides(radius: float, grain_radius: float) -> int:
    """Sides of a polygon around a cylinder of ``radius`` [m] whose corners reach out little.

    A corner is radius (1/cos(pi/N) - 1) from the cylinder, at most `SIDES_GAP` times the mean
    ``grain_radius`` [m]; the section exceeds the circle's by a third of (pi/N)^2.
    """
    return 4 * ceil(pi / sqrt(2 * SIDES_GAP * grain_radius / radius) / 4)
