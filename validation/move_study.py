"""The study of what a jump moves: ``python -m validation.move_study --work FOLDER``.

    python -m validation.move_study --work FOLDER [--only offline|engine]
    python -m validation.move_study_page      docs/moves.md and its picture

Writes a line to ``validation/results/moves.jsonl`` as each jump is judged, and goes on where that
ends.  ``offline`` asks for TRACKBED_DATA (`move_study_offline`), ``engine`` for LIGGGHTS
(`move_study_engine`).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

from adapters.engine import interruptible
from adapters.provenance import commit, machine
from validation.move_study_engine import rows_engine
from validation.move_study_offline import rows_offline

RECORD = Path(__file__).with_name("results") / "moves.jsonl"
Row = dict[str, Any]


def record_read(path: Path = RECORD) -> list[Row]:
    """Rows of the record; a line cut off by a kill is left out."""
    if not path.exists():
        return []
    lines = path.read_text(encoding="utf-8").split("\n")
    return [json.loads(line) for line in lines[:-1] if line]


def record_append(rows: Iterator[Row], path: Path) -> None:
    """Write each row as it comes; a line that a kill cut off is dropped first."""
    whole = "".join(json.dumps(row) + "\n" for row in record_read(path))
    path.write_text(whole, encoding="utf-8")
    origin = {"commit": commit(), "machine": machine()}
    for row in rows:
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
    parser.add_argument("--only", choices=("offline", "engine"))
    parser.add_argument("--record", type=Path, default=RECORD)
    given = parser.parse_args(arguments)
    done = {(row["run"], tuple(row["jump"]), row["move"]) for row in record_read(given.record)}
    parts = []
    if given.only != "engine":
        parts.append(rows_offline(done))
    if given.only != "offline":
        parts.append(rows_engine(given.work, done))
    with interruptible():
        record_append(chain.from_iterable(parts), given.record)


if __name__ == "__main__":
    main()
