"""What must hold on any machine; costs at equal error are reported."""

from __future__ import annotations

from collections.abc import Sequence

from validation.bench.qdem.checks import check_between, report
from validation.case import Check
from validation.studies.qdem_cost.reading import find_cost, fit_order, list_runs, pair_runs
from validation.study import Row

SAME = 1e-3
"""Two codes of the same elements and steps, and two precisions, differ by less than this share of
the error: a thousand times less than what the mesh does to it."""
REFERENCE = 0.003
"""Largest uncertainty of a reference: a sixth of the smallest error that is compared."""
TIPS = 0.02
"""Between time steps, precisions and strain measures, at one time of the race's warm-up."""


WALL = "two threads are timed by the wall; 1.31 on another processor"
CACHED = "the processor's cache holds the mesh: memory is no bound there"


def check_max(name: str, value: float, bar: float, why: str = "") -> Check:
    """A value and its upper bar; ``why`` it does not hold, where that is known."""
    return Check(name, value, f"<= {bar:g}", value <= bar, why="" if value <= bar else why)


def check_min(name: str, value: float, bar: float, unit: str = "") -> Check:
    """A value and its lower bar."""
    return Check(name, value, f">= {bar:g}", value >= bar, unit)


def check_bars(rows: Sequence[Row]) -> list[Check]:
    """Checks of the record."""
    checks: list[Check] = []
    for row in rows:
        if "runs" in row:
            checks += check_question(rows, row["part"], row["reference"])
        else:
            checks += check_race(row)
    slope = fit_order(list_runs(rows, "bending", "QDEM float64"), 3)
    return [*checks, check_between("bending: order of convergence of QDEM", slope, 1.8, 2.2)]


def check_question(rows: Sequence[Row], question: str, reference: float) -> list[Check]:
    """The same answers as the same elements elsewhere, at no higher cost."""
    checks = [check_max(f"{question}: uncertainty of the reference", reference, REFERENCE)]
    for name in ("P1 central difference", "QDEM float32"):
        apart = max(
            abs(theirs["error"] / ours["error"] - 1)
            for ours, theirs in pair_runs(rows, question, "QDEM float64", name)
        )
        checks.append(check_max(f"{question}: error of {name} over QDEM's, less 1", apart, SAME))
    ours, theirs = pair_runs(rows, question, "QDEM float64", "P1 central difference")[-1]
    title = f"{question}: cost of QDEM over central differences', {ours['elements']:,} elements"
    checks.append(check_max(title, ours["cost_s"] / theirs["cost_s"], 1))
    error = min(row["error"] for row in list_runs(rows, question, "QDEM float64"))
    cost = find_cost(list_runs(rows, question, "QDEM float64"), error).seconds
    for name in ("P1 Newmark", "P2 Newmark"):
        other = find_cost(list_runs(rows, question, name), error)
        title = f"{question}: cost of QDEM over {name}'s at an error of {error:.2g}"
        checks.append(report(title + " (extrapolated)" * other.guessed, cost / other.seconds))
    return checks


def check_race(row: Row) -> list[Check]:
    """Speeds by ratios within one race, and a share of the bandwidth that no kernel can exceed."""
    speed = {name: turn["speed"] for name, turn in row["race"].items()}
    tips = [turn["tip"] for turn in row["race"].values() if turn["tip"] is not None]
    ours, single = speed["qdem finger float64 2 threads"], speed["qdem finger float32 2 threads"]
    viscous = speed["qdem finger, viscous float64 2 threads"]
    mkl = [s for name, s in speed.items() if name.startswith("mkl") and "float64 2" in name]
    share = ours * row["bytes_per_element"] / 1e3 / row["bandwidth"]["2"]
    checks = [
        check_min("speed, float64, 2 threads", ours, 110, "Mel/s"),
        check_min("over scipy, float64", ours / speed["scipy float64 1 threads"], 1.5),
        check_min("float32 over float64, 2 threads", single / ours, 1.5),
        check_max("cost of viscosity, float64, 2 threads", ours / viscous, 1.35, WALL),
        check_min("2 threads over 1, float64", ours / speed["qdem finger float64 1 threads"], 1.9),
        check_max("traffic over the memory triad, 2 threads", share, 1, CACHED),
    ]
    if tips:
        checks.append(check_max("tips apart after the warm-up", max(tips) / min(tips) - 1, TIPS))
    if mkl:
        checks.append(check_min("over MKL's best, float64, 2 threads", ours / max(mkl), 1))
    return checks
