"""Compute the reference ensemble of the settlement study, window by window.

    python -m validation.settlement_ensemble_runs --work FOLDER [--only confined|partial|coarse]
        [--runs NAME ...] [--minutes M]

Goes on where the record (validation/results/settlement-ensemble) ends, with one engine process.  Of
the kind that is asked, or of that with the smallest part done, the run with the fewest cycles is
next, so that an ensemble grows evenly.  Named runs alone (such as ``confined-1-0``) let processes
in several copies of the record share an ensemble.  After M minutes it ends with the window in
progress; a kill loses that window and nothing else.  FOLDER holds nothing that is needed again.
"""

from __future__ import annotations

import argparse
import json
import shutil
import time
from collections.abc import Collection, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from adapters.engine import Engine, EngineStart, engine_named, interruptible
from adapters.errors import EngineFailed, NotConverged, NotCredible, UsageError
from adapters.procedure import scene_record
from adapters.progress import Progress
from adapters.provenance import commit, machine
from adapters.run_folder import Outcome, RunFolder
from adapters.scene import Scene
from adapters.stages import Bed, Run, Variant, compute, prepare
from adapters.state import state_load
from adapters.window import window_load
from validation.settlement_ensemble import KINDS, Kind, Piece, piston_stiffness
from validation.settlement_ensemble_record import (
    RECORD,
    Checkpoint,
    EnsembleRecord,
    Kept,
    digest,
    parts_joined,
    rows_text,
)

NOT_BEGUN = -1
"""Cycles of a packing whose rain of grains has not been computed."""


def scene_digest(scene: Scene) -> str:
    """SHA-256 of all parameters of a scene."""
    return digest(json.dumps(scene_record(scene), sort_keys=True).encode())


@cache
def origin() -> dict[str, str]:
    """Commit and machine of this process; the record itself changes while it runs."""
    return {"commit": commit(), "machine": machine()}


def cycles_done(piece: Piece, record: EnsembleRecord) -> int | None:
    """Cycles of a run so far; None when it is through, failed, or waits for its packing."""
    kept = record.kept(piece.name)
    if kept is not None:
        return None if kept.failed or kept.cycle >= piece.last else kept.cycle
    if piece.packing is None:
        return NOT_BEGUN
    before = record.kept(piece.packing.name)
    return piece.first if before is not None and before.cycle == piece.first else None


def share_done(kind: Kind, record: EnsembleRecord) -> float:
    """Cycles computed over the cycles of all runs of a kind."""
    pieces = list(kind.runs())
    kept = [record.kept(piece.name) for piece in pieces]
    done = sum(k.cycle - p.first for k, p in zip(kept, pieces, strict=True) if k is not None)
    return done / sum(piece.last - piece.first for piece in pieces)


def next_piece(
    kinds: Sequence[Kind], record: EnsembleRecord, names: Collection[str] = ()
) -> Piece | None:
    """The run whose turn it is, of ``names`` where there are any; None when all are through."""
    for kind in sorted(kinds, key=lambda kind: share_done(kind, record)):
        asked = (piece for piece in kind.runs() if not names or piece.name in names)
        found = [(cycles_done(piece, record), piece) for piece in asked]
        waiting = [(cycles, piece) for cycles, piece in found if cycles is not None]
        if waiting:
            return min(waiting, key=lambda pair: pair[0])[1]
    return None


def advance(piece: Piece, record: EnsembleRecord, work: Path) -> Kept:
    """Compute the next window of a run, or its rain of grains, and bank it.

    Raises as the engine and the checks do; `UsageError` when the record was made with another scene
    or engine.
    """
    scene, folder = piece.kind.scene(piece.seed), work / piece.name
    shutil.rmtree(folder, ignore_errors=True)
    run = Run(
        scene, RunFolder(folder), engine_named(scene.engine.name), Variant(), Progress(quiet=True)
    )
    kept = record.kept(piece.name)
    begun = kept if piece.packing is None else kept or record.kept(piece.packing.name)
    try:
        if begun is None:
            return _rain(piece, run, record)
        refuse_other(begun, scene, run.engine)
        return _window(piece, run, record, kept, begun)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def refuse_other(kept: Kept, scene: Scene, engine: Engine) -> None:
    """Raise `UsageError` when a run of the record is not of this scene and engine."""
    for what, old, new in (
        ("scene", kept.scene_sha256, scene_digest(scene)),
        ("engine", kept.engine, engine.version()),
    ):
        if old != new:
            raise UsageError(
                f"the record is of another {what} ({old[:40]}, not {new[:40]})",
                where=kept.checkpoint.file,
                remedy="restore the scene or install that engine; for another reference remove "
                "the run's files",
            )


def _part(outcome: Outcome) -> dict[str, Any]:
    decks = digest(json.dumps(outcome.notes["decks"], sort_keys=True).encode())
    return {
        "cycles": [outcome.first_cycle, outcome.last_cycle],
        **origin(),
        "decks_sha256": decks,
        "ended": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def _outcome(run: Run, name: str) -> Outcome:
    outcome = run.folder.outcome(name)
    assert outcome is not None
    return outcome


def _rain(piece: Piece, run: Run, record: EnsembleRecord) -> Kept:
    bed = prepare(run)
    outcome = _outcome(run, "preparation")
    state = state_load(run.folder.path / "preparation" / "state.npz")
    kept = Kept(
        cycle=0,
        checkpoint=Checkpoint("", "", bed.start.time_step, bed.start.piston_height),
        mean_height=outcome.notes["mean_height"],
        density_height=outcome.notes["density_height"],
        scene_sha256=scene_digest(run.scene),
        engine=run.engine.version(),
        preparation={"figures": outcome.notes["figures"], "cpu_s": outcome.cost["engine"]},
        parts=(_part(outcome),),
    )
    return record.bank(
        piece.name, kept, bed.start.restart.read_bytes(), state.radius, {0: state.position}
    )


def _window(piece: Piece, run: Run, record: EnsembleRecord, kept: Kept | None, begun: Kept) -> Kept:
    """A window of a run that stands at ``begun``: its own record, or its packing's."""
    cycle = begun.cycle
    heights = {"mean_height": begun.mean_height, "density_height": begun.density_height}
    stage = run.folder.begin("preparation")  # of which a window asks these two heights
    run.folder.finish(stage, Outcome("preparation", 0, 0, [], {}, notes=heights))
    restart = run.folder.path / "checkpoint.restart"
    restart.write_bytes(record.restart(begun))
    start = EngineStart(
        restart,
        begun.checkpoint.time_step,
        0,
        begun.checkpoint.piston_height,
        first=cycle == 0,
        perturbation=0.0 if kept else piece.perturbation,
    )
    own = kept or replace(begun, rows=(), states={}, preparation={}, parts=())
    try:
        done = compute(run, Bed(cycle, start), min(piece.kind.window, piece.last - cycle))
    except (EngineFailed, NotCredible, NotConverged) as error:
        if not (isinstance(error, EngineFailed) and error.from_outside):
            record.table_write(piece.name, replace(own, failed=str(error)))
        raise
    name = f"window_{cycle:06d}"
    outcome = _outcome(run, name)
    window = window_load(run.folder.path / name / "states.npz")
    columns = {column: [row[column] for row in outcome.rows] for column in outcome.rows[0]}
    stiffness = piston_stiffness(window.piston, run.scene.steps_per_cycle)
    columns["piston_stiffness"] = stiffness.tolist()
    columns["cpu_s"] = [outcome.cost["engine"] / len(window)] * len(window)
    after = replace(
        own,
        cycle=done.cycle,
        checkpoint=Checkpoint("", "", done.start.time_step, done.start.piston_height),
        parts=parts_joined(own.parts, _part(outcome)),
        rows=own.rows + rows_text(columns),
    )
    marked = [i for i, c in enumerate(window.cycle) if i and int(c) in piece.kind.marks]
    positions = {int(window.cycle[i]): np.ascontiguousarray(window.position[i]) for i in marked}
    return record.bank(piece.name, after, done.start.restart.read_bytes(), window.radius, positions)


def go_on(
    kinds: Sequence[Kind],
    record: EnsembleRecord,
    work: Path,
    minutes: float = np.inf,
    names: Collection[str] = (),
) -> None:
    """Window after window until all runs of ``kinds`` are through, or ``minutes`` are over.

    Of these runs those of ``names`` where there are any; `UsageError` for a name that is no run's.
    """
    known = {piece.name for kind in kinds for piece in kind.runs()}
    if strange := sorted(set(names) - known):
        raise UsageError(
            f"no run of the ensemble is named {', '.join(strange)}",
            where="--runs",
            remedy=f"name some of {', '.join(sorted(known))}",
        )
    began = time.monotonic()
    origin()
    with interruptible(), RunFolder(work).locked():
        record.tidy()
        while time.monotonic() - began < 60 * minutes:
            piece = next_piece(kinds, record, names)
            if piece is None:
                print("all runs are through", flush=True)
                return
            try:
                kept = advance(piece, record, work)
            except (EngineFailed, NotCredible, NotConverged) as error:
                marked = record.kept(piece.name)
                if marked is None or not marked.failed:
                    raise
                print(f"{piece.name} failed: {error}", flush=True)
                continue
            settlement = float(kept.rows[-1].split(",")[1]) if kept.rows else 0.0
            cpu_s = kept.rows[-1].split(",")[-1] if kept.rows else kept.preparation["cpu_s"]
            print(
                f"{piece.name}: cycle {kept.cycle} of {piece.last}, "
                f"settlement {1e6 * settlement:.1f} um, {float(cpu_s):.3g} CPU s",
                flush=True,
            )


def main(words: Sequence[str] | None = None) -> None:
    """Read the command line and go on."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--work", type=Path, required=True, help="folder for the engine's files")
    parser.add_argument("--only", nargs="+", choices=KINDS, default=list(KINDS))
    parser.add_argument("--runs", nargs="+", default=[], metavar="NAME", help="only these runs")
    parser.add_argument("--minutes", type=float, default=np.inf, help="begin no window after these")
    parser.add_argument("--record", type=Path, default=RECORD, help="folder of the record")
    arguments = parser.parse_args(words)
    kinds = [KINDS[name] for name in arguments.only]
    go_on(
        kinds, EnsembleRecord(arguments.record), arguments.work, arguments.minutes, arguments.runs
    )


if __name__ == "__main__":
    main()
