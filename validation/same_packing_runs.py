"""The runs of the study of `validation.same_packing`, one line each in its record.

    python -m validation.same_packing_runs            go on where the record ends (40 CPU minutes)

A run is a line of validation/results/same-packing.jsonl, written when it ends; one that failed
says why, and is not run again.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from adapters.errors import TrackbedError
from adapters.provenance import provenance
from adapters.state import FloatArray
from validation.same_packing import SEEDS, WAYS, Way, rained, run

RECORD = Path(__file__).parent / "results" / "same-packing.jsonl"
BASE = 3
"""Ways at the head of `WAYS` that are run bed by bed."""
FIRST = 5
"""Beds on which all ways are run before any is on the others."""

Row = dict[str, Any]


def record_read(path: Path = RECORD) -> list[Row]:
    """Rows of the record; none where there is no file."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def plan() -> Iterator[tuple[Way, int]]:
    """Every way and seed, in the order in which they are run.

    All ways of the first beds come before the others', so that a study cut short has fewer beds.
    """
    for seeds in (SEEDS[:FIRST], SEEDS[FIRST:]):
        for seed in seeds:
            for way in WAYS[:BASE]:
                yield way, seed
        for way in WAYS[BASE:]:
            for seed in seeds:
                yield way, seed


@cache
def start_of(seed: int) -> tuple[FloatArray, FloatArray]:
    """The rained bed of a seed: positions (n, 3), radii (n,) [m]."""
    with TemporaryDirectory() as temporary:
        return rained(seed, Path(temporary) / "rain")


def row_of(way: Way, seed: int) -> Row:
    """One run as a line of the record."""
    position, radius = start_of(seed)
    row: Row = {"way": way.name, "seed": seed, "ok": True, "why": ""}
    began = time.process_time()
    with TemporaryDirectory() as temporary:
        try:
            figures, cpu_s = run(way, seed, position, radius, Path(temporary))
            row |= asdict(figures) | {"cpu_s": cpu_s}
        except TrackbedError as error:
            row |= {"ok": False, "why": str(error)}
    scene = way.scene(seed)
    row |= {
        "grains": scene.grain_count,
        "time_step": scene.time_step,
        "steps_per_cycle": scene.steps_per_cycle,
        "python_cpu_s": time.process_time() - began,
        "engine": way.made().version(),
    }
    origin = provenance(["python", "-m", "validation.same_packing_runs"])
    return row | {key: origin[key] for key in ("commit", "machine", "command", "started")}


def main(words: Sequence[str] | None = None) -> None:
    """Read the command line and run what the record lacks."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=RECORD)
    out: Path = parser.parse_args(words).out
    done = {(row["way"], row["seed"]) for row in record_read(out)}
    for way, seed in plan():
        if (way.name, seed) in done:
            continue
        row = row_of(way, seed)
        with out.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(row) + "\n")
        print(way.name, seed, row.get("cpu_s"), row["why"], flush=True)


if __name__ == "__main__":
    main()
