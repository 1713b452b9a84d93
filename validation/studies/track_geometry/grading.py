"""Lines on beds of two gradings: D1 against axles, with the interval that their packings leave.

    trackbed sweep bed.toml --set 'sample.grading="AREMA 4"' --seeds 12 --into arema
    python -m validation.studies.track_geometry.grading arema

The second line keeps the readings of a sweep as ``arema.csv`` here, a column a packing; ``en`` is
the other.  Those that are here are of 29 November 2026, LIGGGHTS-PUBLIC 3.8.0.
"""

from __future__ import annotations

import csv
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from track_line.laws import SEAT_AREA
from track_line.measured import BedFit, fit_beds, format_settings, read_beds
from track_line.measured.ensemble import Ensemble
from track_line.scene.file import build_line, load_scene
from track_line.settling import march_line, start_line
from trackbed.scenes import find_scene_file

HERE = Path(__file__).parent
GRADINGS = {"EN 13450 31.5/50": "en.csv", "AREMA 4": "arema.csv"}
FORCE = 102e3 * SEAT_AREA
"""Of half a sleeper on the beds of ``bed.toml`` [N]."""
AXLES, LINES, FEWER = 1e5, 10, 1  # of all beds, and without one
TONNAGE = 0.01, 2.0
"""At 500 axles of 20 t, where the beds end, and at the end of the line [MGT]."""


def keep_readings(sweep: Path) -> None:
    """Write the readings of a sweep's beds [mm], those of computed cycles, as a table here."""
    with (sweep / "settlement.csv").open() as stream:
        rows = [row for row in csv.DictReader(stream) if row["kind"] == "computed"]
    beds = list(dict.fromkeys(row["member"] for row in rows))
    found = {(row["cycle"], row["member"]): row["loaded_body_settlement"] for row in rows}
    with (HERE / f"{sweep.name}.csv").open("w", newline="") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(["cycle", *(f"seed {bed.split('seed=')[1].split('-')[0]} [mm]"
                                   for bed in beds)])  # fmt: skip
        for cycle in sorted({row["cycle"] for row in rows}, key=float):
            cells = (found.get((cycle, bed)) for bed in beds)
            table.writerow([cycle, *(f"{1e3 * float(one):.6g}" if one else "" for one in cells)])


def settle_line(beds: Ensemble, law: str | None, lines: int) -> tuple[BedFit, Any, Any]:
    """What the beds say by a law, or the best; tonnage (k,) [MGT] and D1 (3, k) [m], low, median
    and high of all sections of so many ``lines`` of the shipped scene."""
    fit = fit_beds(beds, law)
    sets = [*format_settings(fit), f"line.axles={AXLES}", f"law.parameters.force={FORCE}"]
    line = build_line(load_scene(find_scene_file("line"), sets), lines)
    records = [record for _, record in march_line(line, start_line(line), AXLES)]
    tonnage = line.find_tonnage(np.array([one.cycle for one in records]))
    d1 = np.array([one.deviation for one in records])
    return fit, tonnage, np.quantile(d1, (0.05, 0.5, 0.95), axis=(1, 2))


def measure_grading(name: str) -> dict[str, Any]:
    """The line on the beds of a grading, and ln D1 [m] at each of `TONNAGE` without each bed."""
    beds, left = read_beds(HERE / GRADINGS[name]), []
    fit, tonnage, d1 = settle_line(beds, None, LINES)
    law = None if fit.law is None else fit.law.name
    for which in range(len(beds.names)):
        parts = ("settled", "packing", "pressure", "bedding", "names")
        kept = {part: np.delete(getattr(beds, part), which, axis=0) for part in parts}
        _, places, found = settle_line(replace(beds, **kept), law, FEWER)
        left.append(np.log(np.interp(TONNAGE, places, found[1])).tolist())
    return {
        "grading": name, "beds": len(beds.names), "law": law, "variation": vars(fit.total),
        "gain": float((beds.settled[:, -1] - beds.settled[:, 0]).mean()),
        "persistence": vars(fit.persistence[0]), "tonnage": tonnage.tolist(), "d1": d1.tolist(),
        "left": left,
    }  # fmt: skip


if __name__ == "__main__":
    keep_readings(Path(sys.argv[1]))
