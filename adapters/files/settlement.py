"""A settlement series: settlement at load cycles, with its unit."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from adapters.bed import FloatArray

UNKNOWN = "unknown"
"""Unit of numbers that come without one: they may be metres, millimetres or a strain."""


@dataclass(frozen=True)
class Series:
    """Settlement at ascending cycles, k of them."""

    cycle: FloatArray
    """Load cycles done, not always whole numbers, none twice, shape (k,)."""
    settlement: FloatArray
    """Settlement, positive downwards, in ``unit``, shape (k,)."""
    unit: str = "m"
    """m, cm, mm, um, %, 1 (strain), or `UNKNOWN`."""
    begun: float = 0.0
    """Settlement before cycle 0, where that is known, in ``unit``."""
    counted_from: float = 0.0
    """The user's number of cycle 0: the load change that ``cycle`` is counted from."""
    where: str = ""
    """File or folder it was read from, for errors."""
    left_out: int = 0
    """Rows that `since` and `after` left out."""

    def since(self, cycle: float) -> Series:
        """The rows from the user's ``cycle`` on, to leave out a bedding-in that no law describes.

        Behind `after`, not before it: that takes what settled before the change from earlier rows.
        """
        return self._kept(self.cycle + self.counted_from >= cycle)

    def after(self, cycle: float) -> Series:
        """The rows behind ``cycle``, counted from there: a changed load starts the law again."""
        rows = self.cycle > cycle
        begun = float(self.settlement[~rows][-1]) if not rows.all() else self.begun
        kept, counted_from = self._kept(rows), self.counted_from + cycle
        return replace(kept, cycle=kept.cycle - cycle, begun=begun, counted_from=counted_from)

    def _kept(self, rows: NDArray[np.bool_]) -> Series:
        return replace(
            self,
            cycle=self.cycle[rows],
            settlement=self.settlement[rows],
            left_out=self.left_out + int((~rows).sum()),
        )
