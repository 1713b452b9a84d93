"""Round grains: discs in the plane and spheres in space."""

from dataclasses import dataclass
from math import pi

import numpy as np

from rigid_lcp.arrays import Floats
from rigid_lcp.shapes.numbers import require_length


@dataclass(frozen=True)
class RoundGrain:
    """A grain of ``radius`` [m].  Raises `ShapeError` for a radius that is not positive."""

    radius: float

    def __post_init__(self) -> None:
        kind = type(self).__name__.lower()
        object.__setattr__(self, "radius", require_length(self.radius, "radius", kind))

    @property
    def reach(self) -> float:
        """Radius [m]."""
        return self.radius

    @property
    def width(self) -> float:
        """Diameter [m]."""
        return 2 * self.radius


class Disc(RoundGrain):
    """Disc of ``radius`` [m]."""

    dim = 2

    def mass_properties(self, density: float) -> tuple[float, float]:
        """Mass [kg] and moment of inertia [kg m^2] at ``density`` [kg/m^2]."""
        mass = density * (pi * self.radius**2)
        return mass, mass * self.radius**2 / 2


class Sphere(RoundGrain):
    """Sphere of ``radius`` [m]."""

    dim = 3

    def mass_properties(self, density: float) -> tuple[float, Floats]:
        """Mass [kg] and inertia tensor (3, 3) [kg m^2] at ``density`` [kg/m^3]."""
        volume = 4.0 / 3.0 * np.pi * self.radius**3
        return density * volume, density * (0.4 * volume * self.radius**2 * np.eye(3))
