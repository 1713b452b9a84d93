"""The record of a run for ``validation/results``: one JSON line for each way to the same bed.

    python -m validation.record RUN --case settlement-karrech --out validation/results

writes ``CASE.jsonl`` (errors and costs from the run's report.json) and the settlement tables
``CASE.run.csv`` and ``CASE.control.csv``, from which the errors can be computed again.
"""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from adapters.errors import UsageError
from adapters.report import report_write
from adapters.run_folder import write_atomically

ERRORS = (
    "settlement_error",
    "coordination_number_error",
    "relative_density_error",
    "elastic_deflection_error",
    "jump_displacement_error",
    "coordinates_error",
)
"""Errors of a `Comparison` that are recorded, a line each."""


def record_lines(report: dict[str, Any], case: str) -> list[dict[str, Any]]:
    """Lines of the record from ``report.json``: error and cost of every way, from one run."""
    provenance, parameters = report["provenance"], report["parameters"]
    procedure = {k: v for k, v in parameters.items() if k.startswith("procedure.")}
    return [
        {
            "case": case,
            "method": row["name"],
            "setting": procedure,
            "seed": parameters["sample.seed"],
            "cycle": report["compared_at"],
            "error": row[kind],
            "error_kind": kind,
            "cost_s": row["cpu_s"],
            "speed_up": row["speed_up"],
            "work": row["computed"],
            "work_unit": "load cycles computed",
            "ok": row[kind] is not None,
            "why": "",
            "commit": provenance.get("commit", ""),
            "command": provenance.get("command", ""),
            "machine": provenance.get("machine", ""),
            "engine": report["engines"],
            "started": provenance.get("started", ""),
        }
        for row in report["error_rows"]
        for kind in ERRORS
    ]


def record_run(run: Path, case: str, out: Path) -> Path:
    """Write the record of ``run`` under ``out``; raises `UsageError` for a run without control."""
    report_write(run)
    report = json.loads((run / "report.json").read_text(encoding="utf-8"))
    if not report["error_rows"]:
        raise UsageError(
            "this run has no control beside it, so its error is not known",
            where=str(run),
            remedy="trackbed run SCENE --control",
        )
    path = out / f"{case}.jsonl"
    lines = (json.dumps(line) for line in record_lines(report, case))
    write_atomically(path, "\n".join(lines) + "\n")
    shutil.copyfile(run / "settlement.csv", out / f"{case}.run.csv")
    shutil.copyfile(run / "control" / "settlement.csv", out / f"{case}.control.csv")
    return path


def main(words: Sequence[str] | None = None) -> None:
    """Read the command line and write the record."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("run", type=Path, help="a run folder with a control")
    parser.add_argument("--case", required=True, help="name of the record")
    parser.add_argument("--out", type=Path, default=Path("validation/results"))
    arguments = parser.parse_args(words)
    print(record_run(arguments.run, arguments.case, arguments.out))


if __name__ == "__main__":
    main()
