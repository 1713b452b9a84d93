"""A run folder that begins at the last state of an ensemble's packing or full run."""

from __future__ import annotations

from adapters.run_folder import Outcome
from adapters.stages import Run
from adapters.state import state_save
from validation.move_study_offline import states_at
from validation.settlement_ensemble import Piece
from validation.settlement_ensemble_record import EnsembleRecord


def packing_lay(run: Run, piece: Piece, record: EnsembleRecord) -> None:
    """Lay the rain of grains and the cycles of ``piece``, a packing or a full run that came to its
    last cycle, into an empty run's folder.

    From the record: heights, grains after the rain, the table's rows, the checkpoint.  They have
    cost this run nothing.  Not for a folder that is to go on from its own rain.
    """
    if run.folder.outcome("preparation") is not None:
        return
    packing = piece.packing or piece
    rained, kept = record.kept(packing.name), record.kept(piece.name)
    assert rained is not None
    assert kept is not None
    assert kept.cycle == piece.last
    radius, position = record.states(packing.name)
    stage = run.folder.begin("preparation")
    state_save(states_at(run.scene, position[0], radius), stage / "state.npz")
    heights = {"mean_height": kept.mean_height, "density_height": kept.density_height}
    notes = heights | {"time_step": 0, "figures": rained.preparation["figures"]}
    run.folder.finish(stage, Outcome("preparation", 0, 0, [], {}, notes=notes))
    rows = [
        dict(zip(table, map(float, row), strict=True)) | {"cycle": int(row[0]), "kind": "computed"}
        for table in map(record.table, dict.fromkeys((packing.name, piece.name)))
        for row in zip(*table.values(), strict=True)
    ]
    stage = run.folder.begin("window_000000")
    (stage / "end.restart").write_bytes(record.restart(kept))
    saved = kept.checkpoint
    notes = {
        "time_step": saved.time_step,
        "piston_mesh": 0,
        "piston_height": saved.piston_height,
    }
    run.folder.finish(stage, Outcome("window", 0, kept.cycle, rows, {}, notes=notes))
