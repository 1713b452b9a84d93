"""Compare relaxations: ``python -m validation.relaxation_runs --work FOLDER [--only paper|bed]``.

Writes a line a finished run to ``validation/results/relaxation.jsonl``; a second call goes on
behind the last one.  ``paper``: the jumps of `validation.relaxation_jumps` (three minutes).
``bed``: live beds of the coarse scene in LIGGGHTS, all ways bed by bed (two minutes a bed).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from adapters.engine import interruptible
from adapters.provenance import commit, machine
from adapters.run_folder import RunFolder
from validation.relaxation_beds import SEEDS, LiveBed
from validation.relaxation_jumps import jumps_load
from validation.relaxation_ways import RESUBMITTED, WAYS, bed_row, paper_ways

RECORD = Path(__file__).parent / "results" / "relaxation.jsonl"

Row = dict[str, Any]
KINDS = ("paper", "bed")


def record_read(path: Path = RECORD) -> list[Row]:
    """Rows of the record; none where there is no file."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def key(row: Row) -> tuple[str, str, str]:
    """What makes a row the same run as another."""
    return row["kind"], row["bed"], row["way"]


def paper_rows(work: Path) -> Iterator[tuple[Row, Callable[[], Row]]]:
    """Jumps at paper scale: the head of each row, and what fills it."""
    for jump in jumps_load():
        for way, filled in paper_ways(jump, work):
            yield {"kind": "paper", "bed": jump.name, "way": way}, filled


def bed_rows(work: Path) -> Iterator[tuple[Row, Callable[[], Row]]]:
    """Live beds: the head of each row, and what fills it."""
    for seed in SEEDS:
        bed = LiveBed(seed, work)
        name = f"coarse-{seed}"
        yield {"kind": "bed", "bed": name, "way": "base"}, bed.base
        for way in (RESUBMITTED, *WAYS):
            head = {"kind": "bed", "bed": name, "way": way}
            yield head, lambda bed=bed, way=way: bed_row(bed, way)  # type: ignore[misc]


def go_on(kinds: Sequence[str], work: Path, path: Path = RECORD) -> None:
    """Every run that the record lacks, one line each as it ends."""
    done = {key(row) for row in record_read(path)}
    plans = {"paper": paper_rows, "bed": bed_rows}
    origin = {"commit": commit()[:7], "machine": machine()}
    with interruptible(), RunFolder(work).locked():
        for kind in kinds:
            for head, filled in plans[kind](work):
                if key(head) in done:
                    continue
                row = head | filled() | origin
                with path.open("a", encoding="utf-8") as stream:
                    stream.write(json.dumps(row) + "\n")
                print(*key(row), row.get("refused", ""), flush=True)


def main(words: Sequence[str] | None = None) -> None:
    """Read the command line and go on."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--work", type=Path, required=True, help="folder for the engines' files")
    parser.add_argument("--only", nargs="+", choices=KINDS, default=list(KINDS))
    arguments = parser.parse_args(words)
    arguments.work.mkdir(parents=True, exist_ok=True)
    go_on(arguments.only, arguments.work)


if __name__ == "__main__":
    main()
