"""The JSON file of the YADE scripts, and the manners of a ``yade`` that fails."""

from __future__ import annotations

import json
from math import pi
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adapters.bed import contact_law as law
from adapters.bed.container import Container, count_sides
from adapters.bed.radii import RadiusDistribution
from adapters.bed.state import FloatArray, State
from adapters.engines.contract import EngineStart
from adapters.engines.decks import PISTON_MARGIN
from adapters.engines.yade import (
    YadeEngine,
    cover_piston,
    cover_rim,
    cover_side,
    find_damping_ratio,
    gather_shared_parameters,
)
from adapters.errors import EngineFailed, SceneError
from adapters.scene.file import load_scene
from adapters.scene.tables import Scene
from trackbed import command
from trackbed.scenes import find_scene_file

ENGINE = YadeEngine()


def coarse(*overrides: str) -> Scene:
    return load_scene(find_scene_file("karrech-coarse"), ('engine.name="yade"', *overrides))


def cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """z component of the product of plane vectors (..., 2)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def areas(triangles: FloatArray) -> FloatArray:
    """Signed areas [m^2] of triangles (t, 3, 2)."""
    return cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]) / 2


# --- contact law ----------------------------------------------------------------------------


@settings(max_examples=20)
@given(st.floats(0.06, 0.999))
@pytest.mark.long
def test_damping_of_rebound_makes_the_rebound(restitution: float) -> None:
    """Integrated without a pull, the damping rebounds as asked, and exceeds that with a pull."""
    ratio = law.find_rebound_damping(restitution)
    hit = law.solve_collision(0.3, 2e9, 3e-3, 1e-4, ratio, may_pull=False)
    assert hit.restitution == pytest.approx(restitution, abs=1e-8)
    assert ratio > law.DAMPING_FACTOR * law.find_alpha(restitution)


def test_each_key_of_the_scene_is_what_it_says() -> None:
    """viscous_alpha names the viscous force, restitution the rebound; 1 is no damping at all."""
    assert find_damping_ratio(coarse()) == law.DAMPING_FACTOR * 0.44
    text = find_scene_file("karrech-coarse").read_text()
    assert "viscous_alpha = 0.44" in text
    assert law.find_rebound_damping(1.0) == 0.0


def test_pairs_have_the_friction_of_the_scene() -> None:
    """mu between grains, at walls, none at mirrors; without friction no tangential damping."""
    scene = coarse("material.grain.friction=0.3", "material.wall.friction=0.0")
    pairs = {pair["second"]: pair for pair in gather_shared_parameters(scene, 0.1)["pairs"]}
    assert {name: pair["friction"] for name, pair in pairs.items()} == {
        "grain": 0.3,
        "wall": 0.0,
        "mirror": 0.0,
    }
    damping = find_damping_ratio(scene)
    assert all(pair["damping_normal"] == damping for pair in pairs.values())
    tangential = [pairs[name]["damping_tangential"] for name in ("grain", "wall", "mirror")]
    assert tangential == [damping, 0.0, 0.0]


# --- what the scene names -------------------------------------------------------------------


def written(folder: Path, scene: Scene, **change: object) -> dict[str, object]:
    """Parameters of a window."""
    restart = folder / "saved"
    restart.write_bytes(b"x")
    start = EngineStart(restart, 100, 0, 0.04, **change)  # type: ignore[arg-type]
    digests = ENGINE.write_cycles(scene, start, 3, folder)
    assert set(digests) == {"cycles.py", "bed.py", "record.py"}
    return json.loads((folder / "params.json").read_text())


def test_parameters_hold_only_what_the_scene_names(tmp_path: Path) -> None:
    """No mirror without symmetry, no seat but the first, no places but after a jump."""
    content = written(tmp_path, coarse())
    assert set(content["materials"]) == {"grain", "wall", "mirror"}
    window = content["window"]
    assert set(window) == {"start", "cycles", "steps_per_cycle", "track_steps", "load"}
    assert (window["start"], window["cycles"]) == ("continue", 3)
    assert window["load"]["waveform"] == "sine"
    whole = written(tmp_path, coarse("sample.symmetry=[]"), first=True)
    assert set(whole["materials"]) == {"grain", "wall"}
    assert "seat" in whole["window"]
    still = np.zeros((2, 3))
    moved = State(np.array([1, 2]), still + 0.01, np.ones(2), np.ones(2), still, still)
    after = written(tmp_path, coarse(), moved=moved)
    assert after["window"]["moved"] == [[0.01] * 3] * 2
    assert written(tmp_path, coarse(), perturbation=1e-10)["window"]["perturbation"] == 1e-10
    smooth = coarse("material.grain.friction=0.0", "material.wall.friction=0.0")
    assert not written(tmp_path, smooth)["frictional"]


def test_sine_is_the_load_of_the_scene(tmp_path: Path) -> None:
    """mean - amplitude/2 cos(2 pi f t), as the script adds it up from a mean and a harmonic."""
    scene = coarse()
    load = written(tmp_path, scene)["window"]["load"]
    phase = np.linspace(0, 2, 41)
    time = phase / load["frequency"]
    harmonic = load["amplitude"] / 2 * np.sin(2 * pi * load["frequency"] * time + pi / 2)
    target = load["mean_force"] - harmonic
    np.testing.assert_allclose(target, scene.stress_at(phase) * scene.loaded_area, atol=1e-12)


def test_mpi_is_refused() -> None:
    """Two processes of YADE would write the same files."""
    with pytest.raises(SceneError, match="one process"):
        coarse('engine.launcher=["/usr/bin/mpirun", "-np", "2"]')
    assert coarse('engine.launcher=["nice", "-n", "9"]').engine.launcher[0] == "nice"


# --- geometry -------------------------------------------------------------------------------


@given(st.floats(0.01, 2.0), st.floats(1e-4, 5e-3), st.floats(1e-3, 1.0), st.integers(0, 10**6))
def test_triangle_covers_its_side(radius: float, grain: float, height: float, number: int) -> None:
    """It lies in the tangent plane and holds the side's rectangle, corner to corner, to height."""
    sides = count_sides(radius, grain)
    container = Container("cylinder", (), radius, sides=sides)
    angle = float(container.side_angles()[number % sides])
    triangle = cover_side(container, angle, height)
    outward = np.array([np.cos(angle), np.sin(angle), 0.0])
    assert triangle @ outward == pytest.approx(radius, rel=1e-12)
    along = np.array([-outward[1], outward[0], 0.0])
    plane = np.column_stack([triangle @ along, triangle[:, 2]])
    half = radius * np.tan(np.pi / sides)
    for point in [(-half, 0.0), (half, 0.0), (-half, height), (half, height)]:
        turns = cross(np.roll(plane, -1, axis=0) - plane, np.array(point) - plane)
        assert np.all(turns > 0) or np.all(turns < 0)


def test_mirrors_pass_through_corners() -> None:
    """Quarter, half and whole have a quarter, a half and all of the sides, on their side."""
    for symmetry, share in ((("x", "y"), 4), (("x",), 2), (("y",), 2), ((), 1)):
        container = Container("cylinder", symmetry, 0.03, sides=68)
        angles = container.side_angles()
        assert len(angles) == 68 // share
        for axis in symmetry:
            assert np.all((np.cos if axis == "x" else np.sin)(angles) > 0)


@given(st.integers(3, 60), st.floats(0.0, 6.0))
def test_triangles_of_a_polygon_cover_it_once(corners: int, turn: float) -> None:
    """Areas add up to the polygon's and none turns over; every seam goes to the middle."""
    angle = turn + np.linspace(0, 2 * np.pi, corners + 1)[:-1]
    polygon = np.column_stack([np.cos(angle), np.sin(angle)])
    triangles = cover_rim(polygon)
    area = areas(triangles)
    assert np.all(area > 0)
    assert area.sum() == pytest.approx(corners / 2 * np.sin(2 * np.pi / corners), rel=1e-9)
    assert not triangles[:, 0].any()


def test_grains_meet_the_rim_near_it() -> None:
    """Closer to it than a fifth of a mean radius; a piston of a pebble's size is all rim."""
    grain = RadiusDistribution("constant", 0.003)
    container = Container("cylinder", ("x", "y"), 0.03)
    assert cover_piston(container, 0.02, grain)["plane_reach"] == pytest.approx(0.02 - 0.0006)
    assert cover_piston(container, 0.0005, grain)["plane_reach"] == 0
    assert "plane_reach" not in cover_piston(container, np.inf, grain)


def test_pistons_cover_what_is_loaded() -> None:
    """A whole piston the section with room to spare; a partial one its disc behind the mirrors."""
    container = Container("cylinder", ("x", "y"), 0.03)
    grain = RadiusDistribution("constant", 0.004 / PISTON_MARGIN)
    (whole,) = np.array(cover_piston(container, np.inf, grain)["triangles"])
    for point in [(-0.004, -0.004), (0.034, 0.034), (-0.003, 0.033), (0.033, -0.003)]:
        turns = cross(np.roll(whole, -1, axis=0) - whole, np.array(point) - whole)
        assert np.all(turns <= 1e-18)  # the normal points down
    part = np.array(cover_piston(container, 0.02, grain)["triangles"])
    assert np.all(areas(part) < 0)
    assert part.min() == pytest.approx(-0.004)
    assert np.linalg.norm(part, axis=2).max() == pytest.approx(0.02, rel=1e-2)
    box = Container("box", (), size_x=0.02, size_y=0.01)
    (lid,) = np.array(cover_piston(box, np.inf, grain)["triangles"])
    assert lid.min() == pytest.approx(-0.004)


# --- a program that fails -------------------------------------------------------------------


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Make a ``yade``, the only program on PATH."""

    def make(text: str) -> None:
        path = tmp_path / "yade"
        path.write_text(f"#!/bin/sh\n{text}\n")
        path.chmod(0o755)

    monkeypatch.setenv("PATH", f"{tmp_path}")
    return make


STARTED = "echo Running script prepare.py"


@pytest.mark.parametrize(
    ("work", "words", "from_outside"),
    [
        (f"{STARTED}; exit 1", "exit code 1", False),
        ("exit 1", "exit code 1", True),
        (f"{STARTED}; kill -9 $$", "ended by SIGKILL", True),
    ],
)
def test_run_that_fails(tmp_path: Path, program, work: str, words: str, from_outside: bool) -> None:
    """A process that ends badly is named, and who is to blame: YADE has begun when it says so."""
    program(work)
    with pytest.raises(EngineFailed, match=words) as caught:
        ENGINE.run(coarse(), "in.prepare", tmp_path, lambda: None, {})
    assert caught.value.from_outside == from_outside


def test_dry_run_prints_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """``trackbed run --dry-run`` leaves scripts and parameters, and says how to run them."""
    words = ["run", str(find_scene_file("karrech-coarse")), "--engine", "yade", "--dry-run"]
    assert command.main([*words, "--run-folder", str(tmp_path / "run")]) == 0
    assert "yade -n -x -j1 prepare.py params.json" in capsys.readouterr().out
    names = {path.name for path in (tmp_path / "run" / "dry_run").iterdir()}
    assert names == {"prepare.py", "bed.py", "record.py", "params.json"}
