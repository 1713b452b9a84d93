"""What a settlement law is.

A law is a frozen dataclass whose fields are its parameters in SI units, with defaults.  It speaks
of a bed of mean quality; that others settle more is the scatter's (`track_line.beds`).
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from track_line.arrays import Floats, Numbers

SEAT_AREA = 0.325
"""Of half a sleeper on its bed, 0.26 m by 1.25 m [m^2]."""


@dataclass(frozen=True)
class BedLoad:
    """What an axle does to beds; arrays that fit each other."""

    force: Floats  # greatest force R of half a sleeper on its bed [N], zero where it hangs
    bed: Floats  # stiffness of the bed under half a sleeper [N/m]


class Law(ABC):
    """ds/dN as a function of load, settlement and axles so far.

    Hardening by time: the rate depends on N alone; by strain: on s alone.
    """

    formula: ClassVar[str]
    source: ClassVar[str]  # where the form and the defaults are from, and which of the two is not
    validity: ClassVar[str]  # what it was measured on, and what it is not for

    terms: ClassVar[tuple[str, ...]] = ()
    """Parameters each of which is a factor of a part of the settlement from rest: what a fit to
    measured beds finds, none below zero.  Without any the law is not fitted."""
    shape: ClassVar[tuple[str, float, float] | None] = None
    """Parameter that bends the curve, and between which numbers above zero a fit looks for it."""
    exponent: ClassVar[tuple[str, float] | None] = None
    """Parameter of which the exponent of the force is the sum with this number."""

    @abstractmethod
    def rate(self, load: BedLoad, settled: Floats, cycle: float) -> Floats:
        """ds/dN [m] at the settlement s = ``settled`` [m] behind N = ``cycle`` axles."""

    @abstractmethod
    def advance(self, load: BedLoad, settled: Floats, cycle: float, cycles: Numbers) -> Floats:
        """The integral of `rate` over ``cycles`` further axles, one number or an array that fits
        the others, at constant load [m]."""

    def advance_mixed(
        self, load: BedLoad, shares: Floats, settled: Floats, cycle: float, cycles: float
    ) -> Floats:
        """`advance` under axles of several kinds in turn, ``load.force`` (kinds, ...) of ``shares``
        (kinds,) that add up to one.

        The mean of the kinds, which is exact where the rate does not depend on the settlement.
        """
        return np.asarray(np.tensordot(shares, self.advance(load, settled, cycle, cycles), 1))
