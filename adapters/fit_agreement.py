"""What each slow law says of a later cycle beside their joint prediction."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np

from adapters.fit_auto import Outlook

AGREE = 0.1
"""A law agrees whose increment behind the last reading lies so near the joint one, as its share.
Not as a share of the total: near the last cycle all totals are alike, whatever the laws say."""


@dataclass(frozen=True)
class LawSaid:
    """One law's own prediction."""

    prediction: float | None
    """Median of its windows, in the unit of the series; None where that is not finite."""
    votes: int
    """Of its windows, how many have a vote in the joint prediction: 0 to 3."""
    agrees: bool
    """Its increment is within `AGREE` of the joint one, whether that is given or refused; or both
    are below the error of a reading (`Outlook.reading`), so that none could tell them apart: a bed
    at rest."""
    inside: bool | None
    """Inside the band; None where the prediction is refused, as no band holds there."""


def laws_said(outlook: Outlook, series: int = 0, refused: bool = False) -> dict[str, LawSaid]:
    """By name, what the laws of ``outlook`` say of one of its series."""
    candidates, last = outlook.candidates, float(outlook.last[series])
    joint, reading = float(outlook.prediction[series]) - last, float(outlook.reading[series])
    low, high = float(outlook.low[series]), float(outlook.high[series])
    found = {}
    for name in dict.fromkeys(candidates.law):
        own = [row for row, law in enumerate(candidates.law) if law == name]
        gain = float(np.median(candidates.increment[own, series]))
        value = last + gain
        found[name] = LawSaid(
            value if isfinite(value) else None,
            int(outlook.votes[own, series].sum()),
            abs(gain - joint) <= AGREE * abs(joint) or max(abs(gain), abs(joint)) <= reading,
            None if refused else low <= value <= high,
        )
    return found
