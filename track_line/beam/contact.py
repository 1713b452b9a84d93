"""Beds that only push: the complementarity problem of a line, solved exactly.

A sleeper of weight W between a pad k_p and a bed k_b that lies g below its first level takes from
the rail, at its deflection w,

    Q(w) = max(k_s (w - g) - W k_s/k_b, -W),    k_s = k_p k_b/(k_p + k_b),

and presses R = Q + W >= 0 on its bed: where it hangs, R = 0.  So the rail alone is left, on
springs of two branches; the set of those that bear is found by solving and choosing again, for the
last few turns one at a time, the least index first, which ends for every such problem (Murty 1974).
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import ceil

import numba
import numpy as np

from track_line.arrays import Bools, Floats
from track_line.beam.kernel import BROKEN, pass_comb
from track_line.beam.rail import GRAVITY, Rail, Track
from trackbed.errors import NotConverged


@dataclass(frozen=True)
class Comb:
    """How one axle over every sleeper is computed in few solutions."""

    apart: float = 17.0
    """Between wheels of one solution, over (4 E I a/k_s)^(1/4), the length over which a rail on
    mean beds carries a load away [-]: 26 seats of 60E1 rails on beds of 28 MN/m.  With 24 peak
    forces err by 6e-7, with 16 deflections with voids by 0.3 mm."""
    turns: int = 400
    """Solutions of one line before it is given up; 3 do from a near start, 8 from none."""


COMB = Comb()


@dataclass(frozen=True)
class Support:
    """What the rail rests on: b lines of n sleepers."""

    bed: Floats  # stiffness k_b of the bed under half a sleeper, shape (b, n) [N/m]
    series: Floats  # k_s of pad and bed, shape (b, n) [N/m]
    sleeper_weight: float  # W [N]
    pad: float  # k_p [N/m]
    period: int  # seats between the wheels of one solution


@dataclass(frozen=True)
class Rest:
    """b lines at rest under given wheels."""

    rail: Floats  # deflection of the rail over each sleeper, shape (b, n) [m]
    force: Floats  # R of each sleeper on its bed, shape (b, n) [N]
    gap: Floats  # between sleeper and bed, where it hangs, shape (b, n) [m]


@dataclass(frozen=True)
class Passage:
    """An axle that has stood over every sleeper of b lines."""

    force: Floats  # R of each sleeper while the wheel is over it, shape (b, n) [N]
    level: Floats  # deflection of the rail under the wheel, shape (b, n) [m]
    bears: Bools  # which sleepers bear, shape (b, period, n): where the next passage begins


def make_support(track: Track, bed: Floats) -> Support:
    """Beds of these stiffnesses (b, n) [N/m] under the pads and sleepers of a track."""
    series = track.pad * bed / (track.pad + bed)
    far = (4 * track.bending * track.spacing / series.mean()) ** 0.25
    period = ceil(COMB.apart * far / track.spacing)
    return Support(bed, series, track.sleeper_mass * GRAVITY, track.pad, period)


def rest_wheels(rail: Rail, support: Support, settled: Floats, load: Floats) -> Rest:
    """Lines under wheels that stand over seats.

    ``settled`` (b, n) [m]: how deep each bed lies; ``load`` (n,) [N]: on the rail over each
    sleeper.  Raises `NotConverged`.
    """
    bears = np.ones((len(settled), 1, load.size), bool)
    rail_level, force = _solve(rail, support, settled, load, bears, 1)
    sunk = rail_level - (force - support.sleeper_weight) / support.pad
    return Rest(rail_level, force, np.where(force > 0, 0.0, np.maximum(settled - sunk, 0.0)))


def roll_axle(
    rail: Rail, support: Support, settled: Floats, wheel: Floats | float,
    bears: Bools | None = None,
) -> Passage:  # fmt: skip
    """The peak force of every sleeper and the loaded level under an axle that rolls by.

    ``settled`` (b, n) [m]: how deep each bed lies; ``wheel``: load of a wheel, one or over each
    sleeper (b, n) [N]; ``bears``: of the passage before, to begin from.  The wheel stands over
    each sleeper in turn, slowly; other axles are `Support.period` seats away or more.  Raises
    `NotConverged`.
    """
    lines, seats = settled.shape
    bears = np.ones((lines, support.period, seats), bool) if bears is None else bears.copy()
    level, force = _solve(rail, support, settled, wheel, bears, support.period)
    return Passage(force, level, bears)


def _solve(
    rail: Rail, support: Support, settled: Floats, load: Floats | float, bears: Bools, period: int
) -> tuple[Floats, Floats]:
    """Deflection [m] and force [N] of each loaded seat, (b, n) each; ``bears`` is brought along.

    Lines are shared among the threads of numba.
    """
    level, force = np.empty_like(settled), np.empty_like(settled)
    rest = support.series * (settled + support.sleeper_weight / support.bed)
    lifted = settled - support.sleeper_weight / support.pad
    load = np.ascontiguousarray(np.broadcast_to(load, settled.shape), float)
    given = rail.diagonal, rail.upper, rail.weight, support.sleeper_weight, period, COMB.turns
    threads = numba.get_num_threads()
    shared = (load, support.series, rest, lifted, bears, level, force)
    parts = zip(*(np.array_split(each, threads) for each in shared), strict=True)
    with ThreadPoolExecutor(threads) as pool:
        status = list(pool.map(lambda part: pass_comb(*given, *part), parts))
    if BROKEN in status or any(status):
        why = "no two sleepers bear" if BROKEN in status else f"{COMB.turns} turns did not do"
        raise NotConverged(
            f"which sleepers of a line bear could not be found: {why}",
            remedy="look for voids deeper than the rail can span, and for beds without stiffness",
        )
    return level, force
