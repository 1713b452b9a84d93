"""What the settlement gains over a jump, from every cycle computed so far.

By the slopes of `adapters.jumps.slopes`.  Behind the last block the walk's mean does not change, so
the gain is the logarithm's with that slope.  Behind a jump the walk is known on both sides of it.
What earlier jumps, with the windows behind them, gained beyond that is taken off the next jump,
with what its own window will gain so (`find_asked_gain`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from adapters.bed import FloatArray, IntArray
from adapters.jumps.rates import Stretch
from adapters.jumps.slopes import Landing, estimate_slopes


@dataclass(frozen=True, eq=False)
class Jumped:
    """A jump that was made, with the window behind it."""

    cycles: IntArray
    """Cycles done before it, behind it, and at the end of the window behind it, shape (3,)."""
    settlement: FloatArray
    """At their ends [m], shape (3,)."""

    @property
    def landing(self) -> Landing:
        """Where it ended, and by what the mean grain was moved."""
        return Landing(int(self.cycles[1]), float(self.settlement[1] - self.settlement[0]))

    @property
    def followed(self) -> float:
        """Settlement in the window behind it, healing cycles too [m]."""
        return float(self.settlement[2] - self.settlement[1])


def find_asked_gain(known: Sequence[Stretch], h: int, jumps: Sequence[Jumped] = ()) -> float:
    """Settlement [m] to move the mean grain by in a jump of ``h`` cycles, 0 at least.

    ``known``: all cycles computed, ascending, but the first behind each jump.  The logarithm's
    gain, less what ``jumps`` before and the windows behind them gained too much; the window behind
    this one will gain too much by the same share of what the bed is moved by.
    """
    slopes = estimate_slopes(known, [one.landing for one in jumps])
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
