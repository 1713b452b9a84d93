"""The scene of a sleeper's block on ballast, made small: what each engine's block pushes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from adapters.bed.contact_law import find_normal_force
from adapters.bed.overlaps import find_pairs
from adapters.engines.contract import get_engine
from adapters.procedure.run import run_scene
from adapters.scene.file import load_scene
from adapters.scene.stages import list_stages
from tests.engine_sample import QUIET, REAL, TINY, window_of
from trackbed.scenes import find_scene_file, read_template

SMALL = (
    "sample.fill_height=0.06", "loading.footprint=[0.08, 0.07]", "material.grain.young=1e9",
    "loading.amplitude=5e3", "loading.mean=1e4", "procedure.total_cycles=3", "procedure.k_i=2",
    "procedure.k=2", "procedure.h=1", "sample.rain_friction=0.1",
)  # fmt: skip


@pytest.mark.parametrize("name", REAL)
@pytest.mark.long
def test_block_pushes_what_lies_under_it(name: str, tmp_path: Path) -> None:
    """The face's force on each grain is Hertz's for its overlap with the nearest point of the block
    to 1 % of the greatest, which dampers take."""
    overrides = (f'engine.name="{name}"', *SMALL)
    run_scene(find_scene_file("ballast"), tmp_path, overrides=overrides, progress=QUIET)
    scene = load_scene(find_scene_file("ballast"), overrides)
    window = window_of(tmp_path, "window_000002")
    state = window.state(-1)
    walls = scene.walls(state.piston_height)
    rows = find_pairs(state.position, state.radius, walls)
    under = (rows.second == -len(walls.plane_name)) & (rows.overlap > 0)
    grain, force = rows.first[under], state.wall_force[get_engine(name).wall_names(scene, True)[-1]]
    push = find_normal_force(rows.overlap[under], scene.stiffness.wall, state.radius[grain])
    found = np.einsum("na,na->n", force[grain], rows.normal[under])
    assert found == pytest.approx(push, abs=0.01 * push.max())
    assert np.abs(np.delete(force, grain, axis=0)).max() < 0.01 * push.max()
    first = window_of(tmp_path, "window_000000").contacts[-1]  # of these many were made by the rain
    sizes = np.linalg.norm([first.normal_force, first.tangential_force], axis=2)
    assert (sizes[1] > 2 * scene.sample.rain_friction * sizes[0]).mean() > 0.1


@pytest.mark.parametrize("name", REAL)
def test_stages_follow_one_another(name: str, tmp_path: Path) -> None:
    """From cycle 2 on the load that presses the piston has the second stage's level, and the time
    of a cycle its period: sine and frequency of every sample, to the step in which an engine looks.
    """
    text = read_template("karrech-coarse")
    stage = "[[loading.stage]]\nfrom_cycle = 2\namplitude = 9e3\nmean = 8e3\nfrequency = 30.0\n"
    (tmp_path / "scene.toml").write_text(f"{text}\n{stage}")
    overrides = (f'engine.name="{name}"', *TINY[:4], "procedure.total_cycles=4")
    run_scene(tmp_path / "scene.toml", tmp_path / "run", overrides=overrides, progress=QUIET)
    for begin, scene in list_stages(load_scene(tmp_path / "scene.toml", overrides)):
        tracks = [window_of(path, ".").piston for path in sorted((tmp_path / "run").glob("window*"))
                  if begin <= int(path.name[-6:]) < begin + 2]  # fmt: skip
        step, force = (np.concatenate([getattr(one, key) for one in tracks]) for key in
                       ("time_step", "target_force"))  # fmt: skip
        expected = scene.stress_at(step / scene.steps_per_cycle) * scene.loaded_area
        assert force == pytest.approx(expected, abs=0.01 * expected.max())
        assert scene.time_step * scene.steps_per_cycle == pytest.approx(1 / (50, 30)[begin // 2])
