"""States in files: npz without loss, dumps of any engine with the columns that are needed."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from adapters.bed.state import State
from adapters.engines.fake import place_lattice
from adapters.errors import DumpError, UsageError
from adapters.files import Frame, read_frames, write_dump
from adapters.files.states import read_state_file, write_state_file
from adapters.scene import load_scene
from tests.small_bed import small_bed
from trackbed.command import main


@pytest.fixture
def state() -> State:
    """Seven grains with awkward numbers."""
    random = np.random.default_rng(3)
    return State(
        np.array([2, 3, 5, 7, 11, 13, 17]),
        random.normal(size=(7, 3)) / 3,
        random.uniform(1e-3, 4e-3, 7),
        random.uniform(1e-4, 1e-3, 7),
        random.normal(size=(7, 3)) * 1e-9,
        random.normal(size=(7, 3)),
        piston_height=0.1,
        cycle=4,
        time_step=123456,
    )


@pytest.mark.parametrize("name", ["state.npz", "state.dump", "state.dump.gz", "state.vtkhdf"])
def test_round_trip(state: State, name: str, tmp_path: Path) -> None:
    """Every number of a grain comes back bit for bit."""
    path = tmp_path / name
    if path.suffix == ".vtkhdf":
        pytest.importorskip("h5py")
    write_state_file(state, path)
    again = read_state_file(path, density=1.0)
    for field in ("identifier", "position", "radius", "mass", "velocity", "spin", "time_step"):
        np.testing.assert_array_equal(getattr(again, field), getattr(state, field))
    assert np.isnan(again.piston_height) == (path.suffix != ".npz")


def test_last_frame_and_masses_of_spheres(tmp_path: Path) -> None:
    """Of a dump the last frame counts; a mass it does not name is that of a sphere, at rest."""
    path = tmp_path / "two.dump"
    values = np.array([[1.0, 0, 0, 0.5, 0.01], [2.0, 0, 0, 0.9, 0.02]])
    columns = ("id", "x", "y", "z", "radius")
    later = values + np.array([0, 0, 0, 1, 0])
    write_dump(path, [Frame(0, columns, values), Frame(10, columns, later)])
    state = read_state_file(path, density=2710.0)
    assert state.time_step == 10
    np.testing.assert_array_equal(state.position[:, 2], [1.5, 1.9])
    volume = 4 / 3 * np.pi * np.array([0.01, 0.02]) ** 3
    np.testing.assert_allclose(state.mass, 2710.0 * volume, rtol=1e-14)
    assert not state.velocity.any()
    assert not state.spin.any()


def test_dump_without_radius(tmp_path: Path) -> None:
    """A dump of points is refused with the name of the column it lacks."""
    path = tmp_path / "points.dump"
    write_dump(path, [Frame(0, ("id", "x", "y", "z"), np.array([[1.0, 0, 0, 0]]))])
    with pytest.raises(DumpError, match="radius"):
        read_state_file(path, density=1.0)


@pytest.mark.parametrize("name", ["no.npz", "no.dump"])
def test_missing_file(name: str, tmp_path: Path) -> None:
    """A file that is not there is wrong use, and the text names it."""
    with pytest.raises(UsageError, match=name):
        read_state_file(tmp_path / name, density=1.0)


@pytest.mark.parametrize("name", ["garbage.npz", "garbage.dump"])
def test_garbage(name: str, tmp_path: Path) -> None:
    """Binary garbage under either name is named, not read."""
    path = tmp_path / name
    path.write_bytes(bytes(range(256)) * 40)
    with pytest.raises((UsageError, DumpError), match=name):
        read_state_file(path, density=1.0)


def test_relax_writes_a_state(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """``relax`` takes 50 % of overlap out of two grains and states what the bed was and is."""

    assert main(["new", "karrech-coarse", str(tmp_path)]) == 0
    radius = 3.2e-3
    columns = ("id", "x", "y", "z", "radius")
    deep, there = tmp_path / "deep.dump", tmp_path / "relaxed.dump"
    values = np.array([[1, 0.01, 0.01, radius, radius], [2, 0.013, 0.01, radius, radius]])
    write_dump(deep, [Frame(0, columns, values)])
    words = ["relax", str(deep), "--out", str(there), "--json"]
    assert main(words) == 2
    assert "--scene" in capsys.readouterr().err
    assert main([*words, "--scene", str(tmp_path / "scene.toml")]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["estimated"]["max_penetration"] == pytest.approx(2 * radius - 0.003)
    assert record["relaxed"]["max_penetration"] < 1e-6
    (frame,) = read_frames(there)
    apart = np.linalg.norm(np.diff(frame.block("x", "y", "z"), axis=0))
    assert apart == pytest.approx(2 * radius, abs=1e-6)


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (["here.dump", "--out", "a.vtu"], 2, "no .vtu file\n  -> name it .npz, or .dump"),
        (["here.dump", "--out", "a.csv"], 2, "no .csv file"),
        (["here.dump", "--out", "none/a.dump"], 2, "does not exist\n  -> make it"),
        (["none.npz", "--out", "a.npz"], 2, "none.npz: the dump cannot be opened (No such file"),
        ([".", "--out", "a.dump"], 2, "(Is a directory)\n  -> give a file: "),
        (["scene.toml", "--out", "a.dump"], 2, "this is a scene, no series and no state"),
        (["points.dump", "--out", "a.dump"], 6, "points.dump, time step 0: there is no column rad"),
        (["deep.dump", "--out", "a.dump"], 7, "look whether the scene is that of this bed"),
    ],
)
def test_relax_has_remedies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
    words: list[str], code: int, said: str,
) -> None:  # fmt: skip
    """By cause: other files, folders, scenes, columns that lack, a bed of another scene."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "karrech-coarse", "."]) == 0
    grains = np.array([[1, 0.01, 0.01, 0.01, 3e-3], [2, 0.02, 0.01, 0.01, 3e-3]])
    columns = ("id", "x", "y", "z", "radius")
    write_dump("here.dump", [Frame(0, columns, grains)])
    write_dump("points.dump", [Frame(0, columns[:4], grains[:, :4])])
    grains[:, 4] = 0.05  # wider than the container
    write_dump("deep.dump", [Frame(0, columns, grains)])
    assert main(["relax", *words, "--scene", "scene.toml"]) == code
    assert said in capsys.readouterr().err


def test_export_has_remedies(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A folder that is not there, a file, the folder around the run: what to give instead."""
    (tmp_path / "bed" / "run").mkdir(parents=True)
    (tmp_path / "bed" / "run" / "manifest.json").write_text("{}")
    (tmp_path / "scene.toml").write_text("")
    for name, said in (
        ("none", "there is no such folder"),
        ("scene.toml", "this is a file, not a run folder"),
        ("bed", f"its runs: {tmp_path / 'bed' / 'run'}"),
        ("bed/run", "start it again"),
    ):
        assert main(["export", str(tmp_path / name), "--to", "csv"]) == 2
        assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("move", "scale", "said"),
    [
        ([0, 0, -0.5], 1, r"60 of 60 grains have their centres outside the walls.* behind floor"),
        ([0.1, 0, 0], 1, r"outside the walls of the scene, grain \d+ by .* behind cylinder"),
        ([0, 0, 0], 2, r"warning: .* of the smaller radius in one another.*radii are diameters"),
        ([0, 0, 0], 1.3, r"warning: grain \d+ moved .* of its radii"),
        ([0, 0, 1.0], 1, r"60 of 60 grains rest neither .* 1 m above it: nothing bears this bed"),
        ([0, 0, 0], 0.9, "60 of 60 grains rest neither on others nor on the floor"),
        ([[0, 0, 0]] * 59 + [[0, 0, 1.0]], 1, r"warning: .*1 of 60 grains rest .*: grain 60 is 1"),
        ([0, 0, 0], 1, "^$"),
    ],
)
def test_a_state_of_another_scene_is_not_relaxed(
    move: list[float], scale: float, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 2 and the grain, where it would be moved back without a word; a warning of grains
    in one another."""
    (tmp_path / "scene.toml").write_text(small_bed(k=4, h=8, total_cycles=24))
    radius = np.full(60, 2e-3)
    position = place_lattice(load_scene(tmp_path / "scene.toml"), 60, 2e-3) + move
    still = np.zeros((60, 3))
    state = State(np.arange(1, 61), position, scale * radius, radius, still, still)
    write_state_file(state, tmp_path / "state.npz")
    words = ["relax", str(tmp_path / "state.npz"), "--scene", str(tmp_path / "scene.toml")]
    code = main([*words, "--out", str(tmp_path / "out.npz")])
    assert (code == 2) is ("outside" in said or "60 of 60" in said)
    assert re.search(said, capsys.readouterr().err)


@pytest.mark.parametrize(("scale", "doubts"), [(1.0, 0), (1e-3, 1)])
def test_grains_of_another_unit_are_named_by_relax(
    scale: float, doubts: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Grains of some micrometres rest as well as others; nobody has such ballast."""
    assert main(["new", "karrech-coarse", str(tmp_path)]) == 0
    radius = 3.2e-3 * scale
    rows = np.array([[1, 0.01, 0.01, radius, radius], [2, 0.01 + 2 * radius, 0.01, radius, radius]])
    path, columns = tmp_path / "a.dump", ("id", "x", "y", "z", "radius")
    write_dump(path, [Frame(0, columns, rows)])
    words = ["--out", str(tmp_path / "b.dump"), "--scene", str(tmp_path / "scene.toml")]
    assert main(["relax", str(path), *words]) == 0
    assert capsys.readouterr().err.count("a.dump: a grain of 6.4e-06 m is below") == doubts
