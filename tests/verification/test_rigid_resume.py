"""A run that goes on from any of its frames has the frames it would have had, to the last bit."""

from __future__ import annotations

from pathlib import Path

import pytest

from rigid_lcp import Simulation
from rigid_lcp.scene.file import SceneFile, load_scene
from rigid_lcp.scene.run import FRAME, RunFolder, make_simulation, run_scene
from tests.rigid_runs import SLIDING_BLOCK, WORN_AND_BROKEN, WORN_IN_SPACE, frame_bits

BOUNCING = """
dimensions = 2
[run]
duration = 0.3
step = 1e-2
frames = 3
method = "acceleration"
[surface]
friction = 0.3
restitution = 0.5
[[ground]]
normal = [0, 1]
[[body]]
name = "box"
box = [0.2, 0.1]
density = 1000.0
position = [0.0, 0.1]
angle = 0.2
velocity = [0.3, 0.0]
"""

TUMBLING = """
dimensions = 3
[run]
duration = 0.2
step = 2e-3
frames = 3
[surface]
friction = 0.4
[[ground]]
normal = [0, 0, 1]
[[body]]
name = "cube"
box = [0.2, 0.2, 0.2]
density = 2700.0
position = [0, 0, 0.19]
angle = [0.9, 0.3, 0.2, 0.1]
[[body]]
name = "ball"
radius = 0.1
density = 2700.0
position = [0.05, 0.02, 0.45]
spin = [3.0, 0.0, 1.0]
"""

PILE = Path(__file__).parents[2] / "trackbed" / "scenes" / "pile.toml"
FEW = ("grains.0.count=8", "run.duration=0.2", "run.step=2e-3", "run.frames=4", "load.0.begin=0.1")
SCENES = {
    "sliding": SLIDING_BLOCK, "poured": PILE.read_text(), "bouncing": BOUNCING,
    "tumbling": TUMBLING, "worn and broken": WORN_AND_BROKEN, "worn in space": WORN_IN_SPACE,
}  # fmt: skip


def run_in(folder: RunFolder, file: SceneFile, *, resume: bool) -> Simulation:
    _, run = make_simulation(file)
    run_scene(file, run, folder, resume=resume, progress=lambda *_: None)
    return run


@pytest.mark.parametrize("kind", SCENES)
@pytest.mark.long
def test_a_resumed_run_is_the_uninterrupted_one(tmp_path: Path, kind: str) -> None:
    """From every frame on; whatever a step needs of the one before is in the frame."""
    path = tmp_path / "scene.toml"
    path.write_text(SCENES[kind], encoding="utf-8")
    file = load_scene(path, FEW if kind == "poured" else ())
    folder = RunFolder(tmp_path / "run")
    folder.path.mkdir()
    whole = run_in(folder, file, resume=False)
    frames = frame_bits(folder.path)
    count = file.tables.run.frames
    assert len(frames) == count + 1
    for kept in range(1, count + 1):
        for number in range(kept, count + 1):
            (folder.path / FRAME.format(number)).unlink()
        resumed = run_in(folder, file, resume=True)
        assert frame_bits(folder.path) == frames, f"on from frame {kept - 1}"
        assert resumed.energy == whole.energy
        assert resumed.broken == whole.broken
        assert resumed.pace == whole.pace


@pytest.mark.long
def test_steps_above_the_tolerance_are_counted_over_a_stop(tmp_path: Path) -> None:
    """No method reaches 1e-30: steps that are not exact are counted, before the stop and after."""
    path = tmp_path / "scene.toml"
    path.write_text(SLIDING_BLOCK, encoding="utf-8")
    file, folder = load_scene(path), RunFolder(tmp_path / "run")
    folder.path.mkdir()

    def run(resume: bool) -> Simulation:
        _, made = make_simulation(file)
        made.tolerance = 1e-30
        run_scene(file, made, folder, resume=resume, progress=lambda *_: None)
        return made

    counted = run(resume=False).steps_above
    assert counted > 3
    for kept in (3, 1):
        for number in range(kept, 4):
            (folder.path / FRAME.format(number)).unlink()
        assert run(resume=True).steps_above == counted
