"""Half and whole sleepers of a track: where they and the ballast lie, their modes, their loads."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import curve_fit
from scipy.spatial import cKDTree

import qdem_fem as q
from qdem_fem.element.material import Material
from qdem_fem.files.errors import SceneError
from qdem_fem.march.kinetic_damping import Rest
from qdem_fem.mesh.tetrahedra import TetMesh
from qdem_fem.scene.checks import load_scene
from qdem_fem.track import bearing
from qdem_fem.track import bed as track_bed
from qdem_fem.track import enter as track_scene
from qdem_fem.track.bearing import Pulse
from qdem_fem.track.bed import Bed, guide_sleeper
from qdem_fem.track.bodies import TrackBox, place_grains
from qdem_fem.track.enter import TrackPrepared, enter_track
from qdem_fem.track.layout import TrackLayout
from qdem_fem.track.recipe import make_bed_grains
from qdem_fem.track.sleeper_mesh import SleeperShape
from validation.bench.qdem import judge
from validation.bench.track_trials import SCENE, load_track

CONCRETE = Material(45e9, 0.167, 2350.0)
WHOLE = TrackLayout("whole", TrackBox(5.0, 0.6), SleeperShape(), (24, 4, 3), 0.012, (0.5, 1.3))
HALF = replace(WHOLE, part="half", box=TrackBox(2.4, 0.6), cells=(12, 4, 3))
WIDTH = 'contact.periodic={axis="y", width=0.42}'
SCENES = Path(__file__).parents[2] / "trackbed" / "scenes"


def bend_freely(mesh: TetMesh) -> tuple[judge.FloatArray, judge.FloatArray]:
    """Frequencies [Hz] and shapes (k, n, 3) of modes in which whole sections move up and down, of
    the seven lowest with strain."""
    stiffness = judge.build_stiffness(mesh.nodes, mesh.elements, CONCRETE.young, CONCRETE.poisson)
    mass = np.repeat(judge.lump_mass(mesh.nodes, mesh.elements, CONCRETE.density), 3)
    value, vector = eigh(stiffness.toarray(), np.diag(mass), subset_by_index=[6, 12])
    shapes = vector.T.reshape(7, -1, 3)
    _, section = np.unique(mesh.nodes[:, 0].round(9), return_inverse=True)
    count = np.bincount(section)
    up = [np.bincount(section, shape[:, 2]) for shape in shapes]
    bent = [(u**2 / count).sum() > 0.5 * (s**2).sum() for u, s in zip(up, shapes, strict=True)]
    return np.sqrt(value[bent]) / 2 / np.pi, shapes[bent] / np.abs(shapes[bent]).max()


def test_modes_of_a_free_track_sleeper_are_those_of_its_eigenproblem() -> None:
    # 160 samples of a sleeper let go in the sum of its first bending modes, each read off by its
    # shape.  The step bends a frequency by (2 pi f dt)^2/24 = 8e-5 at most; half a mesh of six
    # tetrahedra a cell is no mirror image of the other half, which is left out: 0.15 % here.
    mesh = WHOLE.sleeper(0.3)
    frequency, modes = bend_freely(mesh)
    bending = np.arange(len(frequency))
    for layout, seen, within in ((WHOLE, bending, 2e-4), (HALF, bending[::2], 3e-3)):
        part = layout.sleeper(0.3)
        shifted = part.nodes + np.array([WHOLE.span[0] - layout.span[0], 0.0, 0.0])
        away, at = cKDTree(mesh.nodes).query(shifted)
        assert away.max() < 1e-9
        shape = modes[seen][:, at]
        body = q.Body(part, CONCRETE)
        run = q.Simulation([body], threads=1)
        guide_sleeper(run, body, upright=False)
        body.displacement = 1e-6 * shape.sum(axis=0)
        weight = shape * run.assembly.mass[:, None]
        read = []
        for _ in range(160):
            read.append((run.time, *(weight * body.displacement).sum(axis=(1, 2))))
            run.advance(5e-5)
        time, *parts = np.array(read).T
        for expected, part_read in zip(frequency[seen], parts, strict=True):

            def swing(t: object, f: float, size: float, phase: float) -> object:
                return size * np.cos(2 * np.pi * f * t + phase)  # type: ignore[operator]

            (found, *_), _ = curve_fit(swing, time, part_read, [expected, part_read[0], 0.0])
            assert found == pytest.approx(expected, rel=within)


def scene_of(folder: Path, part: str, *changes: tuple[str, str]) -> TrackPrepared:
    """The track of 20 grains with another part of a sleeper."""
    length, cells = (2.4, 6) if part == "whole" else (1.2, 3)
    text = SCENE.replace("length = 0.13", f'part = "{part}"\nlength = {length}')
    text = text.replace("cells = [3, ", f"cells = [{cells}, ").replace("share = 0.13\n", "")
    for change in changes:
        text = text.replace(*change)
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    prepared = load_scene(path)
    assert isinstance(prepared, TrackPrepared)
    return prepared


@pytest.mark.long
@pytest.mark.parametrize("layout", [WHOLE, HALF])
def test_loose_ballast_keeps_to_its_shoulder_and_off_the_sleeper(
    layout: TrackLayout, tmp_path: Path
) -> None:
    grains = 40 * place_grains(make_bed_grains(scene_of(tmp_path, "half").recipe))
    below = np.concatenate(layout.place_grains_below(grains, 1))
    out = layout.measure_beyond(below[:, 0])
    assert out.max() + layout.radius <= 1.3 + 1e-9
    top, near, foot = (
        below[(out >= a) & (out < b), 2].max() for a, b in ((0.0, 0.4), (0.7, 0.9), (1.1, 1.3))
    )
    assert top > near > foot  # half and a quarter of it, in whole grains
    sleeper = layout.sleeper(0.5).nodes
    beside = np.concatenate(layout.place_beside(grains, 0.5, 2))
    out = layout.measure_beyond(beside[:, 0])
    assert 0.4 < out.max() <= 0.5 - layout.radius + 1e-9
    low, high = sleeper.min(axis=0), sleeper.max(axis=0)
    outside = np.maximum(low - beside, beside - high)[:, :2].max(axis=1)
    assert outside.min() >= 2 * layout.radius - 1e-9


@pytest.mark.long
@pytest.mark.filterwarnings("ignore::qdem_fem.files.errors.StepWarning")  # contacts set the step
@pytest.mark.parametrize(("part", "seats"), [("half", 1), ("whole", 2)])
def test_each_rail_seat_takes_its_own_pressure(
    part: str, seats: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # 1 MPa and, in a whole, 2 MPa on 0.0221 m^2; seats are 0.434 m from the ends.
    one = "pressure = { times = [0.0, 0.005, 0.010], values = [0.0, 750e3, 0.0] }"
    two = "pressure = { times = [0.0, 1.0], values = [1e6, 1e6] }"
    two += "\npressure_other = { times = [0.0, 1.0], values = [2e6, 2e6] }" * (seats - 1)
    prepared = scene_of(tmp_path, part, (one, two))
    layout, recipe = prepared.recipe.layout, prepared.recipe
    grains = place_grains(make_bed_grains(recipe))
    nodes = layout.place_grains_below(grains[: recipe.below], 1)
    nodes += layout.place_beside(grains[recipe.below :], 0.5, 2)
    nodes.append(layout.sleeper(0.5).nodes)
    bed = Bed("rest", nodes, np.zeros((sum(map(len, nodes)), 3)), {}, {})
    monkeypatch.setattr(track_scene, "prepare_bed", lambda *given: bed)
    monkeypatch.setattr(bearing, "run_in", lambda *given: (bed, Pulse(0.5, 1.0, 1.0, 0.0, 0.0)))
    run, bodies = enter_track(prepared)
    now = np.array([0.0])
    force = [(one.weights * one.driver.sample(now)[0]).sum(axis=0) for one in run.conditions.loads]
    assert np.array(force)[:, 2] == pytest.approx([-22.1e3, -44.2e3][:seats])
    sleeper = bodies["sleeper"]
    seat = [
        float(sleeper.nodes[load.nodes - run.first_node[-2], 0].mean()) - layout.span[0]
        for load in run.conditions.loads
    ]
    assert seat == pytest.approx([0.434, 1.566][:seats])
    assert prepared.greatest == pytest.approx(22.1e3 * seats)
    run.advance(20 * run.step)  # no grain touches yet: momentum is what loads and weight gave
    mass = run.assembly.mass[run.first_node[-2] :]
    momentum = (mass * sleeper.velocity[:, 2]).sum()
    expected = (np.array(force)[:, 2].sum() - 9.81 * mass.sum()) * run.time
    assert momentum == pytest.approx(expected, rel=1e-6)
    points = prepared.probes
    place = {name: float(bodies[at].nodes[of, 0].mean()) - layout.span[0]
             for name, (at, of) in points.items()}  # fmt: skip
    assert place["S1"] == pytest.approx(0.0)
    assert place["S3"] == pytest.approx(1.0)
    centres = {n: bodies[n].nodes.mean(axis=0) for n in bodies if n != "sleeper"}
    for name, x in (("B1", 0.0), ("B2", 0.434), ("B3", 1.0)):
        goal = [layout.span[0] + x, 0.21, 0.4]
        away = {n: np.linalg.norm(c - goal) for n, c in centres.items()}
        assert away[points[name][0]] <= min(list(away.values())[: recipe.below]) + 1e-9


@pytest.mark.parametrize(
    ("part", "change", "said"),
    [
        ("half", ("length = 1.2", "length = 1.05"), "and the ballast beyond it need 1.1 m"),
        ("whole", ("cells = [6", "cells = [5"), "at least 6 along"),
        ("half", ("below = 14", "below = 14\nshare = 0.4"), "takes all of the force"),
        ("half", ("below = 14", "below = 14\nshoulder = [0.4, 0.3]"), "must lie farther out"),
        ("half", ("below = 14", "below = 14\npressure_other = { times = [0.0], values = [1.0] }"),
         "only a whole sleeper has it"),
        ("slice", ("below = 14", "below = 14\nshoulder = [0.4, 0.5]"), "no free end"),
        ("slice", ("below = 14", "below = 14"), "what the slice takes"),
    ],
)  # fmt: skip
def test_a_wrong_part_is_refused_with_a_sentence(
    part: str, change: tuple[str, str], said: str, tmp_path: Path
) -> None:
    with pytest.raises(SceneError, match=said):
        scene_of(tmp_path, part, change)


@pytest.mark.long
@pytest.mark.parametrize(("name", "grains"), [("track-half", 1200), ("track", 5700)])
def test_scenes_of_half_and_whole_sleepers_are_sound(name: str, grains: int) -> None:
    prepared = load_scene(SCENES / f"{name}.toml")
    assert isinstance(prepared, TrackPrepared)
    recipe = prepared.recipe
    assert recipe.below + recipe.beside == grains
    nodes = recipe.layout.sleeper(0.0).nodes  # spheres overlap: no cell is wider than one
    for axis in (0, 2):
        assert np.diff(np.unique(nodes[:, axis].round(9))).max() <= 2 * recipe.radius


@pytest.mark.parametrize("periodic", [False, True])
@pytest.mark.long
def test_hard_stages_of_a_periodic_bed_are_stopped_together(
    periodic: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[bool] = []

    def find(run: object, *shares: object, each: bool, **_: object) -> Rest:
        asked.append(each)
        return Rest(0.0, 0.0, 0.0, 0, 0, 0, 0.0)

    monkeypatch.setattr(track_bed, "find_rest", find)
    recipe = load_track(tmp_path, *(WIDTH,) * periodic).recipe
    track_bed.prepare_bed(recipe, tmp_path / "bed.npz", 1)
    assert asked == [True] * (len(track_bed.STAGES) - 2) + [not periodic] * 2


def test_a_grain_that_left_a_periodic_box_counts_where_its_image_is() -> None:
    places = np.array([[2.5, y, 0.3] for y in (0.3, 0.3 + 0.6, 0.3 - 1.2, 0.6, 0.9 + 0.2)])
    assert WHOLE.measure_across(places) == pytest.approx([0.0, 0.0, 0.0, 0.3, 0.2], abs=1e-12)
    assert WHOLE.is_under(places).tolist() == [True, True, True, False, False]
