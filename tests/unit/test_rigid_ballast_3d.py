"""The bed of the block on polyhedral ballast: its scene file, its load, how the study goes on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import validation.rigid_ballast_3d as study_3d
from rigid_lcp.rotations import rotate
from rigid_lcp.scene_file import scene_read
from rigid_lcp.scene_run import simulation_of
from rigid_lcp.simulation import Simulation
from validation.rigid_ballast_3d import SCENE, Data, Study, bed, block_laid, load_at, study_run


def test_the_scene_starts_without_overlap_and_the_block_on_top() -> None:
    scene, run = simulation_of(scene_read(SCENE))
    moving = [body for body in scene.bodies if body.movable]
    block = next(n for n, body in enumerate(scene.bodies) if body.name == "sleeper")
    assert len(moving) == 61
    assert len(run.world.contacts(run.motion, 0.0)) == 0
    others = np.delete(run.positions, block, axis=0)
    assert run.positions[block, 2] > others[:, 2].max()


def test_load_goes_from_the_least_to_the_most_and_back() -> None:
    study = Study(least=10.0, most=90.0, frequency=5.0)
    found = [load_at(study, seconds) for seconds in (0.0, 0.05, 0.1, 0.2)]
    assert found == pytest.approx([10.0, 50.0, 90.0, 10.0])


def test_block_is_laid_a_hair_above_the_stones() -> None:
    scene, block = bed(Study(stones=5), 1)
    run = Simulation(scene)
    laid = block_laid(scene, run.motion, block)
    bottom = laid.position[block, 2] - 0.03
    corners = [
        run.positions[n] + rotate(run.angles[n], body.shape.vertices)
        for n, body in enumerate(scene.bodies)
        if body.movable and n != block
    ]
    assert bottom == pytest.approx(max(each[:, 2].max() for each in corners) + 1e-4)
    assert not laid.velocity[block].any()


def test_a_killed_study_goes_on_where_it_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    beds, runs = [], []

    def laid(study: Study, sample: int) -> tuple[None, int]:
        beds.append(sample)
        return None, 0

    def cycled(study: Study, start: None, block: int, step: float) -> Data:
        if len(runs) == 3:
            raise KeyboardInterrupt
        runs.append((beds[-1], step))
        return {"step": step, "settlement": [0.0], "cpu_s": 0.0, "why": ""}

    monkeypatch.setattr(study_3d, "laid", laid)
    monkeypatch.setattr(study_3d, "cycled", cycled)
    record = tmp_path / "record.jsonl"
    with pytest.raises(KeyboardInterrupt):
        study_run(Study(), 2, (2e-3, 1e-3), record)
    first = record.read_text()
    monkeypatch.setattr(
        study_3d, "cycled",
        lambda _study, _start, _block, step: {
            "step": step, "settlement": [0.0], "cpu_s": 0.0, "why": "",
        },
    )  # fmt: skip
    beds.clear()
    lines = study_run(Study(), 2, (2e-3, 1e-3), record)
    assert record.read_text().startswith(first)
    assert [(line["sample"], line["step"]) for line in lines] == [
        (1, 2e-3), (1, 1e-3), (2, 2e-3), (2, 1e-3),
    ]  # fmt: skip
    assert beds == [2]
