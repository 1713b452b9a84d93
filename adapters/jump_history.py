"""What the settlement gains over a jump, from every cycle computed so far.

The logarithm has one slope a = du / d ln N; a bed of few grains has bursts, so that a window's own
slope can be several times its mean.  Here a is a random walk in ln N, as its drift is not known
beforehand,

    Var[a(N_2) - a(N_1)] = (`DRIFT` a_mean)^2 |ln(N_2 / N_1)|,

seen through the noise of each block of computed cycles; its best linear unbiased estimate at the
jump (ordinary kriging, Matheron 1963) weighs the last window alone where cycles are quiet, and all
blocks where they are not.  Behind the last block the walk's mean does not change, so the gain is
the logarithm's with that slope.

A bed that was moved settles more in the first cycle behind the jump than it would have: contacts
that were moved do not bear yet.  What earlier jumps and their healing cycles gained beyond the
forecast is taken off the next jump, with what its own healing cycles will gain so (`asked_gain`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from adapters.jump_rates import Noise, Stretch, noise_of
from adapters.state import FloatArray, IntArray

DRIFT = 1.0
"""Standard deviation of the slope's change over a unit of ln N, over the mean slope."""
SEATING = 0.2
"""Share of the first k_i cycles that is another process: the rained bed takes the load."""
LONGEST_BLOCK = 0.35
"""Greatest ln(end / start) of a block, so that it has one slope."""


@dataclass(frozen=True)
class Gain:
    """Settlement over a jump [m], and its standard error by noise and drift [m]."""

    mean: float
    error: float


@dataclass(frozen=True, eq=False)
class Jumped:
    """A jump that was made, with the healing cycles behind it."""

    known: tuple[Stretch, ...]
    """Cycles computed before it."""
    cycles: IntArray
    """Cycles done before it, behind it, and behind the healing cycles, shape (3,)."""
    settlement: FloatArray
    """At their ends [m], shape (3,)."""


def asked_gain(known: Sequence[Stretch], h: int, jumps: Sequence[Jumped]) -> float:
    """Settlement [m] to move the mean grain by in a jump of ``h`` cycles, 0 at least.

    The forecast less what ``jumps`` before gained beyond theirs, all in all, and less the mean of
    what healing cycles did.  Bursts of the healing cycles count as the jump's own.
    """
    gained, healed = [], []
    for one in jumps:
        before, behind, after = one.cycles.tolist()
        all_in_all = gain_of(one.known, after - before).mean
        in_healing = all_in_all - gain_of(one.known, behind - before).mean
        gained.append(float(one.settlement[2] - one.settlement[0]) - all_in_all)
        healed.append(float(one.settlement[2] - one.settlement[1]) - in_healing)
    expected = sum(healed) / len(healed) if healed else 0.0
    return max(gain_of(known, h).mean - sum(gained) - expected, 0.0)


def blocks_of(stretches: Sequence[Stretch]) -> tuple[Stretch, ...]:
    """Stretches cut where they are longer than `LONGEST_BLOCK` in ln N, at equal ratios.

    A cycle is the shortest block.  Stretches begin behind cycle 0.
    """
    blocks: list[Stretch] = []
    for one in stretches:
        first, last = one.first_cycle, one.last_cycle
        count = max(1, int(np.ceil(np.log(last / first) / LONGEST_BLOCK)))
        edges = np.unique(np.geomspace(first, last, count + 1).round().astype(int)) - first
        blocks += (one.part(a, b) for a, b in pairwise(edges))
    return tuple(blocks)


def slope_weights(place: FloatArray, variance: FloatArray, at: float) -> tuple[FloatArray, float]:
    """Weights (b,), sum 1, of slopes at ``place`` = ln N, and the variance of what they estimate.

    ``variance`` (b,) of each slope's noise, over that of the walk in a unit of ln N; ``at`` the
    place of the estimate.  Stationary is only the walk's change: the level is free, hence the
    Lagrange multiplier in the last row.
    """
    count = len(place)
    system = np.zeros((count + 1, count + 1))
    system[:count, :count] = np.diag(variance) - np.abs(place[:, None] - place) / 2
    system[:count, count] = system[count, :count] = 1
    known = np.append(-np.abs(place - at) / 2, 1)
    weights = np.linalg.solve(system, known)
    return weights[:count], float(-known @ weights)


def gain_of(stretches: Sequence[Stretch], h: int) -> Gain:
    """Settlement over ``h`` cycles behind the last of ``stretches``, ascending, [m].

    Not below zero: a bed under load does not rise for long.  A bed without motion gains nothing.
    """
    blocks = blocks_of(stretches)
    span = np.array([np.log(one.last_cycle / one.first_cycle) for one in blocks])
    slope = np.array([one.gain.sum() for one in blocks]) / span
    cycles = np.array([len(one.gain) for one in blocks])
    drift = DRIFT * float(slope @ span) / float(span.sum())
    if drift == 0:
        return Gain(0.0, 0.0)
    noise: Noise = noise_of(blocks)
    middle = np.array([0.5 * np.log(one.first_cycle * one.last_cycle) for one in blocks])
    last = float(blocks[-1].last_cycle)
    end = float(np.log(last))
    weights, unsure = slope_weights(middle, noise.variance * cycles / (span * drift) ** 2, end)
    length = float(np.log1p(h / last))
    walked = unsure * length**2 + length**3 / 3  # of the walk's mean over the jump, times length
    error = abs(drift) * float(np.sqrt(max(walked, 0.0)))
    return Gain(max(float(weights @ slope), 0.0) * length, error)
