"""LIGGGHTS under our decks: laws of mechanics, restarts, faults, and decks without Python."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from adapters.bed.sample import GRAVITY
from adapters.bed.state import FloatArray, State
from adapters.engines import decks
from adapters.files.run_folder import RunFolder
from adapters.files.window import Window, load_window
from adapters.moves import Jump
from adapters.procedure import stages
from adapters.procedure.status import read_status
from tests.engine_sample import (
    AFTER,
    FIRST,
    JUMP,
    QUIET,
    SECOND,
    TINY,
    Sample,
    at_rest,
    start_of,
    window_of,
)
from tests.forked_commands import Commands, awaited, gone
from tests.small_bed import read_rows
from trackbed import command
from trackbed.scenes import read_template

pytestmark = pytest.mark.engine("liggghts")


@pytest.fixture(scope="module")
def liggghts(samples: Callable[[str], Sample]) -> Sample:
    return samples("liggghts")


# --- mechanics ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def steps(liggghts: Sample, tmp_path_factory: pytest.TempPathFactory) -> Window:
    """Twenty single time steps from the end of a cycle, a state each."""
    folder = tmp_path_factory.mktemp("steps") / "window"
    return liggghts.computed(liggghts.start(SECOND), 1, folder, single_steps=20)


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


def test_contacts_accelerate_their_grains(steps: Window, liggghts: Sample) -> None:
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
        grain = liggghts.scene.material.grain
        shear = grain.young / (4 * (1 + grain.poisson) * (2 - grain.poisson))
        stiffness = 8 * shear * np.sqrt(reduced * state.contacts.overlap)
        spring = stiffness * np.linalg.norm(state.contacts.tangential_spring, axis=1)
        loaded = spring / np.linalg.norm(state.contacts.normal_force, axis=1) / grain.friction
        np.maximum.at(share, pair.ravel(), np.repeat(loaded, 2))
    sticking = share < 0.9
    assert sticking.sum() >= 8
    change = steps.mass[:, None] * np.diff(steps.velocity[:2], axis=0)[0]
    change /= liggghts.scene.time_step
    force = [outer_force(steps, i, steps.mass) + inner_force(steps.state(i)) for i in (0, 1)]
    error = np.linalg.norm(change - np.mean(force, axis=0), axis=1)[sticking]
    assert error.max() < 0.1 * np.linalg.norm(force[0], axis=1)[sticking].max()


# --- restarts -------------------------------------------------------------------------------


def test_resubmission_keeps_every_tangential_spring(liggghts: Sample, tmp_path: Path) -> None:
    """h = 0: positions and springs before the first step are those saved, bit for bit."""
    before, start = liggghts.window(SECOND).state(-1), liggghts.start(SECOND)
    moved = replace(start, moved=at_rest(before), piston_mesh=start.piston_mesh + 1)
    after = liggghts.computed(moved, 1, tmp_path / "again", single_steps=1).state(0)
    assert np.array_equal(after.position, before.position)
    assert not after.velocity.any()
    assert len(before.contacts) > 20
    assert np.array_equal(after.contacts.pair, before.contacts.pair)
    assert np.array_equal(after.contacts.tangential_spring, before.contacts.tangential_spring)


@pytest.mark.parametrize("lift", [0.5, 2.0])
@pytest.mark.long
def test_a_lifted_loose_grain_does_not_raise_the_piston(
    liggghts: Sample, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, lift: float
) -> None:
    """A loose grain that the estimate throws up through the piston is put back under it."""
    folder = liggghts.copy(tmp_path / "run", JUMP, AFTER)
    going = stages.Run(liggghts.scene, RunFolder(folder), liggghts.engine, stages.Variant(), QUIET)
    bed = stages.Bed(5, start_of(folder, SECOND), SECOND)
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
    steps = liggghts.scene.steps_per_cycle
    unloading = window_of(folder, SECOND).piston.elastic_deflection(steps).max()
    assert window.piston.height.max() < before.piston_height + unloading


def test_piston_follows_its_target_and_is_not_lifted(liggghts: Sample) -> None:
    """Root mean square of the force error below 3 % of the peak after three cycles; behind the
    jump it stands where the relaxed bed has it, no higher than before."""
    before, after = liggghts.window(SECOND), liggghts.window(AFTER)
    steps = liggghts.scene.steps_per_cycle
    assert before.piston.force_error(steps)[1:].max() < 0.03  # it begins behind two cycles
    assert after.piston.force_error(steps)[3:].max() < 0.03
    assert after.piston_start <= before.piston_heights()[-1]


def test_digests_are_those_of_the_shipped_decks(liggghts: Sample, tmp_path: Path) -> None:
    """The record of a window names every static deck it used, by content."""
    outcome = RunFolder(liggghts.run).outcome(SECOND)
    assert outcome is not None
    copies = decks.copy_deck(tmp_path, tuple(outcome.notes["decks"]), "liggghts_inputs")
    assert copies == outcome.notes["decks"]


# --- signals -----------------------------------------------------------------


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.long
def test_interrupted_while_the_engine_works(
    commands: Commands, liggghts: Sample, tmp_path: Path, number: signal.Signals
) -> None:
    """A signal ends the engine too, with exit code 130 and every finished stage in its place."""
    folder = liggghts.copy(tmp_path / "run", AFTER)
    pid = commands.start("resume", folder)
    awaited(folder / "partial" / AFTER / "screen.txt")
    os.kill(pid, number)
    assert commands.end() == 130
    assert gone(folder)
    assert RunFolder(folder).stage_names() == ["preparation", FIRST, SECOND, JUMP]
    assert commands.run("resume", folder) == 0
    assert (folder / "settlement.csv").read_bytes() == liggghts.table


# --- other scenes, other ways to start ------------------------------------------------------


@pytest.mark.skipif(shutil.which("mpirun") is None, reason="mpirun is not installed")
@pytest.mark.long
def test_launcher(commands: Commands, liggghts: Sample, tmp_path: Path) -> None:
    """Two processes under mpirun compute a run; killed, they leave nothing behind."""
    folder = tmp_path / "run"
    yielding = ("--mca", "mpi_yield_when_idle", "1")  # or two that wait take turns with no one
    words = ("mpirun", "--allow-run-as-root", "--oversubscribe", *yielding, "-np", "2")
    launcher = f"engine.launcher={json.dumps(words)}"
    softer = "material.grain.young=1e8"  # half the steps
    more = ("procedure.k_i=1", "procedure.k=2", "procedure.total_cycles=3", softer, launcher)
    asked = [word for override in (*TINY, *more) for word in ("--set", override)]
    commands.start("run", liggghts.file, "--run-folder", folder, *asked)
    awaited(folder / "partial" / FIRST / "screen.txt")
    commands.kill()
    assert gone(folder)
    assert commands.run("resume", folder) == 0, commands.output.read_text()
    table = (folder / "settlement.csv").read_text().splitlines()
    assert [line.split(",")[0] for line in table[1:]] == ["1", "2", "3"]
    log = (folder / "window_000001" / "log.liggghts").read_text()
    assert "1 by 2" in log or "2 by 1" in log or "1 by 1 by 2" in log


def test_dry_run_by_hand(liggghts: Sample, tmp_path: Path) -> None:
    """What --dry-run writes, run with the bare engine, is the preparation of the run itself."""
    assert command.main([*liggghts.words(tmp_path), "--dry-run"]) == 0
    folder = tmp_path / "dry_run"
    bare = ["liggghts", "-in", "in.prepare"]
    subprocess.run(bare, cwd=folder, check=True, capture_output=True)
    for name in ("history.txt", "states.dump", "contacts.dump"):
        kept = liggghts.run / "preparation" / name
        assert (folder / name).read_bytes() == kept.read_bytes(), name


@pytest.mark.long
def test_members_part_by_chance_alone(tmp_path: Path) -> None:
    """A grain moved by 1e-10 m: the first five cycles are the same bits, in the next all grains are
    elsewhere, in full runs too; each full run has the start of its own member."""
    keys = (
        "sample.count=60",
        "material.grain.young=1e9",
        "procedure.k_i=5",
        "procedure.k=5",
        "procedure.h=15",
    )
    settings = [word for key in keys for word in ("--set", key)]
    (tmp_path / "scene.toml").write_text(read_template("karrech-coarse"))
    words = ["run", str(tmp_path / "scene.toml"), "--engine", "liggghts", "--cycles", "40"]
    assert command.main([*words, *settings, "--members", "2", "--control"]) == 0
    (own, full), (other, beside) = (
        (read_rows(folder), read_rows(folder / "control"))
        for folder in (tmp_path / "run", tmp_path / "run" / "members" / "1")
    )
    assert own[:5] == full[:5] == other[:5] == beside[:5]
    assert own[:10] == full[:10] != other[:10] == beside[:10]
    places = [
        load_window(folder / "window_000005" / "states.npz").position[1]
        for folder in (tmp_path / "run", tmp_path / "run" / "members" / "1")
    ]
    assert (places[0] != places[1]).any(axis=1).all()
    result = read_status(tmp_path / "run").result
    assert result is not None
    assert (result.members, result.pairs, result.cycle) == (2, 2, 40)
    assert result.loaded_body.chaos > 1e-9
    assert result.error.chaos > 1e-4
