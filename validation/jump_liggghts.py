"""Jumps by tolerance on LIGGGHTS beside full runs of the same seeds: tables of the page.

`validation.jump_runs` makes the record.  A full run tells what the bed would have gained, its own
bursts included; it parts from the run that jumps by chaos, too.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from itertools import takewhile
from typing import Any

import numpy as np
from scipy.stats import binomtest

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


def share_interval(held: Sequence[bool]) -> str:
    """14 of 17 (82 %, 95 % interval 57 to 96 %): Clopper and Pearson's, of independent trials."""
    found = binomtest(sum(held), len(held)).proportion_ci()
    said = share(sum(held), len(held)).removesuffix(")")
    return f"{said}, 95 % interval {100 * found.low:.0f} to {100 * found.high:.0f} %)"


def settlement_of(run: dict[str, Any]) -> float:
    """Settlement at the last cycle of a run of the record [m]."""
    return float(run["rows"][-1][2])


def liggghts_error(run: dict[str, Any], runs: Rows) -> float | None:
    """Against the full run of the same seed; None where that is not there yet."""
    full = full_run(run["seed"], runs)
    return float(settlement_of(run) / full.path[-1] - 1) if full is not None else None


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


def spans(run: dict[str, Any]) -> Iterator[tuple[int, int, float, float]]:
    """Of each jump with the healing cycles behind it, what the tolerance bounds: first and last
    cycle N and N + h + m, what the run gains between them and its settlement behind them [m]."""
    rows = run["rows"]
    for place, row in enumerate(rows):
        if row[1] != "j":
            continue
        begin = rows[place - 1]
        *_, end = (row, *takewhile(lambda one: one[1] == "h", rows[place + 1 :]))
        yield begin[0], end[0], end[2] - begin[2], end[2]


def realised(run: dict[str, Any], runs: Rows) -> list[bool]:
    """Of each jump: whether its gain, healing cycles included, is that of the full run between the
    same cycles, to within the tolerance of what the run has settled behind them; the chaos between
    the two counts as error."""
    full = full_run(run["seed"], runs)
    if full is None:
        return []
    return [
        abs(gained - full.mean(first, last)) <= tolerance_of(run) * abs(settled)
        for first, last, gained, settled in spans(run)
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
        for first, last, *_ in spans(run):
            if first >= COARSE.k_i:
                apart = one.mean(first, last) - other.mean(first, last)
                held.append(bool(abs(apart) <= tolerance_of(run) * abs(one.path[last])))
    return held


def _settlement(piece: Piece, record: EnsembleRecord) -> FloatArray:
    assert piece.packing is not None
    return np.asarray(record.since_rain(piece.packing.name, piece.name)["settlement"])


def ways_within(runs: Rows, within: Callable[[Rows], list[bool]]) -> dict[str, list[bool]]:
    """Of each way by tolerance, what ``within`` says of the jumps of its runs."""
    ways = [way.name for way in jump_runs.STUDY.ways if way.name.startswith("tolerance")]
    return {way: within([run for run in runs if run["way"] == way]) for way in ways}


def jumps_realised(runs: Rows) -> dict[str, list[bool]]:
    """`realised`, by way."""
    return ways_within(runs, lambda these: [one for run in these for one in realised(run, runs)])


def jumps_chaos(runs: Rows, record: EnsembleRecord) -> dict[str, list[bool]]:
    """`chaos_within`, by way."""
    return ways_within(runs, lambda these: chaos_within(these, record))


def ways_told(found: dict[str, list[bool]]) -> str:
    """Shares and their intervals, by way."""
    return " and ".join(f"{share_interval(held)} at {way}" for way, held in found.items())


def liggghts_table(runs: Rows) -> str:
    """Every run of the coarse bed."""
    lines = []
    for run in runs:
        error, band = liggghts_error(run, runs), band_of_record(run)
        full = full_run(run["seed"], runs)
        inside = ""
        if band is not None and full is not None:
            inside = "yes" if band.low <= full.path[-1] <= band.high else "**no**"
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
