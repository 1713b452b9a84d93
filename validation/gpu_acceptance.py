"""A GPU's acceptance: is QDEM there what it is on the processor, and how fast?

    python -m validation.gpu_acceptance record.jsonl [--minutes 9]

Needs this checkout, numba with numba-cuda, NumPy and SciPy, and none of the other packages.  Every
stage writes a line of its checks as it ends; one that fails says why, and the next goes on.  None
begins once the minutes are over.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from validation.case import Check
from validation.cases.qdem_gpu import compare_twins, list_stages

Stage = Callable[[], list[Check]]


def describe_card() -> dict[str, str]:
    """What the driver says of the card; empty where there is none."""
    asked = "name,driver_version,memory.total,clocks.max.sm"
    try:
        words = ["nvidia-smi", f"--query-gpu={asked}", "--format=csv,noheader"]
        said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError):
        return {}
    return dict(zip(asked.split(","), (word.strip() for word in said.split(",")), strict=False))


def check_twins() -> list[Check]:
    """Every kernel beside the processor's, in round-off."""
    return [
        Check(f"GPU over CPU kernel: {name}", apart, "<= 1", apart <= 1, "of round-off")
        for name, apart in compare_twins().items()
    ]


def run_stages(stages: dict[str, Stage], record: Path, minutes: float) -> bool:
    """Run the stages one after the other; whether every check of every stage held."""
    begun, held = time.monotonic(), True
    for name, stage in stages.items():
        row: dict[str, Any] = {"stage": name, "card": describe_card()}
        start = time.monotonic()
        if start - begun > 60 * minutes:
            row["skipped"] = "the time was over"
        else:
            try:
                checks = stage()
                row["checks"] = [asdict(check) for check in checks]
                held &= all(check.ok for check in checks)
            except Exception as error:  # the time on a card is short: the next stage goes on
                row["failed"], held = f"{type(error).__name__}: {error}", False
        row["seconds"] = round(time.monotonic() - start, 2)
        with record.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(row) + "\n")
        print(json.dumps(row), flush=True)
    return held


def main() -> int:
    """``python -m validation.gpu_acceptance``; 1 where a check or a stage failed."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("record", type=Path, help="file that a line a stage is added to")
    parser.add_argument("--minutes", type=float, default=9.0, help="after which no stage begins")
    arguments = parser.parse_args()
    stages: dict[str, Stage] = {"twins": check_twins, **list_stages(quick=False)}
    return 0 if run_stages(stages, arguments.record, arguments.minutes) else 1


if __name__ == "__main__":
    raise SystemExit(main())
