"""Power law with strain hardening: what an ensemble of grain beds, or a test, is fitted by."""

from dataclasses import dataclass

import numpy as np

from track_line.arrays import Floats, Numbers
from track_line.laws.contract import BedLoad, Law


@dataclass(frozen=True)
class Power(Law):
    """s = a (F/F0)^m N^b at constant force; ds/dN = b u^(1/b) s^(1 - 1/b), u = a (F/F0)^m.

    A bed that was loaded less goes on where a bed of its settlement would be: the rate forgets how
    it came there.
    """

    a: float = 0.7e-3  # settlement by the first axle [m]
    force: float = 34e3  # F0: the force at which a was found [N]
    m: float = 1.6  # exponent of the force [-]
    b: float = 0.2  # exponent of the axles [-]

    formula = "s = a (F/F0)^m N^b"
    source = (
        "form: Monismith et al. 1975; m: Hettler 1984, quoted from memory; a, b: an example where "
        "a scene gives no fit"
    )
    validity = "the cycles and the ballast it was fitted to; no collapse, no threshold"
    terms, shape, exponent = ("a",), ("b", 0.01, 1.0), ("m", 0.0)

    def _first(self, load: BedLoad) -> Floats:
        """u: settlement by one axle of this load [m]."""
        return np.asarray(self.a * (load.force / self.force) ** self.m)

    def rate(self, load: BedLoad, settled: Floats, cycle: float) -> Floats:
        first = self._first(load)
        return np.asarray(self.b * first ** (1 / self.b) * settled ** (1 - 1 / self.b))

    def advance(self, load: BedLoad, settled: Floats, cycle: float, cycles: Numbers) -> Floats:
        return self._grow(self._first(load), settled, cycles)

    def advance_mixed(
        self, load: BedLoad, shares: Floats, settled: Floats, cycle: float, cycles: float
    ) -> Floats:
        """As one kind of axle with u^(1/b) = sum of share u_i^(1/b): hardening by strain adds the
        rates at one settlement."""
        first = self._first(load)
        greatest = first.max(axis=0)
        ratio = first / np.where(greatest > 0, greatest, 1.0)
        mean = np.tensordot(shares, ratio ** (1 / self.b), 1) ** self.b
        return self._grow(greatest * mean, settled, cycles)

    def _grow(self, first: Floats, settled: Floats, cycles: Numbers) -> Floats:
        """Settlement by further axles, of which the ``first`` ever would settle u [m]."""
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            further = cycles * (first / settled) ** (1 / self.b)  # over the axles that it had
            grown = settled * np.expm1(self.b * np.log1p(further))
        return np.where(settled > 0, grown, first * cycles**self.b)


LAW = Power
