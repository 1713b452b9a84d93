"""Runs whose bodies wear and break are kept in frames and go on from them to the last digit."""

from __future__ import annotations

import numpy as np
import pytest

from rigid_lcp.errors import SceneError
from rigid_lcp.report.page import draw_movie
from rigid_lcp.scene.file import load_scene
from rigid_lcp.scene.run import (
    RunFolder,
    list_left_out,
    make_simulation,
    pack_bodies,
    run_scene,
    summarise_run,
)
from tests.rigid_runs import WORN_AND_BROKEN, WORN_IN_SPACE


def scene_file(tmp_path, text=WORN_AND_BROKEN):
    path = tmp_path / "scene.toml"
    path.write_text(text)
    return load_scene(path)


@pytest.mark.long
def test_frames_of_changed_bodies_are_drawn(tmp_path):
    """Worn and broken bodies as they were in each frame; `test_rigid_resume` goes on from them."""
    file = scene_file(tmp_path)
    scene, run = make_simulation(file)
    folder = RunFolder(tmp_path / "run")
    folder.path.mkdir()
    run_scene(file, run, folder, resume=False, progress=lambda *_: None)
    assert run.broken
    assert run.worn.volume > 0
    assert len(draw_movie(folder, scene, "broken")) == 7


def test_a_run_that_asks_for_neither_keeps_no_bodies(tmp_path):
    text = WORN_AND_BROKEN[: WORN_AND_BROKEN.index("[wear]")]
    file = scene_file(tmp_path, text)
    _, run = make_simulation(file)
    assert run.worn is None
    assert pack_bodies(run) == {}
    assert sum("abrasion" in line or "fragmentation" in line for line in list_left_out(file)) == 2
    assert not any("abrasion" in line for line in list_left_out(scene_file(tmp_path)))


@pytest.mark.parametrize(("old", "new", "words"), [
    ("coefficient = 1e-7", "coefficient = 0", "must be above 0"),
    ("tension = 1.2e4", "tension = 4e4\nmodulus = 3.0", "both modulus"),
    ("step = 2e-3", 'step = 2e-3\nmethod = "acceleration"', "acceleration level"),
    ("every = 2", "evry = 2", "evry: unknown key; did you mean every"),
])  # fmt: skip
def test_tables_that_are_refused(tmp_path, old, new, words):
    with pytest.raises(SceneError, match=words):
        scene_file(tmp_path, WORN_AND_BROKEN.replace(old, new, 1))


def test_wear_in_space_is_kept_and_named(tmp_path):
    """`test_rigid_resume` goes on from its frames; the summary names what went."""
    file = scene_file(tmp_path, WORN_IN_SPACE)
    scene, run = make_simulation(file)
    folder = RunFolder(tmp_path / "run")
    folder.path.mkdir()
    run_scene(file, run, folder, resume=False, progress=lambda *_: None)
    arrays = pack_bodies(run)
    assert arrays["wear_counts"].tolist()[0] == -1
    assert arrays["wear_lost"].sum() > 0
    summary = summarise_run(file, scene, run, folder)
    assert summary["worn"] == run.worn.volume > 0
    assert summary["worn_mass"] == pytest.approx(2700 * arrays["wear_lost"].sum())
    last = folder.frames()[-1]  # of corners that wore in another way: computed again
    with np.load(last) as frame:
        np.savez(last, **{**frame, "wear_counts": np.zeros((3, 2))})
    assert last not in folder.frames()


def test_bodies_of_a_frame_are_numbered_as_they_broke(tmp_path):
    file = scene_file(tmp_path)
    _, run = make_simulation(file)
    part = run.fragment(1, ([0.0, 0.1], [0.0, 1.0]))
    second = run.fragment(part, ([0.05, 0.1], [1.0, 0.0]))
    arrays = pack_bodies(run)
    assert part == 3
    assert second == 4
    assert arrays["body_whole"].tolist() == [0, 1, 2, 1, 1]
    assert np.isnan(arrays["broken"][:, 3]).all()
