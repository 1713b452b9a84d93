"""How much of a restitution makes no energy: bisection, contact by contact.

Used by both integrators: `rigid_lcp.restitution_scale` and `rigid_lcp.collisions` say why it may.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Flags = NDArray[np.bool_]

RESOLUTION = 1 / 64
"""To which a share is found [-]; a smaller one is none."""


class Share:
    """The greatest share of the restitution of contacts that makes no energy, by bisection.

    No restitution makes none; it is taken that neither does a smaller share than one that makes
    none.  Where that is found wrong nothing is kept.
    """

    def __init__(self, count: int) -> None:
        self.now = np.ones(count)
        """What is to be tried next, (count,) [-]."""
        self._least, self._most = np.zeros(count), np.ones(count)

    def next(self, gains: Flags) -> bool:
        """Whether another share is to be tried, where those tried now made energy (count,)."""
        before = self.now
        self._most = np.where(gains, before, self._most)
        self._least = np.where(gains, self._least, before)
        wrong = gains & (before <= self._least)
        self._least[wrong] = self._most[wrong] = 0.0
        middle = 0.5 * (self._least + self._most)
        self.now = np.where(self._most - self._least > RESOLUTION, middle, self._least)
        return bool((self.now != before).any())

    def leave_out(self) -> None:
        """No restitution, at the next trial and the last."""
        self.now = np.zeros_like(self.now)
        self._least, self._most = self.now.copy(), self.now.copy()
