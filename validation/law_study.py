"""Error against cost of laws and rivals on `law_series`: ``python -m validation.law_study``.

Writes ``validation/results/laws.jsonl``, a line for each method and source; TRACKBED_DATA names
the folder of the real series.  Costs are CPU times of one prediction on this machine, medians.
"""

from __future__ import annotations

import argparse
import json
import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from adapters.fit_auto import outlook
from adapters.fit_refusal import UNCERTAIN, failure, refusals
from adapters.fit_regime import REGIMES
from adapters.laws import law_named
from adapters.provenance import provenance
from adapters.run_folder import write_atomically
from adapters.state import FloatArray
from validation.cases.jump_without_engine import data_folder
from validation.law_bound import bound_rows, large_errors, left_out, summary, ways
from validation.law_series import (
    OTHER_CUTS,
    REACH,
    LawCase,
    ballast_cases,
    ballast_series,
    doubling_cases,
    family_cases,
    fast_cases,
    run_cases,
)

BOUNDED = ("ballast", "other cuts", "families")
"""Sources on which the bound on the band is varied."""
RECORD = Path(__file__).with_name("results") / "laws.jsonl"
MEMBERS = 12
"""Of each family."""
LAWS = (
    "linear", "log", "log-linear", "power", "shenton", "hyperbolic", "stretched-exponential",
    "inverse-log", "sato", "hca", "karrech2007",
)  # fmt: skip
REGIME_CUTS = (100.0, 300.0, 1e3, 3e3, 1e4, 1e5, np.inf)
"""Last known cycle; inf: the whole test."""
WHOLE_TO, FAIL_AT = 1e6, 0.3
"""Whole tests are predicted up to here; the strain at which they were stopped, 0.297 to 0.305."""
RIVALS = ("polyfit", "curve_fit")
Row = dict[str, Any]


def law_alone(name: str) -> Callable[[LawCase], float]:
    """Last reading and the increment of one law fitted to all readings."""
    law = law_named(name)

    def predict(case: LawCase) -> float:
        parameters = law.fit(case.cycle, case.settlement)
        last = float(case.cycle[-1])
        return float(case.settlement[-1] + law.increment(parameters, last, case.to_cycle))

    return predict


def polyfit(case: LawCase) -> float:
    """What a user would write first: c + a ln N by numpy.polyfit."""
    return float(
        np.polyval(np.polyfit(np.log(case.cycle), case.settlement, 1), np.log(case.to_cycle))
    )


def curve_fit(case: LawCase) -> float:
    """And second: a N^b by scipy.optimize.curve_fit, started at the last reading and b = 0.1."""
    from scipy import optimize

    def power(n: FloatArray, a: float, b: float) -> FloatArray:
        return np.asarray(a * n**b)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # its covariance is not used
        found, _ = optimize.curve_fit(
            power, case.cycle, case.settlement, p0=(case.settlement[-1], 0.1), maxfev=20000
        )
    return float(power(np.array(case.to_cycle), *found))


def predictors() -> dict[str, Callable[[LawCase], float]]:
    """Every method but auto."""
    return {name: law_alone(name) for name in LAWS} | {"polyfit": polyfit, "curve_fit": curve_fit}


def auto_rows(cases: Sequence[LawCase]) -> list[Row]:
    """A row a case: what auto says, its band, its regime, the best candidate in hindsight."""
    found = []
    for case in cases:
        start = time.process_time()
        said = outlook(case.cycle, case.settlement[:, None], case.to_cycle)
        cost = time.process_time() - start
        prediction, low, high = (float(x[0]) for x in (said.prediction, said.low, said.high))
        (refusal,) = refusals(said)
        scale = abs(case.truth)
        each = case.settlement[-1] + said.candidates.increment[:, 0]
        found.append(
            {
                "name": case.name,
                "cut": case.cut,
                "regime": refusal.regime if refusal else said.regime[0].name,
                "allowed": refusal is None,
                "certain": said.regime[0].jump_allowed,
                "width": (high - low) / 2 / float(said.settled[0]),
                "ways": {way: u / case.truth - 1 for way, u in ways(said, case).items()},
                "exponent": said.regime[0].exponent,
                "error": prediction / case.truth - 1,
                "inside": low <= case.truth <= high,
                "half_width": (high - low) / 2 / scale,
                "hindsight": float(np.abs(each / case.truth - 1).min()),
                "cost_s": cost,
            }
        )
    return found


def auto_summary(rows: Sequence[Row]) -> Row:
    """Errors and band where auto lets the jump go ahead, and what leaving a series out changes."""
    allowed = [row for row in rows if row["allowed"]]
    names = sorted({row["name"] for row in rows})
    others = [[row["error"] for row in allowed if row["name"] != name] for name in names]
    without = [summary(errors)["error_90"] for errors in others if errors]
    return {
        "method": "auto",
        **summary(row["error"] for row in allowed),
        "refused": len(rows) - len(allowed),
        "error_90_without_one": [min(without), max(without)],
        "coverage": float(np.mean([row["inside"] for row in allowed])),
        "half_width": float(np.median([row["half_width"] for row in allowed])),
        "large": large_errors(rows),
        "hindsight": summary(row["hindsight"] for row in allowed),
        "all": summary(row["error"] for row in rows),
        "regimes": {
            name: sum(row["regime"] == name for row in rows) for name in (*REGIMES, UNCERTAIN)
        },
        "cost_s": float(np.median([row["cost_s"] for row in rows])),
        "worst": [
            {key: row[key] for key in ("name", "cut", "regime", "error", "exponent")}
            for row in sorted(allowed, key=lambda row: -abs(row["error"]))[:6]
        ],
        "coverage_by_name": {
            name: [
                sum(row["inside"] for row in allowed if row["name"] == name),
                sum(row["name"] == name for row in allowed),
            ]
            for name in names
        },
    }


def method_summary(
    name: str,
    predict: Callable[[LawCase], float],
    cases: Sequence[LawCase],
    allowed: Sequence[bool],
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
    return {
        "method": name,
        **summary(kept),
        "all": summary(errors),
        "cost_s": float(np.median(cost)),
    }


def sources(members: int, folder: Path | None) -> dict[str, list[LawCase]]:
    """Cases by source; real ones only where their folder is there."""
    made = {"families": family_cases(members)}
    if folder is None:
        return made
    real = {
        "ballast": ballast_cases(folder),
        "other cuts": ballast_cases(folder, OTHER_CUTS),
        "doublings": doubling_cases(folder),
    }
    return real | made | {"engine": run_cases(folder)}


def study(members: int, folder: Path | None) -> list[Row]:
    """All rows: auto and every other method on every source, and the share of alarms."""
    found, real = [], []
    for source, cases in sources(members, folder).items():
        rows = auto_rows(cases)
        if source in BOUNDED:
            found += bound_rows(source, rows)
            real += rows if source != "families" else []
        allowed = [row["allowed"] for row in rows]
        found.append({"source": source, **auto_summary(rows)})
        for name, predict in predictors().items():
            found.append({"source": source, **method_summary(name, predict, cases, allowed)})
    fast = auto_rows(fast_cases(members))
    refused = sum(not row["allowed"] for row in fast)
    found.append({"source": "fast", "method": "auto", "cases": len(fast), "refused": refused})
    if folder:
        found.append({"source": "left out", "method": "auto", **left_out(real)})
        found += [regimes_row(folder), *whole_rows(folder)]
    return found + [grains_row(name) for name in ("log", "hyperbolic", "stretched-exponential")]


def regimes_row(folder: Path) -> Row:
    """What is said of every ballast test, `REACH` times ahead, from its readings up to
    `REGIME_CUTS`: its regime, or that of the refusal; None: too few readings.
    """
    regimes: dict[str, list[str | None]] = {}
    for name, cycle, strain in ballast_series(folder):
        told: list[str | None] = []
        for cut in REGIME_CUTS:
            known = cycle <= cut * (1 + 1e-9)
            enough = known.sum() >= 5 and (cycle[known][-1] >= cut / 2 or not np.isfinite(cut))
            told.append(verdict(cycle[known], strain[known]) if enough else None)
        regimes[name] = told
    return {"source": "ballast regimes", "method": "auto", "regimes": regimes}


def verdict(cycle: FloatArray, strain: FloatArray) -> str:
    """Regime of a series, or of the refusal to predict it `REACH` times ahead."""
    said = outlook(cycle, strain[:, None], REACH * float(cycle[-1]))
    (refusal,) = refusals(said)
    return refusal.regime if refusal else said.regime[0].name


def whole_rows(folder: Path) -> list[Row]:
    """Each whole test at `WHOLE_TO`: what is said with and without `FAIL_AT`."""
    found = []
    for name, cycle, strain in ballast_series(folder):
        said = outlook(cycle, strain[:, None], WHOLE_TO)
        (refusal,) = refusals(said)
        failed = refusal or failure(float(said.prediction[0]), FAIL_AT, WHOLE_TO)
        told = said.regime[0].name
        found.append(
            {
                "source": "whole",
                "method": name,
                "last_cycle": said.last_cycle,
                "last": float(said.last[0]),
                "exponent": [said.regime[0].exponent, said.regime[0].deviation],
                "prediction": float(said.prediction[0]),
                "band": [float(said.low[0]), float(said.high[0])],
                "said": refusal.regime if refusal else told,
                "said_fail_at": failed.regime if failed else told,
            }
        )
    return found


def grains_row(name: str, grains: int = 1000, cycles: int = 50) -> Row:
    """CPU time of one fit to noisy logarithms of all axes of all grains, least of three."""
    cycle = np.arange(1.0, cycles + 1)
    noise = 0.05 * np.random.default_rng(0).standard_normal((cycles, grains, 3))
    displacement = np.log(cycle)[:, None, None] + noise
    law, seconds = law_named(name), []
    for _ in range(3):
        start = time.process_time()
        law.fit(cycle, displacement)
        seconds.append(time.process_time() - start)
    setting = {"grains": grains, "cycles": cycles}
    return {"source": "grains", "method": name, "setting": setting, "cost_s": min(seconds)}


def record_read() -> list[Row]:
    """The committed record."""
    return [json.loads(line) for line in RECORD.read_text(encoding="utf-8").splitlines()]


def main() -> None:
    """Write the record."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--members", type=int, default=MEMBERS)
    members = parser.parse_args().members
    origin = provenance(["python", "-m", "validation.law_study", "--members", str(members)])
    rows = study(members, data_folder())
    lines = [json.dumps({"case": "laws", **row, "members": members, **origin}) for row in rows]
    write_atomically(RECORD, "\n".join(lines) + "\n")
    for row in rows:
        print(
            {
                key: row[key]
                for key in ("source", "method", "cases", "error", "error_90")
                if key in row
            }
        )


if __name__ == "__main__":
    main()
