"""docs/engines.md and its plot, from validation/results/same-packing.jsonl and yade.json.

python -m validation.same_packing_page
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from adapters.run_folder import write_atomically
from validation.page_text import page_filled
from validation.same_packing import CYCLES, SEEDS, WAYS
from validation.same_packing_reading import (
    ENGINES,
    FIGURES,
    JUDGED,
    LEVEL,
    PAIRS,
    TITLES,
    by_way,
    paired,
    reading_engines,
    reading_noise,
    reading_on_the_way,
    reading_settings,
    real,
    told,
)
from validation.same_packing_runs import Row, record_read
from validation.student import interval
from validation.tangential_rules import (
    LOOPS,
    force_incremental,
    force_rescaled,
    force_secant,
    path,
    work,
)
from validation.yade_page import rows_yade, share_told, yade_read

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "engines.md"
PLOT = ROOT / "docs" / "engines.png"
TEXT = Path(__file__).parent / "same_packing_page.md"

ON_THE_WAY = (1, 3, 5, 10, 20, 50)
"""Cycles at which the curves are compared."""

COLOURS = {"liggghts": "#0072B2", "lammps": "#E69F00", "yade": "#009E73"}
"""Told apart by colour-blind readers too (Okabe and Ito)."""


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(row) + " |" for row in rows)])


def table_engines(runs: dict[str, dict[int, Row]]) -> str:
    """Means over the beds, a line for each engine."""
    words = [words for words, _, _ in FIGURES.values()]
    rows = []
    for name in ENGINES:
        found = list(runs[name].values())
        cells = [told(np.array([row[key] for row in found]), key, signed=False) for key in FIGURES]
        cpu = float(np.median([row["cpu_s"] for row in found])) if found else float("nan")
        rows.append([TITLES[name], *cells, str(len(found)), f"{cpu:.0f}"])
    return table(["engine", *words, "beds", "CPU s a run"], rows)


def table_differences(runs: dict[str, dict[int, Row]]) -> str:
    """Engine against engine on the same beds; bold where the protocol calls it real."""
    rows = []
    for first, second in combinations(ENGINES, 2):
        cells = []
        for key in FIGURES:
            values = paired(runs, second, first, key)
            text = told(values, key)
            marked = key in JUDGED and real(values, LEVEL)
            cells.append(f"**{text}**" if marked else text)
        rows.append([f"{TITLES[second]} less {TITLES[first]}", *cells])
    return table(["difference", *(words for words, _, _ in FIGURES.values())], rows)


def table_settings(runs: dict[str, dict[int, Row]]) -> str:
    """One setting at a time; bold where 95 % leaves out zero."""
    rows = []
    for words, way, other in PAIRS:
        cells = []
        for key in FIGURES:
            values = paired(runs, way, other, key)
            text = told(values, key)
            cells.append(f"**{text}**" if len(values) > 1 and real(values) else text)
        beds = len(runs[way].keys() & runs[other].keys())
        rows.append([words, f"{way} less {other}", *cells, str(beds)])
    head = ["what changes", "difference", *(words for words, _, _ in FIGURES.values()), "beds"]
    return table(head, rows)


def table_on_the_way(runs: dict[str, dict[int, Row]]) -> str:
    """Differences of the settlement after fewer cycles, engines and laws."""
    shown = [(f"{TITLES[b]} less {TITLES[a]}", b, a) for a, b in combinations(ENGINES, 2)]
    shown += PAIRS
    rows = []
    for words, way, other in shown:
        curves = np.atleast_2d(paired(runs, way, other, "curve"))
        if len(curves) < 2:
            continue
        cells = [told(curves[:, cycle], "settlement") for cycle in ON_THE_WAY]
        marked = [
            f"**{cell}**" if real(curves[:, cycle]) else cell
            for cell, cycle in zip(cells, ON_THE_WAY, strict=True)
        ]
        rows.append([words, *marked, str(len(curves))])
    head = ["settlement's difference, µm, after cycle", *map(str, ON_THE_WAY), "beds"]
    return table(head, rows)


def loop_energies() -> dict[str, list[float]]:
    """Energy that each rule loses in the first round of each loop, if negative creates.

    Loops and unit of `validation.cases.contact_law`: normal force 0.25 to 1, k_t ~ F_n^(1/3).
    """
    laws = {"mindlin": force_secant, "mindlin/force": force_incremental, "paper": force_rescaled}
    energies: dict[str, list[float]] = {name: [] for name in laws}
    low, high = 0.25 ** (2 / 3), 1.0
    for loop in LOOPS.values():
        overlap, slip = path([low, 0.0] + loop * [high - low, 1.0], 2000).T
        stiffness = np.sqrt(overlap)
        unit = (1.0 - np.sqrt(low)) / 2
        for name, law in laws.items():
            energies[name].append(work(law(stiffness, slip), slip) / unit)
    return energies


def table_rules(runs: dict[str, dict[int, Row]]) -> str:
    """Energy per loop, and the settlement of the same beds, rule by rule."""
    energies = loop_energies()
    beds = set.intersection(
        *(set(runs[way]) for way in ("lammps", "lammps, mindlin", "lammps, mindlin/force"))
    )
    rows = []
    for name, key, way in (
        ("`mindlin_rescale/force`, the paper's", "paper", "lammps"),
        ("`mindlin`, LIGGGHTS'", "mindlin", "lammps, mindlin"),
        ("`mindlin/force`, YADE's", "mindlin/force", "lammps, mindlin/force"),
    ):
        lost = [f"{energy:+.2f}" if abs(energy) > 5e-3 else "0" for energy in energies[key]]
        values = np.array([runs[way][bed]["settlement"] for bed in sorted(beds)])
        less = [
            "" if way == "lammps" else told(paired(runs, way, "lammps", figure), figure)
            for figure in ("settlement", "settlement_after_first")
        ]
        rows.append([name, *lost, told(values, "settlement", signed=False), *less])
    head = ["rule in LAMMPS", *(f"lost: {name}" for name in LOOPS), "settlement, µm"]
    return table([*head, "less the paper's, µm", "the same, cycles 2 to 50"], rows)


def failures(rows: Sequence[Row]) -> str:
    """Runs that failed, and how many of the plan are there."""
    bad = [
        f"* {row['way']}, seed {row['seed']}: {row['why'].splitlines()[0]}"
        for row in rows
        if not row["ok"]
    ]
    done = f"{len(rows)} of {len(WAYS) * len(SEEDS)} runs of the plan have been made"
    spent = sum(row.get("cpu_s", 0.0) for row in rows) / 60
    first = f"{done} ({spent:.0f} CPU minutes of the engines)"
    return "\n".join([f"{first}; these failed:", "", *bad]) if bad else f"{first}; none failed."


def page(rows: Sequence[Row], yade: dict[str, Any]) -> str:
    """The page of a record."""
    runs = by_way(rows)
    grains = {row["grains"] for row in rows}
    steps = min(row["steps_per_cycle"] for row in rows)
    parts = {
        "GRAINS": ", ".join(map(str, sorted(grains))),
        "STEPS": f"{steps:,}",
        "BEDS": str(len(SEEDS)),
        "CYCLES": str(CYCLES),
        "TABLE_ENGINES": table_engines(runs),
        "TABLE_DIFFERENCES": table_differences(runs),
        "TABLE_SETTINGS": table_settings(runs),
        "TABLE_ON_THE_WAY": table_on_the_way(runs),
        "TABLE_RULES": table_rules(runs),
        "TABLE_YADE": table(["what", "figure", "bar"], rows_yade(yade)),
        "SHARE": share_told(yade),
        "READING_ENGINES": reading_engines(runs),
        "READING_NOISE": reading_noise(runs),
        "READING_SETTINGS": reading_settings(runs),
        "READING_WAY": reading_on_the_way(runs),
        "RUNS": failures(rows),
        "MACHINE": rows[0]["machine"],
        "VERSIONS": ", ".join(dict.fromkeys(row["engine"] for row in rows)),
        "COMMITS": ", ".join(dict.fromkeys(row["commit"][:7] for row in rows)),
    }
    return page_filled(TEXT.read_text(encoding="utf-8"), parts)


def draw(rows: Sequence[Row], target: Path) -> None:
    """Settlement curves of the engines, and differences bed by bed."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    runs = by_way(rows)
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.2), layout="constrained")
    cycles = np.arange(CYCLES + 1)
    for name in ENGINES:
        curves = 1e6 * np.array([row["curve"] for row in runs[name].values()])
        middle, half = np.array([interval(column) for column in curves.T]).T
        left.plot(cycles, middle, color=COLOURS[name], label=TITLES[name])
        left.fill_between(
            cycles, middle - half, middle + half, color=COLOURS[name], alpha=0.15, lw=0
        )
    left.set(xlabel="load cycle", ylabel="settlement [µm]", title="mean of the beds, 95 %")
    left.legend(frameon=False)
    shown = [(f"{TITLES[b]} less {TITLES[a]}", b, a) for a, b in combinations(ENGINES, 2)]
    shown += [(words, way, other) for words, way, other in PAIRS]
    names: list[str] = []
    for words, way, other in shown:
        values = 1e6 * paired(runs, way, other, "settlement")
        if len(values) < 2:
            continue
        height = -len(names)
        names.append(words)
        middle, half = interval(values)
        right.plot(values, np.full(len(values), height), ".", color="0.7", ms=4)
        right.errorbar(middle, height, xerr=half, fmt="o", color="k", capsize=3, ms=4)
    right.axvline(0, color="0.5", lw=0.8)
    right.set_yticks(-np.arange(len(names)), names, fontsize=8)
    right.set(xlabel="difference in settlement [µm]", title="bed by bed, mean and 95 %")
    figure.savefig(target, dpi=130)
    plt.close(figure)


def main() -> None:
    """Write page and plot."""
    rows = record_read()
    write_atomically(PAGE, page(rows, yade_read()))
    draw(rows, PLOT)


if __name__ == "__main__":
    main()
