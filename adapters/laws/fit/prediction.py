"""Fit a law to a settlement series, predict, say how far the prediction can be off, and draw it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from math import isfinite, log
from typing import TYPE_CHECKING, Any

import numpy as np

from adapters.bed import FloatArray
from adapters.errors import JumpRefused, NotConverged, UsageError
from adapters.files import Series, make_too_few_error
from adapters.laws.fit.band import estimate_prediction_band
from adapters.laws.fit.candidates import CANDIDATES, thin_rows
from adapters.laws.fit.growth import find_fall, find_growth
from adapters.laws.fit.outlook import JUDGED, TO_TELL, LawSaid, compare_laws, find_outlook
from adapters.laws.fit.refusal import (
    Refusal,
    find_failure,
    find_refusals,
    predict_failure,
    refuse_fall,
    refuse_growth,
)
from adapters.laws.fit.regime import COLLAPSE, SHAKEDOWN, WHY_NOT, Regime, find_regimes
from adapters.laws.form import Law

if TYPE_CHECKING:
    from matplotlib.figure import Figure

POINTS = 12
"""Cycles behind the last reading at which a prediction is drawn, evenly spaced in ln N."""


@dataclass(frozen=True)
class ClaimNumbers:
    """Data without which nothing good is claimed: no steady regime, no failure excluded."""

    rows: int = 8  # readings: twice the parameters of the longest law, to fit it and to doubt it
    late: int = 3  # of them in the last decade: a rate and its change
    reach: float = 10.0
    """Cycle asked for over the last one [-]: so far ahead bands were judged on real tests."""


CLAIM = ClaimNumbers()
UNCLAIMED = (
    f"not said: that takes {CLAIM.rows} cycles, {CLAIM.late} of them in the last decade, no fall, "
    f"and a prediction at most {CLAIM.reach:g} times ahead"
)
"""In the place of a regime that is not claimed."""


@dataclass(frozen=True)
class Prediction:
    """A law fitted to a series, and what it says of a later cycle."""

    law: str
    parameters: dict[str, float]  # by name; lengths in ``unit``, rates in ``unit`` per cycle
    prediction: float  # settlement at the cycle asked for, in ``unit``
    band: tuple[float, float]
    """Low and high end of the settlement at that cycle, in ``unit``; see
    `estimate_prediction_band`."""
    unit: str
    regime: str | None = None
    """One of `fit.regime.REGIMES`; None where a good one is a claim without data (`CLAIM`)."""
    laws: dict[str, LawSaid] = field(default_factory=dict)
    """What each slow law says, by name; empty for a law that was named."""
    failure_excluded: bool | None = None
    """True where no end of the band reaches the user's bound of failure, neither of that asked for
    nor of that with 90 %, the regime is a good one, and there are data for the claim (`CLAIM`);
    None without a bound."""

    def to_json(self) -> dict[str, Any]:
        """What ``trackbed fit --json`` prints.

        The fields by name; of ``laws`` those of `LawSaid`.  ``failure_excluded`` only with
        ``--fail-at``.
        """
        content = asdict(self) | {"band": list(self.band)}
        if self.failure_excluded is None:
            del content["failure_excluded"]
        return content


def fit_series(
    series: Series, law: Law, to_cycle: float, probability: float = 0.9,
    fail_at: float | None = None,
) -> Prediction:  # fmt: skip
    """Fit ``law`` to all of ``series`` and predict the settlement at ``to_cycle``.

    ``to_cycle`` counts as ``series.cycle`` does; errors name cycles as the user counts them, from
    before ``series.counted_from``.
    The prediction is the last settlement of the series plus the law's increment from there on.
    ``probability`` is the share of cases in which the band should hold the truth; ``fail_at`` is
    the settlement or strain at which the bed fails, in the unit of the series, where it is known.

    Raises `UsageError` when ``to_cycle`` lies before the last cycle of the series or the series
    is too short (one row more than the law has parameters), `JumpRefused` when the series or the
    result reaches ``fail_at``, `NotConverged` when the result is not finite.
    """
    cycle, settlement = _select_training_rows(series, law)
    last = float(cycle[-1])
    _check_target(series, last, to_cycle, probability, fail_at)
    begin = series.counted_from
    with np.errstate(over="ignore", invalid="ignore"):  # judged below, in one place
        parameters = law.fit(cycle, settlement)
        prediction = float(settlement[-1] + law.increment(parameters, last, to_cycle))
        band = widest = (prediction, prediction)
        if to_cycle > last:
            below, above = estimate_prediction_band(law, cycle, settlement, to_cycle, probability)
            judged = (below, above)
            if probability < JUDGED:
                judged = estimate_prediction_band(law, cycle, settlement, to_cycle, JUDGED)
            band = (prediction - below, prediction + above)
            widest = (prediction - judged[0], prediction + judged[1])
    named = dict(zip(law.parameter_names, map(float, parameters), strict=True))
    if refusal := find_failure(cycle + begin, settlement, fail_at):
        raise _make_refusal(refusal, law.name, named, {})
    if not (np.isfinite(parameters).all() and np.isfinite(band).all()):
        raise NotConverged(
            f"the law {law.name} gives no finite settlement at cycle {to_cycle + begin:.10g}",
            remedy="predict less far, or use the law log",
        )
    if refusal := predict_failure(prediction, fail_at, to_cycle + begin):
        raise _make_refusal(refusal, law.name, named, {})
    reach = to_cycle / last if last > 0 else 1.0
    regime = find_regime(series, reach)
    return Prediction(
        law.name, named, prediction, band, series.unit, regime,
        failure_excluded=excludes_failure(widest, fail_at, regime, reach),
    )  # fmt: skip


def fit_auto(
    series: Series, to_cycle: float, probability: float = 0.9, fail_at: float | None = None,
    frequency: float | None = None,
) -> Prediction:  # fmt: skip
    """Predict the settlement at ``to_cycle`` from the slow laws together; see
    `find_outlook`.  ``frequency`` [Hz]: that of a cyclic triaxial test on fresh ballast.

    ``parameters`` of the result: ``exponent`` beta of the tail with its deviation, which the
    regime follows from, and under each law's name the settlement that it alone predicts (the
    median of its windows); ``laws`` says which agree.

    Raises `JumpRefused` where `fit.refusal.find_refusals` says so and ``to_cycle`` lies behind the
    series; it has ``laws`` too.  Otherwise as `fit_series`: a regime that is refused comes before
    a result that is not finite.
    """
    rows = series.cycle > 0
    cycle, settlement = series.cycle[rows], series.settlement[rows]
    if len(cycle) < CANDIDATES.rows_fewest:
        raise make_too_few_error(
            len(cycle), CANDIDATES.rows_fewest, TO_TELL, where=series.where or "law auto",
            left_out=series.left_out, else_do=", or name a law: --law log",
        )  # fmt: skip
    _check_target(series, float(cycle[-1]), to_cycle, probability, fail_at)
    found = find_outlook(cycle, settlement[:, None], to_cycle, probability, frequency)
    begin, settled = series.counted_from, np.abs(settlement[:, None] - series.begun).max(axis=0)
    found = replace(found, settled=settled, counted_from=begin)
    parameters = found.regime[0].parameters()
    prediction, alone = float(found.prediction[0]), float(found.alone[0])
    refusal = find_failure(cycle + begin, settlement, fail_at)
    if refusal is None and isfinite(alone):
        refusal = predict_failure(max(prediction, alone, key=abs), fail_at, to_cycle + begin)
    refusal = refusal or refuse_fall(cycle + begin, settlement)
    if found.regime[0].jump_allowed and to_cycle > cycle[-1]:
        refusal = refusal or refuse_growth(cycle, settlement, begin)
    refusal = refusal or find_refusals(found)[0]
    said = compare_laws(found, refused=refusal is not None)
    if refusal:
        raise _make_refusal(refusal, "auto", parameters, said)
    parameters |= {name: one.prediction for name, one in said.items() if one.prediction is not None}
    band = (float(found.low[0]), float(found.high[0]))
    widest = (*band, *(float(end[0]) for end in found.judged))
    reach = to_cycle / cycle[-1]
    regime = name_regime(found.regime[0], cycle, reach)
    return Prediction(
        "auto", parameters, prediction, band, series.unit, regime, said,
        failure_excluded=excludes_failure(widest, fail_at, regime, reach),
    )  # fmt: skip


def excludes_failure(
    ends: Sequence[float], fail_at: float | None, regime: str | None, reach: float
) -> bool | None:
    """Whether ``ends`` of bands lie below the bound of failure, of either sign, in a good
    ``regime`` and no farther ahead than `CLAIM`; None without a bound."""
    if fail_at is None:
        return None
    good = regime is not None and regime not in WHY_NOT and reach <= CLAIM.reach * (1 + 1e-9)
    return bool(good and max(map(abs, ends)) < fail_at)


def name_regime(regime: Regime, cycle: FloatArray, reach: float) -> str | None:
    """Name of a regime seen at cycles (k,); None for a good one where data lack for the claim: few
    cycles, or ``reach`` times the last one asked for, of a total that has no end."""
    late = int((cycle >= cycle[-1] / 10 * (1 - 1e-9)).sum())
    enough = len(cycle) >= CLAIM.rows and late >= CLAIM.late
    far = reach > CLAIM.reach * (1 + 1e-9) and regime.name != SHAKEDOWN
    return None if regime.jump_allowed and (far or not enough) else regime.name


def _make_refusal(
    refusal: Refusal, law: str, parameters: dict[str, Any], said: dict[str, LawSaid]
) -> JumpRefused:
    return JumpRefused(
        refusal.why, where=f"law {law}", remedy=refusal.remedy, law=law, regime=refusal.regime,
        parameters={name: value for name, value in parameters.items() if isfinite(value)},
        laws={name: asdict(one) for name, one in said.items()},
    )  # fmt: skip


def find_regime(series: Series, reach: float = 1.0) -> str | None:
    """Regime of a series, as `name_regime` lets it be said at ``reach``; None where it has
    fewer than four cycles after the start, or falls."""
    rows = series.cycle > 0
    if rows.sum() < CANDIDATES.rows_fewest or find_fall(series.settlement):
        return None
    cycle = series.cycle[rows]
    (regime,) = find_regimes(*thin_rows(cycle, series.settlement[rows, None]))
    grown = regime.jump_allowed and find_growth(cycle, series.settlement[rows])
    return COLLAPSE if grown else name_regime(regime, cycle, reach)


def _check_target(
    series: Series, last: float, to_cycle: float, probability: float, fail_at: float | None
) -> None:
    if not 0 < probability < 1:
        raise UsageError(
            f"a probability lies between 0 and 1, not at {probability:g}",
            remedy="ask for a band with --probability 0.9, say: none holds the truth for certain",
        )
    if fail_at is not None and not (fail_at > 0 and isfinite(fail_at)):
        raise UsageError(
            f"the settlement of failure is a positive number, not {fail_at:g}",
            remedy=f"give --fail-at in the unit of the series, {series.unit}",
        )
    if not (isfinite(to_cycle) and to_cycle >= last):
        raise UsageError(
            f"cycle {to_cycle + series.counted_from:.10g} does not lie behind the last one of the "
            f"series, {last + series.counted_from:.10g}",
            where=series.where,
            remedy="ask for a later cycle: the earlier ones are known",
        )


def _select_training_rows(series: Series, law: Law) -> tuple[FloatArray, FloatArray]:
    """Cycles and settlement that ``law`` can take: cycle 0 only where it has a value there."""
    rows = (series.cycle > 0) if law.first_state else np.ones(len(series.cycle), bool)
    cycle, settlement = series.cycle[rows], series.settlement[rows]
    fewest = law.minimum_cycles + 1
    if len(cycle) < fewest:
        purpose = f"to fit the law {law.name} and know its error"
        raise make_too_few_error(
            len(cycle), fewest, purpose, where=series.where, left_out=series.left_out
        )
    return cycle, settlement


def describe_formula(
    law: Law | None, found: Prediction, series: Series, to_cycle: float, unit: str
) -> Iterator[str]:
    """What was fitted, as lines with units; of auto (None) the tail with the exponent of the
    regime, from the last reading to what is predicted for ``to_cycle`` of the series."""
    begin, last, reading = series.counted_from, float(series.cycle[-1]), series.settlement[-1]
    cycles = f", N in cycles from cycle {begin:.10g} on" if begin else ", N in cycles"
    units = {"1": "", "m": unit, "m/cycle": f"{unit}/cycle", "cycle": "cycles"}
    if law:
        yield f"u(N) = {law.formula}{cycles}"
        for name, one in zip(law.parameter_names, law.parameter_units, strict=True):
            yield f"  {name} = {found.parameters[name]:.6g} {units[one]}".rstrip()
        return
    if to_cycle > last:
        beta, x = round(found.parameters["exponent"], 2), f"(N / {last:.10g})"
        column = ((to_cycle / last) ** beta - 1) / beta if beta else log(to_cycle / last)
        form = f"({x}^{beta:g} - 1) / ({beta:g})" if beta else f"ln {x}"
        slope = f"{(found.prediction - reading) / column:.6g} {unit}".rstrip()
        ends = "from the last reading to the prediction"
        start = f"{reading:.6g} {unit}".rstrip()
        yield f"u(N) = {start} + {slope} {form}{cycles}: {ends}"
    for name, value in found.parameters.items():
        yield f"  {name} = {value:.6g} {'' if name.startswith('exponent') else unit}".rstrip()


def draw_forecast(
    series: Series, predict: Callable[[float], Prediction], to_cycle: float
) -> Figure:
    """Readings and what is predicted behind them against the user's load cycles, and where that is
    refused; ``predict`` gives it at cycles of the series."""
    from matplotlib.figure import Figure

    begin, last = series.counted_from, float(series.cycle[-1])
    cycles, found, refused = [last], [], None
    for cycle in np.geomspace(last, to_cycle, POINTS)[1:] if to_cycle > last else ():
        try:
            found.append(predict(float(cycle)))
        except JumpRefused as refusal:
            refused = refusal.regime
            break
        cycles.append(float(cycle))
    ahead, anchor = np.array(cycles) + begin, float(series.settlement[-1])
    low, high = np.array([(anchor, anchor), *(one.band for one in found)]).T
    figure = Figure(figsize=(7.2, 4.0))
    axis = figure.subplots()
    axis.plot(series.cycle + begin, series.settlement, "ko", ms=3, label="readings")
    axis.fill_between(ahead, low, high, color="#0b5fa5", alpha=0.15, lw=0, label="band")
    joint = [anchor, *(one.prediction for one in found)]
    axis.plot(ahead, joint, color="#0b5fa5", label=f"predicted: {found[-1].law}" if found else None)
    for name, said in found[-1].laws.items() if found else ():
        own = np.array([anchor, *(one.laws[name].prediction for one in found)], float)
        style, label = ("--", f"{name}, agrees") if said.agrees else (":", name)
        axis.plot(ahead, own, style, lw=0.9, label=label)
    if refused:
        axis.axvspan(ahead[-1], to_cycle + begin, color="#e07b00", alpha=0.2, lw=0,
                     label=f"refused: {refused}")  # fmt: skip
    axis.set(xscale="log", xlabel="load cycles", ylabel=f"settlement ({series.unit})")
    axis.invert_yaxis()
    axis.legend(loc="lower left")
    return figure
