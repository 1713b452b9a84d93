"""Spheres: round grains in space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rigid_lcp.arrays import Floats
from rigid_lcp.shapes.numbers import require_length


@dataclass(frozen=True)
class Sphere:
    """A sphere of the given radius [m].  Raises `ShapeError` unless the radius is positive."""

    radius: float
    dim = 3

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", require_length(self.radius, "radius", "sphere"))

    @property
    def reach(self) -> float:
        """Radius [m]."""
        return self.radius

    @property
    def width(self) -> float:
        """Diameter [m]."""
        return 2 * self.radius

    def mass_properties(self, density: float) -> tuple[float, Floats]:
        """Mass [kg] and inertia tensor (3, 3) [kg m^2] at ``density`` [kg/m^3]."""
        volume = 4.0 / 3.0 * np.pi * self.radius**3
        return density * volume, density * (0.4 * volume * self.radius**2 * np.eye(3))
