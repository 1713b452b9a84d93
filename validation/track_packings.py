"""One bogie on rough rails on several packings of the small track: means, and what they are worth.

    trackbed qdem scenes/track-small.toml --run-folder rough-1
    trackbed qdem scenes/track-small.toml --set track.seed=2 --set track.bed=bed-2.npz \
        --run-folder rough-2                                             (and so on)
    python -m validation.track_packings rough-1 rough-2 rough-3 [--other high-1 high-2 high-3]

``--other``: the same packings at another friction (``--set contact.friction=1.73``), to be compared
one by one.  Writes ``validation/results/track-packings.json`` and
``docs/qdem-track-packings.png``.  A peak is a maximum of a spectrum, smoothed over 20 Hz, that
stands out by twice the scatter of such a spectrum of noise; packings share it where each has one
within 10 Hz.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from scipy.signal import find_peaks

from qdem_fem.mesh_checks import FloatArray
from qdem_fem.output import table_read, write_whole
from qdem_fem.run_folder import machine
from qdem_fem.scene_checks import scene_load
from qdem_fem.spectra import fourier_spectrum, parzen_smoothed
from qdem_fem.track_figures import (
    BANDWIDTH,
    GRAINS,
    HIGHEST,
    SENSORS,
    acceleration_spectrum,
    mobility,
)
from qdem_fem.track_scene import TrackPrepared
from validation.student import interval

ROOT = Path(__file__).parents[1]
PACKINGS = ROOT / "validation" / "results" / "track-packings.json"
PICTURE = ROOT / "docs" / "qdem-track-packings.png"
APART = 8.0
"""Of the frequencies kept in the record [Hz]."""
SILENT = 1e-9
"""Share of the load's greatest amplitude below which it says nothing, as of mobility."""


def scatter(duration: float) -> float:
    """Twice the scatter of a smoothed spectrum of noise of a ``duration`` [s], in dB.

    A window of bandwidth b leaves the power a relative variance of 1/(b T).
    """
    return float(2 * 10 / np.log(10) / np.sqrt(BANDWIDTH * duration))


def peaks_standing_out(frequency: FloatArray, size: FloatArray, least: float) -> list[float]:
    """Frequencies of maxima of an amplitude (k,) with a prominence of ``least`` dB [Hz].

    Where it is nan, as of a silent load, it is unknown: what it rises to beside that is no peak."""
    known = np.isfinite(size)
    level = 20 * np.log10(np.maximum(size, np.max(size[known], initial=0.0) * 1e-12))
    found: list[float] = []
    for part in np.split(np.arange(len(size)), np.flatnonzero(np.diff(known)) + 1):
        if len(part) and known[part[0]]:
            at, _ = find_peaks(level[part], prominence=least)
            found += [float(frequency[i]) for i in part[at]]
    return found


def peaks_shared(each: Sequence[Sequence[float]], within: float = BANDWIDTH / 2) -> list[float]:
    """Means of the peaks of the first packing that all others have ``within`` some Hz, too [Hz]."""
    found = []
    for peak in each[0]:
        near = [min(other, key=lambda f: abs(f - peak)) for other in each if len(other)]
        if len(near) == len(each) and all(abs(f - peak) <= within for f in near):
            found.append(float(np.mean(near)))
    return found


def curves(prepared: TrackPrepared, folder: Path) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Smoothed spectra: the load's [N s], accelerations [m/s], mobility of grains [m/(s N)]."""
    rows, load = table_read(folder / "probes.csv"), prepared.load
    time = rows["time"]
    frequency, spectrum = fourier_spectrum(time, np.interp(time, load.times, load.values[:, 2]))
    seen = frequency <= HIGHEST
    found = {
        "load": (frequency[seen], parzen_smoothed(frequency, np.abs(spectrum), BANDWIDTH)[seen])
    }
    for name in (*SENSORS, *GRAINS):
        up = rows[f"{name}_z"] - rows[f"{name}_z"][0]
        found[name] = (
            acceleration_spectrum(time, up) if name in SENSORS else mobility(time, up, load)
        )
    frequency, size = found["S2"]
    below = np.interp(frequency, *found["load"])
    below = np.where(below <= SILENT * below.max(), np.nan, below)
    return found | {"S2 over load": (frequency, size / below)}


def grain_acceleration(run: dict[str, Any], name: str) -> FloatArray:
    """Smoothed spectrum of the vertical acceleration of a grain [m/s] (Fig. 11b), every `APART` Hz:
    mobility times 2 pi f times load.  Nan where the load is silent."""
    mobility = np.array(run["curves"][name])
    size = 2 * np.pi * APART * np.arange(len(mobility)) * mobility * np.array(run["curves"]["load"])
    return np.where(mobility > 0, size, np.nan)


def packing_facts(folder: Path) -> dict[str, Any]:
    """Figures of one run: `validation.track_bogie.run_facts`, curves, and peaks that stand out."""
    from validation.track_bogie import run_facts

    manifest = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    prepared = scene_load(folder / "scene.toml", manifest["overrides"])
    assert isinstance(prepared, TrackPrepared)
    facts = run_facts(prepared, folder)
    least = scatter(float(prepared.scene.simulation.duration or 0.0))
    found = curves(prepared, folder)
    grid = np.arange(0.0, HIGHEST, APART)
    bogie = manifest["scene"]["track"]["bogie"]
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    return facts | {
        "bogie": bogie,
        "bed": result.get("bed", {}),
        "prominence": least,
        "peaks": {n: peaks_standing_out(f, s, least) for n, (f, s) in found.items()},
        "curves": {
            name: [float(f"{one:.4g}") for one in np.interp(grid, frequency, np.nan_to_num(size))]
            for name, (frequency, size) in found.items()
        },
    }


def near(found: Sequence[float], goal: float) -> float | None:
    """Of some frequencies the one nearest to a goal [Hz], if it is within a tenth of it."""
    best = min(found, key=lambda f: abs(f - goal), default=np.inf)
    return best if abs(best - goal) <= 0.1 * goal else None


def beside_paper(runs: Sequence[dict[str, Any]]) -> list[str]:
    """Rows: what section 4 of the paper found, and what all packings here say."""

    def means(told: Callable[[dict[str, Any]], float]) -> str:
        named = {name: interval([told(run["points"][name]) for run in runs]) for name in points}
        return ", ".join(f"{name} {mean:.2g}" for name, (mean, _) in named.items())

    points = [name for name in runs[0]["points"] if name in GRAINS]
    shared = {name: peaks_shared([run["peaks"][name] for run in runs]) for name in runs[0]["peaks"]}
    last = means(lambda point: 1e6 * point["passages"][-1]["end"])
    lines = [
        "| found in the paper | here |",
        "|---|---|",
        f"| settlement greatest under the rail, B2 | behind both axles [µm]: {last} |",
        "| lateral motion larger than vertical | "
        f"{means(lambda point: point['lateral_over_vertical'])} |",
    ]
    grain = peaks_shared([grain_peaks(run, "B2") for run in runs])
    sought = [
        ("acceleration of S2", shared["S2"], (100, 200, 400, 800)),
        ("acceleration of B2", grain, (100, 200, 320, 400, 800)),
        ("mobility of B2", shared["B2"], (45,)),
    ]
    for what, peaks, goals in sought:
        for goal in goals:
            peak, loads = near(peaks, goal), near(shared["load"], goal)
            here = "none that all share" if peak is None else f"{peak:.0f} Hz"
            if peak is not None and loads is not None:
                here += f"; the load has one at {loads:.0f} Hz"
            lines.append(f"| peak of the {what} near {goal} Hz | {here} |")
    return lines


def grain_peaks(run: dict[str, Any], name: str) -> list[float]:
    """Peaks of a grain's acceleration that stand out [Hz]."""
    size = grain_acceleration(run, name)
    frequency = APART * np.arange(len(size), dtype=np.float64)
    return peaks_standing_out(frequency, size, run["prominence"])


def frictions_text(runs: Sequence[dict[str, Any]], other: Sequence[dict[str, Any]]) -> str:
    """What another friction changes, packing by packing."""
    low, high = runs[0]["friction"], other[0]["friction"]
    lines = [
        f"| quantity [µm] | friction {low:g} | {high:g} | difference | 95 % | less in |",
        "|---|---|---|---|---|---|",
    ]
    measures: dict[str, Callable[[dict[str, Any]], float]] = {
        "settlement of {}, greatest": lambda point: max(p["greatest"] for p in point["passages"]),
        "settlement of {} behind both axles": lambda point: point["passages"][-1]["end"],
        "lateral motion of {}, greatest": lambda point: point["lateral_greatest"],
    }
    for (what, told), name in product(measures.items(), runs[0]["points"]):
        before, after = (
            1e6 * np.array([told(run["points"][name]) for run in those]) for those in (runs, other)
        )
        mean, half = interval(after - before)
        lines.append(
            f"| {what.format(name)} | {before.mean():.3g} | {after.mean():.3g} | {mean:+.3g} | "
            f"± {half:.2g} | {(after < before).sum()} of {len(after)} |"
        )
    return "\n".join([*lines, ""])


def packings_text(record: dict[str, Any]) -> str:
    """Means over packings, a row a quantity; below, what another friction changes."""
    runs = list(record["runs"].values())
    first = runs[0]
    count = len(runs)
    lines = [
        f"`{record['command']}`, {record['machine']}, {record['started'][:10]}: {count} "
        f"packing{'s' * (count > 1)}, friction {first['friction']:g}, the bogie from "
        f"{first['bogie']['lead']:g} m before the sleeper to as far behind; one rough rail and its "
        "wheels for all.",
        "",
        f"| quantity | {' | '.join('packing ' + str(run['seed']) for run in runs)} | mean | 95 % |",
        f"|---|{count * '---|'}---|---|",
    ]

    def row(what: str, values: Sequence[float], form: str = ".3g") -> None:
        mean, half = interval(values)
        cells = " | ".join(f"{one:{form}}" for one in values)
        worth = "" if np.isnan(half) else f"± {half:.2g}"
        lines.append(f"| {what} | {cells} | {mean:{form}} | {worth} |")

    for name in first["points"]:
        for number, axle in enumerate(("first", "second")):
            for key, word in (("greatest", "greatest"), ("end", "behind it")):
                values = [1e6 * run["points"][name]["passages"][number][key] for run in runs]
                row(f"settlement of {name}, {axle} axle, {word} [µm]", values)
        row(f"lateral over vertical motion of {name}, greatest",
            [run["points"][name]["lateral_over_vertical"] for run in runs], ".2g")  # fmt: skip
    row("missing in the account of energies",
        [run["energy"]["relative_imbalance"] for run in runs], ".1e")  # fmt: skip
    row("processor time [s]", [run["cost"]["cpu_s"] for run in runs], ".0f")
    if all("creep" in run["bed"] for run in runs):
        row("creep of the bed without the load", [run["bed"]["creep"] for run in runs], ".1e")

    def told(found: Sequence[float]) -> str:
        return ", ".join(f"{one:.0f}" for one in found) or "none"

    lines += [
        "",
        f"Peaks below {HIGHEST:g} Hz that stand out by {first['prominence']:.1f} dB or more [Hz]:",
        "",
        f"| spectrum | {' | '.join('packing ' + str(run['seed']) for run in runs)} | shared |",
        f"|---|{count * '---|'}---|",
    ]
    for name in first["peaks"]:
        each = [run["peaks"][name] for run in runs]
        shared = told(peaks_shared(each)) if count > 1 else ""
        what = f"mobility of {name}" if name in GRAINS else name
        lines.append(f"| {what} | {' | '.join(told(one) for one in each)} | {shared} |")
    for name in (name for name in first["peaks"] if name in GRAINS):
        each = [grain_peaks(run, name) for run in runs]
        shared = told(peaks_shared(each)) if count > 1 else ""
        lines.append(
            f"| acceleration of {name} | {' | '.join(told(one) for one in each)} | {shared} |"
        )
    lines += ["", "A peak is near where it is within a tenth:", "", *beside_paper(runs)]
    if other := list(record.get("other", {}).values()):
        lines += ["", "The same packings and load at another friction:", ""]
        lines.append(frictions_text(runs, other))
    return "\n".join([*lines, ""])


def picture(path: Path, record: dict[str, Any]) -> None:
    """Spectra of load, sleeper and a grain, a line a packing."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 7), layout="constrained")
    FigureCanvasAgg(figure)
    shown = (("load", "N s"), ("S2", "m/s"), ("S2 over load", "1/kg"), ("B2", "m/(s N)"))
    for axes, (name, unit) in zip(figure.subplots(2, 2).flat, shown, strict=True):
        for run in record["runs"].values():
            size = np.array(run["curves"][name])
            axes.semilogy(
                APART * np.arange(len(size)), size, lw=0.9, label=f"packing {run['seed']}"
            )
        kind = {"load": "", "S2": ", acceleration", "B2": ", mobility"}.get(name, "")
        axes.set(xlabel="frequency [Hz]", ylabel=f"[{unit}]", title=name + kind)
        axes.legend(fontsize=7)
    figure.savefig(path, dpi=110, metadata={"Software": None})


def main() -> None:
    """Read the runs, write the record and the picture."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("run", type=Path, nargs="+")
    parser.add_argument("--other", type=Path, nargs="+", default=[])
    arguments = parser.parse_args()
    runs, other = arguments.run, arguments.other
    words = [path.name for path in runs] + ["--other"] * bool(other) + [p.name for p in other]
    record: dict[str, Any] = {
        "command": "python -m validation.track_packings " + " ".join(words),
        "machine": machine(),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "runs": {path.name: packing_facts(path) for path in runs},
    }
    if other:
        record["other"] = {path.name: packing_facts(path) for path in other}
        here, there = ([run["seed"] for run in record[key].values()] for key in ("runs", "other"))
        if here != there:
            parser.error(f"packings are compared one by one: seeds {here} and {there} differ")
    write_whole(PACKINGS, json.dumps(record, indent=1) + "\n")
    picture(PICTURE, record)


if __name__ == "__main__":
    main()
