"""The record of `qdem_work_precision` in words and in a table; every number is from its rows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from validation.qdem_work_report import (
    COMPARED,
    LEVELS,
    Row,
    cost_at,
    family,
    figures,
    pairs,
    same_mesh,
)

PAPER_STEP, PAPER_FEM_STEP = 1e-7, 3e-5
"""Time steps of section 3.1 [s]."""
PAPER_DAYS, PAPER_FEM_DAYS = 2.0, 1.0
PAPER_ELEMENTS = 488_361


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
