"""The picture of ``docs/laws.md``: error against cost, and predictions with bands."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from adapters.errors import UsageError
from adapters.fit_auto import outlook
from validation.cases.jump_without_engine import data_folder
from validation.law_series import ballast_series
from validation.law_study import LAWS, RIVALS, Row, verdict

SHOWN = (
    ("p_10kPa_q_230kPa_f_5Hz", 1e3),
    ("p_30kPa_q_230kPa_f_30Hz", 3e3),
    ("p_30kPa_q_230kPa_f_50Hz", 1e3),
)
"""Series and cuts: a usual one, one that shook down, and one that is refused."""


def draw(rows: Sequence[Row], target: Path) -> None:
    """Error against cost to the left, three series of `SHOWN` to the right.

    Raises `UsageError` without TRACKBED_DATA: the series are not part of the repository.
    """
    folder = data_folder()
    if folder is None:
        raise UsageError("the picture needs the series", remedy="set TRACKBED_DATA")
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(1, 4, figsize=(15, 4))
    draw_errors(axes[0], rows)
    series = {name: (cycle, strain) for name, cycle, strain in ballast_series(folder)}
    for axis, (name, cut) in zip(axes[1:], SHOWN, strict=True):
        draw_series(axis, name, cut, *series[name])
    axes[1].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(target, dpi=120)
    pyplot.close(figure)


def draw_errors(axis: Any, rows: Sequence[Row]) -> None:
    """Median (dot) to 90th percentile (end of the line) against cost, real ballast."""
    for row in rows:
        if row["source"] != "ballast" or row["method"] == "karrech2007":
            continue
        name = row["method"]
        color = "#c8553d" if name == "auto" else "#1b6ca8" if name in LAWS else "0.45"
        marker = "*" if name == "auto" else "o" if name in LAWS else "s"
        cost = 1e3 * row["cost_s"]
        axis.plot([cost] * 2, [100 * row["error"], 100 * row["error_90"]], color=color, lw=0.8)
        axis.plot(cost, 100 * row["error"], marker, color=color, ms=10 if name == "auto" else 5)
        beside = (4, -3) if name in LAWS or name == "auto" else (-4, 6)  # a rival fits the same law
        axis.annotate(name, (cost, 100 * row["error"]), fontsize=7, xytext=beside,
                      textcoords="offset points")  # fmt: skip
    axis.set(xscale="log", yscale="log", xlabel="CPU time of a prediction, ms")
    axis.set_ylabel("error at 10 N_c, %: median to 90th percentile")
    axis.axhline(8, color="0.6", lw=0.7, ls=":")
    axis.set_title(f"real ballast ({len(LAWS) - 1} laws, auto, {len(RIVALS)} rivals)", fontsize=9)


def draw_series(axis: Any, name: str, cut: float, cycle: Any, strain: Any) -> None:
    """Readings, what was known, and the outlook from there on."""
    known = cycle <= cut * (1 + 1e-9)
    last = float(cycle[known][-1])
    ahead = last * np.geomspace(1.01, float(cycle[-1]) / last, 40)
    said = [outlook(cycle[known], strain[known, None], to) for to in ahead]
    low, middle, high = (
        np.array([getattr(one, part)[0] for one in said]) for part in ("low", "prediction", "high")
    )
    axis.fill_between(ahead, 100 * low, 100 * high, color="#c8553d", alpha=0.2, label="90 % band")
    axis.plot(ahead, 100 * middle, color="#c8553d", label="auto")
    axis.plot(cycle[known], 100 * strain[known], "o", color="#1b6ca8", ms=4, label="known")
    later = {"color": "0.4", "mfc": "none", "ms": 4, "label": "later"}
    axis.plot(cycle[~known], 100 * strain[~known], "o", **later)
    axis.axvline(10 * last, color="0.6", lw=0.7, ls=":")
    axis.set(xscale="log", xlabel="cycles", ylabel="axial strain, %", ylim=(0, 250 * strain[-1]))
    regime = verdict(cycle[known], strain[known])
    axis.set_title(f"{name.replace('_', ' ')}, N_c = {cut:,.0f}: {regime}", fontsize=9)
