"""Beds of stones on LIGGGHTS: shape, mass, energy, restarts, jumps, and what a run leaves."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from adapters.bed import State, load_state
from adapters.bed.stones import find_form, write_form
from adapters.engines import EngineStart, get_engine
from adapters.errors import NotConverged
from adapters.files import Window, load_window, read_window, restart
from adapters.procedure.run import resume, run_scene
from adapters.scene import Scene, draw_start, load_scene
from tests.engine_sample import QUIET, at_rest, start_of
from tests.small_bed import read_rows
from trackbed import command
from trackbed.scenes import read_template

pytestmark = [pytest.mark.engine("liggghts"), pytest.mark.long]
STONES = (
    'engine.name="liggghts"', 'sample.form="wedge"', "sample.radius=0.022", "sample.count=30",
    "material.grain.young=2e8", "loading.piston_mass=0.005", "procedure.k_i=2", "procedure.k=3",
    "procedure.h=4", "procedure.healing_cycles=1", "procedure.total_cycles=13",
    "loading.amplitude=4000.0", "loading.mean=2000.0",
)  # fmt: skip
"""Thirty stones of unequal spheres, one jump from cycle 5 to 9."""
SECOND = "window_000002"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run of `STONES`, beside its scene."""
    folder = tmp_path_factory.mktemp("stones")
    (folder / "scene.toml").write_text(read_template("karrech-coarse"))
    run_scene(folder / "scene.toml", folder / "run", overrides=STONES, progress=QUIET)
    return folder / "run"


def load(run: Path, changes: Sequence[str] = ()) -> Scene:
    """Its scene, with changes."""
    return load_scene(run.parent / "scene.toml", (*STONES, *changes))


def compute(scene: Scene, start: EngineStart, cycles: int, folder: Path, split: int = 1) -> Window:
    """A window, in ``split`` commands of the engine."""
    engine = get_engine("liggghts")
    folder.mkdir()
    digests = engine.write_cycles(scene, start, cycles, folder)
    (folder / "run_sine.in").write_text(f"run {cycles // split * scene.steps_per_cycle}\n" * split)
    engine.run(scene, "in.cycles", folder, lambda: None, digests)
    names = engine.wall_names(scene, piston=True)
    return read_window(folder, 0, names, start.piston_height, scene.form)


def saved(run: Path) -> State:
    """The bed before the jump."""
    return load_window(run / SECOND / "states.npz").state(-1)


def test_a_run_keeps_its_stones_and_counts_their_rotation(run: Path, tmp_path: Path) -> None:
    """Thirty stones in every state, behind the jump as it placed and turned them; the bed keeps
    what it settled by; exports tell rotations of each."""
    rows = read_rows(run)
    assert [row["kind"] for row in rows].count("jumped") == 1
    jumped = [row["kind"] for row in rows].index("jumped")
    turned = [float(row["mean_rotation"]) for row in rows]
    assert 0 < turned[0] < turned[-1]
    settled = [float(row["mean_grain_settlement"]) for row in rows]
    asked = settled[jumped] - settled[jumped - 1]
    assert settled[jumped + 1] - settled[jumped - 1] > 0.5 * asked > 0
    after = load_window(run / "window_000009" / "states.npz").state(0)
    moved = load_state(run / "jump_000005_1" / "relaxed.npz")
    assert after.position.shape == (30, 3)
    np.testing.assert_allclose(after.position, moved.position, rtol=0, atol=1e-17)
    np.testing.assert_array_equal(after.orientation, moved.orientation)
    assert after.piston_height == moved.piston_height
    assert command.main(["export", str(run), "--to", "csv", "--into", str(tmp_path)]) == 0
    table = np.genfromtxt(tmp_path / "grains.csv", delimiter=",", names=True)
    last = table[table["cycle"] == 13]
    angle = np.linalg.norm([last[f"rotation_{axis}"] for axis in "xyz"], axis=0)
    assert angle.mean() == pytest.approx(turned[-1], rel=1e-12)


def test_mass_and_inertia_are_the_form_s(run: Path) -> None:
    """Of each body in the restart file: the mass of its volume, the moments of its form."""
    scene, state = load(run), saved(run)
    bodies = restart.find_stones(bytearray((run / SECOND / "end.restart").read_bytes()), "motion")
    bodies = bodies[np.argsort(bodies[:, restart.STONE_ID])]
    mass = 4 / 3 * np.pi * scene.material.grain.density * state.radius**3
    assert bodies[:, restart.MASS] == pytest.approx(mass, rel=1e-12)
    moments = (mass * state.radius**2)[:, None] * find_form("wedge").inertia
    np.testing.assert_allclose(bodies[:, 25:28], moments, rtol=1e-12)


def test_a_lone_stone_keeps_its_energy(run: Path, tmp_path: Path) -> None:
    """It falls, rebounds without loss, spins and flies on: energies of the engine's own columns.

    Between some fifty contacts, to 5e-4: each takes a hundred steps and more, and Verlet's error of
    (1/100)^2 of what it stores does not add up; the spheres' mean height is the centre's to 1e-5.
    """
    scene = load(run, (
        'sample.form="elongated"', "sample.symmetry=[]", "sample.radius=0.05", "sample.count=1",
        "material.grain.restitution=1.0", "material.grain.friction=0.0",
        "material.wall.friction=0.0", "engine.rayleigh_share=0.1",
    ))  # fmt: skip
    position, radius, height = draw_start(scene)
    engine = get_engine("liggghts")
    digests = engine.write_preparation(scene, position, radius, height, tmp_path)
    with suppress(NotConverged):  # it never rests, but may stand still at a top
        engine.run(scene, "in.prepare", tmp_path, lambda: None, digests)
    history = np.loadtxt(tmp_path / "history.txt", skiprows=1)
    energy, free = history[:, 2:5].sum(axis=1), history[:, 6] == 0
    assert free.sum() > 100
    assert history[:, 3].max() > 0.1 * energy[0]  # it spins
    assert np.ptp(energy[free]) < 5e-4 * energy[0]


def test_windows_are_one_process(run: Path, tmp_path: Path) -> None:
    """A bed lifted by 1 mm falls back: three windows, and one process of three runs, to the bit.

    The piston, heavy and far above, drives nothing: at a second run LIGGGHTS doubles its force.
    """
    scene = load(run, ("loading.amplitude=100.0", "loading.mean=50.0", "loading.piston_mass=1.0"))
    before, start = saved(run), start_of(run, SECOND)
    lifted = at_rest(before, before.position + np.array([0, 0, 1e-3]))
    start = replace(start, moved=lifted, piston_height=start.piston_height + 0.02)
    whole = compute(scene, start, 3, tmp_path / "whole", split=3)
    assert len(whole.contacts[1]) > len(whole.contacts[0]) or len(whole.contacts[2]) > 20
    for number in range(3):
        folder = tmp_path / f"window_{number}"
        window = compute(scene, start, 1, folder)
        for name in ("position", "orientation", "velocity", "spin"):
            one, all_ = getattr(window, name), getattr(whole, name)
            np.testing.assert_array_equal(one[1], all_[number + 1])
        height = float(window.piston.height[-1])
        start = EngineStart(folder / "end.restart", int(window.time_step[-1]), 0, height)
    assert np.linalg.norm(whole.position[3] - whole.position[0], axis=1).max() > 1e-4


@pytest.mark.parametrize("drop", [0.0, 1e-6])
def test_a_jump_keeps_every_spring(run: Path, tmp_path: Path, drop: float) -> None:
    """Stones and piston lowered by ``drop`` [m]: shapes, contacts and springs are those saved.

    Springs are read before the first step: none is lost, and none but by Coulomb's limit, which
    round-off of the moved places may touch, is another.
    """
    before, start = saved(run), start_of(run, SECOND)
    lowered = at_rest(before, before.position - np.array([0, 0, drop]))
    start = replace(start, moved=lowered, piston_height=start.piston_height - drop)
    after = compute(load(run), start, 1, tmp_path / "window").state(0)
    np.testing.assert_array_equal(after.orientation, before.orientation)
    assert np.abs(after.position - lowered.position).max() <= (1e-17 if drop else 0.0)
    assert not after.velocity.any()
    assert not after.spin.any()
    moved = bytearray((tmp_path / "window" / "start.restart").read_bytes())
    mesh = restart.find_mesh(moved, "piston_0", "mesh/surface/stress")[0]
    assert mesh == pytest.approx(start.piston_height, abs=1e-15)
    assert len(before.contacts) > 20
    assert np.array_equal(after.contacts.pair, before.contacts.pair)
    spring, was = after.contacts.tangential_spring, before.contacts.tangential_spring
    assert np.abs(was).max() > 1e-7
    if not drop:
        assert np.array_equal(spring, was)
    np.testing.assert_allclose(spring, was, atol=1e-6 * np.abs(was).max())
    for name in ("piston_wall", "cylinder"):  # whose contacts go along
        held, holds = (one.wall_force[name].any(axis=1) for one in (before, after))
        assert held.any()
        assert np.array_equal(held, holds)


def test_a_form_of_a_file_goes_with_the_run(run: Path, tmp_path: Path) -> None:
    """A run folder holds its form: it is resumed without the file, and another form is refused."""
    form = find_form("pair")
    write_form(form, 3e-3, tmp_path / "pair.toml")
    (tmp_path / "scene.toml").write_text(read_template("karrech-coarse"))
    words = [*STONES, 'sample.form="pair.toml"', "sample.count=10", "procedure.total_cycles=6"]
    run_scene(tmp_path / "scene.toml", tmp_path / "run", overrides=words, progress=QUIET)
    (tmp_path / "pair.toml").unlink()
    resume(tmp_path / "run", cycles=7, progress=QUIET)
    assert read_rows(tmp_path / "run")[-1]["cycle"] == "7"
    state = load_state(tmp_path / "run" / "preparation" / "state.npz")
    assert state.orientation is not None
    assert state.orientation.shape == (10, 4)
