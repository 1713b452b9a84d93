"""The first push of the ballast study, before chaos parts all runs; and its long runs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from validation.rigid_ballast_measures import settlement_law

Row = dict[str, Any]
DRAWS, SEED = 2000, 1
"""Samples of the bootstrap, and the seed of its random numbers."""


@dataclass(frozen=True)
class Push:
    """A level's first push over its beds."""

    name: str
    method: str
    level: Row
    sunk: float
    """Mean way of the sleeper down at the peak [m]."""
    errors: dict[int, float]
    """Greatest distance of the sleeper from the reference on its way to the peak [m], by seed."""
    costs: dict[int, float]
    """Processor time [s], by seed."""
    dissipated: float
    """Mean work of the load less gain of the bodies, to the peak [J per metre of track]."""
    steps: float
    """Mean number of steps."""
    is_limit: bool
    """It is the finest of its method, judged by that of the other."""

    @property
    def error(self) -> float:
        """Median error [m]."""
        return float(np.median(list(self.errors.values())))

    @property
    def cost(self) -> float:
        """Mean cost [s]."""
        return float(np.mean(list(self.costs.values())))


def pushes_of(rows: Sequence[Row]) -> list[Push]:
    """Every level, each method's coarse ones first, on the beds that all levels have.

    The reference is the mean of the finest level of each method; a finest one is judged by the
    other.  None without recorded pushes of both methods.
    """
    runs: dict[str, dict[int, Row]] = {}
    for row in rows:
        if row["kind"] == "push" and row["ok"]:
            runs.setdefault(row["name"], {})[row["bed"]["seed"]] = row
    levels = {name: next(iter(mine.values()))["level"] for name, mine in runs.items()}
    order = {method: sorted((n for n in runs if levels[n]["method"] == method),
                            key=lambda n: levels[n]["value"], reverse=method == "rigid")
             for method in ("rigid", "soft")}  # fmt: skip
    seeds = sorted(set.intersection(*(set(mine) for mine in runs.values()))) if runs else []
    if not seeds or not all(order.values()):
        return []
    ends = {method: order[method][-1] for method in order}
    found = []
    for method, other in (("rigid", "soft"), ("soft", "rigid")):
        for name in order[method]:
            mine = {seed: runs[name][seed] for seed in seeds}
            judges = [ends[other]] if name == ends[method] else list(ends.values())
            errors = {}
            for seed, row in mine.items():
                way = np.mean([runs[judge][seed]["sunk"] for judge in judges], axis=0)
                errors[seed] = float(np.abs(np.array(row["sunk"]) - way).max())
            lost = [row["work"][-1] - row["work"][0] - row["energy"][-1] + row["energy"][0]
                    for row in mine.values()]  # fmt: skip
            found.append(Push(
                name, method, levels[name], _mean(row["sunk"][-1] for row in mine.values()), errors,
                {seed: row["cpu_s"] for seed, row in mine.items()}, _mean(lost),
                _mean(row["steps"] for row in mine.values()), name == ends[method],
            ))  # fmt: skip
    return found


def _mean(values: Iterable[float]) -> float:
    return float(np.mean(list(values)))


def cost_at_error(error: float, errors: Sequence[float], costs: Sequence[float]) -> float:
    """Cost [s] at which levels of falling ``errors`` come to ``error``, interpolated in logarithms.

    Beyond the last level, NaN; before the first, the cost of the first.
    """
    if error >= errors[0]:
        return costs[0]
    for k in range(len(errors) - 1):
        if errors[k] >= error >= errors[k + 1]:
            share = np.log(errors[k] / error) / np.log(errors[k] / errors[k + 1])
            return float(costs[k] * (costs[k + 1] / costs[k]) ** share)
    return float("nan")


def equal_error_cost(rigid: Push, soft: Sequence[Push]) -> tuple[float, float, float]:
    """Cost of soft over rigid grains where their median errors are equal, and its 95 % interval.

    ``soft``: the levels but the finest, coarse ones first.  Percentiles of a bootstrap over the
    beds, in which a sample whose soft levels do not come so far counts as endless.
    """
    seeds = sorted(rigid.errors)
    ours = np.array([[rigid.errors[s], rigid.costs[s]] for s in seeds])
    theirs = np.array([[[p.errors[s], p.costs[s]] for p in soft] for s in seeds])

    def ratio(pick: Any) -> float:
        errors, costs = np.median(theirs[pick, :, 0], axis=0), theirs[pick, :, 1].mean(axis=0)
        found = cost_at_error(float(np.median(ours[pick, 0])), list(errors), list(costs))
        return np.inf if np.isnan(found) else found / float(ours[pick, 1].mean())

    random = np.random.default_rng(SEED)
    drawn = [ratio(random.integers(0, len(seeds), len(seeds))) for _ in range(DRAWS)]
    low, high = np.percentile(drawn, [2.5, 97.5], method="nearest")
    return ratio(np.arange(len(seeds))), float(low), float(high)


def push_findings(pushes: Sequence[Push]) -> str:
    """What the first push says, each number from the record."""
    if not pushes:
        return "No first push is recorded."
    rigid, soft = ([p for p in pushes if p.method == method] for method in ("rigid", "soft"))
    return (
        f"The finest levels ({rigid[-1].name}; {soft[-1].name}) are {1e6 * rigid[-1].error:.3g} um "
        f"apart on the way to the peak (median of {len(rigid[-1].errors)} beds; from "
        f"{1e6 * min(rigid[-1].errors.values()):.2g} to {1e6 * max(rigid[-1].errors.values()):.2g} "
        "um), and the softest from the reference "
        f"{1e6 * soft[0].error:.3g} um.  They dissipate {rigid[-1].dissipated:.2f} and "
        f"{soft[-1].dissipated:.2f} J/m."
    )


def damped_words(rows: Sequence[Row], paper: str) -> str:
    """Stiff soft grains with strong and with usual dashpots beside a rigid level, bed by bed."""
    runs: dict[str, dict[int, Row]] = {}
    for row in rows:
        if row["kind"] in ("push", "damped") and row["ok"]:
            runs.setdefault(row["name"], {})[row["bed"]["seed"]] = row
    lines = []
    for name in dict.fromkeys(row["name"] for row in rows if row["kind"] == "damped"):
        k = runs[name][min(runs[name])]["level"]["value"]
        usual = next(n for n, mine in runs.items() if "damping" not in n
                     and mine[min(mine)]["level"]["value"] == k)  # fmt: skip
        seeds = sorted(runs[name].keys() & runs[usual].keys() & runs[paper].keys())
        away = {n: [1e6 * np.abs(np.subtract(runs[n][s]["sunk"], runs[paper][s]["sunk"])).max()
                    for s in seeds] for n in (name, usual)}  # fmt: skip
        lines.append(
            f"* {name}: {np.median(away[name]):.3g} um from rigid grains with {paper} (median of "
            f"{len(seeds)} beds, largest {max(away[name]):.3g}); with the usual dashpots "
            f"{np.median(away[usual]):.3g} um (largest {max(away[usual]):.3g})."
        )
    return "\n".join(lines)


def long_words(rows: Sequence[Row]) -> str:
    """Mean settlement of the long runs at some cycles, and the better of the two laws."""
    runs: dict[str, list[Row]] = {}
    for row in rows:
        if row["kind"] == "long" and row["ok"]:
            runs.setdefault(f"{row['level']['method']}, {row['name']}", []).append(row)
    lines = []
    for name, mine in runs.items():
        curve = np.mean([row["settlement"] for row in mine], axis=0)
        shown = [n for n in (1, 5, 10, 20, 40) if n <= len(curve)]
        ways = ", ".join(f"{1e3 * curve[n - 1]:.2f} mm after {n}" for n in shown)
        laws = {kind: settlement_law(curve, kind) for kind in ("log", "linear")}
        best = min(laws, key=lambda kind: laws[kind][2])
        a, b, off = laws[best]
        form = "ln N" if best == "log" else "N"
        lines.append(
            f"* {name}, {len(mine)} beds, {len(curve)} cycles: mean settlement {ways}; the better "
            f"law is {1e3 * a:.2f} mm {1e3 * b:+.3f} mm · {form} "
            f"(rms {1e3 * off:.2f} mm)."
        )
    return "\n".join(lines)
