"""The study of what a jump moves: ``python -m validation.move_study --work FOLDER``.

    python -m validation.move_study --work FOLDER [--only offline|engine]
    python -m validation.move_study_page      docs/moves.md and its picture

Writes a line to ``validation/results/moves-PART.jsonl`` as each jump is judged, and goes on where
that ends.  ``offline`` asks for TRACKBED_DATA (`move_study_offline`), ``engine`` for LIGGGHTS
(`move_study_engine`; FOLDER keeps its stages, and holds nothing that is needed when all is done).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from adapters.engine import interruptible
from adapters.provenance import commit, machine
from validation.move_study_engine import rows_engine
from validation.move_study_offline import rows_offline

RESULTS = Path(__file__).with_name("results")
PARTS = ("offline", "engine")
Row = dict[str, Any]
Done = set[tuple[Any, ...]]


def record_read(part: str, folder: Path = RESULTS) -> list[Row]:
    """Rows of a part of the record; a line cut off by a kill is left out."""
    path = folder / f"moves-{part}.jsonl"
    if not path.exists():
        return []
    lines = path.read_text(encoding="utf-8").split("\n")
    return [json.loads(line) for line in lines[:-1] if line]


def record_complete(part: str, rows: Callable[[Done], Iterator[Row]], folder: Path) -> None:
    """Append the rows that a part of the record lacks, each as it comes."""
    known = record_read(part, folder)
    path = folder / f"moves-{part}.jsonl"
    path.write_text("".join(json.dumps(row) + "\n" for row in known), encoding="utf-8")
    origin = {"commit": commit(), "machine": machine()}
    for row in rows({(row["run"], tuple(row["jump"]), row["move"]) for row in known}):
        with path.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(rounded(row | origin)) + "\n")
        print(row["run"], row["jump"], row["move"], flush=True)


def rounded(value: Any) -> Any:
    """The same with numbers of six digits: more are noise, and the record stays small."""
    if isinstance(value, dict):
        return {key: rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [rounded(item) for item in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def main(arguments: Sequence[str] | None = None) -> None:
    """Judge what the record lacks."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=Path, required=True, help="folder for the engine's runs")
    parser.add_argument("--only", choices=PARTS)
    parser.add_argument("--record", type=Path, default=RESULTS, help="folder of the record")
    given = parser.parse_args(arguments)
    with interruptible():
        if given.only != "engine":
            record_complete("offline", rows_offline, given.record)
        if given.only != "offline":
            record_complete("engine", lambda done: rows_engine(given.work, done), given.record)


if __name__ == "__main__":
    main()
