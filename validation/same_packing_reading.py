"""Differences of two ways on the same beds, and what they say: the words of docs/engines.md."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from adapters.state import FloatArray
from validation.same_packing import WAYS, differences
from validation.same_packing_runs import Row
from validation.student import interval

ENGINES = ("liggghts", "lammps", "yade")
TITLES = {"liggghts": "LIGGGHTS", "lammps": "LAMMPS", "yade": "YADE"}
FIGURES = {
    "settlement": ("settlement, µm", 1e6, 0),
    "settlement_after_first": ("cycles 2 to 50, µm", 1e6, 0),
    "coordination": ("coordination number", 1.0, 3),
    "density": ("relative density", 1.0, 4),
    "deflection": ("elastic deflection, µm", 1e6, 2),
}
"""Key of a row: words, factor, decimals."""

JUDGED = ("settlement", "coordination", "density")
"""Figures that the protocol judges."""

EARLY = 3
"""Cycles after which the runs have not strayed far."""

LEVEL = 1 - 0.05 / 9
"""Of an interval that is one of nine."""

PAIRS = (
    ("LIGGGHTS' law in LAMMPS", "lammps, mindlin", "liggghts"),
    ("YADE's law in LAMMPS", "lammps, mindlin/force, no pull", "yade"),
    ("tangential rule: LIGGGHTS' for the paper's", "lammps, mindlin", "lammps"),
    ("tangential rule: YADE's for the paper's", "lammps, mindlin/force", "lammps"),
    ("no contact pulls", "lammps, mindlin/force, no pull", "lammps, mindlin/force"),
    ("half the time step", "liggghts, half the step", "liggghts"),
    ("walls and piston face as soft as grains", "liggghts, walls as grains", "liggghts"),
    ("piston ten times as heavy", "liggghts, piston of 0.1 kg", "liggghts"),
    ("YADE's damping by rebound, e = 0.2145", "yade, rebound e", "yade"),
    ("the twin: noise", "liggghts, twin", "liggghts"),
)
"""What changes, with it, without it."""


def by_way(rows: Sequence[Row]) -> dict[str, dict[int, Row]]:
    """Runs that gave figures, by way and seed."""
    found: dict[str, dict[int, Row]] = {way.name: {} for way in WAYS}
    for row in rows:
        if row["ok"]:
            found[row["way"]][row["seed"]] = row
    return found


def paired(runs: dict[str, dict[int, Row]], way: str, other: str, key: str) -> FloatArray:
    """Differences ``way`` less ``other`` over the beds that both have, shape (beds,)."""
    seeds = sorted(runs[way].keys() & runs[other].keys())
    return differences(
        [runs[way][seed][key] for seed in seeds], [runs[other][seed][key] for seed in seeds]
    )


def told(values: FloatArray, key: str, signed: bool = True, level: float = 0.95) -> str:
    """Mean and interval in the units of `FIGURES`."""
    if not len(values):
        return "-"
    _, factor, digits = FIGURES[key]
    mean, half = interval(values * factor, level)
    sign = "+" if signed else ""
    if not np.isfinite(half):
        return f"{mean:{sign}.{digits}f}"
    return f"{mean:{sign}.{digits}f} ± {half:.{digits}f}"


def real(values: FloatArray, level: float = 0.95) -> bool:
    """Whether zero is outside of the interval."""
    mean, half = interval(values, level)
    return bool(abs(mean) > half)


def names_of(texts: Sequence[str]) -> str:
    """Words in a row: "a, b and c"."""
    return " and ".join([", ".join(texts[:-1]), texts[-1]] if len(texts) > 1 else texts)


def reading_engines(runs: dict[str, dict[int, Row]]) -> str:
    """What the protocol says of the three engines."""
    found, halves, scatter = [], [], []
    for first, second in combinations(ENGINES, 2):
        for key in JUDGED:
            values = paired(runs, second, first, key)
            if real(values, LEVEL):
                words = FIGURES[key][0].split(",")[0]
                found.append(f"{words}, {TITLES[second]} less {TITLES[first]}")
        values = 1e6 * paired(runs, second, first, "settlement")
        halves.append(interval(values)[1])
        scatter.append(float(np.std(values, ddof=1)))
    settled = 1e6 * np.array([r["settlement"] for n in ENGINES for r in runs[n].values()])
    mean = float(settled.mean())
    if found:
        verdict = f"**{len(found)} of the nine judged differences are real**: {names_of(found)}."
    else:
        verdict = "**None of the nine judged differences is real.**"
    needed = int(np.ceil((2.8 * max(scatter) / (0.1 * mean)) ** 2))
    return (
        f"{verdict} What the study can see: the 95 % intervals of the settlement's differences "
        f"reach ± {min(halves):.0f} to ± {max(halves):.0f} µm where the beds settle by {mean:.0f} "
        f"µm on average; two engines could differ by {100 * max(halves) / mean:.0f} % unseen. Bed "
        f"by bed they lie {min(scatter):.0f} to {max(scatter):.0f} µm apart (standard deviation of "
        f"the differences); with that it takes some {needed} beds to see a difference of a tenth "
        "(at 5 %, power 0.8)."
    )


def reading_noise(runs: dict[str, dict[int, Row]]) -> str:
    """How far a run strays from itself."""
    values = 1e6 * paired(runs, "liggghts, twin", "liggghts", "settlement")
    if len(values) < 2:
        return "The twin has not been run on two beds yet."
    mine = float(np.std(values, ddof=1))
    theirs = engines_scatter(runs)
    said = (
        f"A run that differs by 10⁻⁹ m in one grain strays by {mine:.0f} µm (standard deviation of "
        f"the difference to its twin, {len(values)} beds), two engines by {theirs:.0f} µm"
    )
    if mine > 0.5 * theirs:
        return f"{said}: most of what lies between two engines lies between two runs of one."
    return f"{said}: more than a run from itself."


def engines_scatter(runs: dict[str, dict[int, Row]]) -> float:
    """Standard deviation of the settlement's differences, mean of the three pairs [µm]."""
    pairs = combinations(ENGINES, 2)
    return float(
        np.mean([1e6 * np.std(paired(runs, b, a, "settlement"), ddof=1) for a, b in pairs])
    )


def reading_settings(runs: dict[str, dict[int, Row]]) -> str:
    """Which setting moves the settlement by more than its interval."""
    told_by, moved, missing = 0, [], []
    for words, way, other in PAIRS[:-1]:
        values = paired(runs, way, other, "settlement")
        if len(values) < 2:
            missing.append(words)
            continue
        told_by += 1
        if real(values):
            moved.append(f"{words} ({told(values, 'settlement')} µm)")
    start = f"Of {told_by} comparisons of one setting at a time"
    text = (
        f"{start} these move the settlement by more than their 95 % interval: {names_of(moved)}."
        if moved
        else f"{start} none moves the settlement by more than its 95 % interval."
    )
    return text + (
        f" Not run, or not credible (see the end): {names_of(missing)}." if missing else ""
    )


def reading_on_the_way(runs: dict[str, dict[int, Row]]) -> str:
    """Which engines differ after three cycles, and what LIGGGHTS' rule does to it."""

    def early(way: str, other: str) -> FloatArray:
        return np.atleast_2d(paired(runs, way, other, "curve"))[:, EARLY]

    found = [
        f"{TITLES[b]} less {TITLES[a]} {told(early(b, a), 'settlement')} µm"
        for a, b in combinations(ENGINES, 2)
        if real(early(b, a))
    ]
    if not found:
        return f"After {EARLY} cycles too the engines agree within their intervals."
    same = told(early("lammps, mindlin", "liggghts"), "settlement")
    rule = told(early("lammps, mindlin", "lammps"), "settlement")
    half = told(early("liggghts, half the step", "liggghts"), "settlement")
    twin = told(early("liggghts, twin", "liggghts"), "settlement")
    return (
        f"After {EARLY} cycles, before chaos covers it, there are differences: {names_of(found)}. "
        f"LAMMPS under LIGGGHTS' tangential rule differs from LIGGGHTS by {same} µm, and from "
        f"LAMMPS under the paper's rule by {rule} µm: if one setting closes the gap, it is the "
        "tangential rule, which alone raises the tangential force of a contact that sticks while "
        f"the piston comes down. But LIGGGHTS at half the step differs from itself by {half} µm, "
        f"its twin by {twin} µm: on so few beds this is a pointer and no proof, and at the end "
        "nothing of it can be seen."
    )
