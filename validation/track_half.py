"""Half a sleeper under one bogie: what bends, which grains sink, what swings.

    trackbed qdem scenes/track-half.toml --run-folder half
    python -m validation.track_half half

Writes ``validation/results/track-half.json`` and ``docs/qdem-track-half.png``; the page on the
paper's track tells them (`validation.track_paper_page`).
"""

from __future__ import annotations

import argparse
import json
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from qdem_fem.mesh_checks import FloatArray
from qdem_fem.output import table_read, write_whole
from qdem_fem.run_folder import machine
from qdem_fem.track_figures import GRAINS, SENSORS
from validation.page_text import table
from validation.track_packings import APART, packing_facts

ROOT = Path(__file__).parents[1]
RECORD = ROOT / "validation" / "results" / "track-half.json"
PICTURE = ROOT / "docs" / "qdem-track-half.png"
MODES = (200.0, 400.0, 800.0)
"""Of the paper's sleeper [Hz]; a half shows the first and third."""


def bending(folder: Path) -> dict[str, float]:
    """Greatest deflection [m] of the sleeper's end and rail seat below its middle, S1, S2 and S3,
    and the greatest settlement of each [m], since the prepared state."""
    rows = table_read(folder / "probes.csv")
    down: dict[str, FloatArray] = {s: rows[f"{s}_z"][0] - rows[f"{s}_z"] for s in SENSORS}
    found = {f"{name} greatest": float(one.max()) for name, one in down.items()}
    for name in SENSORS[:-1]:
        apart = down[name] - down[SENSORS[-1]]
        found[f"{name} below {SENSORS[-1]}"] = float(apart[np.argmax(np.abs(apart))])
    return found


def half_text(record: dict[str, Any]) -> str:
    """What was measured, a row a quantity."""
    run = record["run"]
    rows = [[f"{what} [µm]", f"{1e6 * value:.3g}"] for what, value in record["bending"].items()]
    for name, point in run["points"].items():
        first, second = point["passages"]
        rows += [
            [f"settlement of {name}, greatest under the first and the second axle [µm]",
             f"{1e6 * first['greatest']:.3g}, {1e6 * second['greatest']:.3g}"],
            [f"settlement of {name} behind them [µm]",
             f"{1e6 * first['end']:.3g}, {1e6 * second['end']:.3g}"],
            [f"lateral over vertical motion of {name}, greatest",
             f"{point['lateral_over_vertical']:.2g}"],
        ]  # fmt: skip
    for name in (*SENSORS, "load", *GRAINS):
        peaks = ", ".join(f"{one:.0f}" for one in run["peaks"][name]) or "none"
        what = {"load": "the load", **{s: f"the acceleration of {s}" for s in SENSORS}}.get(
            name, f"the mobility of {name}"
        )
        rows.append([f"peaks of {what} [Hz]", peaks])
    energy = run["energy"]
    rows += [
        ["missing in the account of energies", f"{energy['relative_imbalance']:.1e}"],
        ["creep of the bed without the load", f"{run['bed']['creep']:.1e}"],
        ["friction, viscosity over the work of load and weight",
         ", ".join(f"{energy[key] / energy['external']:.3f}" for key in ("friction", "viscous"))],
        ["steps, of", f"{run['steps']:,}, {1e6 * run['step']:.3g} µs"],
        ["processor time, one thread", f"{run['cost']['cpu_s']:,.0f} s"],
    ]  # fmt: skip
    return table(["quantity", "measured"], rows)


def picture(path: Path, record: dict[str, Any]) -> None:
    """Spectra of the sleeper's three places, and mobility of the grains under them."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 4), layout="constrained")
    FigureCanvasAgg(figure)
    shown = (("acceleration [m/s]", SENSORS), ("mobility [m/(s N)]", GRAINS[:3]))
    for axes, (what, names) in zip(figure.subplots(1, 2), shown, strict=True):
        for name in names:
            size = np.array(record["run"]["curves"][name])
            axes.semilogy(APART * np.arange(len(size)), size, lw=0.9, label=name)
        axes.set(xlabel="frequency [Hz]", ylabel=what)
        axes.legend(fontsize=8)
    for mode in MODES:
        figure.axes[0].axvline(mode, color="0.8", lw=0.8, zorder=0)
    figure.savefig(path, dpi=110, metadata={"Software": None})


def main() -> None:
    """Read the run, write record and picture."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("run", type=Path)
    folder: Path = parser.parse_args().run
    record = {
        "command": f"python -m validation.track_half {folder.name}",
        "machine": machine(),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "run": packing_facts(folder),
        "bending": bending(folder),
    }
    write_whole(RECORD, json.dumps(record, indent=1) + "\n")
    picture(PICTURE, record)


if __name__ == "__main__":
    main()
