"""Radii of the grains: three distributions or a grading, bounds and moments, seeded samples."""

from dataclasses import dataclass
from math import erf, exp, pi, sqrt

import numpy as np

from adapters.bed.container import Container
from adapters.bed.state import FloatArray
from trackbed.scene_files import Grading, draw_sizes, refuse_outside_limits

PAPER_DENSITY = 0.5615
"""Relative density of a rained bed below its free surface: Karrech et al. (2007), Table 1."""


@dataclass(frozen=True)
class RadiusDistribution:
    """A distribution of radii.

    ``normal`` is cut at ``truncation`` standard deviations on either side of the mean and drawn
    again outside; ``uniform`` spans mean -+ sqrt(3) standard deviations, so that the standard
    deviation is what it says; ``constant`` is the mean.
    """

    name: str  # "normal", "uniform" or "constant"
    mean: float  # mean radius [m]
    standard_deviation: float = 0.0
    """Standard deviation [m]; of the normal distribution before it is cut."""
    truncation: float = 2.0
    """Standard deviations of a normal distribution kept on either side of the mean."""

    @property
    def half_width(self) -> float:
        """Greatest distance of a radius from the mean [m]."""
        widths = {"normal": self.truncation, "uniform": sqrt(3), "constant": 0.0}
        return widths[self.name] * self.standard_deviation

    @property
    def smallest(self) -> float:
        """Lower bound of the radii [m]."""
        return self.mean - self.half_width

    @property
    def greatest(self) -> float:
        """Upper bound of the radii [m]."""
        return self.mean + self.half_width

    @property
    def variance(self) -> float:
        """Variance of the radii [m^2], after the cut."""
        if self.name == "constant":
            return 0.0
        if self.name == "uniform":
            return self.standard_deviation**2
        cut = self.truncation
        density_at_cut = exp(-(cut**2) / 2) / sqrt(2 * pi)
        return self.standard_deviation**2 * (1 - 2 * cut * density_at_cut / erf(cut / sqrt(2)))

    @property
    def volume_mean(self) -> float:
        """Expected volume of a grain [m^3].

        The distributions are symmetric: E[r^3] = mean^3 + 3 mean variance.
        """
        return 4 / 3 * pi * (self.mean**3 + 3 * self.mean * self.variance)


@dataclass(frozen=True)
class GradedRadii:
    """Radii of spheres whose masses follow a grading: half the side of the hole that they pass."""

    grading: Grading

    @property
    def smallest(self) -> float:
        """Lower bound of the radii [m]."""
        return self.grading.bounds[0] / 2

    @property
    def greatest(self) -> float:
        """Upper bound of the radii [m]."""
        return self.grading.bounds[1] / 2

    @property
    def mean(self) -> float:
        """Mean radius of the grains, each counted once [m]."""
        return self.grading.mean_power(1) / 2

    @property
    def volume_mean(self) -> float:
        """Expected volume of a grain [m^3]."""
        return pi / 6 * self.grading.mean_power(3)


Radii = RadiusDistribution | GradedRadii


def draw_radii(distribution: Radii, count: int, seed: int) -> FloatArray:
    """``count`` independent radii [m], shape (count,); the same for the same seed.

    They depend on nothing but the arguments: another container keeps the grains.  Those of a
    grading are drawn by mass; raises `SceneError` where they leave a standard's limits.
    """
    generator = np.random.default_rng([seed, 0])
    if isinstance(distribution, GradedRadii):
        sizes = draw_sizes(distribution.grading, count, generator)
        refuse_outside_limits(distribution.grading, sizes)
        return sizes / 2
    if distribution.name == "constant":
        return np.full(count, distribution.mean)
    if distribution.name == "uniform":
        return generator.uniform(distribution.smallest, distribution.greatest, count)
    deviation = generator.standard_normal(count)
    while (outside := np.abs(deviation) > distribution.truncation).any():
        deviation[outside] = generator.standard_normal(int(outside.sum()))
    return distribution.mean + distribution.standard_deviation * deviation


def find_radius_that_fits(container: Container) -> float:
    """Radius of the largest sphere between the upright walls and mirror planes [m]."""
    if container.shape == "box":
        return min(container.size_x, container.size_y) / 2
    return container.radius / (1, 2, 1 + sqrt(2))[len(container.symmetry)]


def expect_grains(distribution: Radii, container: Container, height: float) -> int:
    """Number of grains that fill ``container`` to ``height`` [m] after the rain.

    At `PAPER_DENSITY`, that of a bed of friction 0.5 without load; a frictionless bed
    packs to 0.64 and ends an eighth lower.
    """
    volume = PAPER_DENSITY * container.area * height
    return round(volume / distribution.volume_mean)
