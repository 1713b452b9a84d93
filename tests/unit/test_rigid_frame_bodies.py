"""Runs whose bodies wear and break are kept in frames and go on from them to the last digit."""

from __future__ import annotations

import numpy as np
import pytest

from rigid_lcp.errors import SceneError
from rigid_lcp.frame_bodies import bodies_arrays
from rigid_lcp.report import frames_draw
from rigid_lcp.run_folder import RunFolder
from rigid_lcp.scene_file import scene_read
from rigid_lcp.scene_run import left_out, scene_run, simulation_of

SCENE = """
dimensions = 2
[run]
duration = 0.06
step = 2e-3
frames = 6
[surface]
friction = 0.4
[[ground]]
normal = [0, 1]
[[body]]
name = "lower"
vertices = [[0, -0.1], [0.1, 0], [0, 0.1], [-0.1, 0]]
density = 2700.0
position = [0, 0.1]
[[body]]
name = "upper"
box = [0.3, 0.05]
density = 1000.0
position = [0, 0.2255]
velocity = [0.5, 0]
[[load]]
body = "upper"
force = [0, -3000]
[wear]
coefficient = 1e-7
every = 2
[strength]
tension = 1.2e4
every = 4
smallest = 1e-2
"""


def scene_file(tmp_path, text=SCENE):
    path = tmp_path / "scene.toml"
    path.write_text(text)
    return scene_read(path)


def test_a_resumed_run_is_the_uninterrupted_one(tmp_path):
    """Worn and broken bodies, pending wear and all: positions equal to the last digits."""
    file = scene_file(tmp_path)
    scene, whole = simulation_of(file)
    folder = RunFolder(tmp_path / "run")
    folder.path.mkdir()
    scene_run(file, whole, folder, resume=False, progress=lambda *_: None)
    assert whole.broken
    assert whole.worn.volume > 0
    for number in (4, 5, 6):
        (folder.path / f"frame_{number:06d}.npz").unlink()
    scene, resumed = simulation_of(file)
    scene_run(file, resumed, folder, resume=True, progress=lambda *_: None)
    assert resumed.broken == whole.broken
    assert resumed.positions == pytest.approx(whole.positions, abs=1e-13)
    assert resumed.worn.volume == pytest.approx(whole.worn.volume, rel=1e-12)
    assert resumed.worn.pending == pytest.approx(whole.worn.pending, rel=1e-6, abs=1e-20)
    areas = [[b.shape.area for b in run.world.scene.bodies[1:]] for run in (whole, resumed)]
    assert areas[0] == pytest.approx(areas[1], rel=1e-13)
    assert len(frames_draw(folder, scene, "broken")) == 7


def test_a_run_that_asks_for_neither_keeps_no_bodies(tmp_path):
    text = SCENE[: SCENE.index("[wear]")]
    file = scene_file(tmp_path, text)
    _, run = simulation_of(file)
    assert run.worn is None
    assert bodies_arrays(run) == {}
    assert sum("abrasion" in line or "fragmentation" in line for line in left_out(file)) == 2
    assert not any("abrasion" in line for line in left_out(scene_file(tmp_path)))


@pytest.mark.parametrize(("old", "new", "words"), [
    ("coefficient = 1e-7", "coefficient = 0", "greater than 0"),
    ("tension = 1.2e4", "tension = 4e4\nmodulus = 3.0", "both modulus"),
    ("step = 2e-3", 'step = 2e-3\nmethod = "acceleration"', "acceleration level"),
    ("every = 2", "evry = 2", "Extra"),
])  # fmt: skip
def test_tables_that_are_refused(tmp_path, old, new, words):
    with pytest.raises(SceneError, match=words):
        scene_file(tmp_path, SCENE.replace(old, new, 1))


def test_wear_in_space_is_refused(tmp_path):
    text = 'dimensions = 3\n[run]\nduration = 1\n[[body]]\nname = "b"\nradius = 1\ndensity = 1\n'
    with pytest.raises(SceneError, match="only polygons"):
        scene_file(tmp_path, text + "[wear]\ncoefficient = 1e-9\n")


def test_bodies_of_a_frame_are_numbered_as_they_broke(tmp_path):
    file = scene_file(tmp_path)
    _, run = simulation_of(file)
    part = run.fragment(1, ([0.0, 0.1], [0.0, 1.0]))
    second = run.fragment(part, ([0.05, 0.1], [1.0, 0.0]))
    arrays = bodies_arrays(run)
    assert part == 3
    assert second == 4
    assert arrays["body_whole"].tolist() == [0, 1, 2, 1, 1]
    assert np.isnan(arrays["broken"][:, 3]).all()
