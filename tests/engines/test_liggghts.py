"""LIGGGHTS under our decks: laws of mechanics, restarts, faults, and decks without Python."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from adapters.bed.sample import GRAVITY
from adapters.bed.state import FloatArray, State, load_state
from adapters.engines.contract import EngineStart
from adapters.engines.liggghts import LiggghtsEngine
from adapters.errors import TrackbedError
from adapters.files.run_folder import RunFolder
from adapters.files.window import Window, load_window, read_window
from adapters.procedure import stages
from adapters.procedure.progress import Progress
from adapters.procedure.run import run_scene
from adapters.scene.file import load_scene
from adapters.scene.tables import Scene
from tests.forked_commands import Commands, processes_in
from trackbed import command
from trackbed.scenes import scene_template

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
    path.write_text(scene_template("karrech-coarse"))
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


def window_of(run: Path, name: str) -> Window:
    return load_window(run / name / "states.npz")


def start_of(run: Path, name: str) -> EngineStart:
    """The start of a window that goes on from a finished one."""
    notes = RunFolder(run).outcome(name).notes  # type: ignore[union-attr]
    return EngineStart(
        run / name / "end.restart", notes["time_step"], notes["piston_mesh"], notes["piston_height"]
    )


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


def at_rest(state: State) -> State:
    still = np.zeros_like(state.position)
    return state.moved(state.position, velocity=still, spin=still)


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


def test_settled_bed_is_in_balance(run: Path) -> None:
    """After the rain contacts, walls and weight of every grain add up to nearly nothing."""
    state = load_state(run / "preparation" / "state.npz")
    walls = np.sum(list(state.wall_force.values()), axis=0)
    force = walls + inner_force(state)
    force[:, 2] -= GRAVITY * state.mass
    weight = GRAVITY * state.mass
    assert np.linalg.norm(force, axis=1).max() < 0.05 * weight.mean()
    assert np.linalg.norm(force.sum(axis=0)) < 0.005 * weight.sum()


def test_overlaps_are_those_of_the_positions(run: Path) -> None:
    """r_i + r_j - distance, for each contact of each cycle end; no overlap without a contact."""
    window = window_of(run, SECOND)
    for index in range(len(window) + 1):
        state = window.state(index)
        pair = state.contacts.pair - 1
        distance = np.linalg.norm(state.position[pair[:, 0]] - state.position[pair[:, 1]], axis=1)
        overlap = state.radius[pair].sum(axis=1) - distance
        np.testing.assert_allclose(state.contacts.overlap, overlap, atol=1e-15)
        first, second = np.triu_indices(len(state.radius), 1)
        gap = np.linalg.norm(state.position[first] - state.position[second], axis=1)
        touching = (gap < state.radius[first] + state.radius[second] - 1e-15).sum()
        assert touching == len(pair)


# --- restarts -------------------------------------------------------------------------------


@pytest.mark.long
def test_window_goes_on_where_the_last_one_ended(run: Path, scene: Scene, tmp_path: Path) -> None:
    """Two windows of two cycles are one of four up to the seam, and a bed as good behind it.

    State and springs cross the seam bit for bit, forces of walls but for their viscous part.  The
    step after it does not: the engine works out its first forces with the velocities of the whole
    step, not the half, and the bed is chaotic.  So a run is defined by its windows.
    """
    start = start_of(run, FIRST)
    whole = computed(scene, start, 4, tmp_path / "whole")
    half = computed(scene, start, 2, tmp_path / "half")
    seam = EngineStart(
        tmp_path / "half" / "end.restart",
        int(half.time_step[-1]),
        start.piston_mesh,
        float(half.piston.height[-1]),
    )
    rest = computed(scene, seam, 2, tmp_path / "rest")
    before, after = half.state(-1), rest.state(0)
    assert np.array_equal(whole.position[:3], half.position)
    assert np.array_equal(whole.velocity[:3], half.velocity)
    for name in ("position", "velocity", "spin", "time_step", "piston_height"):
        assert np.array_equal(getattr(before, name), getattr(after, name)), name
    assert np.array_equal(before.contacts.pair, after.contacts.pair)
    assert np.array_equal(before.contacts.tangential_spring, after.contacts.tangential_spring)
    apart = np.linalg.norm(rest.position[1:] - whole.position[3:], axis=2).mean(axis=1)
    assert apart[0] > 0
    assert apart.max() < 0.05 * whole.radius.mean()


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

    def thrown(*arguments: object) -> FloatArray:
        move = real.displacement(*arguments)  # type: ignore[arg-type]
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


# --- kills, signals, faults -----------------------------------------------------------------


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


def engine_started(run: Path, stage: str) -> None:
    """Wait until an engine works on a stage."""
    log = run / "partial" / stage / "log.liggghts"
    deadline = time.monotonic() + 300
    while not log.exists():
        assert time.monotonic() < deadline, f"no engine came to {stage}"
        time.sleep(0.002)


def gone(folder: Path) -> bool:
    """Whether, within a minute, no process works below a folder any more."""
    deadline = time.monotonic() + 60
    while processes_in(folder):
        if time.monotonic() > deadline:
            return False
        time.sleep(0.02)
    return True


@pytest.mark.long
def test_killed_while_the_engine_works(
    commands: Commands, scene_file: Path, run: Path, tmp_path: Path
) -> None:
    """SIGKILLs at random times while LIGGGHTS computes: no engine stays, the table is identical."""
    folder, times, kills = tmp_path / "run", random.Random(SEED), []
    for stage in ("preparation", FIRST, SECOND, AFTER, AFTER):
        commands.start(*words_on(scene_file, folder))
        engine_started(folder, stage)
        wait = times.uniform(0, 0.3)
        time.sleep(wait)
        kills.append((stage, wait, commands.kill()))
        assert gone(folder), f"an engine is left after the kills {kills}, seed {SEED}"
    assert [status for _, _, status in kills] == [-signal.SIGKILL] * 5
    assert commands.run(*words_on(scene_file, folder)) == 0, commands.output.read_text()
    table = (folder / "settlement.csv").read_bytes()
    assert table == (run / "settlement.csv").read_bytes(), f"kills {kills}, seed {SEED}"


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


@pytest.mark.parametrize(
    ("number", "named"), [(signal.SIGKILL, "SIGKILL"), (signal.SIGTERM, "SIGTERM")]
)
@pytest.mark.long
def test_engine_killed_alone(
    commands: Commands, run: Path, tmp_path: Path, number: signal.Signals, named: str
) -> None:
    """An engine that someone else ends is named, although LIGGGHTS exits 0 after SIGTERM."""
    folder = tmp_path / "run"
    shutil.copytree(run, folder, ignore=shutil.ignore_patterns(AFTER))
    commands.start("resume", folder)
    engine_started(folder, AFTER)
    for pid in processes_in(folder):
        os.kill(pid, number)
    assert commands.end() == 5
    assert f"was ended by {named}" in commands.output.read_text()
    assert not RunFolder(folder).failure(JUMP)


@pytest.mark.long
def test_full_disk(run: Path, scene_file: Path, tmp_path: Path) -> None:
    """An engine that may write no more is named, not taken for a failed jump; then it goes on.

    A limit on the size of files stands for the disk; it lies in the launcher.
    """
    full = tmp_path / "full"
    # MPI's own large files go, so that the first to be too large is the engine's.
    plain = "export PMIX_MCA_gds=hash OMPI_MCA_btl=self; ulimit -f 64"
    script = f'if test -e {full}; then {plain}; fi; exec "$@"'
    launcher = f'engine.launcher=["sh", "-c", """{script}""", "sh"]'
    folder = tmp_path / "run"
    overrides = [word for override in (*TINY, launcher) for word in ("--set", override)]
    words = ["run", str(scene_file), "--run-folder", str(folder), *overrides]
    full.touch()
    assert command.main(words) == 5
    assert RunFolder(folder).stage_names() == []
    full.unlink()
    assert command.main(words) == 0
    table = (folder / "settlement.csv").read_bytes()
    assert table == (run / "settlement.csv").read_bytes()
    shutil.rmtree(folder / AFTER)
    full.touch()
    assert command.main(["resume", str(folder)]) == 5
    assert RunFolder(folder).stage_names() == ["preparation", FIRST, SECOND, JUMP]
    assert not RunFolder(folder).failure(JUMP)
    full.unlink()
    assert command.main(["resume", str(folder)]) == 0
    assert (folder / "settlement.csv").read_bytes() == table


@pytest.mark.parametrize("share", [2.0, 50.0])
@pytest.mark.long
def test_absurd_time_step(
    scene_file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    share: float,
) -> None:
    """Beyond the Rayleigh time the scene is refused; computed all the same, the result is."""
    words = ["--set", f"engine.rayleigh_share={share}", "--run-folder", str(tmp_path / "no")]
    assert command.main(["run", str(scene_file), *words]) == 3
    assert "rayleigh_share" in capsys.readouterr().err
    plain = load_scene(scene_file, TINY)
    step = plain.rayleigh_time * share
    monkeypatch.setattr(Scene, "time_step", step)
    monkeypatch.setattr(Scene, "steps_per_cycle", 100)
    with pytest.raises(TrackbedError) as caught:
        run_scene(scene_file, tmp_path / "run", overrides=TINY, progress=QUIET)
    assert caught.value.exit_code in (5, 6, 7), caught.value
    assert RunFolder(tmp_path / "run").outcomes() == []


# --- other scenes, other ways to start ------------------------------------------------------


@pytest.mark.parametrize("symmetry", ['["y"]', "[]"])
@pytest.mark.long
def test_box(scene_file: Path, tmp_path: Path, symmetry: str) -> None:
    """A box, with a mirror plane and without, is prepared, loaded, jumped and read."""
    text = scene_file.read_text().replace('"cylinder"', '"box"')
    lines = [line for line in text.splitlines() if not line.startswith("radius =")]
    at = lines.index("[sample]") + 1
    lines[at:at] = ["size_x = 0.02", "size_y = 0.016"]
    path = tmp_path / "scene.toml"
    path.write_text("\n".join(lines) + "\n")
    shorter = ("procedure.k_i=1", "procedure.k=3", "procedure.h=2", "procedure.total_cycles=10")
    overrides = (*TINY[1:], *shorter, f"sample.symmetry={symmetry}", "loading.piston_mass=2e-3")
    run_scene(path, tmp_path / "run", overrides=overrides, progress=QUIET)
    table = (tmp_path / "run" / "settlement.csv").read_text()
    assert ",jumped," in table
    assert table.splitlines()[-1].startswith("10,")
    window = window_of(tmp_path / "run", "window_000001")
    low, high = window.position.min(axis=(0, 1)), window.position.max(axis=(0, 1))
    assert (low > 0.9 * window.radius.min()).all()
    assert (high[:2] < np.array([0.02, 0.016]) - 0.9 * window.radius.min()).all()


@pytest.mark.long
def test_load_series_across_a_jump(scene_file: Path, tmp_path: Path) -> None:
    """Every sample of the series, at the ends of its segments too, to 1e-9, in all windows."""
    series = tmp_path / "load.csv"
    stress = 3000 + 11000 * np.array([0, 0.3, 1.0, 0.5, 0.1, 0])
    rows = (f"{t:.17g},{s:.17g}" for t, s in zip(np.linspace(0, 0.02, 6), stress, strict=True))
    series.write_text("time,stress\n" + "\n".join(rows) + "\n")
    head, _, rest = scene_file.read_text().partition("[loading]")
    path = tmp_path / "scene.toml"
    loading = '[loading]\nwaveform = "series"\nseries = "load.csv"\npiston_mass = 0.001\n\n'
    path.write_text(head + loading + rest[rest.index("[procedure]") :])
    shorter = ("procedure.k_i=1", "procedure.k=3", "procedure.h=1", "procedure.total_cycles=9")
    overrides = (*TINY, *shorter)
    run_scene(path, tmp_path / "run", overrides=overrides, progress=QUIET)
    scene = load_scene(path, overrides)
    per_cycle = scene.samples_per_cycle
    # The mesh of samples holds the segments' ends.
    assert per_cycle % 5 == 0
    names = [n for n in RunFolder(tmp_path / "run").stage_names() if n.startswith("window")]
    assert len(names) >= 3
    for name in names:
        window = window_of(tmp_path / "run", name)
        track = window.piston
        assert len(track.time_step) == len(window) * per_cycle
        sample = np.arange(1, len(track.time_step) + 1)
        target = scene.stress_at(sample / per_cycle) * scene.loaded_area
        np.testing.assert_allclose(track.target_force, target, rtol=1e-9)


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
