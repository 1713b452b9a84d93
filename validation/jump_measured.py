"""The controller on the mean curves of full runs: python -m validation.jump_measured [FOLDER]

FOLDER holds runs as ``NAME.npz`` with ``displacement_um`` (cycles + 1, n, 3); without it only the
full run of the repository is taken.  The record is replaced by its old rows and the new ones.
"""

from __future__ import annotations

import csv
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from adapters.jump_band import band_of
from adapters.jump_control import Settings
from adapters.state import FloatArray
from validation.jump_curves import Measured, play
from validation.jump_study import HEALING, RECORD, record_read

CONTROL = RECORD.with_name("settlement-karrech.control.csv")
TOLERANCES = (0.02, 0.05, 0.1)
K_I = 50


def curves(folder: Path | None) -> Iterator[tuple[str, FloatArray]]:
    """Name and settlement [m] after 0, 1, 2, ... cycles of each full run."""
    with CONTROL.open(encoding="utf-8") as stream:
        rows = [float(row["settlement"]) for row in csv.DictReader(stream)]
    yield "karrech, the repository's", np.array([0.0, *rows])
    for path in sorted(folder.glob("*.npz")) if folder is not None else ():
        with np.load(path) as data:
            yield path.stem, -1e-6 * data["displacement_um"][:, :, 2].mean(axis=1, dtype=float)


def rows_of(folder: Path | None) -> Iterator[dict[str, Any]]:
    """A row for each full run and tolerance."""
    for name, path in curves(folder):
        for tolerance in TOLERANCES:
            run = play(Measured(path), K_I, Settings(tolerance, HEALING, len(path) - 1, True))
            band = band_of(run.decisions[-1].cycle, run.settlement, run.checks)
            yield {
                "group": "measured",
                "run": name,
                "tolerance": tolerance,
                "total": len(path) - 1,
                "computed": run.computed,
                "jumps": len(run.errors),
                "within": int((run.errors <= tolerance).sum()),
                "worst": float(f"{run.errors.max(initial=0.0):.4g}"),
                "taken_back": len(run.taken_back),
                "error": float(f"{run.settlement / run.truth - 1:.4g}"),
                "inside": bool(band.low <= run.truth <= band.high),
                "half_width": float(f"{(band.high - band.low) / 2 / run.truth:.4g}"),
            }


def main() -> None:
    """Put the rows in the record."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else None
    rows = [row for row in record_read() if row["group"] != "measured"] + list(rows_of(folder))
    text = "\n".join(json.dumps(row, separators=(",", ":")) for row in rows)
    RECORD.write_text(text + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
