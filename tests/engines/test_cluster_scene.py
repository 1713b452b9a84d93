"""The scene of a million grains, small: same file, same decks, several processes."""

from __future__ import annotations

import json
import os
import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from adapters.bed.radii import draw_radii, expect_grains
from adapters.bed.sample import draw_sample_start
from adapters.bed.state import FloatArray
from adapters.engines.contract import EngineStart, get_engine
from adapters.engines.yade import PARAMETERS
from adapters.errors import EngineMissing, SceneError
from adapters.files.window import Window, read_window
from adapters.scene.file import load_scene
from adapters.scene.tables import Scene
from trackbed.scenes import find_scene_file

SMALL = (
    "sample.count=60",
    "sample.size_x=0.04",
    "sample.size_y=0.02",
    "material.grain.young=1e8",
    "loading.piston_mass=0.02",
    "loading.frequency=1000.0",
)
"""What the tests change: fewer and softer grains, and cycles of a hundred steps."""
YIELDING = ("--oversubscribe", "--mca", "mpi_yield_when_idle", "1")
"""Two processes on a machine with other work: who waits lets the other go on."""
LAUNCHERS = {"liggghts": ("mpirun", *YIELDING, "-np", "2"), "lammps": ("mpiexec", "-n", "2")}


def launcher_of(engine: str) -> tuple[str, ...]:
    """The words that start two processes of an engine; skips where one of the two is not here."""
    try:
        get_engine(engine).version()
    except EngineMissing as error:
        pytest.skip(str(error))
    words = LAUNCHERS[engine]
    here = str(Path(sys.executable).parent)
    found = shutil.which(words[0], path=here if engine == "lammps" else None)
    if found is None:
        pytest.skip(f"{words[0]} is not here")
    return (found, *words[1:])


def start_at_rest(
    scene: Scene, position: FloatArray, radius: FloatArray, folder: Path
) -> EngineStart:
    """A saved state of the scene's engine: the bed after a single look at its energies.

    Centres [m], shape (n, 3), radii [m], shape (n,).  Raises as `Engine.run`.
    """
    engine = get_engine(scene.engine.name)
    folder.mkdir(parents=True)
    top = float((position[:, 2] + radius).max())
    digests = engine.write_preparation(scene, position, radius, top, folder)
    steps = scene.steps_per_cycle
    look_once(folder, check_steps=steps, minimum_steps=steps, history_steps=steps)
    engine.run(scene, "in.prepare", folder, lambda: None, digests)
    return EngineStart(folder / "end.restart", steps, 0, top)


def look_once(folder: Path, **settle: float) -> None:
    """Have the preparation in ``folder`` end at its first look, whatever still moves there."""
    settle["equilibrium_ratio"] = 1e300
    if (folder / PARAMETERS).exists():
        content = json.loads((folder / PARAMETERS).read_text())
        content["settle"] |= settle
        (folder / PARAMETERS).write_text(json.dumps(content))
        return
    text = (folder / "parameters.in").read_text()
    for name, value in settle.items():
        text = re.sub(
            rf"^variable {name} index .*$", f"variable {name} index {value:g}", text, flags=re.M
        )
    (folder / "parameters.in").write_text(text)


def computed(engine_name: str, launcher: tuple[str, ...], folder: Path) -> Window:
    """A cycle of rain, then two load cycles, each stage a fresh run of the scene's decks."""
    words = ", ".join(f'"{word}"' for word in launcher)
    overrides = (*SMALL, f'engine.name="{engine_name}"', f"engine.launcher=[{words}]")
    scene = load_scene(find_scene_file("cluster"), overrides)
    radius = draw_radii(scene.sample.radii, scene.grain_count, scene.sample.seed)
    position, _ = draw_sample_start(radius, scene.container, 0.15, scene.sample.seed)
    start = start_at_rest(scene, position, radius, folder / "rain")
    engine, window = get_engine(engine_name), folder / "window"
    window.mkdir()
    digests = engine.write_cycles(scene, start, 2, window)
    engine.run(scene, "in.cycles", window, lambda: None, digests)
    names = engine.wall_names(scene, piston=True)
    return read_window(window, 0, names, start.piston_height)


def grids(folder: Path) -> set[str]:
    """How the processes of each stage share the box."""
    screens = [(folder / stage / "screen.txt").read_text() for stage in ("rain", "window")]
    return {grid for text in screens for grid in re.findall(r"(\d by \d by \d) MPI", text)}


@pytest.mark.engine("liggghts")
@pytest.mark.parametrize("engine", LAUNCHERS)
@pytest.mark.long
def test_small_on_two_processes(engine: str, tmp_path: Path) -> None:
    """Two processes share the bed as columns, and compute what one does."""
    two = computed(engine, launcher_of(engine), tmp_path / "two")
    one = computed(engine, (), tmp_path / "one")
    assert grids(tmp_path / "two") == {"2 by 1 by 1"}
    assert np.array_equal(two.identifier, one.identifier)
    np.testing.assert_allclose(two.position, one.position, rtol=0, atol=1e-9)
    assert np.abs(one.position[-1] - one.position[0]).max() > 1e-4  # something went on


@pytest.mark.engine("liggghts")
@pytest.mark.skipif(shutil.which("mpirun") is None, reason="mpirun is not installed")
def test_srun_takes_the_number_of_processes_from_the_job(tmp_path, monkeypatch) -> None:
    """The scene's own launcher: one word before the command; here a stand-in for SLURM's."""
    srun = tmp_path / "srun"
    words = " ".join(("mpirun", *YIELDING))
    srun.write_text(f'#!/bin/sh\nexec {words} -np "$SLURM_NTASKS" "$@"\n')
    srun.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("SLURM_NTASKS", "2")
    launcher = load_scene(find_scene_file("cluster")).engine.launcher
    assert launcher == ("srun",)
    computed("liggghts", launcher, tmp_path)
    assert grids(tmp_path) == {"2 by 1 by 1"}


def test_yade_has_no_use_for_srun() -> None:
    """It would run as often as the job has processes, in one folder."""
    with pytest.raises(SceneError, match="one process"):
        load_scene(find_scene_file("cluster"), ['engine.name="yade"'])


def test_what_the_scene_says_of_itself() -> None:
    """A million grains fill a third of a metre; piston mass and load an area are the paper's."""
    cluster, paper = (load_scene(find_scene_file(name)) for name in ("cluster", "karrech"))
    law = cluster.sample.radii
    assert expect_grains(law, cluster.container, 1 / 3) == pytest.approx(1e6, rel=0.02)

    def mass_an_area(scene: Scene) -> float:
        assert scene.loading is not None
        return scene.loading.piston_mass / scene.container.area

    assert mass_an_area(cluster) == pytest.approx(mass_an_area(paper), rel=0.03)
    for table in ("material", "loading"):
        one, other = (getattr(scene, table).model_dump() for scene in (cluster, paper))
        one.pop("piston_mass", None)
        other.pop("piston_mass", None)
        assert one == other
