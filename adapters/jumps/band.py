"""How far the settlement at the end of a controlled run can be off: the errors of all its jumps.

Three parts, kept apart and added as squares:

- *jumps*: what each jump gained is compared with the rates computed on both sides of it; the
  difference is taken out of the middle of the band.  What is left is linear in the gains of the
  computed stretches, and one stretch serves several jumps: its derivatives by all of them are added
  first, then the stretches' variances.
- *laws*: the form of the law inside each jump, off to the same side in all jumps: added as they
  are, not as squares.
- *scatter*: another run of the same bed has other bursts, S for each of its cycles, S their
  long-run variance.

The band is for the settlement of one full run from the same state after k_i cycles; without the
other run's scatter it is for the mean of many.  It is no band for what no check behind a jump can
see: a bed that keeps settling in its own, wrong way.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot, sqrt
from typing import Any

from scipy.special import ndtri

BAND_PROBABILITY = 0.9
"""Chance with which the band is to hold."""


@dataclass(frozen=True)
class Band:
    """Settlement at the last cycle of a controlled run and its uncertainty; metres."""

    cycle: int
    settlement: float  # of the bed, as its table has it
    corrected: float
    """The same with the errors observed behind the jumps taken out: the middle of both bands."""
    low: float
    high: float  # between them a full run from the same state ends with `BAND_PROBABILITY`
    mean_low: float
    mean_high: float  # the same for the mean of many full runs
    jumps: float  # standard deviation from the noise of the rates that were computed
    laws: float  # from the form of the law
    scatter: float  # from the bursts of another run


def estimate_band(cycle: int, settlement: float, checks: Sequence[Mapping[str, Any]]) -> Band:
    """The band of a run at ``cycle`` [m]; ``checks``: `Check` of each jump that was kept, in order.

    Each with ``jump`` and ``window``, the cycles h jumped and m + k computed behind it.
    """
    off = sum(check["gained"] - check["expected"] for check in checks)
    laws = sum(check["form"] for check in checks)
    derivative: dict[int, float] = {}
    variance: dict[int, float] = {}
    other = own = 0.0
    for check in checks:
        for first, cycles, noise, share in check["sources"]:
            derivative[first] = derivative.get(first, 1.0) + share
            variance[first] = noise * cycles
        here = check["sources"][-1]
        own += here[2] * (check["window"] - here[1])  # healing cycles
        other += here[2] * (check["window"] + check["jump"])
    jumps = sqrt(own + sum(derivative[first] ** 2 * variance[first] for first in variance))
    half = float(ndtri((1 + BAND_PROBABILITY) / 2))
    mean, single = half * hypot(jumps, laws), half * hypot(jumps, laws, sqrt(other))
    middle = settlement - off
    ends = (middle - single, middle + single, middle - mean, middle + mean)
    return Band(cycle, settlement, middle, *ends, jumps, laws, sqrt(other))
