"""Shenton's law of ballast behind tamping: a power of the axles and a term in proportion."""

from dataclasses import dataclass

import numpy as np

from track_line.arrays import Floats, Numbers
from track_line.laws.contract import BedLoad, Law


@dataclass(frozen=True)
class Shenton(Law):
    """s = K (A/20 t) ((0.69 mm + 0.028 L) N^0.2 + 2.7e-6 mm N), L the lift by tamping.

    A/20 t, the axle load, is taken as F/F0 of the bed: F0 belongs to an axle of 20 t.
    """

    quality: float = 1.1  # K: sleeper, ballast and ground [-]
    force: float = 34e3
    """F0: of half a sleeper on its bed where an axle of 20 t stands on it, here as on 60E1 rails,
    beds of 28 MN/m, sleepers 0.6 m apart [N]."""
    lift: float = 0.0  # L [m]
    seating: float = 0.69e-3  # [m]
    linear: float = 2.7e-9  # [m] an axle
    b: float = 0.2  # exponent of the axles [-]

    formula = "s = K F/F0 ((0.69 mm + 0.028 L) N^0.2 + 2.7e-6 mm N)"
    source = "Shenton 1985 (Track Technology), as quoted in reviews; read there from memory"
    validity = (
        "British main lines up to some 1e7 axles; Shenton takes mixed axles by their fifth-power "
        "mean, here each counts by its own force"
    )
    terms = ("seating", "linear")

    def rate(self, load: BedLoad, settled: Floats, cycle: float) -> Floats:
        seating = self.b * (self.seating + 0.028 * self.lift) * cycle ** (self.b - 1)
        return np.asarray(self.quality * load.force / self.force * (seating + self.linear))

    def advance(self, load: BedLoad, settled: Floats, cycle: float, cycles: Numbers) -> Floats:
        powers = (cycle + cycles) ** self.b - cycle**self.b
        grown = (self.seating + 0.028 * self.lift) * powers + self.linear * cycles
        return np.asarray(self.quality * load.force / self.force * grown)


LAW = Shenton
