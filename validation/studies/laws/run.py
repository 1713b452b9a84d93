"""Errors and costs of every law and rival on every source of series: ``PARTS``."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy import optimize

from adapters.bed.state import FloatArray
from adapters.errors import UsageError
from adapters.laws import get_law, list_laws
from adapters.laws.fit import prior
from adapters.laws.fit.outlook import find_outlook
from adapters.laws.fit.prior import PRIOR, PriorNumbers, predict_growth
from adapters.laws.fit.refusal import find_refusals, predict_failure
from validation.studies.laws.series import (
    REACH,
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
BANDS = (0.0, 300.0, 1e3, np.inf)
"""Last known cycles between which errors are summed up."""
LEARNED = ("slowing", "burst", "speed", "burst_cycle", "steepness")
START = np.log([0.3, 0.6, 0.5, 250.0, 2.0])
"""Numbers of `PriorNumbers` that the tests teach, and where the search for them starts."""
WHOLE_TO, FAIL_AT, STOPPED = 1e6, 0.3, 0.29
"""Whole tests are predicted up to here; the strain at which they were stopped, 0.297 to 0.305, and
one that only those reached."""


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


def list_predictors() -> dict[str, Callable[[LawCase], float]]:
    """Every method but auto."""
    laws = {name: predict_by_law(name) for name in list_laws()}
    return laws | {"nothing": lambda case: float(case.settlement[-1])}


def summarise(errors: Iterable[float]) -> Row:
    """Median, 90th percentile and root mean square of errors."""
    size = np.abs(np.array(list(errors)))
    middle, high = float(np.median(size)), float(np.quantile(size, 0.9))
    square = float(np.sqrt(np.mean(size**2)))
    return {"cases": len(size), "error": middle, "error_90": high, "rms": square}


def judge_auto(cases: Sequence[LawCase], labelled: bool = False) -> list[Row]:
    """A row a case: what auto says, its band and regime; ``labelled``: with the frequency."""
    found = []
    for case in cases:
        start, frequency = time.process_time(), read_frequency(case.name) if labelled else None
        known = (case.cycle, case.settlement[:, None])
        said = find_outlook(*known, case.to_cycle, frequency=frequency)
        cost = time.process_time() - start
        prediction, low, high = (float(x[0]) for x in (said.prediction, said.low, said.high))
        (refusal,) = find_refusals(said)
        found.append(
            {
                "name": case.name,
                "cut": case.cut,
                "regime": refusal.regime if refusal else said.regime[0].name,
                "allowed": refusal is None,
                "error": prediction / case.truth - 1,
                "inside": low <= case.truth <= high,
                "half_width": (high - low) / 2 / abs(case.truth),
                "cost_s": cost,
            }
        )
    return found


def summarise_auto(rows: Sequence[Row]) -> Row:
    """Errors and band where auto goes ahead, of all and by the last known cycle."""
    allowed = [row for row in rows if row["allowed"]]
    return {
        **summarise(row["error"] for row in allowed),
        "refused": len(rows) - len(allowed),
        "by_cut": [
            summarise(row["error"] for row in allowed if low <= row["cut"] < high) | {"from": low}
            for low, high in pairwise(BANDS)
            if any(low <= row["cut"] < high for row in allowed)
        ],
        "coverage": float(np.mean([row["inside"] for row in allowed])),
        "half_width": float(np.median([row["half_width"] for row in allowed])),
        "all": summarise(row["error"] for row in rows),
        "cost_s": float(np.median([row["cost_s"] for row in rows])),
    }


def summarise_method(
    predict: Callable[[LawCase], float], cases: Sequence[LawCase], allowed: Sequence[bool]
) -> Row:
    """One method on the cases that auto lets go ahead, and on all."""
    errors, cost = [], []
    for case in cases:
        start = time.process_time()
        errors.append(predict(case) / case.truth - 1)
        cost.append(time.process_time() - start)
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


def read_frequency(name: str) -> float:
    """That of a triaxial test [Hz], which ends its name."""
    return float(name.split("_f_")[1].removesuffix("Hz"))


def learn_prior(tests: Sequence[tuple[str, FloatArray, FloatArray]]) -> PriorNumbers:
    """Of `LEARNED` those that miss the growth ln u over ten times the cycles least, each test
    weighing the same; single misses above 0.05 count in proportion, and the start only where the
    tests decide nothing."""

    def make_prior(logarithms: FloatArray) -> PriorNumbers:
        numbers: Row = dict(zip(LEARNED, map(float, np.exp(logarithms)), strict=True))
        return replace(PRIOR, **numbers)

    def miss(logarithms: FloatArray) -> FloatArray:
        missed = [1e-3 * (logarithms - START)]
        with patch.object(prior, "PRIOR", make_prior(logarithms)):
            for name, cycle, strain in tests:
                known = np.geomspace(20, max(cycle[-1] / REACH, 30), 24)
                ends = np.log(np.minimum([known, REACH * known], cycle[-1]))
                begun, grown = np.log(np.interp(ends, np.log(cycle), strain))
                said = predict_growth(np.exp(ends), read_frequency(name))
                missed.append((said - (grown - begun)) / np.sqrt(len(known)))
        return np.concatenate(missed)

    return make_prior(optimize.least_squares(miss, START, loss="soft_l1", f_scale=0.05 / 24**0.5).x)


def measure_labelled() -> Row:
    """Auto with the frequency of each test, by what the other tests taught; and what all teach."""
    tests, rows = list(read_ballast(find_data())), []
    for name in (test[0] for test in tests):
        with patch.object(prior, "PRIOR", learn_prior([one for one in tests if one[0] != name])):
            cases = [case for case in list_ballast_cases(find_data()) if case.name == name]
            rows += judge_auto(cases, labelled=True)
    found = learn_prior(tests)
    return {"auto": summarise_auto(rows), "prior": {key: getattr(found, key) for key in LEARNED}}


def measure_fast() -> Row:
    """How many series with a constant or growing rate are refused."""
    rows = judge_auto(list_fast_cases(MEMBERS))
    return {"cases": len(rows), "refused": sum(not row["allowed"] for row in rows)}


def predict_whole_tests() -> Row:
    """How many whole ballast tests are refused to a million cycles, of those stopped at the strain
    of failure and of the others, without and with ``--fail-at``."""
    found = {"stopped": [0, 0, 0], "others": [0, 0, 0]}
    for _, cycle, strain in read_ballast(find_data()):
        said = find_outlook(cycle, strain[:, None], WHOLE_TO)
        (refusal,) = find_refusals(said)
        failed = refusal or predict_failure(float(said.prediction[0]), FAIL_AT, WHOLE_TO)
        row = found["stopped" if strain[-1] > STOPPED else "others"]
        for place, counted in enumerate((True, refusal is not None, failed is not None)):
            row[place] += counted
    return found


PARTS: dict[str, Callable[[], Row]] = {
    "ballast": partial(measure_source, lambda: list_ballast_cases(find_data())),
    "frequency": measure_labelled,
    "families": partial(measure_source, lambda: list_family_cases(MEMBERS)),
    "engine": partial(measure_source, lambda: list_run_cases(find_data())),
    "fast": measure_fast,
    "whole": predict_whole_tests,
}
