"""Varandas' law of ballast in transition zones, as the open program ROSE computes it."""

from dataclasses import dataclass

import numpy as np
from scipy.special import boxcox

from track_line.arrays import Floats, Numbers
from track_line.laws.contract import BedLoad, Law

SHIFT = 100.0
"""From where on the series below is summed by Euler and Maclaurin, to 1e-9."""


@dataclass(frozen=True)
class Varandas(Law):
    """s = gamma (F/F0)^(alpha + 1) H(N)/H(N0 - 1), H(n) = sum of k^-beta for k = 1 .. n.

    With beta = 1 it is a logarithm.  Between whole axles H is its analytic continuation, so that a
    rate is there.  The axles are counted whatever they weigh; Varandas counts those that were
    heavier, in a histogram.
    """

    gamma: float = 10e-3  # settlement by N0 axles of the force F0 [m]
    force: float = 50e3  # F0 [N]
    alpha: float = 0.6
    beta: float = 0.82
    cycles: float = 1e6  # N0

    formula = "s = gamma (F/F0)^(alpha + 1) H(N)/H(N0 - 1)"
    source = "Varandas et al. 2013; parameters of a test of PlatypusBytes/ROSE (BSD-3)"
    validity = "ballast near bridges and culverts; no linear term: N^0.18 for many axles"
    terms, shape, exponent = ("gamma",), ("beta", 0.02, 2.0), ("alpha", 1.0)

    def _sum(self, number: Numbers) -> Floats:
        """H [-]."""
        places = np.arange(1.0, SHIFT + 1)
        above = np.asarray(number)[..., None] + places
        first = (above**-self.beta - places**-self.beta).sum(axis=-1)
        return np.asarray(self._smooth(SHIFT + number) - self._smooth(SHIFT) - first)

    def _smooth(self, n: Numbers) -> Floats:
        """H(n) up to a constant, for large n (Euler and Maclaurin)."""
        tail = n**-self.beta / 2 - self.beta * n ** (-self.beta - 1) / 12
        return np.asarray(boxcox(n, 1 - self.beta) + tail)

    def _slope(self, number: float) -> float:
        """dH/dn [-]."""
        n, b, places = SHIFT + number, self.beta, np.arange(1, int(SHIFT) + 1)
        smooth = n**-b - b * n ** (-b - 1) / 2 + b * (b + 1) * n ** (-b - 2) / 12
        return float(smooth + (b * (number + places) ** (-b - 1)).sum())

    def _scale(self, load: BedLoad) -> Floats:
        ratio = (load.force / self.force) ** (self.alpha + 1)
        return np.asarray(self.gamma * ratio / self._sum(self.cycles - 1))

    def rate(self, load: BedLoad, settled: Floats, cycle: float) -> Floats:
        return self._scale(load) * self._slope(cycle)

    def advance(self, load: BedLoad, settled: Floats, cycle: float, cycles: Numbers) -> Floats:
        return self._scale(load) * (self._sum(cycle + cycles) - self._sum(cycle))


LAW = Varandas
