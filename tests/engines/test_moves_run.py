"""Every way to move grains, through a jump and two cycles after it on a real engine."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from adapters.bed.state import load_state
from adapters.files.run_folder import RunFolder
from adapters.moves import list_moves
from adapters.procedure.stages import Bed, Run, Variant, compute, jump
from adapters.scene.tables import Scene
from tests.engine_sample import AFTER, JUMP, QUIET, SECOND, Sample


def moved_by(scene: Scene, way: str) -> Scene:
    """The scene with another way to move grains."""
    assert scene.procedure is not None
    return scene.model_copy(update={"procedure": scene.procedure.model_copy(update={"move": way})})


@pytest.mark.parametrize(
    "sample", ["fake", pytest.param("liggghts", marks=pytest.mark.engine)], indirect=True
)
@pytest.mark.parametrize("way", list_moves())
@pytest.mark.long
def test_run_goes_on_after_each_way(sample: Sample, tmp_path: Path, way: str) -> None:
    """The engine takes the relaxed bed: overlaps as carried before, no grain lost, all cycles."""
    folder = RunFolder(sample.copy(tmp_path / "run", JUMP, AFTER))
    run = Run(moved_by(sample.scene, way), folder, sample.engine, Variant(), QUIET)
    start = sample.start(SECOND)
    bed = jump(run, Bed(5, start, SECOND), 2, 1)
    outcome = folder.outcome(JUMP)
    assert outcome is not None
    record = outcome.notes["relaxation"]
    assert record["relaxed"]["max_penetration"] <= 1.1 * record["before"]["max_penetration"] + 1e-9
    before = sample.window(SECOND).state(-1)
    if way == "still":
        estimated = load_state(folder.path / JUMP / "estimated.npz").position
        assert (estimated == before.position).all()
        assert bed.start.piston_height == start.piston_height
    done = compute(run, bed, 2, 1)
    assert done.cycle == 9
    assert done.start == replace(done.start, moved=None)
    rows = RunFolder(folder.path).outcome(done.window)
    assert rows is not None
    assert [row["kind"] for row in rows.rows] == ["healing", "computed"]
