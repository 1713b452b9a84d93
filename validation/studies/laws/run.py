"""Errors and costs of every law and rival on every source of series: ``PARTS``."""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from adapters.bed.state import FloatArray
from adapters.errors import UsageError
from adapters.laws import get_law
from adapters.laws.fit.outlook import find_outlook
from adapters.laws.fit.refusal import UNCERTAIN, find_refusals, predict_failure
from adapters.laws.fit.regime import REGIMES
from validation.studies.laws.series import (
    OTHER_CUTS,
    LawCase,
    list_ballast_cases,
    list_family_cases,
    list_fast_cases,
    list_run_cases,
    read_ballast,
)

Row = dict[str, Any]
MEMBERS = 12
"""Of each family."""
LAWS = (
    "linear", "log", "log-linear", "power", "hyperbolic", "stretched-exponential",
    "inverse-log", "karrech2007",
)  # fmt: skip
WHOLE_TO, FAIL_AT = 1e6, 0.3
"""Whole tests are predicted up to here; the strain at which they were stopped, 0.297 to 0.305."""


def find_data() -> Path:
    """The folder of the real series; raises `UsageError` where TRACKBED_DATA names none."""
    folder = Path(os.environ.get("TRACKBED_DATA", ""))
    if not (folder / "full_runs").is_dir():
        raise UsageError(
            "the real series are not here",
            remedy="set TRACKBED_DATA to a folder with ballast_triaxial/*.txt and full_runs/*.npz",
        )
    return folder


def predict_by_law(name: str) -> Callable[[LawCase], float]:
    """Last reading and the increment of one law fitted to all readings."""
    law = get_law(name)

    def predict(case: LawCase) -> float:
        parameters = law.fit(case.cycle, case.settlement)
        last = float(case.cycle[-1])
        return float(case.settlement[-1] + law.increment(parameters, last, case.to_cycle))

    return predict


def predict_by_polyfit(case: LawCase) -> float:
    """What a user would write first: c + a ln N by numpy.polyfit."""
    line = np.polyfit(np.log(case.cycle), case.settlement, 1)
    return float(np.polyval(line, np.log(case.to_cycle)))


def predict_by_curve_fit(case: LawCase) -> float:
    """And second: a N^b by scipy.optimize.curve_fit, started at the last reading and b = 0.1."""
    from scipy import optimize

    def find_power(n: FloatArray, a: float, b: float) -> FloatArray:
        return np.asarray(a * n**b)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # its covariance is not used
        found, _ = optimize.curve_fit(
            find_power, case.cycle, case.settlement, p0=(case.settlement[-1], 0.1), maxfev=20000
        )
    return float(find_power(np.array(case.to_cycle), *found))


def list_predictors() -> dict[str, Callable[[LawCase], float]]:
    """Every method but auto."""
    laws = {name: predict_by_law(name) for name in LAWS}
    return laws | {"polyfit": predict_by_polyfit, "curve_fit": predict_by_curve_fit}


def summarise(errors: Iterable[float]) -> Row:
    """Median and 90th percentile of absolute errors."""
    size = np.abs(np.array(list(errors)))
    middle, high = float(np.median(size)), float(np.quantile(size, 0.9))
    return {"cases": len(size), "error": middle, "error_90": high}


def judge_auto(cases: Sequence[LawCase]) -> list[Row]:
    """A row a case: what auto says, its band, its regime, the best candidate in hindsight."""
    found = []
    for case in cases:
        start = time.process_time()
        said = find_outlook(case.cycle, case.settlement[:, None], case.to_cycle)
        cost = time.process_time() - start
        prediction, low, high = (float(x[0]) for x in (said.prediction, said.low, said.high))
        (refusal,) = find_refusals(said)
        each = case.settlement[-1] + said.candidates.increment[:, 0]
        found.append(
            {
                "name": case.name,
                "cut": case.cut,
                "regime": refusal.regime if refusal else said.regime[0].name,
                "allowed": refusal is None,
                "error": prediction / case.truth - 1,
                "inside": low <= case.truth <= high,
                "half_width": (high - low) / 2 / abs(case.truth),
                "hindsight": float(np.abs(each / case.truth - 1).min()),
                "cost_s": cost,
            }
        )
    return found


def summarise_auto(rows: Sequence[Row]) -> Row:
    """Errors and band where auto lets the jump go ahead, and what leaving a series out changes."""
    allowed = [row for row in rows if row["allowed"]]
    names = sorted({row["name"] for row in rows})
    others = [[row["error"] for row in allowed if row["name"] != name] for name in names]
    without = [summarise(errors)["error_90"] for errors in others if errors]
    worst = sorted(allowed, key=lambda row: -abs(row["error"]))[:6]
    return {
        **summarise(row["error"] for row in allowed),
        "refused": len(rows) - len(allowed),
        "error_90_without_one": [min(without), max(without)],
        "coverage": float(np.mean([row["inside"] for row in allowed])),
        "half_width": float(np.median([row["half_width"] for row in allowed])),
        "hindsight": summarise(row["hindsight"] for row in allowed),
        "all": summarise(row["error"] for row in rows),
        "regimes": {
            name: sum(row["regime"] == name for row in rows) for name in (*REGIMES, UNCERTAIN)
        },
        "cost_s": float(np.median([row["cost_s"] for row in rows])),
        "worst": [{key: row[key] for key in ("name", "cut", "regime", "error")} for row in worst],
    }


def summarise_method(
    predict: Callable[[LawCase], float], cases: Sequence[LawCase], allowed: Sequence[bool]
) -> Row:
    """One method on the cases that auto lets go ahead, and on all."""
    errors, cost = [], []
    for case in cases:
        start = time.process_time()
        try:
            value = predict(case)
        except Exception:  # a rival that gives up is a result
            value = np.inf
        cost.append(time.process_time() - start)
        errors.append(value / case.truth - 1)
    kept = [error for error, good in zip(errors, allowed, strict=True) if good]
    return {**summarise(kept), "all": summarise(errors), "cost_s": float(np.median(cost))}


def measure_source(read: Callable[[], list[LawCase]]) -> Row:
    """Auto and every other method on the cases of one source."""
    cases = read()
    rows = judge_auto(cases)
    allowed = [row["allowed"] for row in rows]
    methods = {
        name: summarise_method(predict, cases, allowed)
        for name, predict in list_predictors().items()
    }
    return {"auto": summarise_auto(rows), "methods": methods}


def measure_fast() -> Row:
    """How many series with a constant or growing rate are refused."""
    rows = judge_auto(list_fast_cases(MEMBERS))
    return {"cases": len(rows), "refused": sum(not row["allowed"] for row in rows)}


def predict_whole_tests() -> Row:
    """Whole ballast tests to a million cycles, and what is said of them with ``--fail-at``."""
    found = []
    for name, cycle, strain in read_ballast(find_data()):
        said = find_outlook(cycle, strain[:, None], WHOLE_TO)
        (refusal,) = find_refusals(said)
        failed = refusal or predict_failure(float(said.prediction[0]), FAIL_AT, WHOLE_TO)
        regime = said.regime[0].name
        found.append(
            {
                "name": name,
                "last_cycle": said.last_cycle,
                "last": float(said.last[0]),
                "exponent": [said.regime[0].exponent, said.regime[0].deviation],
                "prediction": float(said.prediction[0]),
                "band": [float(said.low[0]), float(said.high[0])],
                "said": refusal.regime if refusal else regime,
                "said_fail_at": failed.regime if failed else regime,
            }
        )
    return {"tests": found}


PARTS: dict[str, Callable[[], Row]] = {
    "ballast": partial(measure_source, lambda: list_ballast_cases(find_data())),
    "other cuts": partial(measure_source, lambda: list_ballast_cases(find_data(), OTHER_CUTS)),
    "families": partial(measure_source, lambda: list_family_cases(MEMBERS)),
    "engine": partial(measure_source, lambda: list_run_cases(find_data())),
    "fast": measure_fast,
    "whole": predict_whole_tests,
}
