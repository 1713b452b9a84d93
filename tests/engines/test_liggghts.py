"""LIGGGHTS under our decks: laws of mechanics, restarts, faults, and decks without Python."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from adapters.bed.sample import GRAVITY
from adapters.bed.state import FloatArray, State
from adapters.engines.contract import EngineStart
from adapters.engines.liggghts import LiggghtsEngine
from adapters.files.run_folder import RunFolder
from adapters.files.window import Window, read_window
from adapters.moves import Jump
from adapters.procedure import stages
from adapters.procedure.progress import Progress
from adapters.procedure.run import run_scene
from adapters.scene.file import load_scene
from adapters.scene.tables import Scene
from tests.engine_sample import at_rest, start_of, window_of
from tests.engines.test_engine_contract import engine_started, gone
from tests.forked_commands import Commands
from trackbed import command
from trackbed.scenes import read_template

pytestmark = pytest.mark.engine("liggghts")

ENGINE = LiggghtsEngine()
QUIET = Progress(quiet=True)
SEED = 2007
TINY = (
    "sample.radius=0.018",
    "sample.count=40",
    "material.grain.young=1e9",
    "loading.piston_mass=0.001",
    "procedure.k_i=3",
    "procedure.k=4",
    "procedure.h=4",
    "procedure.healing_cycles=1",
    "procedure.total_cycles=16",
)
"""Forty grains, about 6,000 steps a cycle, one jump from cycle 7 to 11."""
FIRST, SECOND, JUMP, AFTER = "window_000000", "window_000003", "jump_000007_1", "window_000011"


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The coarse scene, made tiny."""
    path = tmp_path_factory.mktemp("scene") / "scene.toml"
    path.write_text(read_template("karrech-coarse"))
    return path


@pytest.fixture(scope="module")
def run(scene_file: Path) -> Path:
    """A finished run of the tiny scene."""
    folder = scene_file.parent / "run"
    run_scene(scene_file, folder, overrides=TINY, progress=QUIET)
    assert AFTER in RunFolder(folder).stage_names()
    return folder


@pytest.fixture(scope="module")
def scene(scene_file: Path) -> Scene:
    return load_scene(scene_file, TINY)


def written(scene: Scene, start: EngineStart, cycles: int, folder: Path) -> dict[str, str]:
    folder.mkdir()
    return ENGINE.write_cycles(scene, start, cycles, folder)


def computed(scene: Scene, start: EngineStart, cycles: int, folder: Path) -> Window:
    """A window computed outside any run folder."""
    digests = written(scene, start, cycles, folder)
    ENGINE.run(scene, "in.cycles", folder, lambda: None, digests)
    return read(scene, start, folder)


def read(scene: Scene, start: EngineStart, folder: Path) -> Window:
    return read_window(folder, 0, ENGINE.wall_names(scene, piston=True), start.piston_height)


def by_hand(folder: Path, deck: str, *words: str) -> str:
    """Plain ``liggghts -in DECK`` in a folder; what it prints."""
    command = ["liggghts", "-in", deck, *words]
    return subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout


# --- mechanics ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def steps(run: Path, scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Window:
    """Twenty single time steps from the end of a cycle, a state each."""
    folder = tmp_path_factory.mktemp("steps") / "window"
    start = start_of(run, SECOND)
    written(scene, start, 1, folder)
    one = ("-var", "steps_per_cycle", "1", "-var", "track_steps", "1", "-var", "run_steps", "20")
    by_hand(folder, "in.cycles", *one)
    return read(scene, start, folder)


def outer_force(window: Window, index: int, mass: FloatArray) -> FloatArray:
    """Walls and weight on each grain [N], shape (n, 3)."""
    force = np.sum([force[index] for force in window.wall_force.values()], axis=0)
    force[:, 2] -= GRAVITY * mass
    return np.asarray(force)


def inner_force(state: State) -> FloatArray:
    """Contacts between grains, on each grain [N], shape (n, 3)."""
    force = np.zeros_like(state.position)
    on_first = state.contacts.normal_force + state.contacts.tangential_force
    np.add.at(force, state.contacts.pair[:, 0] - 1, on_first)
    np.subtract.at(force, state.contacts.pair[:, 1] - 1, on_first)
    return force


def test_momentum(steps: Window, scene: Scene) -> None:
    """Velocity Verlet: m (v1 - v0) / dt = (F0 + F1) / 2, exactly, for the sum over the grains.

    Contacts cancel in the sum, so F is walls and weight: a wall that is missing from the dump, or
    of the wrong sign, can not hide.
    """
    change = np.diff(np.einsum("n,cna->ca", steps.mass, steps.velocity), axis=0) / scene.time_step
    force = np.array([outer_force(steps, i, steps.mass).sum(axis=0) for i in range(len(steps) + 1)])
    mean = (force[1:] + force[:-1]) / 2
    # Velocities have 16 digits, and their difference is a part in 1e5 of them.
    np.testing.assert_allclose(change, mean, rtol=1e-7, atol=1e-9 * np.abs(force).max())
    assert np.abs(mean).max() > 1e-3 * GRAVITY * steps.mass.sum()  # something was balanced


def test_contacts_accelerate_their_grains(steps: Window, scene: Scene) -> None:
    """The same for single grains, contacts included, where no contact slides.

    The engine dumps a contact's force as recomputed with the velocities of the whole step; the
    force it applied had those of the half step, and a contact about to slide may differ wholly.
    So grains with a contact loaded above 0.9 of Coulomb's bound are left out, and the viscous
    part leaves a tenth.
    """
    share = np.zeros(len(steps.radius))
    for state in (steps.state(0), steps.state(1)):
        pair = state.contacts.pair - 1
        reduced = 1 / (1 / state.radius[pair]).sum(axis=1)
        grain = scene.material.grain
        shear = grain.young / (4 * (1 + grain.poisson) * (2 - grain.poisson))
        stiffness = 8 * shear * np.sqrt(reduced * state.contacts.overlap)
        spring = stiffness * np.linalg.norm(state.contacts.tangential_spring, axis=1)
        loaded = spring / np.linalg.norm(state.contacts.normal_force, axis=1) / grain.friction
        np.maximum.at(share, pair.ravel(), np.repeat(loaded, 2))
    sticking = share < 0.9
    assert sticking.sum() >= 8
    change = steps.mass[:, None] * np.diff(steps.velocity[:2], axis=0)[0] / scene.time_step
    force = [outer_force(steps, i, steps.mass) + inner_force(steps.state(i)) for i in (0, 1)]
    error = np.linalg.norm(change - np.mean(force, axis=0), axis=1)[sticking]
    assert error.max() < 0.1 * np.linalg.norm(force[0], axis=1)[sticking].max()


# --- restarts -------------------------------------------------------------------------------


def test_walls_keep_their_springs(run: Path, scene: Scene, tmp_path: Path) -> None:
    """Put back at rest, the bed drags on floor and cylinder as before, but for damping.

    At rest a tangential force is that of the spring alone; without the springs it would be zero.
    """
    window = window_of(run, FIRST)
    start = start_of(run, FIRST)
    moved = at_rest(window.state(-1))
    again = computed(
        scene, replace(start, moved=moved, piston_mesh=start.piston_mesh + 1), 1, tmp_path / "again"
    )
    for name, axes in (("floor", [0, 1]), ("cylinder", [2])):
        before, after = window.wall_force[name][-1][:, axes], again.wall_force[name][0][:, axes]
        assert np.linalg.norm(before) > 0.01 * GRAVITY * window.mass.sum()
        assert np.linalg.norm(after - before) < 0.3 * np.linalg.norm(before)
    # The piston starts from rest where it was asked to: one sample on it moved a micrometre.
    assert again.piston_start == start.piston_height
    assert abs(again.piston.height[0] - start.piston_height) < 1e-6


@pytest.mark.parametrize("lift", [0.5, 2.0])
@pytest.mark.long
def test_a_lifted_loose_grain_does_not_raise_the_piston(
    run: Path, scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lift: float
) -> None:
    """A loose grain that the estimate throws up through the piston is put back under it."""
    folder = tmp_path / "run"
    shutil.copytree(run, folder, ignore=shutil.ignore_patterns("jump_*", "window_00001*"))
    going = stages.Run(scene, RunFolder(folder), ENGINE, stages.Variant(), QUIET)
    bed = stages.Bed(7, start_of(folder, SECOND), SECOND)
    before = window_of(folder, SECOND).state(-1)
    loose = np.setdiff1d(before.identifier, before.contacts.pair) - 1
    top = int(loose[np.argmax((before.position[:, 2] + before.radius)[loose])])
    real = stages.get_move("smoothed")

    def thrown(jump: Jump) -> FloatArray:
        move = real.displacement(jump)
        above = before.piston_height + lift * before.radius[top]
        move[top, 2] = above - before.radius[top] - before.position[top, 2]
        return move

    monkeypatch.setattr(stages, "get_move", lambda name: replace(real, displacement=thrown))
    bed = stages.jump(going, bed, 4, 1)
    relaxed = bed.start.moved
    assert relaxed is not None
    assert bed.start.piston_height <= before.piston_height
    highest = (relaxed.position[:, 2] + relaxed.radius).max()
    assert highest < bed.start.piston_height + 1e-6
    bed = stages.compute(going, bed, 3, 1)
    window = window_of(folder, bed.window)
    # After a jump nothing but the bed's own unloading, some tens of micrometres, moves it up.
    unloading = window_of(folder, SECOND).piston.elastic_deflection(scene.steps_per_cycle).max()
    assert window.piston.height.max() < before.piston_height + unloading


# --- signals -----------------------------------------------------------------


@pytest.fixture(scope="module")
def commands(run: Path) -> Iterator[Commands]:
    """A server of commands that has all libraries loaded."""
    server = Commands(run.parent)
    server.run("resume", run, here=True)
    yield server
    server.close()


def words_on(scene_file: Path, run: Path, *more: str) -> tuple[object, ...]:
    if (run / "manifest.json").exists():
        return ("resume", run)
    overrides = [word for override in (*TINY, *more) for word in ("--set", override)]
    return ("run", scene_file, "--run-folder", run, *overrides)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.long
def test_interrupted_while_the_engine_works(
    commands: Commands, scene_file: Path, run: Path, tmp_path: Path, number: signal.Signals
) -> None:
    """A signal ends the engine too, with exit code 130 and every finished stage in its place."""
    folder = tmp_path / "run"
    shutil.copytree(run, folder, ignore=shutil.ignore_patterns(AFTER))
    pid = commands.start("resume", folder)
    engine_started(folder, AFTER)
    os.kill(pid, number)
    assert commands.end() == 130
    assert gone(folder)
    assert RunFolder(folder).stage_names() == ["preparation", FIRST, SECOND, JUMP]
    assert commands.run("resume", folder) == 0
    assert (folder / "settlement.csv").read_bytes() == (run / "settlement.csv").read_bytes()


# --- other scenes, other ways to start ------------------------------------------------------


@pytest.mark.skipif(shutil.which("mpirun") is None, reason="mpirun is not installed")
@pytest.mark.long
def test_launcher(commands: Commands, scene_file: Path, tmp_path: Path) -> None:
    """Two processes under mpirun compute a run; killed, they leave nothing behind."""
    folder = tmp_path / "run"
    yielding = ("--mca", "mpi_yield_when_idle", "1")  # or two that wait take turns with no one
    words = ("mpirun", "--allow-run-as-root", "--oversubscribe", *yielding, "-np", "2")
    launcher = f"engine.launcher={json.dumps(words)}"
    softer = "material.grain.young=1e8"  # half the steps
    more = ("procedure.k_i=1", "procedure.k=2", "procedure.total_cycles=3", softer, launcher)
    commands.start(*words_on(scene_file, folder, *more))
    engine_started(folder, FIRST)
    commands.kill()
    assert gone(folder)
    assert commands.run("resume", folder) == 0, commands.output.read_text()
    table = (folder / "settlement.csv").read_text().splitlines()
    assert [line.split(",")[0] for line in table[1:]] == ["1", "2", "3"]
    log = (folder / "window_000001" / "log.liggghts").read_text()
    assert "1 by 2" in log or "2 by 1" in log or "1 by 1 by 2" in log


@pytest.mark.long
def test_example_by_hand(tmp_path: Path) -> None:
    """The shipped decks with the files of example/ run without Python, window after window."""
    decks = Path(str(files("liggghts_inputs")))
    for path in (*decks.glob("*.in"), *decks.glob("in.*"), *(decks / "example").iterdir()):
        shutil.copy(path, tmp_path)
    assert "COMPLETE step" in by_hand(tmp_path, "in.prepare")
    for words in (
        (),
        ("-var", "seat_part", "seat_none.in", "-var", "start_part", "start_continue.in"),
    ):
        shutil.copy(tmp_path / "end.restart", tmp_path / "start.restart")
        assert "COMPLETE step" in by_hand(tmp_path, "in.cycles", *words)
        track = np.loadtxt(tmp_path / "piston.txt", skiprows=1)
        assert np.isfinite(track).all()
        error = track[:, 2] - track[:, 1]
        assert np.sqrt(np.mean(error**2)) < 0.05 * track[:, 1].max()


def test_dry_run_by_hand(scene_file: Path, run: Path, tmp_path: Path) -> None:
    """What --dry-run writes, run with the bare engine, is the preparation of the run itself."""
    words = [word for override in TINY for word in ("--set", override)]
    assert (
        command.main(["run", str(scene_file), "--run-folder", str(tmp_path), "--dry-run", *words])
        == 0
    )
    folder = tmp_path / "dry_run"
    by_hand(folder, "in.prepare")
    for name in ("history.txt", "states.dump", "contacts.dump"):
        assert (folder / name).read_bytes() == (run / "preparation" / name).read_bytes(), name
