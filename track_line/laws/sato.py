"""Sato's law: seating that ends, and a rate for ever that grows with the square of the pressure."""

from dataclasses import dataclass

import numpy as np

from track_line.arrays import Floats, Numbers
from track_line.laws.contract import SEAT_AREA, BedLoad, Law


@dataclass(frozen=True)
class Sato(Law):
    """s = gamma (1 - e^(-alpha N)) + beta N, beta = a (p - p0)^2 where p > p0, p = F/area.

    A sleeper that hangs does not seat either.
    """

    gamma: float = 1e-3  # settlement by seating [m]
    alpha: float = 1e-5  # of its end, an axle [-]
    growth: float = 1e-19  # a [m/Pa^2] an axle
    threshold: float = 42e3  # p0 [Pa]
    area: float = SEAT_AREA  # of half a sleeper on its bed [m^2]

    formula = "s = gamma (1 - e^(-alpha N)) + a (p - p0)^2 N"
    source = "form: Sato 1995 (Vehicle System Dynamics 24); the numbers are an example"
    validity = "Japanese lines of high speed; of the load only the linear term depends"
    terms, shape = ("gamma", "growth"), ("alpha", 1e-9, 1.0)

    def _rate_for_ever(self, load: BedLoad) -> Floats:
        above = np.maximum(load.force / self.area - self.threshold, 0.0)
        return np.asarray(self.growth * above**2)

    def rate(self, load: BedLoad, settled: Floats, cycle: float) -> Floats:
        seating = self.gamma * self.alpha * np.exp(-self.alpha * cycle) * (load.force > 0)
        return np.asarray(seating + self._rate_for_ever(load))

    def advance(self, load: BedLoad, settled: Floats, cycle: float, cycles: Numbers) -> Floats:
        seating = -self.gamma * np.exp(-self.alpha * cycle) * np.expm1(-self.alpha * cycles)
        return np.asarray(seating * (load.force > 0) + cycles * self._rate_for_ever(load))


LAW = Sato
