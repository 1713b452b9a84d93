"""The page docs/engines.md and its figure, from the record."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from validation.figure import draw_figure
from validation.studies.engines.bars import check_bars
from validation.studies.engines.packing import CYCLES, SEEDS, WAYS
from validation.studies.engines.reading import (
    ENGINES,
    FAST,
    FIGURES,
    JUDGED,
    LEVEL,
    TITLES,
    TWIN,
    excludes_zero,
    find_median_speed,
    format_mean,
    group_by_way,
    pair,
)
from validation.study import describe_commits, estimate_mean, format_table, summarise_bars

Row = dict[str, Any]
COLOURS = {"liggghts": "#0072B2", "lammps": "#E69F00", "yade": "#009E73"}
"""Told apart by colour-blind readers too (Okabe and Ito)."""
EARLY = 3
"""Cycles after which the runs have not strayed far."""
SHOWN = [*((f"{TITLES[b]} less {TITLES[a]}", b, a) for a, b in combinations(ENGINES, 2)), TWIN]


def tabulate_engines(runs: dict[str, dict[int, Row]]) -> str:
    """Means over the beds, a line for each engine."""
    lines = []
    for name in ENGINES:
        found = list(runs[name].values())
        cells = [format_mean(np.array([row[k] for row in found]), k, signed=False) for k in FIGURES]
        cpu = float(np.median([row["engine_cpu_s"] for row in found]))
        lines.append([TITLES[name], *cells, str(len(found)), f"{cpu:.0f}"])
    words = [words for words, _, _ in FIGURES.values()]
    return format_table(["engine", *words, "beds", "CPU s a run"], lines)


def tabulate_differences(runs: dict[str, dict[int, Row]]) -> str:
    """Engine against engine and the twin, bold where the protocol calls it real."""
    lines = []
    for words, way, other in SHOWN:
        cells = []
        for key in JUDGED:
            values = pair(runs, way, other, key)
            text = format_mean(values, key)
            cells.append(f"**{text}**" if excludes_zero(values, LEVEL) else text)
        early = pair(runs, way, other, "curve")[:, EARLY]
        text = format_mean(early, "settlement")
        cells.append(f"**{text}**" if excludes_zero(early) else text)
        lines.append([words, *cells, str(len(early))])
    head = ["difference", *(FIGURES[key][0] for key in JUDGED)]
    return format_table([*head, f"settlement after {EARLY} cycles, µm", "beds"], lines)


def tabulate_fast(runs: dict[str, dict[int, Row]]) -> str:
    """What twice the time step changes on each engine, over the mean of the usual step [%]."""
    lines = []
    for engine in ENGINES:
        cells = []
        for key in FAST:
            values = pair(runs, f"{engine}, fast", engine, key)
            whole = np.mean([row[key] for row in runs[engine].values() if key in row])
            mean, half = 100 * np.array(estimate_mean(values / whole))
            text = f"{mean:+.0f} ± {half:.0f} %"
            cells.append(f"**{text}**" if excludes_zero(values) else text)
        cost = [runs[f"{engine}, fast"][s]["engine_cpu_s"] / runs[engine][s]["engine_cpu_s"]
                for s in sorted(runs[engine].keys() & runs[f"{engine}, fast"].keys())]  # fmt: skip
        lines.append([TITLES[engine], *cells, f"{np.median(cost):.2f}", str(len(cost))])
    head = ["engine", "settlement", "stiffness", "energy lost a cycle", "cost", "beds"]
    return format_table(head, lines)


def describe_resolution(runs: dict[str, dict[int, Row]]) -> str:
    """How small a difference the study can see, and how far a run strays from itself."""
    apart = [1e6 * pair(runs, b, a, "settlement") for a, b in combinations(ENGINES, 2)]
    halves = [estimate_mean(values)[1] for values in apart]
    scatter = [float(np.std(values, ddof=1)) for values in apart]
    settled = [row["settlement"] for name in ENGINES for row in runs[name].values()]
    mean = 1e6 * float(np.mean(settled))
    twin = float(np.std(1e6 * pair(runs, "liggghts, twin", "liggghts", "settlement"), ddof=1))
    needed = int(np.ceil((2.8 * max(scatter) / (0.1 * mean)) ** 2))
    return (
        f"the 95 % intervals of the settlement's differences reach ± {min(halves):.0f} to "
        f"± {max(halves):.0f} µm where the beds settle by {mean:.0f} µm: two engines could differ "
        f"by {100 * max(halves) / mean:.0f} % unseen, and it would take some {needed} beds to see "
        f"a tenth (at 5 %, power 0.8). A run that differs by 10⁻⁹ m in one grain strays by "
        f"{twin:.0f} µm (standard deviation), two engines by {np.mean(scatter):.0f} µm: most of "
        "what lies between two engines lies between two runs of one"
    )


def tabulate_speed(rows: Sequence[Row]) -> str:
    """Speeds on the settled bed."""
    lines = []
    for engine in ENGINES:
        for grains in sorted({row["grains"] for row in rows if "speed" in row}):
            middle, least, most = find_median_speed(rows, engine, grains)
            beside = middle / find_median_speed(rows, "lammps", grains)[0]
            mine = [r for r in rows if r.get("speed") == engine and r["grains"] == grains]
            start = float(np.median([row["start_up_s"] for row in mine]))
            lines.append([
                TITLES[engine], f"{grains:,}",
                f"{middle / 1e6:.2f} ({least / 1e6:.2f} to {most / 1e6:.2f})", f"{beside:.2f}",
                f"{1e6 * grains / middle:,.0f}", f"{start:.2f}", str(len(mine)),
            ])  # fmt: skip
    head = [
        "engine", "grains", "10⁶ grain-steps a CPU second", "LAMMPS = 1", "µs a step",
        "start-up, s", "runs",
    ]  # fmt: skip
    return format_table(head, lines)


def describe_runs(rows: Sequence[Row]) -> str:
    """How many of the planned runs are made and failed."""
    made = [row for row in rows if "way" in row]
    spent = sum(row.get("engine_cpu_s", 0.0) for row in made) / 60
    failed = sum(not row["ok"] for row in made)
    return (
        f"{len(made)} of {len(WAYS) * len(SEEDS)} planned packings ({spent:.0f} CPU minutes); "
        f"{failed or 'none'} failed."
    )


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    runs = group_by_way(rows)
    real = sum(
        excludes_zero(pair(runs, b, a, key), LEVEL)
        for a, b in combinations(ENGINES, 2)
        for key in JUDGED
    )
    packing = next(row for row in rows if "way" in row)
    fastest = find_median_speed(rows, "liggghts", 9999)[0]
    slower = {name: fastest / find_median_speed(rows, name, 9999)[0] for name in ("lammps", "yade")}
    return {
        "GRAINS": str(packing["grains"]),
        "STEPS": f"{packing['steps_per_cycle']:,}",
        "BEDS": str(len(SEEDS)),
        "CYCLES": str(CYCLES),
        "TABLE_ENGINES": tabulate_engines(runs),
        "TABLE_FAST": tabulate_fast(runs),
        "TABLE_DIFFERENCES": tabulate_differences(runs),
        "REAL": "None of the nine" if not real else f"{real} of the nine",
        "FASTER": f"{slower['lammps']:.1f}",
        "YADE_FASTER": f"{slower['yade']:.0f}",
        "RESOLUTION": describe_resolution(runs),
        "TABLE_SPEED": tabulate_speed(rows),
        "CYCLE_MINUTES": f"{37_200 * 1e6 / fastest / 128 / 60:.1f}",
        "BARS": summarise_bars(check_bars(rows)),
        "RUNS": describe_runs(rows),
        "ORIGIN": f"{rows[0]['origin']['machine']}; "
        f"{', '.join(dict.fromkeys(row['engine'] for row in rows))}; commits "
        f"{describe_commits(row['origin']['commit'] for row in rows)}.",
    }


def draw(rows: Sequence[Row], picture: Path) -> None:
    """Settlement curves of the engines, differences bed by bed, and speeds."""
    runs = group_by_way(rows)

    def draw_panels(figure: Any) -> None:
        left, middle, right = figure.subplots(1, 3, width_ratios=(3, 3, 2))
        cycles = np.arange(CYCLES + 1)
        for name in ENGINES:
            curves = 1e6 * np.array([row["curve"] for row in runs[name].values()])
            mean, half = np.array([estimate_mean(column) for column in curves.T]).T
            left.plot(cycles, mean, color=COLOURS[name], label=TITLES[name])
            left.fill_between(
                cycles, mean - half, mean + half, color=COLOURS[name], alpha=0.15, lw=0
            )
            speeds = [find_median_speed(rows, name, grains)[0] / 1e6 for grains in (1111, 9999)]
            right.plot((1111, 9999), speeds, "o-", color=COLOURS[name])
        left.set(xlabel="load cycle", ylabel="settlement [µm]", title="mean of the beds, 95 %")
        left.legend(frameon=False)
        for height, (_, way, other) in enumerate(SHOWN):
            values = 1e6 * pair(runs, way, other, "settlement")
            mean, half = estimate_mean(values)
            middle.plot(values, np.full(len(values), -height), ".", color="0.7", ms=4)
            middle.errorbar(mean, -height, xerr=half, fmt="o", color="k", capsize=3, ms=4)
        middle.axvline(0, color="0.5", lw=0.8)
        middle.set_yticks(-np.arange(len(SHOWN)), [words for words, _, _ in SHOWN], fontsize=7)
        middle.set(xlabel="difference in settlement [µm]", title="bed by bed, mean and 95 %")
        right.set(xscale="log", yscale="log", xlabel="grains", title="10⁶ grain-steps a CPU second")

    draw_figure((13, 4), draw_panels, picture)
