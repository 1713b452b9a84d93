"""What each slow law says of a later cycle beside their joint prediction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from adapters.fit_auto import Outlook

AGREE = 0.1
"""A law agrees that lies so near the median of the votes, as a share of it."""


@dataclass(frozen=True)
class LawSaid:
    """One law's own prediction."""

    prediction: float
    """Median of its windows, in the unit of the series."""
    votes: int
    """Of its windows, how many have a vote in the joint prediction: 0 to 3."""
    agrees: bool
    """Within `AGREE` of the joint prediction, whether that is given or refused."""
    inside: bool | None
    """Inside the band; None where the prediction is refused, as no band holds there."""


def laws_said(outlook: Outlook, series: int = 0, refused: bool = False) -> dict[str, LawSaid]:
    """By name, what the laws of ``outlook`` say of one of its series."""
    candidates, joint = outlook.candidates, float(outlook.prediction[series])
    low, high = float(outlook.low[series]), float(outlook.high[series])
    found = {}
    for name in dict.fromkeys(candidates.law):
        own = [row for row, law in enumerate(candidates.law) if law == name]
        gain = np.median(candidates.increment[own, series])
        value = float(outlook.last[series] + gain)
        found[name] = LawSaid(
            value,
            int(outlook.votes[own, series].sum()),
            bool(abs(value - joint) <= AGREE * abs(joint)),
            None if refused else bool(low <= value <= high),
        )
    return found
