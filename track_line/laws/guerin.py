"""Guerin's law: a constant rate by a power of the elastic deflection of the bed."""

from dataclasses import dataclass

import numpy as np

from track_line.arrays import Floats, Numbers
from track_line.laws.contract import BedLoad, Law


@dataclass(frozen=True)
class Guerin(Law):
    """ds/dN = alpha (d/1 mm)^beta, d = F/k_b: soft beds settle more under the same force."""

    alpha: float = 1.44e-9  # [m] an axle
    beta: float = 2.51

    formula = "ds/dN = alpha (F/k_b/1 mm)^beta"
    source = "Guerin 1996 (thesis, ENPC), as quoted in reviews; numbers from memory"
    validity = "a scale model behind its first cycles; no seating, rate for ever"
    terms, exponent = ("alpha",), ("beta", 0.0)

    def rate(self, load: BedLoad, settled: Floats, cycle: float) -> Floats:
        return np.asarray(self.alpha * (load.force / load.bed / 1e-3) ** self.beta)

    def advance(self, load: BedLoad, settled: Floats, cycle: float, cycles: Numbers) -> Floats:
        return cycles * self.rate(load, settled, cycle)


LAW = Guerin
