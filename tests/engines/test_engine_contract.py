"""What every engine promises: one suite, one tiny scene, each engine in turn.

A new engine is added to `ENGINES` below; what it is allowed to differ in is said in its own tests.
"""

from __future__ import annotations

import os
import shutil
import signal
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import trackbed
from adapters import engine_lammps
from adapters.dump import dump_frames
from adapters.engine import Engine, EngineStart, engine_named
from adapters.errors import EngineMissing, TrackbedError
from adapters.procedure import run_scene
from adapters.progress import Progress
from adapters.run_folder import RunFolder
from adapters.sample import GRAVITY
from adapters.scene import Scene
from adapters.scene_file import scene_load
from adapters.state import Contacts, State, state_load
from adapters.window import Window, window_load, window_read
from scenes import scene_template
from tests.forked_commands import Commands, processes_in

REAL = [
    pytest.param(name, marks=pytest.mark.engine(name)) for name in ("liggghts", "lammps", "yade")
]
"""Engines with mechanics, and with a process to kill."""
ENGINES = [*REAL, "fake"]

QUIET = Progress(quiet=True)
TINY = (
    "sample.radius=0.018",
    "sample.count=40",
    "material.grain.young=2e8",
    "loading.piston_mass=0.001",
    "procedure.k_i=2",
    "procedure.k=3",
    "procedure.h=2",
    "procedure.healing_cycles=1",
    "procedure.total_cycles=11",
)
"""Forty soft grains, about 2,500 steps a cycle, one jump from cycle 5 to 7."""
FIRST, SECOND, JUMP, AFTER = "window_000000", "window_000002", "jump_000005_1", "window_000007"
HISTORY = 7
"""Columns of ``history.txt``."""


class Sample:
    """A finished run of the tiny scene on one engine."""

    def __init__(self, name: str, folder: Path) -> None:
        self.name, self.file, self.run = name, folder / "scene.toml", folder / "run"
        self.file.write_text(scene_template("karrech-coarse"))
        self.overrides = (*TINY, f'engine.name="{name}"')
        self.engine: Engine = engine_named(name)
        self.scene: Scene = scene_load(self.file, self.overrides)
        run_scene(self.file, self.run, overrides=self.overrides, progress=QUIET)

    @property
    def table(self) -> bytes:
        return (self.run / "settlement.csv").read_bytes()

    def words(self, run: Path) -> tuple[object, ...]:
        """Of the command that starts a run, or goes on with it."""
        if (run / "manifest.json").exists():
            return ("resume", run)
        overrides = [word for override in self.overrides for word in ("--set", override)]
        return ("run", self.file, "--run-folder", run, *overrides)

    def copy(self, folder: Path, *without: str) -> Path:
        """The run, less some stages."""
        shutil.copytree(self.run, folder, ignore=shutil.ignore_patterns(*without))
        return folder

    def window(self, stage: str) -> Window:
        return window_load(self.run / stage / "states.npz")

    def start(self, stage: str) -> EngineStart:
        """That of a window that goes on from a finished one."""
        outcome = RunFolder(self.run).outcome(stage)
        assert outcome is not None
        notes = outcome.notes
        return EngineStart(
            self.run / stage / "end.restart",
            notes["time_step"],
            notes["piston_mesh"],
            notes["piston_height"],
        )

    def computed(self, start: EngineStart, cycles: int, folder: Path) -> Window:
        """A window computed outside any run folder."""
        folder.mkdir()
        digests = self.engine.write_cycles(self.scene, start, cycles, folder)
        done = self.engine.run(self.scene, "in.cycles", folder, lambda: None, digests)
        assert done.decks == digests
        assert done.cpu_s >= 0
        assert 0 <= done.start_up_s <= max(done.wall_s, done.start_up_s)
        names = self.engine.wall_names(self.scene, piston=True)
        return window_read(folder, 0, names, start.piston_height)


@pytest.fixture(scope="module", params=ENGINES)
def sample(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Sample:
    return Sample(request.param, tmp_path_factory.mktemp(request.param))


@pytest.fixture(scope="module")
def commands(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Commands]:
    """A server of commands."""
    server = Commands(tmp_path_factory.mktemp("commands"))
    yield server
    server.close()


def real(sample: Sample) -> None:
    """Go on only with an engine that has mechanics and a process."""
    if sample.name == "fake":
        pytest.skip("the fake engine has no mechanics and no process")


def at_rest(state: State) -> State:
    still = np.zeros_like(state.position)
    return state.moved(state.position, velocity=still, spin=still)


def springs(contacts: Contacts) -> dict[tuple[int, ...], np.ndarray]:
    """Tangential springs by pair [m]."""
    return dict(zip(map(tuple, contacts.pair.tolist()), contacts.tangential_spring, strict=True))


def check_springs(sample: Sample, before: State, after: State, without: int = 0) -> None:
    """Contacts that a move left alone keep their springs; ``without`` those of one grain.

    At rest a normal force has no viscous part, so Coulomb may allow a contact less than before:
    then its spring is cut short, in its direction.
    """
    old, new = springs(before.contacts), springs(after.contacts)
    # Positions have round-off of their own after a move: overlaps of 1e-18 m come and go.
    lost = [pair for pair in old if pair not in new and without not in pair]
    assert len(lost) <= 2
    pairs = list(map(tuple, after.contacts.pair.tolist()))
    drag = np.linalg.norm(after.contacts.tangential_force, axis=1)
    push = np.linalg.norm(after.contacts.normal_force, axis=1)
    slides = dict(
        zip(pairs, drag > 0.999 * sample.scene.material.grain.friction * push, strict=True)
    )
    kept = [pair for pair in old if pair in new and without not in pair]
    largest = max(np.linalg.norm(old[pair]) for pair in kept)
    assert largest > 1e-9
    assert sum(not slides[pair] for pair in kept) > 10
    for pair in kept:
        expected = old[pair]
        if slides[pair]:
            share = np.linalg.norm(new[pair]) / np.linalg.norm(expected)
            assert share < 1 + 1e-6, pair
            expected = share * expected
        assert new[pair] == pytest.approx(expected, abs=1e-6 * largest), pair


# --- what it leaves -------------------------------------------------------------------------


def test_version_and_command(sample: Sample) -> None:
    """An engine tells its version, and the words that run it, the launcher's first."""
    assert sample.engine.name == sample.name
    assert any(letter.isdigit() for letter in sample.engine.version())
    launched = scene_load(sample.file, (*sample.overrides, 'engine.launcher=["nice"]'))
    if sample.name != "fake":
        assert sample.engine.command(launched, "in.cycles")[0] == "nice"


def test_preparation(sample: Sample) -> None:
    """Files of the rain: a history, frames of it, the settled bed with every grain and wall."""
    folder = sample.run / "preparation"
    history = np.loadtxt(folder / "history.txt", skiprows=1, ndmin=2)
    assert history.shape[1] == HISTORY
    for frame in dump_frames(folder / "rain.dump", expected_ids=range(1, 41)):
        assert {"id", "x", "y", "z", "radius"} <= set(frame.columns)
    state = state_load(folder / "state.npz")
    assert np.array_equal(state.identifier, np.arange(1, 41))
    assert set(state.wall_force) == set(sample.engine.wall_names(sample.scene, piston=False))
    mass = 4 / 3 * np.pi * sample.scene.material.grain.density * state.radius**3
    assert state.mass == pytest.approx(mass, rel=1e-6)
    assert (folder / "end.restart").stat().st_size > 0


def test_settled_bed_is_in_balance(sample: Sample) -> None:
    """Contacts, walls and weight of every grain add up to nearly nothing.

    So forces have the sign, and walls the names, that the contract asks for.
    """
    real(sample)
    state = state_load(sample.run / "preparation" / "state.npz")
    force = np.sum(list(state.wall_force.values()), axis=0)
    force[:, 2] -= GRAVITY * state.mass
    on_first = state.contacts.normal_force + state.contacts.tangential_force
    np.add.at(force, state.contacts.pair[:, 0] - 1, on_first)
    np.subtract.at(force, state.contacts.pair[:, 1] - 1, on_first)
    weight = GRAVITY * state.mass
    assert np.median(np.linalg.norm(force, axis=1)) < 0.05 * weight.mean()
    assert np.linalg.norm(force.sum(axis=0)) < 0.02 * weight.sum()
    floor = state.wall_force["floor"][:, 2].sum()
    # Side walls carry the rest by friction, up or, where the bed sprang back, down.
    assert 0.5 * weight.sum() < floor < 1.5 * weight.sum()


def test_cycles(sample: Sample) -> None:
    """A state each cycle end, and a record of the piston that holds the ends too."""
    scene, window = sample.scene, sample.window(SECOND)
    assert len(window) == 3
    assert np.all(np.diff(window.time_step) == scene.steps_per_cycle)
    assert np.all(window.time_step % scene.steps_per_cycle == 0)
    assert np.isin(window.time_step[1:], window.piston.time_step).all()
    phase = (window.piston.time_step - window.time_step[0]) / scene.steps_per_cycle
    target = scene.stress_at(phase) * scene.loaded_area
    assert window.piston.target_force == pytest.approx(target, rel=1e-9, abs=1e-9 * target.max())
    if sample.name != "fake":
        assert window.piston.force_error(scene.steps_per_cycle).max() < 0.1


def test_overlaps_are_those_of_the_positions(sample: Sample) -> None:
    """r_i + r_j - distance for every contact, and no overlap without one, at every cycle end."""
    real(sample)
    window = sample.window(SECOND)
    for index in range(len(window) + 1):
        state = window.state(index)
        pair = state.contacts.pair - 1
        distance = np.linalg.norm(state.position[pair[:, 0]] - state.position[pair[:, 1]], axis=1)
        overlap = state.radius[pair].sum(axis=1) - distance
        np.testing.assert_allclose(state.contacts.overlap, overlap, atol=1e-14)
        first, second = np.triu_indices(len(state.radius), 1)
        gap = np.linalg.norm(state.position[first] - state.position[second], axis=1)
        gap -= state.radius[first] + state.radius[second]
        found = set(zip(first[gap < -1e-14], second[gap < -1e-14], strict=True))
        assert found <= set(map(tuple, pair.tolist()))
    assert len(pair) > 20


def test_forces_of_contacts_obey_hertz_and_coulomb(sample: Sample) -> None:
    """At rest a contact pushes with 4/3 E* sqrt(R*) delta^(3/2), and drags with mu of it at most.

    Put back at rest, so that next to no damping is in the forces: LIGGGHTS dumps those of the half
    step behind the instant.  Normals point from j to i.
    """
    real(sample)
    state = state_load(sample.run / JUMP / "relaxed.npz")
    after = sample.window(AFTER).state(0)
    assert np.array_equal(after.position, state.position)
    pair = after.contacts.pair - 1
    reduced = 1 / (1 / after.radius[pair]).sum(axis=1)
    overlap = after.contacts.overlap
    force = 4 / 3 * sample.scene.stiffness.grain * np.sqrt(reduced) * overlap**1.5
    apart = after.position[pair[:, 0]] - after.position[pair[:, 1]]
    expected = force[:, None] * apart / np.linalg.norm(apart, axis=1)[:, None]
    bar = 0.02 * force.max()
    np.testing.assert_allclose(after.contacts.normal_force, expected, rtol=0, atol=bar)
    push = np.linalg.norm(after.contacts.normal_force, axis=1)
    drag = np.linalg.norm(after.contacts.tangential_force, axis=1)
    assert np.all(drag <= sample.scene.material.grain.friction * push + bar)


# --- save, load, move, go on ----------------------------------------------------------------


def test_goes_on_where_it_was_saved(sample: Sample, tmp_path: Path) -> None:
    """A window's first state is the last one of the window before it."""
    before = sample.window(SECOND).state(-1)
    window = sample.computed(sample.start(SECOND), 1, tmp_path / "next")
    after = window.state(0)
    for name in ("position", "velocity", "spin", "time_step", "piston_height"):
        assert np.array_equal(getattr(before, name), getattr(after, name)), name
    assert np.array_equal(before.contacts.pair, after.contacts.pair)
    spring = before.contacts.tangential_spring
    # Work on the last digits is allowed: an engine may turn a spring into a force and back.
    tolerance = 1e-9 * np.abs(spring).max(initial=0.0)
    np.testing.assert_allclose(after.contacts.tangential_spring, spring, rtol=0, atol=tolerance)


def test_repeats_itself(sample: Sample, tmp_path: Path) -> None:
    """The same window twice, bit for bit: an interrupted run ends in the same table."""
    one, two = (sample.computed(sample.start(FIRST), 1, tmp_path / name) for name in "ab")
    assert np.array_equal(one.position, two.position)
    assert np.array_equal(one.piston.contact_force, two.piston.contact_force)


def test_moved_grains_keep_their_springs(sample: Sample, tmp_path: Path) -> None:
    """A whole bed shifted up by 1 mm, at rest: places bit for bit, and the drag of each contact.

    The tangential force of a contact at rest is that of its spring alone: an engine that lost its
    history would have none.  Contacts that the shift leaves alone keep it.
    """
    before = at_rest(sample.window(SECOND).state(-1))
    lifted = before.moved(before.position + np.array([0.0, 0.0, 1e-3]))
    start = sample.start(SECOND)
    start = replace(
        start,
        moved=lifted,
        piston_mesh=start.piston_mesh + 1,
        piston_height=start.piston_height + 2e-3,
    )
    after = sample.computed(start, 1, tmp_path / "moved").state(0)
    assert np.array_equal(after.position, lifted.position)
    assert not after.velocity.any()
    assert not after.spin.any()
    assert after.piston_height == start.piston_height
    assert after.time_step == start.time_step
    if sample.name != "fake":
        check_springs(sample, before, after)


def test_new_contacts_start_without_a_spring(sample: Sample, tmp_path: Path) -> None:
    """A grain put on a far one: that contact has no history, and the others theirs.

    Far, since LIGGGHTS keeps the spring of two that parted while they are neighbours.
    """
    real(sample)
    before = at_rest(sample.window(SECOND).state(-1))
    position, radius = before.position.copy(), before.radius
    top = int(np.argmax(position[:, 2]))
    others = np.delete(np.arange(len(position)), top)
    far = np.linalg.norm(position[others] - position[top], axis=1) > 6 * radius.max()
    for stranger in others[far][np.argsort(-position[others[far], 2])]:
        reach = radius[top] + radius[stranger] - 1e-6
        place = position[stranger] + np.array([0.0, 0.0, reach])
        gap = np.linalg.norm(position[others] - place, axis=1) - radius[others] - radius[top]
        if (gap < 0).sum() == 1:  # the stranger alone
            break
    position[top] = place
    start = sample.start(SECOND)
    start = replace(
        start,
        moved=before.moved(position),
        piston_mesh=start.piston_mesh + 1,
        piston_height=max(start.piston_height, position[top, 2] + before.radius[top]),
    )
    after = sample.computed(start, 1, tmp_path / "moved").state(0)
    new = springs(after.contacts)
    pair = (min(top, stranger) + 1, max(top, stranger) + 1)
    assert pair in new  # the engine's neighbours know that grains were moved
    largest = max(np.linalg.norm(spring) for spring in new.values())
    assert np.linalg.norm(new[pair]) < 1e-9 * largest
    check_springs(sample, before, after, without=top + 1)


def test_perturbed_start(sample: Sample, tmp_path: Path) -> None:
    """One grain moved by 1e-10 m along x, nothing else."""
    start = sample.start(FIRST)
    before = sample.window(FIRST).state(-1)
    after = sample.computed(replace(start, perturbation=1e-10), 1, tmp_path / "p").state(0)
    expected = before.position.copy()
    expected[0, 0] += 1e-10
    np.testing.assert_allclose(after.position, expected, rtol=0, atol=1e-16)


def test_jump_and_report(sample: Sample) -> None:
    """The procedure went through its jump, and the report can be written."""
    from adapters.report import report_write

    names = RunFolder(sample.run).stage_names()
    assert names == ["preparation", FIRST, SECOND, JUMP, AFTER]
    assert b",jumped," in sample.table
    relaxed = state_load(sample.run / JUMP / "relaxed.npz")
    assert np.array_equal(sample.window(AFTER).position[0], relaxed.position)
    assert "settlement" in report_write(sample.run).read_text().lower()


# --- dies cleanly ---------------------------------------------------------------------------


def engine_started(run: Path, stage: str) -> None:
    """Wait until an engine works on a stage, and has said so."""
    screen = run / "partial" / stage / "screen.txt"
    deadline = time.monotonic() + 300
    while not (screen.exists() and screen.stat().st_size):
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


@pytest.mark.parametrize("stage", ["preparation", AFTER])
def test_killed_run_resumes_to_the_identical_table(
    sample: Sample, commands: Commands, tmp_path: Path, stage: str
) -> None:
    """SIGKILL while the engine computes: no engine stays, and resumed the table is the same."""
    real(sample)
    without = ("preparation", "window_*", "jump_*") if stage == "preparation" else (AFTER,)
    run = sample.copy(tmp_path / "run", *without)
    commands.start(*sample.words(run))
    engine_started(run, stage)
    time.sleep(0.2)
    assert commands.kill() == -signal.SIGKILL
    assert gone(run)
    assert commands.run(*sample.words(run)) == 0, commands.output.read_text()
    assert (run / "settlement.csv").read_bytes() == sample.table


def test_lost_stage_is_computed_again(sample: Sample, tmp_path: Path) -> None:
    """Without its last window a run resumes to the identical table."""
    run = sample.copy(tmp_path / "run", AFTER)
    assert trackbed.main(["resume", str(run)]) == 0
    assert (run / "settlement.csv").read_bytes() == sample.table


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_engine_killed_alone(
    sample: Sample, commands: Commands, tmp_path: Path, number: signal.Signals
) -> None:
    """An engine that someone else ends is named, with exit code 5; nothing before it is lost."""
    real(sample)
    run = sample.copy(tmp_path / "run", AFTER)
    commands.start("resume", run)
    engine_started(run, AFTER)
    for pid in processes_in(run):
        os.kill(pid, number)
    assert commands.end() == 5
    assert f"was ended by {number.name}" in commands.output.read_text()
    assert RunFolder(run).stage_names() == ["preparation", FIRST, SECOND, JUMP]
    assert not RunFolder(run).failure(JUMP)


def test_absurd_time_step_is_not_credible(
    sample: Sample, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Fifty Rayleigh times a step: nan, lost or flying grains end in a typed error, not in 0."""
    real(sample)
    monkeypatch.setattr(Scene, "time_step", 50 * sample.scene.rayleigh_time)
    monkeypatch.setattr(Scene, "steps_per_cycle", 100)
    with pytest.raises(TrackbedError) as caught:
        run_scene(sample.file, tmp_path / "run", overrides=sample.overrides, progress=QUIET)
    assert caught.value.exit_code in (5, 6, 7), caught.value
    assert RunFolder(tmp_path / "run").outcomes() == []


def test_missing_program(sample: Sample, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine without the engine: exit code 4, and how to get it."""
    real(sample)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(engine_lammps, "lammps_program", lambda: None)
    with pytest.raises(EngineMissing) as caught:
        engine_named(sample.name).version()
    assert "install" in str(caught.value)
    words = ["run", str(sample.file), "--run-folder", str(tmp_path / "run")]
    assert trackbed.main([*words, "--engine", sample.name]) == 4


def test_full_disk(sample: Sample, tmp_path: Path) -> None:
    """An engine that may write no more is named, exit code 5; with room again the run goes on.

    A limit of 4 KiB on the size of files stands for the disk; it lies in the launcher.
    """
    real(sample)
    full = tmp_path / "full"
    # MPI's own large files go, so that the first to be too large is the engine's.
    plain = "export PMIX_MCA_gds=hash OMPI_MCA_btl=self; ulimit -f 8"
    script = f'if test -e {full}; then {plain}; fi; exec "$@"'
    launcher = f'engine.launcher=["sh", "-c", """{script}""", "sh"]'
    overrides = [word for o in (*sample.overrides, launcher) for word in ("--set", o)]
    run = tmp_path / "run"
    full.touch()
    words = ["run", str(sample.file), "--run-folder", str(run), *overrides]
    assert trackbed.main(words) == 5
    assert RunFolder(run).stage_names() == []
    full.unlink()
    assert trackbed.main(words) == 0
    assert (run / "settlement.csv").read_bytes() == sample.table
