"""What the record says: costs at equal error, order of convergence, the same mesh."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from validation.study import Row, format_table

LEVELS = {"bending": (0.3, 0.1, 0.05, 0.03, 0.01), "pulse": (0.3, 0.1, 0.05, 0.03, 0.02)}
"""Errors at which methods are compared."""


FAMILIES = ("QDEM float64", "QDEM float32", "P1 central difference", "P1 Newmark", "P2 Newmark")
"""Methods that are compared."""


def list_runs(rows: Sequence[Row], question: str, name: str) -> list[Row]:
    """Runs of a method on a question, by cost."""
    runs = next(row["runs"] for row in rows if row["part"] == question)
    return sorted((run for run in runs if run["method"] == name), key=lambda run: run["cost_s"])


def list_dependable(rows: Sequence[Row]) -> list[Row]:
    """A family's runs, each with the largest error of those as fine as it in mesh and step.

    Errors of mesh and step may cancel, and do where linear elements are too stiff and Newmark's
    method too slow; one who does not know the answer cannot choose the step for which they do.
    """
    return [
        row | {"error": max(
            r["error"] for r in rows
            if r["elements"] >= row["elements"] and r["step_s"] <= row["step_s"] * (1 + 1e-9)
        )}
        for row in rows
    ]  # fmt: skip


def find_best(rows: Sequence[Row]) -> list[Row]:
    """Those `list_dependable` runs for which nothing cheaper is as good, by cost."""
    best: list[Row] = []
    for row in sorted(list_dependable(rows), key=lambda row: row["cost_s"]):
        if not best or row["error"] < best[-1]["error"]:
            best.append(row)
    return best


@dataclass(frozen=True)
class Cost:
    """What an error costs [s]; ``guessed`` beyond the smallest error that was reached."""

    seconds: float
    guessed: bool

    def __str__(self) -> str:
        return f"{format_figures(self.seconds)} s" + " (extrapolated)" * self.guessed


def format_figures(number: float) -> str:
    """Two figures, without a power of ten."""
    return f"{float(f'{number:.2g}'):g}"


def find_cost(rows: Sequence[Row], error: float) -> Cost:
    """Cost of an error: between the runs of the frontier along straight lines in logarithms.

    Above their largest error the cheapest run's; below the smallest the line through the last
    run and the one nearest to twice its error goes on, which a family that has stopped to
    converge (one mesh, ever finer steps) would not do: add meshes before trusting it.
    """
    best = find_best(rows)
    if not best:
        return Cost(np.nan, True)
    errors, costs = (np.log([row[key] for row in best]) for key in ("error", "cost_s"))
    wanted = np.log(error)
    if wanted >= errors[-1]:
        return Cost(float(np.exp(np.interp(wanted, errors[::-1], costs[::-1]))), False)
    if len(best) < 2:
        return Cost(np.nan, True)
    other = int(np.argmin(np.abs(errors[:-1] - errors[-1] - np.log(2))))
    slope = (costs[-1] - costs[other]) / (errors[-1] - errors[other])
    return Cost(float(np.exp(costs[-1] + slope * (wanted - errors[-1]))), True)


def fit_order(rows: Sequence[Row], count: int = 3) -> float:
    """Order of convergence in the size of the elements, least squares over the ``count`` finest."""
    finest = sorted(rows, key=lambda row: row["elements"])[-count:]
    size = np.log([row["elements"] ** (-1 / 3) for row in finest])
    return float(np.polyfit(size, np.log([row["error"] for row in finest]), 1)[0])


def pair_runs(rows: Sequence[Row], question: str, one: str, other: str) -> list[tuple[Row, Row]]:
    """Runs of two families on the same mesh, coarse meshes first."""
    found = {json.dumps(r["setting"]["cells"]): r for r in list_runs(rows, question, other)}
    return sorted(
        ((r, found[json.dumps(r["setting"]["cells"])]) for r in list_runs(rows, question, one)
         if json.dumps(r["setting"]["cells"]) in found),
        key=lambda pair: pair[0]["elements"],
    )  # fmt: skip


def list_costs(rows: Sequence[Row], question: str) -> str:
    """Costs at equal error: the cheapest bold, what is extrapolated in brackets."""
    lines = []
    for level in LEVELS[question]:
        costs = [find_cost(list_runs(rows, question, name), level) for name in FAMILIES]
        least = min((c.seconds for c in costs if np.isfinite(c.seconds)), default=np.nan)
        cells = []
        for cost in costs:
            known = "none" if np.isnan(cost.seconds) else format_figures(cost.seconds)
            text = f"({known})" if cost.guessed and known != "none" else known
            cells.append(f"**{text}**" if cost.seconds == least else text)
        lines.append([f"{level:.0%}", *cells])
    return format_table(["error", *FAMILIES], lines)
