"""Jumps by tolerance on LIGGGHTS beside full runs of the same seeds: tables of the page.

`validation.jump_runs` makes the record.  A full run tells what the bed would have gained, its own
bursts included; it parts from the run that jumps by chaos, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from adapters.jump_band import band_of
from adapters.jump_control import Settings
from adapters.state import FloatArray
from validation import jump_runs
from validation.jump_curves import Measured
from validation.jump_study import HEALING, oracle
from validation.page_text import table
from validation.settlement_ensemble import COARSE, Piece
from validation.settlement_ensemble_record import EnsembleRecord

Rows = Sequence[dict[str, Any]]


def share(part: int, whole: int) -> str:
    """12 of 13 (92 %)."""
    return f"{part} of {whole} ({100 * part / whole:.0f} %)" if whole else "none"


def settlement_of(run: dict[str, Any]) -> float:
    """Settlement at the last cycle of a run of the record [m]."""
    return float(run["rows"][-1][2])


def liggghts_error(run: dict[str, Any], runs: Rows) -> float | None:
    """Against the full run of the same seed; None where that is not there yet."""
    full = [one for one in runs if one["way"] == "full" and one["seed"] == run["seed"]]
    return settlement_of(run) / settlement_of(full[0]) - 1 if full else None


def band_of_record(run: dict[str, Any]) -> Any:
    """The band of a run with a tolerance; None for another."""
    if not run["decisions"]:
        return None
    held = [check for check in run["checks"] if check["accepted"]]
    return band_of(int(run["rows"][-1][0]), settlement_of(run), held)


def tolerance_of(run: dict[str, Any]) -> float:
    """Of a run by tolerance [-]."""
    return float(run["way"].split()[-1])


def full_run(seed: int, runs: Rows) -> Measured | None:
    """The curve of the full run of a seed; None where that is not there yet."""
    for run in runs:
        if run["way"] == "full" and run["seed"] == seed:
            return Measured(np.array([0.0, *(row[2] for row in run["rows"])]))
    return None


@cache
def oracle_computed(path: tuple[float, ...], tolerance: float) -> int:
    """Cycles of the best schedule of a full run's curve [m], its own gains known."""
    curve = Measured(np.array(path))
    return oracle(curve, Settings(tolerance, HEALING, len(path) - 1, True))


def overspend(run: dict[str, Any], runs: Rows) -> float | None:
    """Cycles computed over the `oracle`'s on the full run of the same seed [-]."""
    full = full_run(run["seed"], runs)
    if full is None:
        return None
    lost = sum(one["lost_cycles"] for one in run["lost"])
    return float((run["computed"] + lost) / oracle_computed(tuple(full.path), tolerance_of(run)))


def realised(run: dict[str, Any], runs: Rows) -> list[bool]:
    """Of each jump: whether its gain is that of the full run between the same cycles, to within the
    tolerance of what the run has settled behind it; the chaos between the two counts as error."""
    full, rows = full_run(run["seed"], runs), run["rows"]
    if full is None:
        return []
    return [
        abs(row[2] - before[2] - full.mean(before[0], row[0])) <= tolerance_of(run) * abs(row[2])
        for before, row in pairwise(rows)
        if row[1] == "j"
    ]


def chaos_within(these: Rows, record: EnsembleRecord) -> list[bool]:
    """The same of two full runs that part by chaos alone, over the jumps of ``these`` runs behind
    k_i of the reference ensemble: its two members, where it has the run's packing."""
    held = []
    for run in these:
        if run["seed"] > COARSE.packings:
            continue
        one, other = (
            Measured(np.array([0.0, *_settlement(Piece(COARSE, run["seed"], member), record)]))
            for member in range(2)
        )
        for before, row in pairwise(run["rows"]):
            if row[1] == "j" and before[0] >= COARSE.k_i:
                apart = one.mean(before[0], row[0]) - other.mean(before[0], row[0])
                held.append(abs(apart) <= tolerance_of(run) * one.path[row[0]])
    return held


def _settlement(piece: Piece, record: EnsembleRecord) -> FloatArray:
    assert piece.packing is not None
    return np.asarray(record.since_rain(piece.packing.name, piece.name)["settlement"])


def chaos_told(runs: Rows, record: EnsembleRecord) -> str:
    """`chaos_within` of the ways by tolerance."""
    found = {
        way.name: chaos_within([run for run in runs if run["way"] == way.name], record)
        for way in jump_runs.STUDY.ways
        if way.name.startswith("tolerance")
    }
    return " and ".join(f"{share(sum(held), len(held))} at {name}" for name, held in found.items())


def liggghts_table(runs: Rows) -> str:
    """Every run of the coarse bed."""
    lines = []
    for run in runs:
        error, band = liggghts_error(run, runs), band_of_record(run)
        full = [one for one in runs if one["way"] == "full" and one["seed"] == run["seed"]]
        inside = ""
        if band is not None and full:
            truth = settlement_of(full[0])
            inside = "yes" if band.low <= truth <= band.high else "**no**"
        lost = sum(one["lost_cycles"] for one in run["lost"])
        lines.append(
            [
                run["way"],
                str(run["seed"]),
                f"{run['computed'] + lost}",
                f"{run['engine_s']:.0f}",
                f"{1e6 * settlement_of(run):.0f}",
                "" if error is None or run["way"] == "full" else f"{100 * error:+.1f} %",
                "" if band is None else observed_within([run]),
                "" if band is None else str(len(run["lost"])),
                "" if band is None else f"{1e6 * band.low:.0f} to {1e6 * band.high:.0f}",
                inside,
                *(["", ""] if band is None else beside_full([run], runs)),
            ]
        )
    head = [
        "way", "seed", "cycles computed", "engine, CPU s", "settlement, µm", "error",
        "observed within", "taken back", "band, µm", "full run inside",
        "as the full run gained", "overspend",
    ]  # fmt: skip
    return table(head, lines)


def observed(runs: Rows) -> tuple[int, int]:
    """Jumps that stand of runs by one tolerance: how many erred by no more than that, and all."""
    tolerance = tolerance_of(runs[0])
    errors = [check["error"] for run in runs for check in run["checks"] if check["accepted"]]
    return sum(abs(error) <= tolerance for error in errors), len(errors)


def observed_within(runs: Rows) -> str:
    """The same in words."""
    return share(*observed(runs))


def beside_full(these: Rows, runs: Rows) -> list[str]:
    """Share of the jumps `realised`, and `overspend`, the median, of runs by one tolerance."""
    held = [one for run in these for one in realised(run, runs)]
    over = [one for run in these if (one := overspend(run, runs)) is not None]
    return [share(sum(held), len(held)), f"{np.median(over):.1f}" if over else ""]


def liggghts_told(runs: Rows) -> str:
    """What the runs say, and what is missing."""
    said = []
    for way in dict.fromkeys(run["way"] for run in runs if run["way"] != "full"):
        these = [run for run in runs if run["way"] == way]
        errors = [e for run in these if (e := liggghts_error(run, runs)) is not None]
        lost = [sum(one["lost_cycles"] for one in run["lost"]) for run in these]
        cycles = np.mean([run["computed"] for run in these]) + np.mean(lost)
        held = ""
        if way.startswith("tolerance"):
            gained, over = beside_full(these, runs)
            held = f"{observed_within(these)} of its jumps observed within, "
            held += f"{gained} gained what the full run did, overspend {over}, "
        spread = f", error {100 * np.mean(errors):+.1f} % on the mean" if errors else ""
        if len(errors) > 1:
            spread += f", {100 * np.std(errors, ddof=1):.1f} % its scatter, "
            spread += f"{100 * np.mean(np.abs(errors)):.1f} % without signs"
        said.append(f"{way}: {held}{cycles:.0f} cycles computed{spread} ({len(these)} seeds)")
    seeds = range(1, jump_runs.STUDY.seeds + 1)
    wanted = {(way.name, seed) for way in jump_runs.STUDY.ways for seed in seeds}
    missing = sorted(wanted - {(run["way"], run["seed"]) for run in runs})
    text = ". ".join(said) + "." if said else ""
    if missing:
        text += " Not run yet: " + ", ".join(f"{way} seed {seed}" for way, seed in missing) + "."
    return text
