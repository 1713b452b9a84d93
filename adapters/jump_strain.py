"""How a bed is compacted by a settlement that is given: more above than below.

A bed under a piston settles in layers by

    u(s) = u_piston s^p,    s = (z - z_lowest) / (z_piston - z_lowest),

p = 1 a uniform strain.  Full runs at paper scale sink their piston by nearly five times what the
mean grain settles, p near 4 (docs/jump-history.md): what is near the piston moves most.  p is that
by which piston and mean grain have gone down in all cycles computed so far.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import brentq

from adapters.run_folder import Outcome
from adapters.state import FloatArray, State

EXPONENTS = (1.0, 5.0)
"""Least and greatest p: a bed is not compacted more below than above, nor at its top alone."""


def piston_ratio(outcomes: Sequence[Outcome], begin: int, end: int) -> float:
    """What the piston sank by over what the mean grain settled, in cycles ``begin`` to ``end``.

    Of windows only, without healing cycles; nan where the mean grain has not settled.
    """
    sunk = settled = 0.0
    for outcome in outcomes:
        if outcome.stage == "window" and outcome.last_cycle <= end:
            rows = [
                row for row in outcome.rows if row["kind"] == "computed" and row["cycle"] >= begin
            ]
            if rows:
                sunk -= float(rows[-1]["piston_height"] - rows[0]["piston_height"])
                settled += float(rows[-1]["settlement"] - rows[0]["settlement"])
    return sunk / settled if settled > 0 else np.nan


def strain_exponent(share: FloatArray, ratio: float) -> float:
    """p with mean(s^p) = 1 / ``ratio`` for heights s (n,) in [0, 1], within `EXPONENTS`.

    Uniform strain where the ratio is not known.
    """
    least, most = EXPONENTS

    def lacking(p: float) -> float:
        return float((share**p).mean()) * ratio - 1

    if not lacking(least) > 0:  # nan too
        return least
    return most if lacking(most) > 0 else float(brentq(lacking, least, most))


def settled_by(
    gain: float, before: State, target: FloatArray, ratio: float = np.nan
) -> tuple[FloatArray, float]:
    """Estimated positions (n, 3) and piston height of a bed settled by ``gain``, all in metres.

    What ``target`` (n, 3) lacks is put on in the shape u(s).  The piston goes down as a bed does
    that settles by the whole gain in that shape, and is never placed above where it is; ``ratio``
    is what it has sunk by over what the mean grain has settled.  A law of its own heights in the
    window is left aside as that of the grains is: in a long jump from a short window its noise
    would press the piston into the grains by a part of a radius.
    """
    lacking = before.position[:, 2].mean() - target[:, 2].mean() - gain
    low = float(before.position[:, 2].min())
    share = np.clip((before.position[:, 2] - low) / ((before.piston_height - low) or 1.0), 0.0, 1.0)
    shape = share ** strain_exponent(share, ratio)
    mean = float(shape.mean())
    target = target.copy()
    target[:, 2] += lacking * shape / mean if mean else lacking
    return target, before.piston_height - (max(gain, 0.0) / mean if mean else 0.0)
