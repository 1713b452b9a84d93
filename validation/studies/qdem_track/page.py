"""The page and its figure: spectra of three packings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from validation.bench.qdem.checks import describe_checks, describe_origin, draw_figure
from validation.studies.qdem_track.bars import check_bars
from validation.studies.qdem_track.bogie import APART, FRICTIONS, POINTS, SEEDS
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
    levers = []
    for words, name in LEVERS.items():
        found = [check.value for check in checks["twenty"] if check.name.startswith(f"{name}")]
        step, cost, error = found[:3]
        levers.append([words, f"{step:.3g}", f"{cost:.2g}", f"{100 * error:+.2g} %"])
    return {
        "twenty": describe_checks(checks["twenty"], TWENTY),
        "levers": format_table(["what", "step", "processor time", "error of settlement"], levers),
        "packings": describe_packings([row["run"] for row in rows if "run" in row])
        + "".join(
            f"\n\nRefused, {row['part']}: {row['refused']}." for row in rows if "refused" in row
        ),
        "made": describe_origin(rows),
    }


def describe_packings(runs: Sequence[dict[str, Any]]) -> str:
    """How many runs there are; bed and sleeper of each, and its watched grains [um]."""
    sleepers, grains = [], []
    for run in runs:
        head, trial = [str(run["seed"]), f"{run['friction']:g}"], run["trial"]
        one = run["points"]["sleeper"]
        lengths = [trial["way"], trial["sunk"], trial["aside"], *(one[key] for key in MEASURES)]
        sleepers.append(
            [*head, str(len(trial["pulses"])), *(f"{1e6 * length:.3g}" for length in lengths)]
        )
        for name in POINTS[:-1]:
            one = run["points"][name]
            cells = [f"{1e6 * one[key]:.3g}" for key in MEASURES]
            grains.append([*head, name, *cells, f"{one['lateral_over_vertical']:.2g}"])
    head = ["packing", "friction"]
    tables = [
        format_table([*head, "pulses before", *TRIED, *MEASURES.values()], sleepers),
        format_table([*head, "grain", *MEASURES.values(), "lateral over vertical"], grains),
        "![spectra](qdem-track.png)",
    ]
    counted = f"Runs measured so far: {len(runs)} of {len(SEEDS) * len(FRICTIONS)}.  Lengths in µm:"
    return "\n\n".join([counted, *tables * bool(runs)])


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
