"""The figures of 20 grains; of packings, what beds bear and what the higher friction leaves."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product
from typing import Any

import numpy as np

from validation.bench.qdem.checks import check_below, list_checks
from validation.case import Check
from validation.studies.qdem_track.bogie import FRICTIONS, SEEDS
from validation.study import Row

PAGE = "docs/qdem-track.md"
LASTING = "a rough rail has many peaks of force, the slow pulse one: more of the way is lasting"
TILTS = "of few packings one tilts under the lower friction, and lifts its grain B2"


def check_bars(rows: Sequence[Row]) -> list[Check]:
    """Every figure of the record against its bar."""
    runs = [row["run"] for row in rows if "run" in row]
    return [*list_checks(rows, PAGE), *check_runs(runs)]


def check_runs(runs: Sequence[dict[str, Any]]) -> Iterator[Check]:
    """Account and bearing of each run; what frictions leave, over packings that have both."""
    for run in runs:
        name = f"packing {run['seed']}, friction {run['friction']:g}"
        ratio = run["points"]["sleeper"]["greatest"] / run["trial"]["way"]
        yield check_below(f"{name}: missing in the account of energies", run["imbalance"], 1e-3)
        yield check_below(
            f"{name}: sleeper under the bogie over the slow pulse", ratio, 2.0, why=LASTING
        )
    for point, key in product(("sleeper", "B2"), ("greatest", "lateral")):
        ratio = compare_frictions(runs, point, key)
        name = f"300 grains, friction 1.73 over 0.577: {key} of {point}, mean of packings"
        if np.isfinite(ratio):
            yield check_below(name, ratio, 1.0, why=TILTS)


def compare_frictions(runs: Sequence[dict[str, Any]], point: str, key: str) -> float:
    """Mean over packings with both at the higher friction over that at the lower; nan for none."""
    found = {(run["seed"], run["friction"]): run["points"][point][key] for run in runs}
    both = [seed for seed in SEEDS if all((seed, friction) in found for friction in FRICTIONS)]
    low, high = (sum(found[seed, friction] for seed in both) for friction in FRICTIONS)
    return float(high / low) if both else np.nan
