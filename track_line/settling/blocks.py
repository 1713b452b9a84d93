"""How many axles one block may have: cycle jumps of a line are bounded by stability.

In a block of dN axles forces stay as they are.  A bed that lies by e too high carries k_s e too
much (its neighbours take a share away) and sinks by k_s e ds/dF too much in the block, ds(F) being
its settlement there.  For k_s ds/dF > 2 the error grows from block to block, from sleeper to
sleeper with another sign; for ds ~ F^m that is ds > 2 F/(m k_s).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.optimize import brentq

from track_line.arrays import Floats
from track_line.laws import BedLoad
from track_line.settling.line import Line


@dataclass(frozen=True)
class Blocks:
    """How blocks are chosen."""

    gain: float = 1.0
    """Of k_s ds/dF, the mean over the beds; 2 is the limit, and some laws fail at 0.8 of that."""
    outliers: float = 0.001
    """Share of beds that may be beyond the limit by themselves: they hang, and come back [-]."""
    fewest: int = 40
    """Blocks of a run at least, equal in N^spread, so that its curve is smooth."""
    spread: float = 0.2
    sample: int = 4000
    """Beds by which a block is chosen, spread over all lines."""
    nudge: float = 1e-4
    """Of the force, for ds/dF [-]."""
    shortest: float = 1e-9
    """Of a block over the whole run [-]."""


BLOCKS = Blocks()


def measure_gain(
    line: Line, forces: list[Floats], hardened: Floats, factor: Floats, cycle: float,
    cycles: float, every: int = 1,
) -> Floats:  # fmt: skip
    """k_s ds/dF of beds [-] for a block of ``cycles`` axles behind ``cycle``.

    ``forces``: of each kind of axle, (b, n) [N]; ``hardened`` (b, n) [m]: what the law has made
    a mean bed of this history settle; ``factor`` (b, n): settlement over a mean bed's; of the
    beds, flat, each ``every``-th is taken.
    """

    def pick(values: Floats) -> Floats:
        return np.ravel(values)[::every]

    total = np.zeros_like(pick(factor))
    for axle, force in zip(line.traffic.axles, forces, strict=True):
        load = BedLoad(pick(force), pick(line.support.bed))
        more = replace(load, force=load.force * (1 + BLOCKS.nudge))
        given: Any = pick(hardened), cycle, cycles
        rise = line.law.advance(more, *given) - line.law.advance(load, *given)
        apart = np.where(load.force > 0, load.force * BLOCKS.nudge, 1.0)
        total += axle.share * rise / apart
    return np.asarray(total * pick(factor) * pick(line.support.series))


def find_block(
    line: Line, forces: list[Floats], hardened: Floats, factor: Floats, cycle: float, end: float,
    finer: float,
) -> float:  # fmt: skip
    """Axles of the next block, of a run that ends at ``end`` axles; arguments as in
    `measure_gain`.  ``finer``: by which blocks are smaller than they may be."""
    every = max(1, factor.size // BLOCKS.sample)
    grown = cycle**BLOCKS.spread + end**BLOCKS.spread / (BLOCKS.fewest * finer)
    longest = min(grown ** (1 / BLOCKS.spread), end) - cycle
    shortest = min(BLOCKS.shortest * end, longest)

    def exceed(logarithm: float) -> float:
        cycles = float(np.exp(logarithm))
        gain = measure_gain(line, forces, hardened, factor, cycle, cycles, every)
        worst = np.quantile(gain, 1 - BLOCKS.outliers) / 2
        return float(max(gain.mean(), worst) * finer / BLOCKS.gain - 1)

    low, high = np.log(shortest), np.log(longest)
    if not exceed(high) > 0:
        return float(longest)
    if exceed(low) > 0:
        return float(shortest)
    return float(np.exp(brentq(exceed, low, high, rtol=1e-3)))
