"""What refusing wide bands costs, and other ways to combine laws, on the cases of `law_study`.

Settings are a bound on the band (half its width over the settlement so far, `fit_refusal.WIDEST` in
the package) and a way to combine the candidates.  So that nothing is judged on what it was chosen
by, `left_out` chooses the setting on all tests but one and predicts that one.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from math import inf
from typing import Any

import numpy as np

from adapters.fit_auto import Outlook
from validation.law_series import LawCase

BOUNDS = (0.25, 0.5, 1.0, 2.0, 4.0, inf)
WAYS = ("median of the votes", "without the power law", "recent decades first", "no faster decade")
"""`adapters.fit_auto`; N^b has no vote, as it never slows down to a logarithm; windows of one
decade, two and all weigh 3 : 2 : 1; no decade ahead brings more than the last one did."""
ERROR_90_BAR, LARGE = 0.2, 0.25
Row = dict[str, Any]


def summary(error: Iterable[float]) -> Row:
    """Median and 90th percentile of absolute errors."""
    size = np.abs(np.array(list(error)))
    return {
        "cases": len(size),
        "error": float(np.median(size)),
        "error_90": float(np.quantile(size, 0.9)),
    }


def ways(said: Outlook, case: LawCase) -> dict[str, float]:
    """Prediction by each of `WAYS`, the bands' middles being those of the first one."""
    candidates, votes = said.candidates, said.votes[:, 0]
    gain = candidates.increment[:, 0]
    slow = votes & np.array([law != "power" for law in candidates.law])
    order = np.argsort(gain)
    weight = votes * np.array([{1.0: 3.0, 2.0: 2.0}.get(one, 1.0) for one in candidates.decades])
    share = np.cumsum(weight[order]) / weight.sum()
    cycle, settlement = np.log(case.cycle), case.settlement
    decade = settlement[-1] - np.interp(cycle[-1] - np.log(10), cycle, settlement)
    most = decade * (np.log(case.to_cycle) - cycle[-1]) / np.log(10)
    median = float(said.prediction[0])
    return {
        WAYS[0]: median,
        WAYS[1]: float(settlement[-1] + np.median(gain[slow])) if slow.any() else median,
        WAYS[2]: float(settlement[-1] + gain[order][np.searchsorted(share, 0.5)]),
        WAYS[3]: float(min(median, settlement[-1] + most)),
    }


def large_errors(rows: Sequence[Row]) -> list[Row]:
    """Cases that do not ratchet for certain and miss by more than `LARGE`, largest first."""
    large = [row for row in rows if row["certain"] and abs(row["error"]) > LARGE]
    return [
        {key: row[key] for key in ("name", "cut", "error", "width")}
        for row in sorted(large, key=lambda row: -abs(row["error"]))
    ]


def kept(rows: Sequence[Row], bound: float) -> list[Row]:
    """Cases that go ahead: no certain ratcheting, and a band no wider than the bound."""
    return [row for row in rows if row["certain"] and row["width"] <= bound]


def bound_rows(source: str, rows: Sequence[Row]) -> list[Row]:
    """A row a setting: how many cases go ahead, their errors and, for auto's way, the band."""
    found = []
    for bound, way in product(BOUNDS, WAYS):
        ahead = kept(rows, bound)
        row = {
            "source": f"{source}, bound",
            "method": f"{way}, {bound:g}",
            "of": len(rows),
            **summary(one["ways"][way] for one in ahead),
        }
        if way == WAYS[0]:
            row["coverage"] = float(np.mean([one["inside"] for one in ahead]))
        found.append(row)
    return found


def left_out(rows: Sequence[Row]) -> Row:
    """Each test by the setting that refuses least on all others and meets the bar there.

    Of settings that refuse alike the one with the least 90th percentile.  All cuts of a test are
    left out together.
    """
    errors, inside, chosen = [], [], {}
    for name in sorted({row["name"] for row in rows}):
        others = [row for row in rows if row["name"] != name]
        best = min(product(BOUNDS, WAYS), key=lambda setting: _cost(others, *setting))
        ahead = kept([row for row in rows if row["name"] == name], best[0])
        errors += [row["ways"][best[1]] for row in ahead]
        inside += [row["inside"] for row in ahead]
        chosen[name] = f"{best[1]}, {best[0]:g}"
    coverage = float(np.mean(inside))
    return {"of": len(rows), **summary(errors), "coverage": coverage, "chosen": chosen}


def _cost(rows: Sequence[Row], bound: float, way: str) -> tuple[bool, int, float]:
    ahead = kept(rows, bound)
    if not ahead:
        return True, len(rows), inf
    error_90 = summary(row["ways"][way] for row in ahead)["error_90"]
    return error_90 > ERROR_90_BAR, len(rows) - len(ahead), error_90
