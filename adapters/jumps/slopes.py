"""Slopes du / d ln N of a bed from all cycles computed, and what jumps add to them.

The logarithm has one slope a; a bed of few grains has bursts, so that a window's own slope can be
several times its mean.  Here a is a random walk in ln N, as its drift is not known beforehand,

    Var[a(N_2) - a(N_1)] = (`SLOPES.drift` a_mean)^2 |ln(N_2 / N_1)|,

seen through the noise of each block of computed cycles; its best linear unbiased estimate
(ordinary kriging, Matheron 1963) weighs the nearest blocks alone where cycles are quiet, and all
of them where they are not.

A bed that was moved by G may settle more than it would have: in the first cycle, as contacts that
were moved do not bear yet, and by some kappa G / n in the n-th (docs/jumps.md).  kappa is one
number for a run, 0 with standard deviation `SLOPES.reseating` before any cycle is seen; the blocks
behind jumps show it, since 1 / n falls much faster than 1 / N.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import sqrt

import numpy as np

from adapters.bed import FloatArray, IntArray
from adapters.jumps.rates import Stretch, find_noise


@dataclass(frozen=True)
class SlopeNumbers:
    """What is known of slopes before any cycle, and the length of their blocks."""

    drift: float = 1.0  # deviation of the slope's change in a unit of ln N, over its mean [-]
    reseating: float = 0.1  # standard deviation of kappa [-]
    longest_block: float = 0.35  # greatest ln(end / start) of a block, so that it has one slope [-]
    longest_reseating: float = 1.1  # that of n since a jump: kappa is separable from the slope [-]


SLOPES = SlopeNumbers()
"""Of the mean grain,"""
LOADED_BODY = SlopeNumbers(drift=2.0, reseating=0.01)
"""and of the loaded body: its slope may grow by its mean and more within a unit of ln N, and its
first cycle behind a jump shows no reseating."""


@dataclass(frozen=True)
class Landing:
    """Where a jump ended."""

    cycle: int  # cycles done behind it
    moved: float  # G, by which the mean grain was moved [m]


@dataclass(frozen=True, eq=False)
class Slopes:
    """Slopes of b blocks of computed cycles, and the covariance that they are read with."""

    place: FloatArray  # ln N in the middle of each block, shape (b,)
    slope: FloatArray  # settlement over the length in ln N [m], shape (b,)
    reseated: FloatArray  # what kappa = 1 adds to each slope [m], shape (b,)
    system: FloatArray
    """Kriging's matrix over the walk's variance in a unit of ln N, shape (b + 1, b + 1)."""
    walk: float = 1.0  # that variance [m^2]
    reseating: float = SLOPES.reseating  # standard deviation of kappa before any cycle [-]

    def at(self, places: FloatArray) -> FloatArray:
        """Estimate of a [m] at places (p,) of ln N, not below 0: no bed rises for long."""
        known = np.ones((len(self.slope) + 1, len(places)))
        known[:-1] = -np.abs(self.place[:, None] - places) / 2
        weights = np.linalg.solve(self.system, known)[:-1]
        return np.maximum(self.slope @ weights, 0.0)

    def kappa(self) -> tuple[float, float]:
        """Estimate of kappa and its standard error; below 0 too, or noise would slow every bed."""
        if not self.reseated.any():
            return 0.0, self.reseating
        known = np.append(self.reseating**2 / self.walk * self.reseated, 0.0)
        weights = np.linalg.solve(self.system, known)[:-1]
        explained = float(weights @ self.reseated)  # share of the prior variance
        error = self.reseating * sqrt(min(max(1 - explained, 0.0), 1.0))
        return float(self.slope @ weights), error


def estimate_slopes(
    stretches: Sequence[Stretch], landings: Sequence[Landing] = (), numbers: SlopeNumbers = SLOPES
) -> Slopes:
    """Blocks of ``stretches`` with their covariance: walk, noise, and kappa behind ``landings``."""
    pieces = [piece for one in stretches for piece in cut_slope_blocks(one, landings)]
    blocks = [block for block, _ in pieces]
    span = np.array([np.log(one.last_cycle / one.first_cycle) for one in blocks])
    slope = np.array([one.gain.sum() for one in blocks]) / span
    reseated = np.array([extra for _, extra in pieces]) / span
    place = np.array([0.5 * np.log(one.first_cycle * one.last_cycle) for one in blocks])
    cycles = np.array([len(one.gain) for one in blocks])
    noise = find_noise(blocks).variance * cycles / span**2
    kappa = 0.0
    for _ in range(2):  # the walk's scale is the mean slope without what jumps add to it
        mean = float((slope - kappa * reseated) @ span) / float(span.sum())
        walk = (numbers.drift * (mean if mean > 0 else float(np.abs(slope).mean()))) ** 2 or 1.0
        prior = numbers.reseating**2 / walk * np.outer(reseated, reseated)
        system = assemble_kriging(place, noise / walk, prior)
        slopes = Slopes(place, slope, reseated, system, walk, numbers.reseating)
        kappa, _ = slopes.kappa()
    return slopes


def assemble_kriging(place: FloatArray, noise: FloatArray, prior: FloatArray) -> FloatArray:
    """Kriging's matrix of blocks at ``place`` (b,), over the walk's variance in a unit of ln N.

    ``noise`` (b,) and the covariance (b, b) by a ``prior`` kappa are over that too.  Stationary is
    only the walk's change: its level is free, hence the Lagrange multiplier in the last row.
    """
    count = len(place)
    system = np.zeros((count + 1, count + 1))
    system[:count, :count] = np.diag(noise) - np.abs(place[:, None] - place) / 2
    system[:count, :count] += prior
    system[:count, count] = system[count, :count] = 1
    return system


def cut_slope_blocks(one: Stretch, landings: Sequence[Landing] = ()) -> list[tuple[Stretch, float]]:
    """A stretch cut at equal ratios of N, behind a jump of n; with each, what kappa = 1 adds [m].

    No longer than `SLOPES.longest_block`, or ``longest_reseating`` behind a jump; a cycle is the
    shortest block.  Stretches begin behind cycle 0.
    """
    first, last = one.first_cycle, one.last_cycle
    start = max((landing.cycle for landing in landings if landing.cycle <= first), default=0)
    longest = SLOPES.longest_reseating if start else SLOPES.longest_block
    from_first = max(first - start, 1)
    count = max(1, int(np.ceil(np.log((last - start) / from_first) / longest)))
    edges = np.unique(np.geomspace(from_first, last - start, count + 1).round().astype(int))
    edges[0] = first - start
    parts = [one.part(a + start - first, b + start - first) for a, b in pairwise(edges.tolist())]
    return [(part, float(find_reseating(part, landings).sum())) for part in parts]


def find_reseating(stretch: Stretch, landings: Sequence[Landing]) -> FloatArray:
    """What kappa = 1 adds to the gain of each cycle of a stretch [m], shape (k,): sum of G / n."""
    cycle = stretch.first_cycle + 1.0 + np.arange(len(stretch.gain))
    more = np.zeros(len(cycle))
    for one in landings:
        if one.cycle <= stretch.first_cycle:
            more += one.moved / (cycle - one.cycle)
    return more


def remove_moves(stretch: Stretch, landings: Sequence[Landing], kappa: float) -> Stretch:
    """The stretch of the bed itself, without what jumps made it settle more."""
    return replace(stretch, gain=stretch.gain - kappa * find_reseating(stretch, landings))


@dataclass(frozen=True, eq=False)
class Jumped:
    """A jump that was made, with the window behind it."""

    cycles: IntArray
    """Cycles done before it, behind it, and at the end of the window behind it, shape (3,)."""
    settlement: FloatArray  # at their ends [m], shape (3,)

    @property
    def landing(self) -> Landing:
        """Where it ended, and by what the mean grain was moved."""
        return Landing(int(self.cycles[1]), float(self.settlement[1] - self.settlement[0]))

    @property
    def followed(self) -> float:
        """Settlement in the window behind it, healing cycles too [m]."""
        return float(self.settlement[2] - self.settlement[1])


def find_asked_gain(
    known: Sequence[Stretch], h: int, jumps: Sequence[Jumped] = (), numbers: SlopeNumbers = SLOPES
) -> float:
    """Settlement [m] to move the mean grain, or the loaded body, by in a jump of ``h`` cycles, 0 at
    least.

    Behind the last block the walk's mean does not change, so the gain is the logarithm's with that
    slope; behind a jump the walk is known on both sides of it.  ``known``: all cycles computed,
    ascending, but the first behind each jump.  Less what ``jumps`` before and the windows behind
    them gained too much; the window behind this one will gain too much by the same share of what
    the bed is moved by.
    """
    slopes = estimate_slopes(known, [one.landing for one in jumps], numbers)
    last = known[-1].last_cycle
    between = np.array([(one.cycles[:2], one.cycles[1:]) for one in jumps], float)
    spans = np.append(between.reshape(-1, 2), [[last, last + h]], axis=0)
    middle = np.log(spans).mean(axis=1)
    middle[-1] = np.log(last)
    expected = slopes.at(middle) * np.log(spans[:, 1] / spans[:, 0])
    over, behind = expected[:-1:2], expected[1:-1:2]
    moved = np.array([one.landing.moved for one in jumps])
    followed = np.array([one.followed for one in jumps])
    owed = float((moved + followed - over - behind).sum())
    share = float(np.clip((followed - behind).sum() / (moved.sum() or np.inf), 0.0, 1.0))
    return max(float(expected[-1]) - owed, 0.0) / (1 + share)
