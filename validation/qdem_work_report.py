"""What the record of `qdem_work_precision` says: costs at equal error, order, the same mesh."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

Row = dict[str, Any]
Chosen = Callable[[Row], bool]
LEVELS = {"bending": (0.3, 0.1, 0.05, 0.03, 0.01), "pulse": (0.3, 0.1, 0.05, 0.03, 0.02)}
"""Errors at which methods are compared."""


def rows_read(path: Path) -> list[Row]:
    """Rows of a record, none if there is no file."""
    if not path.exists():
        return []
    return [json.loads(text) for text in path.read_text(encoding="utf-8").splitlines() if text]


def _qdem(**wanted: Any) -> Chosen:
    default = {"precision": "float64", "safety": 0.9}

    def chosen(row: Row) -> bool:
        setting = default | row["setting"]
        return (
            row["method"] == "QDEM"
            and "h" not in setting
            and all(setting[name] == value for name, value in (default | wanted).items())
        )

    return chosen


def _method(name: str) -> Chosen:
    return lambda row: row["method"] == name


FAMILIES: dict[str, Chosen] = {
    "QDEM float64": _qdem(),
    "QDEM float32": _qdem(precision="float32"),
    "P1 central difference": _method("P1 central difference"),
    "P1 Newmark": _method("P1 Newmark"),
    "P2 Newmark": _method("P2 Newmark"),
    "QDEM, shorter steps": lambda r: "safety" in r["setting"],
    "QDEM on gmsh's meshes": lambda r: "h" in r["setting"],
}


COMPARED = (
    "QDEM float64", "QDEM float32", "P1 central difference", "P1 Newmark", "P2 Newmark"
)  # fmt: skip
"""Families of the table."""


def family(rows: Sequence[Row], question: str, name: str) -> list[Row]:
    """Rows of a family of settings that have an error and a cost, by cost."""
    chosen = FAMILIES[name]
    return sorted(
        (r for r in rows if r["case"] == f"qdem-cost-{question}" and r["ok"] and chosen(r)
         and r["cost_s"] is not None),
        key=lambda row: row["cost_s"],
    )  # fmt: skip


def dependable(rows: Sequence[Row]) -> list[Row]:
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


def frontier(rows: Sequence[Row]) -> list[Row]:
    """Those `dependable` runs for which nothing cheaper is as good, by cost."""
    best: list[Row] = []
    for row in sorted(dependable(rows), key=lambda row: row["cost_s"]):
        if not best or row["error"] < best[-1]["error"]:
            best.append(row)
    return best


@dataclass(frozen=True)
class Cost:
    """What an error costs [s]; ``guessed`` beyond the smallest error that was reached."""

    seconds: float
    guessed: bool

    def __str__(self) -> str:
        return f"{figures(self.seconds)} s" + " (extrapolated)" * self.guessed


def figures(number: float) -> str:
    """Two figures, without a power of ten."""
    return f"{float(f'{number:.2g}'):g}"


def cost_at(rows: Sequence[Row], error: float) -> Cost:
    """Cost of an error: between the runs of the frontier along straight lines in logarithms.

    Above their largest error the cheapest run's; below the smallest the line through the last
    run and the one nearest to twice its error goes on, which a family that has stopped to
    converge (one mesh, ever finer steps) would not do: add meshes before trusting it.
    """
    best = frontier(rows)
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


def order(rows: Sequence[Row], count: int = 3) -> float:
    """Order of convergence in the size of the elements, least squares over the ``count`` finest."""
    finest = sorted(rows, key=lambda row: row["elements"])[-count:]
    size = np.log([row["elements"] ** (-1 / 3) for row in finest])
    return float(np.polyfit(size, np.log([row["error"] for row in finest]), 1)[0])


def spread(rows: Sequence[Row]) -> float:
    """How far a run's dearest repetition is above its cheapest, median of all runs."""
    repeats = [row["repeats_s"] for row in rows if row.get("repeats_s")]
    return float(np.median([max(one) / min(one) - 1 for one in repeats]))


def pairs(rows: Sequence[Row], question: str, one: str, other: str) -> list[tuple[Row, Row]]:
    """Runs of two families on the same mesh, coarse meshes first."""
    found = {json.dumps(r["setting"]["cells"]): r for r in family(rows, question, other)}
    return sorted(
        ((r, found[json.dumps(r["setting"]["cells"])]) for r in family(rows, question, one)
         if json.dumps(r["setting"]["cells"]) in found),
        key=lambda pair: pair[0]["elements"],
    )  # fmt: skip


@dataclass(frozen=True)
class SameMesh:
    """QDEM beside Newmark's method on the finest mesh that was factorised."""

    elements: int
    per_step: float
    """Cost of an implicit step over an explicit one, factorisation not counted."""
    steps: float
    """Explicit over implicit steps."""
    time: float
    """QDEM's whole cost over Newmark's."""
    qdem_step: float
    """[s]"""
    newmark_step: float
    """[s]"""


def same_mesh(rows: Sequence[Row], question: str) -> SameMesh | None:
    """Newmark with the longest step whose error is within a tenth of QDEM's, if that is below 0.3.

    None where no such step was tried, as in the pulse, where errors of lumped masses and of
    central differences cancel in part.
    """
    useful = [r for r in family(rows, question, "QDEM float64") if r["error"] < 0.3]
    for ours in reversed(useful):
        same = [
            r for r in family(rows, question, "P1 Newmark")
            if r["setting"]["cells"] == ours["setting"]["cells"]
            and r["setting"]["solver"] == "direct" and abs(r["error"] / ours["error"] - 1) < 0.1
        ]  # fmt: skip
        if same:
            theirs = max(same, key=lambda r: r["step_s"])
            each = [r["parts_s"]["stepping"] / r["work"] for r in (ours, theirs)]
            return SameMesh(
                ours["elements"], each[1] / each[0], ours["work"] / theirs["work"],
                ours["cost_s"] / theirs["cost_s"], ours["step_s"], theirs["step_s"],
            )  # fmt: skip
    return None
