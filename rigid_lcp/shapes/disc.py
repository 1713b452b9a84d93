"""Discs: round grains in the plane."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

from rigid_lcp.shapes.numbers import require_length


@dataclass(frozen=True)
class Disc:
    """Disc of ``radius`` [m].  Raises `ShapeError` for a radius that is not positive."""

    radius: float

    dim = 2

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", require_length(self.radius, "radius", "disc"))

    @property
    def reach(self) -> float:
        """Radius [m]."""
        return self.radius

    @property
    def width(self) -> float:
        """Diameter [m]."""
        return 2 * self.radius

    def mass_properties(self, density: float) -> tuple[float, float]:
        """Mass [kg] and moment of inertia [kg m^2] at ``density`` [kg/m^2]."""
        mass = density * (pi * self.radius**2)
        return mass, mass * self.radius**2 / 2
