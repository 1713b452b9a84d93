"""What the settlement gains over a jump, from every cycle computed so far.

The logarithm has one slope a = du / d ln N; a bed of few grains has bursts, so that a window's own
slope can be several times its mean.  Here a is a random walk in ln N, as its drift is not known
beforehand,

    Var[a(N_2) - a(N_1)] = (`DRIFT` a_mean)^2 |ln(N_2 / N_1)|,

seen through the noise of each block of computed cycles; its best linear unbiased estimate
(ordinary kriging, Matheron 1963) weighs the nearest blocks alone where cycles are quiet, and all
of them where they are not.  Behind the last block the walk's mean does not change, so the gain is
the logarithm's with that slope.

A bed that was moved by G settles more than it would have: in the first cycle, as contacts that
were moved do not bear yet, and by some kappa G / n in the n-th.  kappa is one number for a run,
0 with standard deviation `RESEATING` before any cycle is seen; the blocks behind jumps tell it,
since 1 / n falls much faster than 1 / N.

Behind a jump the walk is known on both sides of it.  What earlier jumps, with the windows behind
them, gained beyond that is taken off the next jump, with what its own window will gain so
(`asked_gain`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from adapters.jump_rates import Stretch, noise_of
from adapters.state import FloatArray, IntArray

DRIFT = 1.0
"""Standard deviation of the slope's change over a unit of ln N, over the mean slope."""
RESEATING = 0.1
"""Standard deviation of kappa."""
SEATING = 0.2
"""Share of the first k_i cycles that is another process: the rained bed takes the load."""
LONGEST_BLOCK = 0.35
"""Greatest ln(end / start) of a block, so that it has one slope."""
LONGEST_RESEATING = 1.1
"""The same of cycles n since a jump, so that kappa can be told from the slope."""


@dataclass(frozen=True, eq=False)
class Jumped:
    """A jump that was made, with the window behind it."""

    cycles: IntArray
    """Cycles done before it, behind it, and at the end of the window behind it, shape (3,)."""
    settlement: FloatArray
    """At their ends [m], shape (3,)."""

    @property
    def moved(self) -> float:
        """G, by which the mean grain was moved [m]."""
        return float(self.settlement[1] - self.settlement[0])

    @property
    def followed(self) -> float:
        """Settlement in the window behind it, healing cycles too [m]."""
        return float(self.settlement[2] - self.settlement[1])


@dataclass(frozen=True, eq=False)
class Slopes:
    """Slopes of b blocks of computed cycles, and the covariance that they are read with."""

    place: FloatArray
    """ln N in the middle of each block, shape (b,)."""
    slope: FloatArray
    """Settlement over the length in ln N [m], shape (b,)."""
    reseated: FloatArray
    """What kappa = 1 adds to each slope [m], shape (b,)."""
    system: FloatArray
    """Kriging's matrix over the walk's variance in a unit of ln N, shape (b + 1, b + 1)."""

    def at(self, places: FloatArray) -> FloatArray:
        """Estimate of a [m] at places (p,) of ln N, not below 0: no bed rises for long."""
        known = np.ones((len(self.slope) + 1, len(places)))
        known[:-1] = -np.abs(self.place[:, None] - places) / 2
        weights = np.linalg.solve(self.system, known)[:-1]
        return np.maximum(self.slope @ weights, 0.0)

    def kappa(self, variance: float) -> float:
        """Estimate of kappa, not below 0; ``variance`` its own over the walk's."""
        known = np.append(variance * self.reseated, 0.0)
        weights = np.linalg.solve(self.system, known)[:-1]
        return max(float(self.slope @ weights), 0.0)


def asked_gain(known: Sequence[Stretch], h: int, jumps: Sequence[Jumped] = ()) -> float:
    """Settlement [m] to move the mean grain by in a jump of ``h`` cycles, 0 at least.

    ``known``: all cycles computed, ascending, but the first behind each jump.  The logarithm's
    gain, less what ``jumps`` before and the windows behind them gained too much; the window behind
    this one will gain too much by the same share of what the bed is moved by.
    """
    slopes = slopes_of(known, jumps)
    last = known[-1].last_cycle
    between = np.array([(one.cycles[:2], one.cycles[1:]) for one in jumps], float)
    spans = np.append(between.reshape(-1, 2), [[last, last + h]], axis=0)
    middle = np.log(spans).mean(axis=1)
    middle[-1] = np.log(last)
    expected = slopes.at(middle) * np.log(spans[:, 1] / spans[:, 0])
    over, behind = expected[:-1:2], expected[1:-1:2]
    moved = np.array([one.moved for one in jumps])
    followed = np.array([one.followed for one in jumps])
    owed = float((moved + followed - over - behind).sum())
    share = float(np.clip((followed - behind).sum() / (moved.sum() or np.inf), 0.0, 1.0))
    return max(float(expected[-1]) - owed, 0.0) / (1 + share)


def slopes_of(stretches: Sequence[Stretch], jumps: Sequence[Jumped] = ()) -> Slopes:
    """Blocks of ``stretches`` with their covariance: walk, noise, and kappa behind ``jumps``."""
    pieces = [piece for one in stretches for piece in blocks_of(one, jumps)]
    blocks = [block for block, _ in pieces]
    span = np.array([np.log(one.last_cycle / one.first_cycle) for one in blocks])
    slope = np.array([one.gain.sum() for one in blocks]) / span
    reseated = np.array([extra for _, extra in pieces]) / span
    place = np.array([0.5 * np.log(one.first_cycle * one.last_cycle) for one in blocks])
    cycles = np.array([len(one.gain) for one in blocks])
    noise = noise_of(blocks).variance * cycles / span**2
    kappa = 0.0
    for _ in range(2):  # the walk's scale is the mean slope without what jumps add to it
        mean = float((slope - kappa * reseated) @ span) / float(span.sum())
        walk = (DRIFT * (mean if mean > 0 else float(np.abs(slope).mean()))) ** 2 or 1.0
        slopes = Slopes(place, slope, reseated, system_of(place, noise / walk, reseated, walk))
        kappa = slopes.kappa(RESEATING**2 / walk)
    return slopes


def system_of(
    place: FloatArray, noise: FloatArray, reseated: FloatArray, walk: float = 1.0
) -> FloatArray:
    """Kriging's matrix of blocks at ``place`` (b,), over the walk's variance in a unit of ln N.

    ``noise`` (b,) is over that too, ``walk`` [m^2] is that.  Stationary is only the walk's change:
    its level is free, hence the Lagrange multiplier in the last row.
    """
    count = len(place)
    system = np.zeros((count + 1, count + 1))
    system[:count, :count] = np.diag(noise) - np.abs(place[:, None] - place) / 2
    system[:count, :count] += RESEATING**2 / walk * np.outer(reseated, reseated)
    system[:count, count] = system[count, :count] = 1
    return system


def blocks_of(one: Stretch, jumps: Sequence[Jumped] = ()) -> list[tuple[Stretch, float]]:
    """A stretch cut at equal ratios of N, behind a jump of n; with each, what kappa = 1 adds [m].

    No longer than `LONGEST_BLOCK` and `LONGEST_RESEATING`; a cycle is the shortest block.
    Stretches begin behind cycle 0.
    """
    first, last = one.first_cycle, one.last_cycle
    before = [jump for jump in jumps if jump.cycles[1] <= first]
    start = int(before[-1].cycles[1]) if before else 0
    longest = LONGEST_RESEATING if before else LONGEST_BLOCK
    from_first = max(first - start, 1)
    count = max(1, int(np.ceil(np.log((last - start) / from_first) / longest)))
    edges = np.unique(np.geomspace(from_first, last - start, count + 1).round().astype(int))
    edges[0] = first - start
    found = []
    for begin, end in pairwise(edges.tolist()):
        cycle = np.arange(start + begin, start + end)
        extra = sum(jump.moved * float((1 / (cycle - jump.cycles[1] + 1)).sum()) for jump in before)
        found.append((one.part(start + begin - first, start + end - first), extra))
    return found
