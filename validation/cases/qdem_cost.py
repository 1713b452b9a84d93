"""Error against cost of QDEM beside central differences and Newmark's method with scikit-fem.

Two questions (`qdem_work_problems`), one slow and one fast, asked of every method on meshes and
with steps of several sizes.  The full form judges the record ``validation/results/qdem-cost.jsonl``
after making the runs that it lacks (all of them: half an hour of one core); the quick form makes
small runs of its own in a minute.  `docs/qdem-cost.md` says in words what comes out.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

from validation.case import Check
from validation.qdem_work_precision import RECORD, record_apart
from validation.qdem_work_report import LEVELS, Row, cost_at, family, order, pairs, same_mesh

SAME = 1e-3
"""Two codes of the same elements and steps, and two precisions, differ by less than this share of
the error: a thousand times less than what the mesh does to it."""
REFERENCE = 0.003
"""Largest uncertainty of a reference: a sixth of the smallest error that is compared."""


def run(quick: bool) -> list[Check]:
    """Bars on what must hold on any machine, and the costs at equal error, which are reported."""
    if not quick:
        return cost_checks(record_apart(RECORD, quick=False), finest=3)
    with tempfile.TemporaryDirectory() as folder:
        return cost_checks(record_apart(Path(folder) / "qdem-cost.jsonl", quick=True), finest=2)


def cost_checks(rows: Sequence[Row], finest: int) -> list[Check]:
    """Checks of a record; orders of convergence are those of the ``finest`` meshes."""
    failed = [row for row in rows if not row["ok"]]
    checks = [Check("runs that failed", len(failed), "0", not failed)]
    for question in LEVELS:
        checks += [
            _reference_check(rows, question),
            *_same_answer_checks(rows, question),
            *_cost_checks(rows, question),
        ]
    slope = order(family(rows, "bending", "QDEM float64"), finest)
    checks.append(
        Check("bending: order of convergence of QDEM", slope, "1.8 to 2.2", 1.8 <= slope <= 2.2)
    )
    return checks


def _reference_check(rows: Sequence[Row], question: str) -> Check:
    row = next(
        r for r in rows if r["case"] == f"qdem-cost-{question}" and r["method"] == "reference"
    )
    return Check(
        f"{question}: uncertainty of the reference",
        row["error"],
        f"<= {REFERENCE:g}",
        row["error"] <= REFERENCE,
    )


def _same_answer_checks(rows: Sequence[Row], question: str) -> list[Check]:
    """The same elements and steps have the same error, whoever computes them."""
    checks = []
    for name in ("P1 central difference", "QDEM float32"):
        apart = max(
            abs(theirs["error"] / ours["error"] - 1)
            for ours, theirs in pairs(rows, question, "QDEM float64", name)
        )
        title = f"{question}: error of {name} over that of QDEM float64, less 1"
        checks.append(Check(title, apart, f"<= {SAME:g}", apart <= SAME))
    return checks


def _cost_checks(rows: Sequence[Row], question: str) -> list[Check]:
    checks = []
    ours, theirs = pairs(rows, question, "QDEM float64", "P1 central difference")[-1]
    if question == "bending":  # a pulse is over in too few steps to time them
        step = (ours["parts_s"]["stepping"] / ours["work"]) / (
            theirs["parts_s"]["stepping"] / theirs["work"]
        )
        title = f"bending: cost of a step of QDEM over scipy's, {ours['elements']} elements"
        checks.append(Check(title, step, "<= 1", step <= 1))
    whole = ours["cost_s"] / theirs["cost_s"]
    title = f"{question}: cost of QDEM over central differences', {ours['elements']} elements"
    checks.append(Check(title, whole, "<= 1", whole <= 1))
    # at the smallest error that QDEM reached, so that its own cost is measured
    error = min(row["error"] for row in family(rows, question, "QDEM float64"))
    cost = cost_at(family(rows, question, "QDEM float64"), error).seconds
    for name in ("P1 Newmark", "P2 Newmark"):
        other = cost_at(family(rows, question, name), error)
        title = f"{question}: cost of QDEM over {name}'s at an error of {error:.2g}"
        if other.guessed:
            title += " (extrapolated)"
        checks.append(Check(title, cost / other.seconds, "reported", True))
    implicit = same_mesh(rows, question)
    if implicit is not None:
        title = f"{question}: cost of a step of Newmark over one of QDEM"
        checks += [
            Check(f"{title}, {implicit.elements} elements", implicit.per_step, "reported", True),
            Check(f"{question}: steps of QDEM over Newmark's", implicit.steps, "reported", True),
        ]
    return checks
