"""Li and Selig's law of fine-grained ground below the ballast."""

from dataclasses import dataclass

import numpy as np

from track_line.arrays import Floats, Numbers
from track_line.laws.contract import SEAT_AREA, BedLoad, Law


@dataclass(frozen=True)
class LiSelig(Law):
    """s = H a (sigma_d/sigma_s)^m N^b, sigma_d = spread F/area in a layer of thickness H.

    (100 a, m, b): silt .64, 1.7, .10; plastic silt .84, 2, .13; clay 1.1, 2, .16; fat clay 1.2,
    2.4, .18.  a is a strain, not per cent.
    """

    a: float = 1.2e-2
    m: float = 2.4
    b: float = 0.18
    thickness: float = 2.0  # H [m]
    strength: float = 200e3  # sigma_s: unconfined, compressive [Pa]
    spread: float = 0.4
    """Deviator stress in the layer over the pressure under the sleeper [-]; an example."""
    area: float = SEAT_AREA  # of half a sleeper on its bed [m^2]

    formula = "s = H a (sigma_d/sigma_s)^m N^b"
    source = "Li and Selig 1996 (J. Geotech. Eng. 122); a, m, b as in PlatypusBytes/ROSE (BSD-3)"
    validity = "saturated silt and clay at stresses below failure; not for ballast"
    terms, shape, exponent = ("a",), ("b", 0.01, 1.0), ("m", 0.0)

    def _first(self, load: BedLoad) -> Floats:
        ratio = self.spread * load.force / self.area / self.strength
        return np.asarray(self.thickness * self.a * ratio**self.m)

    def rate(self, load: BedLoad, settled: Floats, cycle: float) -> Floats:
        return self._first(load) * self.b * cycle ** (self.b - 1)

    def advance(self, load: BedLoad, settled: Floats, cycle: float, cycles: Numbers) -> Floats:
        return self._first(load) * ((cycle + cycles) ** self.b - cycle**self.b)


LAW = LiSelig
