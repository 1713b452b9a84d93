"""Run the rivals of the settlement procedure on the coarse bed, and its error budget.

    python -m validation.settlement_rivals_runs --work FOLDER [--minutes M] [--last N]
        [--study coarse|confined|far|partial] [--only rivals|healing|budget|reference]
        [--methods NAME ...] [--packings N ...]
    python -m validation.settlement_rivals_page      docs/settlement-rivals.md and its picture

Writes a line to the record of the study (`validation.settlement_rivals_studies`) as each run ends
and goes on where that ends; after M minutes it begins no further run.  ``healing`` and ``budget``
are those of the coarse bed.  ``reference`` reads the ensemble, from another folder by
``--ensemble``, and needs no engine.  FOLDER may be thrown away.
"""

from __future__ import annotations

import argparse
import json
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np

from adapters.engine import interruptible
from adapters.provenance import commit, machine
from adapters.run_folder import RunFolder
from validation.move_study import rounded
from validation.settlement_ensemble import COARSE, Kind, Piece
from validation.settlement_ensemble_record import RECORD as ENSEMBLE
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_rivals import HEALED, Method, Row, method_run
from validation.settlement_rivals_budget import EVERY, JUMPS, PARTS, PLACE, part_run
from validation.settlement_rivals_reference import LAWS, law_name, law_row, reference_row
from validation.settlement_rivals_studies import STUDIES, Study

PARTS_OF_STUDY = ("reference", "rivals", "healing", "budget")
MEMBERS = range(COARSE.members)
SEEDS = range(1, COARSE.packings + 1)

Key = tuple[str, str, int, int, int]
Planned = tuple[Row, Callable[[], Row]]
"""What a run is, and what fills its row."""


def record_read(path: Path = STUDIES["coarse"].record) -> list[Row]:
    """Rows of the record; a line cut off by a kill is left out."""
    if not path.exists():
        return []
    lines = path.read_text(encoding="utf-8").split("\n")
    return [json.loads(line) for line in lines[:-1] if line]


def key(row: Row) -> Key:
    """What makes a row the same run as another."""
    return row["part"], row["method"], row["seed"], row["member"], row["last"]


def rival_row(
    method: Method, seed: int, member: int, last: int, record: EnsembleRecord, folder: Path
) -> Row:
    """What is kept of a method on a packing; its ``folder`` is not."""
    row = method_run(method, seed, member, last, record, folder)
    shutil.rmtree(folder, ignore_errors=True)
    return row


def plan_rivals(
    work: Path, study: Study, record: EnsembleRecord, last: int, part: str = "rivals"
) -> Iterator[Planned]:
    """Every method on every packing, the first run of all before any second."""
    most, seeds = (
        max(map(study.runs_of, study.methods), default=0),
        range(1, study.kind.packings + 1),
    )
    for member, method, seed in product(range(most), study.methods, seeds):
        if member < study.runs_of(method):
            head = {"part": part, "method": method.name, "seed": seed, "member": member}
            folder = work / f"{method.name.replace(' ', '-').replace('/', '-')}-{seed}-{member}"
            filled = partial(rival_row, method, seed, member, last, record, folder)
            yield head | {"last": last}, filled


def plan_budget(work: Path, record: EnsembleRecord) -> Iterator[Planned]:
    """Every part of a jump and every jump at every place, the first place of all packings before
    any second."""
    for member, part, seed in product(MEMBERS, (*PARTS, *JUMPS), SEEDS):
        head = {"part": "budget", "method": part.name, "seed": seed, "member": member}
        filled = partial(part_run, part, seed, member, record, work / "budget")
        yield head | {"last": PLACE}, filled


def plan_reference(kind: Kind, record: EnsembleRecord, last: int) -> Iterator[Planned]:
    """Every member of the ensemble that has reached ``last``, and laws fitted to its curve."""
    for seed, member in product(range(1, kind.packings + 1), range(kind.members)):
        piece = Piece(kind, seed, member)
        kept = record.kept(piece.name)
        if kept is None or kept.cycle < last:
            continue
        head = {"part": "reference", "method": EVERY, "seed": seed, "member": member}
        yield head | {"last": last}, partial(reference_row, piece, last, record)
        for law, cycles in LAWS:
            if kind.k_i + cycles >= last:  # nothing would be left to predict
                continue
            head = {"part": "law", "method": law_name(law, cycles), "seed": seed}
            filled = partial(law_row, law, cycles, piece, last, record)
            yield head | {"member": member, "last": last}, filled


def chosen(
    plan: Iterator[Planned], methods: Sequence[str] | None, packings: Sequence[int] | None
) -> Iterator[Planned]:
    """Of a plan the runs of these methods on these packings; None: all."""
    for head, fill in plan:
        named = methods is None or head["method"] in methods
        if named and (packings is None or head["seed"] in packings):
            yield head, fill


def go_on(plan: Iterator[Planned], path: Path, minutes: float) -> None:
    """Every run that the record lacks, a line each as it ends, until ``minutes`` are over."""
    began = time.monotonic()
    known = record_read(path)
    path.write_text("".join(json.dumps(row) + "\n" for row in known), encoding="utf-8")
    done = {key(row) for row in known}
    origin = {"commit": commit(), "machine": machine()}
    for head, fill in plan:
        if key(head) in done:
            continue
        if time.monotonic() - began > 60 * minutes:
            return
        row = head | rounded(fill()) | origin
        with path.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(row, separators=(",", ":")) + "\n")
        print(*key(head), row.get("refused", ""), f"{row.get('cpu_s', 0):.0f} CPU s", flush=True)


def main(words: Sequence[str] | None = None) -> None:
    """Read the command line and go on."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--work", type=Path, required=True, help="folder for the engine's files")
    parser.add_argument("--minutes", type=float, default=np.inf, help="begin no run after these")
    parser.add_argument("--last", type=int, help="cycle to compare at (default: the study's)")
    parser.add_argument("--study", choices=STUDIES, default=COARSE.name)
    parser.add_argument("--only", nargs="+", choices=PARTS_OF_STUDY, default=PARTS_OF_STUDY)
    parser.add_argument("--methods", nargs="+", help="only these")
    parser.add_argument("--packings", nargs="+", type=int, help="only these")
    parser.add_argument("--record", type=Path, help="default: that of the study")
    parser.add_argument("--ensemble", type=Path, default=ENSEMBLE, help="the ensemble's record")
    given = parser.parse_args(words)
    record, study = EnsembleRecord(given.ensemble), STUDIES[given.study]
    path, last = given.record or study.record, given.last or study.last
    with interruptible(), RunFolder(given.work).locked():
        coarse = given.study == COARSE.name
        healed = replace(study, methods=HEALED if coarse else ())
        plans = {
            "reference": plan_reference(study.kind, record, last),
            "rivals": plan_rivals(given.work, study, record, last),
            "healing": plan_rivals(given.work, healed, record, last, "healing"),
            "budget": plan_budget(given.work, record) if coarse else iter(()),
        }
        for part in given.only:
            go_on(chosen(plans[part], given.methods, given.packings), path, given.minutes)


if __name__ == "__main__":
    main()
