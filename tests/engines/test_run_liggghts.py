"""Whole runs on LIGGGHTS with forty soft grains: seconds, not hours, and the same code."""

from __future__ import annotations

import random
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from adapters.bed.state import Contacts, State
from adapters.engines import decks
from adapters.engines.contract import EngineStart
from adapters.engines.liggghts import LiggghtsEngine
from adapters.errors import NotConverged
from adapters.files.run_folder import RunFolder
from adapters.files.window import Window, load_window, read_window
from adapters.procedure import fixed as jump_fixed
from adapters.procedure import room as jump_room
from adapters.procedure.progress import Progress
from adapters.procedure.run import run_scene
from adapters.relaxation.rearranged import LEAST, MOST, OVERLAP_MAX
from adapters.scene.file import load_scene
from adapters.scene.tables import Scene
from trackbed.scenes import scene_template

pytestmark = pytest.mark.engine("liggghts")

ENGINE = LiggghtsEngine()
QUIET = Progress(quiet=True)
TINY = (
    "sample.radius=0.018",
    "sample.count=40",
    "material.grain.young=1e9",
    "loading.piston_mass=0.001",
    "procedure.k_i=6",
    "procedure.k=4",
    "procedure.h=6",
    "procedure.healing_cycles=2",
    "procedure.total_cycles=22",
)
"""Forty grains, about 6,000 steps a cycle, one jump from cycle 10 to 16."""


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The coarse scene; `TINY` makes it small."""
    path = tmp_path_factory.mktemp("scene") / "scene.toml"
    path.write_text(scene_template("karrech-coarse"))
    return path


@pytest.fixture(scope="module")
def run(scene_file: Path) -> Path:
    """A finished run of the tiny scene."""
    folder = scene_file.parent / "run"
    run_scene(scene_file, folder, overrides=TINY, progress=QUIET)
    return folder


def tiny(scene_file: Path) -> Scene:
    return load_scene(scene_file, TINY)


def window_of(run: Path, name: str) -> Window:
    return load_window(run / name / "states.npz")


def springs(contacts: Contacts) -> dict[tuple[int, int], bytes]:
    """Tangential springs by pair, bit for bit."""
    return {
        (int(i), int(j)): spring.tobytes()
        for (i, j), spring in zip(contacts.pair, contacts.tangential_spring, strict=True)
    }


def resubmitted(
    scene: Scene, run: Path, stage: str, moved: State, folder: Path, piston: float
) -> Window:
    """One cycle from the end of ``stage`` with the grains where ``moved`` has them."""
    outcome = RunFolder(run).outcome(stage)
    assert outcome is not None
    folder.mkdir()
    start = EngineStart(
        run / stage / "end.restart",
        outcome.notes["time_step"],
        outcome.notes["piston_mesh"] + 1,
        piston,
        moved=moved,
    )
    digests = ENGINE.write_cycles(scene, start, 1, folder)
    ENGINE.run(scene, "in.cycles", folder, lambda: None, digests)
    return read_window(folder, moved.cycle, ENGINE.wall_names(scene, piston=True), piston)


def at_rest(state: State, position: np.ndarray) -> State:
    return state.moved(position, velocity=np.zeros_like(position), spin=np.zeros_like(position))


def test_resubmission_keeps_every_tangential_spring(
    run: Path, scene_file: Path, tmp_path: Path
) -> None:
    """h = 0: positions and springs before the first step are those saved, bit for bit."""
    before = window_of(run, "window_000006").state(-1)
    window = resubmitted(
        tiny(scene_file),
        run,
        "window_000006",
        at_rest(before, before.position),
        tmp_path / "again",
        before.piston_height,
    )
    assert np.array_equal(window.position[0], before.position)
    assert not window.velocity[0].any()
    assert len(before.contacts) > 20
    assert springs(window.contacts[0]) == springs(before.contacts)


def test_broken_contacts_lose_their_springs_and_new_ones_start_at_zero(
    run: Path, scene_file: Path, tmp_path: Path
) -> None:
    """One grain lifted away and pressed on a stranger: the other springs stay as they were.

    The stranger is one it has not touched at any cycle end of the window: LIGGGHTS keeps the
    spring of a pair that parted for as long as the two are neighbours (start_moved.in).
    """
    window = window_of(run, "window_000006")
    before = window.state(-1)
    position = before.position.copy()
    top = int(np.argmax(position[:, 2]))
    others = np.delete(np.arange(len(position)), top)
    held = {tuple(pair) for contacts in window.contacts for pair in contacts.pair.tolist()}
    distance = np.linalg.norm(position[others] - position[top], axis=1)
    gap = distance - before.radius[others] - before.radius[top]
    stranger = next(
        int(i) for i in others[np.argsort(gap)] if tuple(sorted((i + 1, top + 1))) not in held
    )
    direction = position[top] - position[stranger]
    reach = before.radius[top] + before.radius[stranger] - 1e-6
    position[top] = position[stranger] + reach * direction / np.linalg.norm(direction)
    window = resubmitted(
        tiny(scene_file),
        run,
        "window_000006",
        at_rest(before, position),
        tmp_path / "moved",
        before.piston_height,
    )
    old, new = springs(before.contacts), springs(window.contacts[0])
    kept = {pair for pair in old if top + 1 not in pair}
    assert kept <= new.keys()
    assert all(new[pair] == old[pair] for pair in kept)
    pair = (min(top, stranger) + 1, max(top, stranger) + 1)
    assert not np.frombuffer(new[pair]).any()


def test_jump_restarts_where_it_was_relaxed(run: Path) -> None:
    """The window after a jump starts at the relaxed positions; no loose grain lifts the piston."""
    from adapters.bed.state import load_state

    relaxed = load_state(run / "jump_000010_1" / "relaxed.npz")
    window = window_of(run, "window_000016")
    assert np.array_equal(window.position[0], relaxed.position)
    before = window_of(run, "window_000006").piston_heights()[-1]
    assert window.piston_start == relaxed.piston_height <= before


def test_piston_follows_its_target(run: Path, scene_file: Path) -> None:
    """Root mean square of the force error below 3 % of the peak after three cycles."""
    steps = tiny(scene_file).steps_per_cycle
    for name in ("window_000000", "window_000016"):
        assert window_of(run, name).piston.force_error(steps)[3:].max() < 0.03


def test_grains_are_in_balance(run: Path) -> None:
    """Contacts, walls and weight add up to m a: small beside the weight in the prepared bed.

    The bed settled to a kinetic energy of 1e-6 of the potential, so what is left is its rattle.
    """
    from adapters.bed.state import load_state

    state = load_state(run / "preparation" / "state.npz")
    force = np.sum(list(state.wall_force.values()), axis=0)
    force[:, 2] -= 9.81 * state.mass
    pair = state.contacts.pair - 1
    inner = state.contacts.normal_force + state.contacts.tangential_force
    np.add.at(force, pair[:, 0], inner)
    np.subtract.at(force, pair[:, 1], inner)
    assert np.median(np.linalg.norm(force, axis=1)) < 0.05 * 9.81 * state.mass.mean()


@pytest.mark.long
def test_serial_runs_repeat_bit_for_bit(run: Path, scene_file: Path, tmp_path: Path) -> None:
    """The same scene gives the same table, so that an interrupted run can end in it too."""
    run_scene(scene_file, tmp_path / "run", overrides=TINY, progress=QUIET)
    again = (tmp_path / "run" / "settlement.csv").read_bytes()
    assert again == (run / "settlement.csv").read_bytes()


@pytest.mark.long
def test_five_kills(run: Path, scene_file: Path, tmp_path: Path) -> None:
    """Five SIGKILLs at random times; resumed, the table is identical and no engine is left."""
    seed = random.randrange(10**6)
    print(f"seed {seed}")
    times = random.Random(seed)
    folder = tmp_path / "run"
    command = [sys.executable, "-m", "trackbed", "run", str(scene_file)]
    command += ["--run-folder", str(folder)]
    command += [word for override in TINY for word in ("--set", override)]
    for _ in range(5):
        with subprocess.Popen(command, stderr=subprocess.DEVNULL) as child:
            time.sleep(times.uniform(0.8, 3.0))
            child.send_signal(signal.SIGKILL)
        command = [sys.executable, "-m", "trackbed", "resume", str(folder)]
        if not (folder / "manifest.json").exists():
            command = [*command[:3], "run", str(scene_file), "--run-folder", str(folder)]
            command += [word for override in TINY for word in ("--set", override)]
    subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
    assert (folder / "settlement.csv").read_bytes() == (run / "settlement.csv").read_bytes()
    working = subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True).stdout
    assert str(folder) not in working


@pytest.mark.long
def test_load_series_is_followed_to_the_sample(scene_file: Path, run: Path, tmp_path: Path) -> None:
    """The engine's target force is the CSV's, linear between samples, in every recorded step."""
    series = tmp_path / "load.csv"
    stress = 14150 * np.array([0, 0.3, 1.0, 0.5, 0.1, 0])
    rows = (f"{t:.17g},{s:.17g}" for t, s in zip(np.linspace(0, 0.02, 6), stress, strict=True))
    series.write_text("time,stress\n" + "\n".join(rows) + "\n")
    text = scene_file.read_text()
    for key in ("amplitude", "mean", "frequency"):
        text = "\n".join(line for line in text.splitlines() if not line.startswith(f"{key} ="))
    head, loading, tail = text.partition("[loading]")
    # "mean" also names the mean radius: the loading table alone is changed.
    head = scene_file.read_text().partition("[loading]")[0]
    tail = tail.replace('waveform = "sine"', 'waveform = "series"\nseries = "load.csv"')
    path = tmp_path / "scene.toml"
    path.write_text(head + loading + tail)
    changes = [*TINY, "procedure.k_i=2", "procedure.total_cycles=4", "procedure.k=2"]
    run_scene(path, tmp_path / "run", overrides=changes, progress=QUIET)
    scene = load_scene(path, changes)
    for name in ("window_000000", "window_000002"):
        window = window_of(tmp_path / "run", name)
        phase = (window.piston.time_step - window.time_step[0]) / scene.steps_per_cycle
        target = scene.stress_at(phase) * scene.loaded_area
        assert window.piston.target_force == pytest.approx(
            target, rel=1e-9, abs=1e-9 * target.max()
        )


@pytest.mark.parametrize(
    "changes",
    [
        ("material.grain.friction=0.0", "material.wall.friction=0.0"),
        ("sample.symmetry=[]",),
        ("loading.area_share=0.8",),
    ],
    ids=["frictionless", "whole cylinder", "partial piston"],
)
@pytest.mark.long
def test_other_scenes_run(changes: tuple[str, ...], scene_file: Path, tmp_path: Path) -> None:
    """A scene with less, or another, physics is prepared, loaded and read."""
    short = ("procedure.k_i=2", "procedure.k=2", "procedure.total_cycles=4")
    run_scene(scene_file, tmp_path / "run", overrides=[*TINY, *short, *changes], progress=QUIET)
    table = (tmp_path / "run" / "settlement.csv").read_text().splitlines()
    assert len(table) == 5


@pytest.mark.long
def test_decks_run_by_hand(scene_file: Path, run: Path, tmp_path: Path) -> None:
    """A dry run's folder, and a window's, run with the bare engine."""
    run_scene(scene_file, tmp_path / "run", overrides=TINY, dry_run=True, progress=QUIET)
    words = ["liggghts", "-in", "in.prepare"]
    folder = tmp_path / "run" / "dry_run"
    subprocess.run(words, cwd=folder, check=True, stdout=subprocess.DEVNULL)
    assert (folder / "end.restart").exists()
    window = tmp_path / "window"
    shutil.copytree(run / "window_000006", window)
    words = ["liggghts", "-in", "in.cycles"]
    said = subprocess.run(words, cwd=window, check=True, capture_output=True, text=True).stdout
    assert "COMPLETE step" in said


def test_state_of_an_absurd_time_step_is_refused(scene_file: Path, tmp_path: Path) -> None:
    """A step far beyond the Rayleigh time ends in a named error, whatever the exit code."""
    from adapters.errors import TrackbedError

    changes = [*TINY, "engine.time_step=2e-3"]
    with pytest.raises(TrackbedError) as caught:
        run_scene(scene_file, tmp_path / "run", overrides=changes, progress=QUIET)
    assert caught.value.exit_code in (3, 5, 6, 7)


def test_digests_are_those_of_the_shipped_decks(run: Path) -> None:
    """The record of a window names every static deck it used, by content."""
    outcome = RunFolder(run).outcome("window_000006")
    assert outcome is not None
    copies = decks.copy_deck(run.parent, tuple(outcome.notes["decks"]))
    assert copies == outcome.notes["decks"]
    assert replace(outcome, notes={}).stage == "window"


@pytest.mark.long
def test_engine_goes_on_from_grains_that_changed_places(
    scene_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With no room for any smallest move grains change places: the engine takes the bed over, its
    overlaps are those of before, the piston holds its load, and from the second cycle on contacts
    are as many as before the jump, within what cycles scatter by."""

    def jammed(*_: object) -> None:
        raise NotConverged("made to fail")

    monkeypatch.setattr(jump_room, "relaxed", jammed)
    monkeypatch.setattr(jump_fixed, "find_history_gain", lambda *_: 300e-6)
    history = ('procedure.settlement="history"', 'procedure.jammed="rearranged"', "procedure.h=30")
    more = ("procedure.k_i=10", "procedure.total_cycles=50")
    run_scene(scene_file, tmp_path / "run", overrides=(*TINY, *history, *more), progress=QUIET)
    outcomes = RunFolder(tmp_path / "run").outcomes()
    (place,) = [n for n, outcome in enumerate(outcomes) if outcome.stage == "jump"]
    jump, behind = outcomes[place], outcomes[place + 1]
    record = jump.notes["relaxation"]
    assert record["method"] == "rearranged"
    assert record["relaxed"]["max_penetration"] <= OVERLAP_MAX * record["before"]["max_penetration"]
    assert LEAST / 4 <= jump.notes["gain"] / 300e-6 <= MOST
    before = [row["coordination_number"] for one in outcomes[:place] for row in one.rows][4:]
    after = [row["coordination_number"] for row in behind.rows[1:]]
    assert abs(np.mean(after) - np.mean(before)) < 3 * np.std(before, ddof=1)
    assert behind.rows[-1]["force_error"] < 0.25
