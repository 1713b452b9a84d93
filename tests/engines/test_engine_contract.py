"""What every engine promises: one suite, one tiny scene, each engine in turn.

A new engine is a file that sets ``ENGINE``; what it is allowed to differ in is said in its own
tests.  Faults of its process are in ``test_faults.py``.
"""

from __future__ import annotations

import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from adapters.bed.sample import GRAVITY
from adapters.bed.state import Contacts, State, load_state
from adapters.engines.contract import get_engine
from adapters.files.dump_reader import read_frames
from adapters.files.run_folder import RunFolder
from adapters.procedure.run import run_scene
from adapters.scene.file import load_scene
from tests.engine_sample import AFTER, FIRST, JUMP, QUIET, SECOND, TINY, Sample, at_rest, window_of
from tests.forked_commands import Commands, awaited, gone
from trackbed.scenes import find_scene_file, read_template

HISTORY = 7  # columns of ``history.txt``


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
    launched = load_scene(sample.file, (*sample.overrides, 'engine.launcher=["nice"]'))
    if sample.name != "fake":
        assert sample.engine.command(launched, "in.cycles")[0] == "nice"


def test_preparation(sample: Sample) -> None:
    """Files of the rain: a history, frames of it, the settled bed with every grain and wall."""
    folder = sample.run / "preparation"
    history = np.loadtxt(folder / "history.txt", skiprows=1, ndmin=2)
    assert history.shape[1] == HISTORY
    for frame in read_frames(folder / "rain.dump"):
        assert {"id", "x", "y", "z", "radius"} <= set(frame.columns)
        assert np.array_equal(frame.column("id"), np.arange(1, 41))
    state = load_state(folder / "state.npz")
    assert np.array_equal(state.identifier, np.arange(1, 41))
    assert set(state.wall_force) == set(sample.engine.wall_names(sample.scene, piston=False))
    mass = 4 / 3 * np.pi * sample.scene.material.grain.density * state.radius**3
    assert state.mass == pytest.approx(mass, rel=1e-6)
    assert (folder / "end.restart").stat().st_size > 0


def test_settled_bed_is_in_balance(sample: Sample) -> None:
    """Contacts, walls and weight of every grain add up to nearly nothing.

    So forces have the sign, and walls the names, that the contract asks for.
    """
    sample.need_process()
    state = load_state(sample.run / "preparation" / "state.npz")
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
    sample.need_process()
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
    sample.need_process()
    state = load_state(sample.run / JUMP / "relaxed.npz")
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


@pytest.mark.long
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


@pytest.mark.long
def test_repeats_itself(sample: Sample, tmp_path: Path) -> None:
    """The same window twice, bit for bit: an interrupted run ends in the same table."""
    one, two = (sample.computed(sample.start(FIRST), 1, tmp_path / name) for name in "ab")
    assert np.array_equal(one.position, two.position)
    assert np.array_equal(one.piston.contact_force, two.piston.contact_force)


@pytest.mark.long
def test_moved_grains_keep_their_springs(sample: Sample, tmp_path: Path) -> None:
    """A whole bed shifted up by 1 mm, at rest: places bit for bit, and the drag of each contact.

    The tangential force of a contact at rest is that of its spring alone: an engine that lost its
    history would have none.  Contacts that the shift leaves alone keep it.
    """
    before = at_rest(sample.window(SECOND).state(-1))
    lifted = before.move_to(before.position + np.array([0.0, 0.0, 1e-3]))
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


@pytest.mark.long
def test_new_contacts_start_without_a_spring(sample: Sample, tmp_path: Path) -> None:
    """A grain put on a far one: that contact has no history, and the others theirs.

    Far, since LIGGGHTS keeps the spring of two that parted while they are neighbours.
    """
    sample.need_process()
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
        moved=before.move_to(position),
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


@pytest.mark.long
def test_perturbed_start(sample: Sample, tmp_path: Path) -> None:
    """One grain moved by 1e-10 m along x, nothing else."""
    start = sample.start(FIRST)
    before = sample.window(FIRST).state(-1)
    after = sample.computed(replace(start, perturbation=1e-10), 1, tmp_path / "p").state(0)
    expected = before.position.copy()
    expected[0, 0] += 1e-10
    np.testing.assert_allclose(after.position, expected, rtol=0, atol=1e-16)


@pytest.mark.long
def test_jump_and_report(sample: Sample) -> None:
    """The procedure went through its jump, and the report can be written."""
    from adapters.report.page import write_report

    names = RunFolder(sample.run).stage_names()
    assert names == ["preparation", FIRST, SECOND, JUMP, AFTER]
    assert b",jumped," in sample.table
    relaxed = load_state(sample.run / JUMP / "relaxed.npz")
    assert np.array_equal(sample.window(AFTER).position[0], relaxed.position)
    assert "settlement" in write_report(sample.run).read_text().lower()


# --- other scenes ---------------------------------------------------------------------------

SHORT = ("procedure.k_i=1", "procedure.k=3", "procedure.h=1", "procedure.total_cycles=9")
with_decks = pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.engine(name)) for name in ("liggghts", "lammps")]
)


@with_decks
@pytest.mark.parametrize("symmetry", ['["y"]', "[]"])
@pytest.mark.long
def test_box(name: str, tmp_path: Path, symmetry: str) -> None:
    """A box, with a mirror plane and without, is prepared, loaded, jumped; grains stay inside."""
    lines = read_template("karrech-coarse").replace('"cylinder"', '"box"').splitlines()
    lines = [line for line in lines if not line.startswith("radius =")]
    at = lines.index("[sample]") + 1
    lines[at:at] = ["size_x = 0.02", "size_y = 0.016"]
    (tmp_path / "scene.toml").write_text("\n".join(lines) + "\n")
    overrides = (*TINY[1:], *SHORT, f'engine.name="{name}"', f"sample.symmetry={symmetry}")
    overrides += ("loading.piston_mass=2e-3",)
    run_scene(tmp_path / "scene.toml", tmp_path / "run", overrides=overrides, progress=QUIET)
    assert ",jumped," in (tmp_path / "run" / "settlement.csv").read_text()
    window = window_of(tmp_path / "run", "window_000001")
    low, high = window.position.min(axis=(0, 1)), window.position.max(axis=(0, 1))
    assert (low > 0.9 * window.radius.min()).all()
    assert (high[:2] < np.array([0.02, 0.016]) - 0.9 * window.radius.min()).all()


@with_decks
@pytest.mark.long
def test_load_series_across_a_jump(name: str, tmp_path: Path) -> None:
    """Every sample of the series, at the ends of its segments too, to 1e-9, in all windows."""
    stress = 3000 + 11000 * np.array([0, 0.3, 1.0, 0.5, 0.1, 0])
    rows = (f"{t:.17g},{s:.17g}" for t, s in zip(np.linspace(0, 0.02, 6), stress, strict=True))
    (tmp_path / "load.csv").write_text("time,stress\n" + "\n".join(rows) + "\n")
    head, _, rest = read_template("karrech-coarse").partition("[loading]")
    path = tmp_path / "scene.toml"
    loading = '[loading]\nwaveform = "series"\nseries = "load.csv"\npiston_mass = 0.001\n\n'
    path.write_text(head + loading + rest[rest.index("[procedure]") :])
    overrides = (*TINY, *SHORT, f'engine.name="{name}"')
    run_scene(path, tmp_path / "run", overrides=overrides, progress=QUIET)
    scene = load_scene(path, overrides)
    assert scene.samples_per_cycle % 5 == 0  # the mesh of samples holds the segments' ends
    names = [n for n in RunFolder(tmp_path / "run").stage_names() if n.startswith("window")]
    assert len(names) >= 3
    for one in names:
        window = window_of(tmp_path / "run", one)
        track = window.piston
        assert len(track.time_step) == len(window) * scene.samples_per_cycle
        phase = np.arange(1, len(track.time_step) + 1) / scene.samples_per_cycle
        target = scene.stress_at(phase) * scene.loaded_area
        np.testing.assert_allclose(track.target_force, target, rtol=1e-9)


@with_decks
@pytest.mark.parametrize(
    "changes",
    [
        ("material.grain.friction=0.0", "material.wall.friction=0.0"),
        ("sample.symmetry=[]", "sample.radius=0.012"),
        ("loading.area_share=0.6",),
    ],
    ids=["frictionless", "whole cylinder", "partial piston"],
)
@pytest.mark.long
def test_other_scenes(name: str, tmp_path: Path, changes: tuple[str, ...]) -> None:
    """Less, or other, physics is prepared, loaded and read: without friction no deck and no file
    has a tangential force, and a piston on a part of the section presses that part only."""
    overrides = (*TINY, *SHORT, "procedure.total_cycles=4", f'engine.name="{name}"', *changes)
    run_scene(
        find_scene_file("karrech-coarse"), tmp_path / "run", overrides=overrides, progress=QUIET
    )
    scene = load_scene(find_scene_file("karrech-coarse"), overrides)
    window = window_of(tmp_path / "run", "window_000001")
    assert len(window) == 3
    error = np.sqrt(np.mean((window.piston.contact_force - window.piston.target_force) ** 2))
    assert error < 0.1 * window.piston.target_force.max()
    place = np.hypot(window.position[..., 0], window.position[..., 1])
    pressed = np.abs(window.wall_force["piston_wall"]).max(axis=2) > 0
    assert (place[pressed] < scene.piston_reach + window.radius.max()).all()
    frictionless = scene.material.grain.friction == 0
    assert any(contacts.tangential_force.any() for contacts in window.contacts) != frictionless
    assert window.spin.any() != frictionless
    folder = tmp_path / "run" / "window_000001"
    decks = "".join(path.read_text() for path in folder.glob("*.in"))
    assert ("mindlin" in decks or "tangential history" in decks) != frictionless
    assert not (folder / "pairs.dump").exists()


@with_decks
def test_momentum(name: str, samples: Callable[[str], Sample], tmp_path: Path) -> None:
    """Velocity Verlet: m (v1 - v0) / dt = (F0 + F1) / 2, exactly, for the sum over the grains.

    Contacts cancel in the sum, so F is walls and weight: a wall that is missing from the dump, or
    of the wrong sign, can not hide.  Velocities have 16 digits, their difference is a part in 1e5.
    """
    sample = samples(name)
    steps = sample.computed(sample.start(SECOND), 1, tmp_path / "steps", single_steps=20)
    change = np.diff(np.einsum("n,cna->ca", steps.mass, steps.velocity), axis=0)
    change /= sample.scene.time_step
    force = np.sum(list(steps.wall_force.values()), axis=0).sum(axis=1)
    force[:, 2] -= GRAVITY * steps.mass.sum()
    mean = (force[1:] + force[:-1]) / 2
    np.testing.assert_allclose(change, mean, rtol=1e-7, atol=1e-9 * np.abs(force).max())
    assert np.abs(mean).max() > 1e-3 * GRAVITY * steps.mass.sum()  # something was balanced


@with_decks
def test_walls_keep_springs(name: str, samples: Callable[[str], Sample], tmp_path: Path) -> None:
    """Put back at rest, the bed drags on floor and cylinder as before, but for damping and what it
    adds to Coulomb's limit; without the springs all drag would be gone."""
    sample = samples(name)
    start, before = sample.start(SECOND), sample.window(SECOND).state(-1)
    moved = replace(start, moved=at_rest(before), piston_mesh=start.piston_mesh + 1)
    window = sample.computed(moved, 1, tmp_path / "again", single_steps=1)
    after = window.state(0)
    assert np.array_equal(after.position, before.position)
    assert not after.velocity.any()
    for wall, axes in (("floor", [0, 1]), ("cylinder", [2])):
        drag, again = before.wall_force[wall][:, axes], after.wall_force[wall][:, axes]
        least, change = (0.01, 0.3) if name == "liggghts" else (1e-3, 0.75)
        assert np.linalg.norm(drag) > least * GRAVITY * before.mass.sum()
        assert np.linalg.norm(again - drag) < change * np.linalg.norm(drag)
        cosine = np.sum(again * drag) / np.linalg.norm(again) / np.linalg.norm(drag)
        assert np.linalg.norm(again) > 0.4 * np.linalg.norm(drag)
        assert cosine > 0.7
    # The piston starts from rest where it was asked to.
    assert window.piston_start == start.piston_height
    assert abs(window.piston.height[0] - start.piston_height) < 1e-6


@with_decks
@pytest.mark.long
def test_example_by_hand(name: str, tmp_path: Path) -> None:
    """The shipped decks with the files of example/ run without Python, window after window."""
    decks = Path(str(files(f"{name}_inputs")))
    for path in (*decks.glob("*.in"), *decks.glob("in.*"), *(decks / "example").iterdir()):
        shutil.copy(path, tmp_path)
    program = get_engine(name).program()
    assert program is not None

    def by_hand(deck: str, *words: str) -> str:
        command = [*program, "-in", deck, *words]
        done = subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True)
        return done.stdout

    assert "COMPLETE step" in by_hand("in.prepare")
    later = ("-var", "seat_part", "seat_none.in", "-var", "start_part", "start_continue.in")
    for words in ((), later):
        shutil.copy(tmp_path / "end.restart", tmp_path / "start.restart")
        assert "COMPLETE step" in by_hand("in.cycles", *words)
        track = np.loadtxt(tmp_path / "piston.txt", skiprows=1)
        assert np.isfinite(track).all()
        error = track[:, 2] - track[:, 1]
        assert np.sqrt(np.mean(error**2)) < 0.05 * track[:, 1].max()


# --- dies cleanly ---------------------------------------------------------------------------


@pytest.mark.parametrize("stage", ["preparation", AFTER])
@pytest.mark.long
def test_killed_run_resumes_to_the_identical_table(
    sample: Sample, commands: Commands, tmp_path: Path, stage: str
) -> None:
    """SIGKILL while the engine computes: no engine stays, and resumed the table is the same.

    The stage that was killed is computed again; what follows it is known from the sample.
    """
    without = ("preparation", "window_*", "jump_*") if stage == "preparation" else (AFTER,)
    run = sample.copy(tmp_path / "run", *without)
    sample.replayed(run, but=stage)
    if sample.name == "fake":  # no process of its own: made slow
        commands.start(*sample.words(run), slow=0.2)
        assert commands.until(stage.partition("_")[0])
    else:
        commands.start(*sample.words(run))
        awaited(run / "partial" / stage / "screen.txt")
        time.sleep(0.2)
    assert commands.kill() == -signal.SIGKILL
    assert gone(run)
    assert commands.run(*sample.words(run)) == 0, commands.output.read_text()
    assert (run / "settlement.csv").read_bytes() == sample.table
