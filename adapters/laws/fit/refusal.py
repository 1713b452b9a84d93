"""When a prediction of the slow laws together is refused, and the words for it."""

from dataclasses import dataclass

import numpy as np

from adapters.bed import FloatArray
from adapters.errors import NotConverged
from adapters.laws.fit.growth import find_fall, find_growth
from adapters.laws.fit.outlook import JUDGED, Outlook
from adapters.laws.fit.regime import COLLAPSE, WHY_NOT

UNCERTAIN = "uncertain"
"""In the place of a regime: the tail excludes none, and the band says nothing of the size."""
WIDEST = 1.0
"""Half-width of a band over all that settled so far, above which it is no prediction: what is not
known of the future is then more than what is known of the past."""


@dataclass(frozen=True)
class Refusal:
    """Why there is no prediction; `fit` turns it into the error `JumpRefused`, exit code 6."""

    regime: str  # ``ratcheting``, ``collapse`` or `UNCERTAIN`
    why: str  # one sentence; settlements in the unit of the series, cycles as the user counts them
    remedy: str  # what to do


def find_refusals(outlook: Outlook) -> list[Refusal | None]:
    """Why each of n series is not predicted; None where it is.

    - the regime is ratcheting or collapse (90 %): no law says when that ends;
    - half the width of the band with `JUDGED`, whatever band was asked for, exceeds `WIDEST` times
      the settlement so far (the largest reading, from the series' own zero): the laws differ by
      more than all that was ever measured.  The constant is 1, and no number that was fitted.  A
      series whose zero lies far off (a level of a track above the sea) is never refused for it:
      give settlement since the load began.

    A prediction for the last cycle itself is a reading, and never refused.  Raises `NotConverged`
    where the regime allows a prediction and the laws give no finite one.
    """
    return [_find_refusal(outlook, series) for series in range(len(outlook.regime))]


def _find_refusal(outlook: Outlook, series: int) -> Refusal | None:
    if outlook.to_cycle == outlook.last_cycle:
        return None
    regime, begin = outlook.regime[series], outlook.counted_from
    last, to_cycle = outlook.last_cycle + begin, outlook.to_cycle + begin
    if not regime.jump_allowed:
        how = f"it goes as N^(beta - 1) with beta = {regime.exponent:.2f} ± {regime.deviation:.2f}"
        if regime.growth > 1:
            how = f"it is {regime.growth:.3g} times its least before"
        return Refusal(
            regime.name,
            f"up to cycle {last:.10g} {WHY_NOT[regime.name]}: {how}"
            + (f", N counted from cycle {begin:.10g}" if begin else "")
            + ", and no law says when that ends",
            "compute or measure more cycles, or name a law yourself: --law log, linear ...",
        )
    ends = (outlook.low, outlook.high, *outlook.judged)
    if not np.isfinite([end[series] for end in ends]).all():
        raise NotConverged(
            f"the slow laws give no finite settlement at cycle {to_cycle:.10g}",
            remedy="predict less far, or use the law log",
        )
    low, high = (float(end[series]) for end in outlook.judged)
    settled = float(outlook.settled[series])
    if high - low > 2 * WIDEST * settled:
        return Refusal(
            UNCERTAIN,
            f"the laws differ too much at cycle {to_cycle:.10g}: from {low:.3g} to {high:.3g} with "
            f"{JUDGED:.0%}, where {settled:.3g} is all that settled up to cycle {last:.10g}",
            "measure more cycles, predict less far, or name a law yourself: --law log, power ...",
        )
    return None


def refuse_fall(cycle: FloatArray, settlement: FloatArray) -> Refusal | None:
    """Why nothing is said of a series that falls, (k,) at the user's cycles (k,): no law has one
    course before and behind a tamping, or a gauge that was set back."""
    if (fall := find_fall(settlement)) is None:
        return None
    row, size = fall
    before, behind = cycle[row - 1], cycle[row]
    return Refusal(
        UNCERTAIN,
        f"the settlement falls by {size:.3g} between cycles {before:.10g} and {behind:.10g}, as "
        "where the track was tamped or the gauge set back: no law goes through that",
        f"take what came behind it: --load-change {behind:.10g}",
    )


def refuse_growth(cycle: FloatArray, settlement: FloatArray, begin: float) -> Refusal | None:
    """Why nothing is said of a series (k,) at cycles (k,), counted from the user's cycle ``begin``,
    whose rate had grown: no slow law goes through that, however many readings come behind it."""
    if (grown := find_growth(cycle, settlement)) is None:
        return None
    row, ratio = grown
    end = cycle[row] + begin
    return Refusal(
        COLLAPSE,
        f"up to cycle {end:.10g} the rate grew to {ratio:.3g} times its least, and no slow law "
        "describes what comes before and behind that",
        f"take what came behind it, once it has calmed: --load-change {end:.10g}",
    )


def find_failure(cycle: FloatArray, settled: FloatArray, fail_at: float | None) -> Refusal | None:
    """Collapse where a series, ``settled`` (k,) at the user's cycles (k,), has reached the
    user's bound in the same unit, of either sign: whatever would be predicted then."""
    reached = np.flatnonzero(np.abs(settled) >= (np.inf if fail_at is None else fail_at))
    if not len(reached):
        return None
    first = reached[0]
    return Refusal(
        COLLAPSE,
        f"{abs(settled[first]):.3g} was reached at cycle {cycle[first]:.10g}, and {fail_at:g} "
        "was given as failure (--fail-at): it has failed",
        "leave out what came behind the failure, or give another bound",
    )


def predict_failure(prediction: float, fail_at: float | None, to_cycle: float) -> Refusal | None:
    """Collapse where ``prediction``, for the user's cycle ``to_cycle``, reaches the user's bound,
    in the same unit, of either sign."""
    if fail_at is None or abs(prediction) < fail_at:
        return None
    return Refusal(
        COLLAPSE,
        f"{abs(prediction):.3g} is predicted at cycle {to_cycle:.10g}, and {fail_at:g} was given "
        "as failure (--fail-at): no law of settlement describes what comes then",
        "ask for an earlier cycle",
    )
