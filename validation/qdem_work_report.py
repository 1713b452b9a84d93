"""What the record of `qdem_work_precision` says: costs at equal error, sentences, the picture."""

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
PAPER_STEP, PAPER_FEM_STEP = 1e-7, 3e-5
"""Time steps of section 3.1 [s]."""
PAPER_DAYS, PAPER_FEM_DAYS = 2.0, 1.0
PAPER_ELEMENTS = 488_361


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
    """Newmark with the longest step whose error is within a tenth of QDEM's."""
    for ours in reversed(family(rows, question, "QDEM float64")):
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


# --- words ------------------------------------------------------------------------------------


def summary(rows: Sequence[Row]) -> str:
    """Where each method wins; every number is from the rows, or of the paper where it says so."""
    text = []
    for question, levels in LEVELS.items():
        reference = next(
            r for r in rows if r["case"] == f"qdem-cost-{question}" and r["method"] == "reference"
        )
        text.append(f"{question}: reference uncertain by {reference['error']:.1g}")
        text += [_level(rows, question, level) for level in levels]
        text += _same_mesh_words(rows, question)
        text += _precision_words(rows, question)
        text += _step_words(rows, question)
    text += _scaling_words(rows)
    text += _paper_words(rows)
    return "\n".join(text)


def table(rows: Sequence[Row], question: str) -> str:
    """Costs at equal error in Markdown: the cheapest bold, extrapolations in brackets."""
    lines = ["| error | " + " | ".join(COMPARED) + " |", "|---|" + "---|" * len(COMPARED)]
    for level in LEVELS[question]:
        costs = [cost_at(family(rows, question, name), level) for name in COMPARED]
        least = min((c.seconds for c in costs if np.isfinite(c.seconds)), default=np.nan)
        cells = []
        for cost in costs:
            known = "none" if np.isnan(cost.seconds) else figures(cost.seconds)
            text = f"({known})" if cost.guessed and known != "none" else known
            cells.append(f"**{text}**" if cost.seconds == least else text)
        lines.append(f"| {level:.0%} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _level(rows: Sequence[Row], question: str, level: float) -> str:
    costs = {name: cost_at(family(rows, question, name), level) for name in COMPARED}
    known = {name: cost for name, cost in costs.items() if np.isfinite(cost.seconds)}
    winner = min(known, key=lambda name: known[name].seconds)
    said = "; ".join(f"{name} {cost}" for name, cost in known.items())
    return f"  an error of {level:.1%}: {winner} is cheapest ({said})"


def _same_mesh_words(rows: Sequence[Row], question: str) -> list[str]:
    found = same_mesh(rows, question)
    if found is None:
        return []
    return [
        f"  on the same mesh of {found.elements} elements, to the same error: an implicit step "
        f"costs {found.per_step:.0f} explicit ones, but QDEM needs {found.steps:.3g} times as many "
        f"({found.qdem_step:.2g} s against {found.newmark_step:.2g} s), so its time to solution is "
        f"{found.time:.2g} times Newmark's"
    ]


def _precision_words(rows: Sequence[Row], question: str) -> list[str]:
    words = []
    for name in ("QDEM float32", "P1 central difference"):
        found = pairs(rows, question, "QDEM float64", name)
        if found:
            ours, theirs = found[-1]
            words.append(
                f"  {name} on {ours['elements']} elements: cost "
                f"{theirs['cost_s'] / ours['cost_s']:.2f} of QDEM float64's, error "
                f"{theirs['error']:.5f} against {ours['error']:.5f}"
            )
    return words


def _step_words(rows: Sequence[Row], question: str) -> list[str]:
    words = []
    whole = {str(r["setting"]["cells"]): r for r in family(rows, question, "QDEM float64")}
    for r in family(rows, question, "QDEM, shorter steps"):
        beside = whole[str(r["setting"]["cells"])]
        words.append(
            f"  {r['elements']} elements, step {r['setting']['safety']:g} of the critical one: "
            f"error {r['error']:.5f} against {beside['error']:.5f} at 0.9, cost "
            f"{r['cost_s'] / beside['cost_s']:.2f} times"
        )
    return words


def _scaling_words(rows: Sequence[Row]) -> list[str]:
    scaled = family(rows, "bending", "QDEM on gmsh's meshes")
    words = []
    for plain in (r for r in scaled if not r["setting"]["slowest"]):
        for r in scaled:
            if r["setting"]["h"] == plain["setting"]["h"] and r["setting"]["slowest"]:
                words.append(
                    f"  mass scaling of {r['setting']['slowest']:.0%} of {r['elements']} elements: "
                    f"{r['notes']['mass added']:.1%} more mass, step "
                    f"{r['step_s'] / plain['step_s']:.2f} times as long, error {r['error']:.3f} "
                    f"against {plain['error']:.3f}, cost {r['cost_s']:.1f} s against "
                    f"{plain['cost_s']:.1f} s"
                )
    return ["mass scaling on gmsh's meshes, bending:", *words] if words else []


def _paper_words(rows: Sequence[Row]) -> list[str]:
    ours = family(rows, "bending", "QDEM float64")
    steps = PAPER_FEM_STEP / PAPER_STEP
    time = PAPER_DAYS / PAPER_FEM_DAYS
    words = [
        "the paper's figures (section 3.1):",
        f"  its 300 is the ratio of the numbers of steps, {steps:.0f}; with {PAPER_DAYS:.0f} days "
        f"against {PAPER_FEM_DAYS:.0f} a step took {steps / time:.0f} times less time (one GPU "
        f"against a workstation), and the answer came {time:.0f} times later",
    ]
    if ours:
        finest = max(ours, key=lambda row: row["elements"])
        step = finest["step_s"] * (finest["elements"] / PAPER_ELEMENTS) ** (1 / 3)
        words.append(
            f"  at 0.9 of the critical step of our meshes, brought to its number of elements, the "
            f"step would be {step:.2g} s, {step / PAPER_STEP:.0f} times its {PAPER_STEP:.0e} s"
        )
    return words
