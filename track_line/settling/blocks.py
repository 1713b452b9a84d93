"""How many axles one block may have: cycle jumps of a line are bounded by stability.

In a block of dN axles forces stay as they are.  A bed that lies by e too high carries k_s e too
much (its neighbours take a share away) and sinks by k_s e ds/dF too much in the block, ds(F) being
its settlement there.  For k_s ds/dF > 2 the error grows from block to block, from sleeper to
sleeper with another sign; for ds ~ F^m that is ds > 2 F/(m k_s).
"""

from dataclasses import dataclass

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
    fewest: int = 40  # blocks of a run at least, equal in N^spread, so that its curve is smooth
    spread: float = 0.2
    sample: int = 4000  # beds by which a block is chosen, spread over all lines
    search: float = 20.0  # powers of e over which the length of a block is looked for
    nudge: float = 1e-4  # of the force, for ds/dF [-]


BLOCKS = Blocks()


def measure_gain(
    line: Line, force: Floats, hardened: Floats, factor: Floats, cycle: float, cycles: float,
    every: int = 1,
) -> Floats:  # fmt: skip
    """k_s ds/dF [-] of each ``every``-th bed, for a block of ``cycles`` axles behind ``cycle``.

    ``force``: of each kind of axle, (kinds, b, n) [N]; ``hardened`` (b, n) [m]: what the law has
    made a mean bed of this history settle; ``factor`` (b, n): settlement over a mean bed's.
    """
    given = (line.support.bed, line.support.series, hardened, factor)
    bed, series, hardened, factor = (values.ravel()[::every] for values in given)
    force = force.reshape(len(force), -1)[:, ::every]
    apart = BLOCKS.nudge * force.max(axis=0)
    more, less = (
        line.law.advance_mixed(BedLoad(one, bed), line.shares, hardened, cycle, cycles)
        for one in (np.where(force > 0, force + apart, 0.0), force)
    )
    return np.asarray((more - less) / np.where(apart > 0, apart, 1.0) * factor * series)


def find_block(
    line: Line, force: Floats, hardened: Floats, factor: Floats, cycle: float, end: float,
    finer: float,
) -> float:  # fmt: skip
    """Axles of the next block, of a run that ends at ``end`` axles; arguments as in
    `measure_gain`.  ``finer``: by which blocks are smaller than they may be."""
    every = max(1, factor.size // BLOCKS.sample)
    grown = cycle**BLOCKS.spread + end**BLOCKS.spread / (BLOCKS.fewest * finer)
    longest = min(grown ** (1 / BLOCKS.spread), end) - cycle

    def exceed(logarithm: float) -> float:
        cycles = float(np.exp(logarithm))
        gain = measure_gain(line, force, hardened, factor, cycle, cycles, every)
        worst = np.quantile(gain, 1 - BLOCKS.outliers) / 2
        return float(max(gain.mean(), worst) * finer / BLOCKS.gain - 1)

    high = float(np.log(longest))
    low = high - BLOCKS.search
    if not exceed(high) > 0:
        return float(longest)
    return float(np.exp(low if exceed(low) > 0 else brentq(exceed, low, high, rtol=1e-3)))
