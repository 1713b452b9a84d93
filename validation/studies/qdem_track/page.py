"""The page and its figure: spectra by packing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from qdem_fem.report.track import GRAINS
from validation.bench.qdem.checks import describe_checks, describe_origin
from validation.figure import draw_figure
from validation.studies.qdem_track.bars import check_bars
from validation.studies.qdem_track.bogie import APART, FRICTIONS, SEEDS
from validation.study import Row, format_table

TWENTY = {
    "unbalanced force over mean contact force, at rest": "equilibrium, unbalanced",
    "missing in the account of energies, friction 0.577": "friction 0.577: missing",
    "the same, friction 1.73": "friction 1.73: missing",
    "greatest settlement, friction 1.73 over 0.577": "friction 1.73 over 0.577: settlement",
    "greatest lateral motion, the same": "friction 1.73 over 0.577: lateral",
    "way of the sleeper under a slow pulse": "held: way",
    "left of it, down": "held: sunk",
    "left, aside": "held: aside",
    "where nothing holds the sleeper: way": "free: way",
    "and left, down": "free: sunk",
    "and left, aside": "free: aside",
    "resumed run less uninterrupted one": "resumed run",
    "processor seconds a simulated second": "friction 0.577: processor",
}
LEVERS = {
    "contacts = 3 in place of near": "three contacts",
    "mass scaling, elements to 1.2 µs": "mass scaling to 1.2",
    "to 2 µs": "mass scaling to 2",
    "springs of 0.1 of Table 1's": "springs times 0.1",
    "springs of 0.01": "springs times 0.01",
}
TRIED = ("way", "left down", "left aside")
MEASURES = {"first": "greatest at axle 1", "greatest": "greatest", "end": "behind both axles",
            "lateral": "greatest lateral motion"}  # fmt: skip


def describe(rows: Sequence[Row]) -> dict[str, str]:
    """The text for each mark of the page."""
    parts = {row["part"]: row for row in rows}
    checks = {part: check_bars([row]) for part, row in parts.items()}
    runs, levers = [row["run"] for row in rows if "run" in row], []
    for words, name in LEVERS.items():
        found = [check.value for check in checks["twenty"] if check.name.startswith(f"{name}")]
        step, cost, error = found[:3]
        levers.append([words, f"{step:.3g}", f"{cost:.2g}", f"{100 * error:+.2g} %"])
    return {
        "twenty": describe_checks(checks["twenty"], TWENTY),
        "levers": format_table(["what", "step", "processor time", "error of settlement"], levers),
        "packings": describe_packings(runs)
        + "".join(
            f"\n\nRefused, {row['part']}: {row['refused']}." for row in rows if "refused" in row
        ),
        "grains": describe_grains(runs),
        "paper": compare_paper(runs),
        "made": describe_origin(rows),
    }


def describe_packings(runs: Sequence[dict[str, Any]]) -> str:
    """How many runs there are, and bed and sleeper of each [um]."""
    rows = []
    for run in runs:
        trial, one = run["trial"], run["points"]["sleeper"]
        lengths = [trial["way"], trial["sunk"], trial["aside"], *(one[key] for key in MEASURES)]
        rows.append([
            str(run["seed"]), f"{run['friction']:g}", str(len(trial["pulses"])),
            *(f"{1e6 * length:.3g}" for length in lengths),
        ])  # fmt: skip
    head = ["packing", "friction", "pulses before", *TRIED, *MEASURES.values()]
    counted = f"Runs to the end: {len(runs)} of {len(SEEDS) * len(FRICTIONS)}.  Lengths in µm:"
    return f"{counted}\n\n{format_table(head, rows)}\n\n![spectra](qdem-track.png)"


def describe_grains(runs: Sequence[dict[str, Any]]) -> str:
    """Medians and ranges over packings, of sleeper and watched grains [um]."""
    rows = []
    for friction, name in product(FRICTIONS, ("sleeper", *GRAINS)):
        found = [run["points"][name] for run in runs if run["friction"] == friction]
        rows.append([
            f"{friction:g}", name,
            *(describe_spread([1e6 * one[key] for one in found]) for key in MEASURES),
            describe_spread([one["lateral_over_vertical"] for one in found]),
        ])  # fmt: skip
    return format_table(["friction", "point", *MEASURES.values(), "lateral over vertical"], rows)


def describe_spread(values: Sequence[float]) -> str:
    """Median, and in brackets the least and the greatest."""
    middle, least, most = (
        f"{float(f'{one:.2g}'):g}" for one in np.percentile(values, (50, 0, 100))
    )
    return f"{middle} ({least} to {most})"


def compare_paper(runs: Sequence[dict[str, Any]]) -> str:
    """What the paper found, and in how many packings it is so here."""
    low, high = ({run["seed"]: run["points"] for run in runs if run["friction"] == one}
                 for one in FRICTIONS)  # fmt: skip
    both = sorted(low.keys() & high.keys())
    claims: dict[str, Callable[[Any], bool]] = {
        "settlement is greatest under the rail, B2": lambda one: (
            one["B2"]["greatest"] >= max(one[name]["greatest"] for name in ("B1", "B3"))
        ),
        "lateral motion is larger than vertical, B2": lambda one: (
            one["B2"]["lateral_over_vertical"] > 1
        ),
        "ballast goes down suddenly under the first car, B2 by half at axle 1": lambda one: (
            one["B2"]["first"] > 0.5 * one["B2"]["greatest"]
        ),
    }
    rows = [
        [claim, f"{sum(map(holds, low.values()))} of {len(low)}"] for claim, holds in claims.items()
    ]
    for (key, words), name in product(
        {"greatest": "settlement", "lateral": "lateral motion"}.items(), ("sleeper", "B2")
    ):
        less = sum(high[seed][name][key] < low[seed][name][key] for seed in both)
        rows.append([f"the higher friction reduces {words}, {name}", f"{less} of {len(both)}"])
    return format_table(["found in the paper", "packings in which it is so here"], rows)


def draw(rows: Sequence[Row], picture: Path) -> None:
    """Spectra of load, sleeper and a grain, a line a packing, at the friction of Table 1."""
    runs = [row["run"] for row in rows if row.get("run", {}).get("friction") == FRICTIONS[0]]

    def draw_panels(figure: Any) -> None:
        shown = {"load": "load [N s]", "S2": "acceleration of the sleeper, S2 [m/s]",
                 "B2": "mobility of a grain, B2 [m/(s N)]"}  # fmt: skip
        for axes, (name, words) in zip(figure.subplots(1, 3), shown.items(), strict=True):
            for run in runs:
                size = np.array(run["curves"][name])
                at = APART * np.arange(len(size))
                axes.semilogy(at, size, lw=0.9, label=f"packing {run['seed']}")
            axes.set(xlabel="frequency [Hz]", title=words)
        if runs:
            figure.axes[0].legend(fontsize=7)

    draw_figure((12, 3.6), draw_panels, picture)
