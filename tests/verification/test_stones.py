"""Stones of several spheres: mass and inertia of forms, packing, spheres in a bed, bad input."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import liggghts_inputs
from adapters.bed import Contacts, Container, State
from adapters.bed.stones import find_kinetic_energies, find_rotation, find_touching, pack_spheres
from adapters.bed.stones.catalogue import CATALOGUE, find_form
from adapters.bed.stones.form import Form, spread_spheres
from adapters.bed.stones.solid import integrate_mesh, integrate_union
from adapters.bed.stones.toml import read_form, write_form
from adapters.engines.liggghts_stones import WORDS, format_rain
from adapters.errors import NotConverged, NotCredible, SceneError, UsageError
from adapters.files import Frame
from adapters.files.stones import gather_stones
from adapters.relaxation.stones import encode, relax_stones
from adapters.scene import draw_start, load_scene
from tests.small_bed import small_bed
from trackbed import command
from trackbed.scene_files import GRADINGS, refuse_outside_limits
from trackbed.scenes import read_template

SAMPLES = 100_000
CORNER = np.array([*product((0, 1), repeat=3)], float)
FACES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
TRIANGLE = np.array([(a, *pair) for a, b, c, d in FACES for pair in ((b, c), (c, d))])
"""A unit cube whose triangles face outwards."""


def throw_points(form: Form) -> tuple[np.ndarray, float]:
    """Random points inside a form, and the volume that each stands for."""
    low, high = -form.reach, form.reach
    point = np.random.default_rng(1).uniform(low, high, (SAMPLES, 3))
    apart = np.linalg.norm(point[:, None] - form.place, axis=2)
    return point[(apart < form.radius).any(axis=1)], (high - low) ** 3 / SAMPLES


def turned(count: int, seed: int = 0) -> np.ndarray:
    """Random orientations, shape (count, 4)."""
    q = np.random.default_rng(seed).standard_normal((count, 4))
    return q / np.linalg.norm(q, axis=1)[:, None]


def lone(orientation: np.ndarray, spin: np.ndarray) -> State:
    """Stones of radius 0.02 m and mass 0.1 kg, 1 m apart."""
    n = len(spin)
    place = np.arange(n)[:, None] * np.array([1.0, 0, 0]) + [0, 0, 0.5]
    still = np.zeros((n, 3))
    size, mass = np.full(n, 0.02), np.full(n, 0.1)
    return State(np.arange(1, n + 1), place, size, mass, still, spin, orientation=orientation)


def test_union_of_two_spheres_is_the_closed_form() -> None:
    """A lens of two unit spheres d apart has pi (2 - d)^2 (d^2 + 4 d)/(12 d); to 1e-4."""
    d = 1.2
    solid = integrate_union(np.array([[0.0, 0, 0], [d, 0, 0]]), np.ones(2))
    lens = np.pi * (2 - d) ** 2 * (d**2 + 4 * d) / (12 * d)
    assert solid.volume == pytest.approx(8 / 3 * np.pi - lens, rel=1e-4)
    assert solid.centre == pytest.approx([d / 2, 0, 0], abs=1e-4)
    one = integrate_union(np.array([[3.0, 2, 1]]), np.ones(1))  # far from the origin
    assert one.inertia == pytest.approx(0.4 * 4 / 3 * np.pi * np.eye(3), abs=1e-3)


def test_box_is_exact() -> None:
    """Sides a, b, c: volume a b c, inertia V (b^2 + c^2)/12, from any origin, either way round."""
    a, b, c = sides = np.array([0.03, 0.02, 0.01])
    volume, far = a * b * c, np.array([1.0, 2.0, 3.0])
    solid = integrate_mesh(CORNER * sides + far, TRIANGLE)
    assert solid.volume == pytest.approx(volume, rel=1e-9)
    assert solid.centre == pytest.approx(far + sides / 2)
    solid = integrate_mesh(CORNER * sides, TRIANGLE)
    wanted = volume * np.diag([b**2 + c**2, a**2 + c**2, a**2 + b**2]) / 12
    assert solid.inertia == pytest.approx(wanted, rel=1e-12, abs=1e-12 * volume * a**2)
    assert integrate_mesh(CORNER * sides, TRIANGLE[:, ::-1]).volume == pytest.approx(-volume)


@pytest.mark.parametrize("name", CATALOGUE)
def test_each_form_of_the_catalogue_against_random_points(name: str) -> None:
    """Volume, centre, principal axes, moments, spin energy of a turned stone: within five standard
    errors of 1e5 points."""
    form = find_form(name)
    point, share = throw_points(form)
    volume = share * len(point)
    error = np.sqrt(volume * (8 * form.reach**3 - volume) / SAMPLES)
    assert abs(volume - 4 / 3 * np.pi) < 5 * error
    deviation = point.std(axis=0) / np.sqrt(len(point))
    assert (np.abs(point.mean(axis=0)) < 5 * deviation).all()
    product = -np.einsum("pi,pj->pij", point, point)
    product += (point**2).sum(axis=1)[:, None, None] * np.eye(3)
    noise = product.std(axis=0) / np.sqrt(len(point)) + 1e-4
    assert (np.abs(product.mean(axis=0) - np.diag(form.inertia)) < 5 * noise).all()
    state = lone(turned(1), np.array([[30.0, -20.0, 10.0]]))
    energy = find_kinetic_energies(form, state)[1]
    dust = replace(form, place=point, radius=np.full(len(point), 0.1))
    speed = np.cross(state.spin, spread_spheres(dust, state)[0] - state.position)
    of_points = 0.5 * 0.1 * (speed**2).sum(axis=1)
    error = of_points.std() / np.sqrt(len(point))
    assert abs(energy - of_points.mean()) < 5 * error < 0.05 * energy


def test_rotation_between_two_orientations() -> None:
    """A stone turned by a vector of 0.3 rad has turned by it, from wherever it began."""
    start, vector = turned(5), np.tile([0.1, -0.2, 0.2], (5, 1))
    end = Rotation.from_rotvec(vector) * Rotation.from_quat(np.roll(start, -1, axis=1))
    quaternion = np.roll(end.as_quat(), 1, axis=1)
    np.testing.assert_allclose(find_rotation(start, quaternion), vector, atol=1e-14)


def test_own_spheres_touch_nothing_of_their_stone() -> None:
    """Two stones 1 m apart above a floor: no contact; one on the floor: those below it alone."""
    form = find_form("cube")
    state = lone(turned(2), np.zeros((2, 3)))
    walls = Container("box", size_x=9.0, size_y=9.0).walls()
    state = state.move_to(state.position + np.array([2.0, 2, 0]))
    assert not len(find_touching(form, state, walls))
    place, radius = spread_spheres(form, state)
    lowest = (place[:, 2] - radius).min()
    rows = find_touching(form, state.move_to(state.position - [0, 0, lowest + 1e-6]), walls)
    assert rows.second.tolist() == [-1]
    assert rows.overlap == pytest.approx([1e-6], rel=1e-6)


BOX = Container("box", size_x=0.123, size_y=0.123)


def dense() -> State:
    """27 stones at random turns on a grid so narrow that their spheres press one another."""
    grid = 0.0205 + 0.041 * np.array([*product(range(3), repeat=3)])
    return replace(lone(turned(27, 3), np.zeros((27, 3))), position=grid, piston_height=0.125)


def test_relaxed_stones_have_their_overlaps_again() -> None:
    """Strained by 1 % and shaken by a third of the mean overlap: each contact carries what it did
    to 1 %, nothing else touches deeper, and the mean height is the strained one."""
    form, before, walls = find_form("cube"), dense(), BOX.walls(0.125)
    carried = find_touching(form, before, walls)
    assert len(carried) > 60
    mean = carried.overlap.mean()
    shaken = before.position * [1, 1, 0.99]
    shaken += 0.3 * mean * np.random.default_rng(5).standard_normal((27, 3))
    target, after = before.move_to(shaken), BOX.walls(0.1245)
    relaxed, _ = relax_stones(form, target, before, walls, after)
    rows = find_touching(form, relaxed, after)
    had = dict(zip(map(int, encode(carried)), carried.overlap, strict=True))
    for code, overlap in zip(map(int, encode(rows)), rows.overlap, strict=True):
        assert overlap == pytest.approx(had.pop(code, 0.0), abs=0.01 * mean)
    assert max(had.values(), default=0.0) <= 0.01 * mean  # of contacts that are no more
    assert relaxed.position[:, 2].mean() == pytest.approx(shaken[:, 2].mean(), abs=1e-12)
    assert before.orientation is not None
    assert relaxed.orientation is not None
    turn = find_rotation(before.orientation, relaxed.orientation)
    assert 0 < np.linalg.norm(turn, axis=1).max() < 0.1


def test_a_bed_that_was_not_moved_is_left_alone_and_one_without_room_refused() -> None:
    """No step for overlaps that are right; a piston pressed down by a fifth of the bed."""
    form, before, walls = find_form("cube"), dense(), BOX.walls(0.125)
    relaxed, record = relax_stones(form, before, before, walls, walls)
    assert record["error"] < 1e-9
    assert np.array_equal(relaxed.position, before.position)
    with pytest.raises(NotConverged, match="overlaps of stones err"):
        relax_stones(form, before, before, walls, BOX.walls(0.1))


@pytest.mark.long
def test_packing_comes_nearer_with_more_spheres(tmp_path: Path) -> None:
    """A box, turned, moved and inside out: errors fall, the union has its volume, mass and inertia
    are the box's own; the file keeps them to the last digit."""
    sides = np.array([0.04, 0.03, 0.02])
    turn = np.linalg.qr(np.random.default_rng(2).standard_normal((3, 3)))[0]
    turn *= np.linalg.det(turn)
    form, size, fits = pack_spheres("box", (CORNER * sides) @ turn.T + 5.0, TRIANGLE[:, ::-1], 8)
    assert [fit.spheres for fit in fits] == [1, 2, 4, 8]
    for name in ("volume_error", "growth"):
        assert (np.diff(np.abs([getattr(fit, name) for fit in fits])) < 0).all(), name
    assert fits[-1].inertia_error < 0.3 * fits[0].inertia_error
    assert 4 / 3 * np.pi * size**3 == pytest.approx(sides.prod(), rel=1e-6)
    a, b, c = np.sort(sides)[::-1] / size
    wanted = [(b**2 + c**2) / 12, (a**2 + c**2) / 12, (a**2 + b**2) / 12]
    assert form.inertia == pytest.approx(wanted, rel=1e-5)
    union = integrate_union(form.place, form.radius)
    assert union.volume == pytest.approx(4 / 3 * np.pi, rel=1e-3)
    write_form(form, size, tmp_path / "box.toml")
    back = read_form(str(tmp_path / "box.toml"))
    for name in ("place", "radius", "inertia"):
        np.testing.assert_allclose(getattr(back, name), getattr(form, name), rtol=1e-14, atol=1e-15)


def test_open_meshes_and_wrong_numbers_are_refused() -> None:
    """A cube without a triangle, one turned round, no mesh at all."""
    around = TRIANGLE.copy()
    around[0] = around[0, ::-1]
    for mesh, what in ((TRIANGLE[1:], "not closed"), (around, "face"), (TRIANGLE[:0], "no tri")):
        with pytest.raises(UsageError, match=what):
            pack_spheres("cube", CORNER, mesh, 2)


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ("volume = 1.0\ninertia=[1.0,1.0]\nspheres=[[0,0,0,1]]", "inertia"),
        ("spheres = [[0,0,0,1]]\ninertia=[1,1,1]", "volume"),
        ("volume = 1.0\ninertia=[1,1,3]\nspheres=[[0,0,0,1]]", "above the sum"),
        ("volume = nan\ninertia=[1,1,1]\nspheres=[[0,0,0,1]]", "volume"),
        ("volume = 1.0\ninertia=[1,1,1]\nspheres=[[0,0,0,1],[0,0,0,1]]", "twice"),
        ("volume = 1.0\ninertia=[1,1,1]\nspheres=[]", "none"),
        ("size = 1", "volume: Field required"), ("[", "Invalid"),
    ],
)  # fmt: skip
def test_files_that_are_no_stone(tmp_path: Path, change: str, what: str) -> None:
    """Each is named, with what to do."""
    (tmp_path / "stone.toml").write_text(f'name = "x"\n{change}\n')
    with pytest.raises(SceneError, match=what) as error:
        read_form(str(tmp_path / "stone.toml"))
    assert "trackbed stone" in error.value.remedy


def test_spheres_that_left_their_stone_are_seen() -> None:
    """From dumps: contacts between stones, forces of walls summed; a moved sphere is named."""
    form, state = find_form("triangle"), lone(turned(2), np.zeros((2, 3)))
    place, radius = spread_spheres(form, state)
    assert state.orientation is not None
    rows = np.column_stack([
        state.identifier, state.position, state.orientation, state.velocity, state.spin, state.mass,
    ])  # fmt: skip
    body = Frame(7, ("id",) * 15, rows[::-1])  # an engine lists them in any order
    force = np.ones((6, 3))
    contact = Contacts(np.array([[3, 6]]), np.ones(1), force[:1], force[:1], force[:1])
    spheres = State(
        np.arange(2, 8), place, radius, np.ones(6), np.zeros((6, 3)), np.zeros((6, 3)), contact,
        {"floor": force}, time_step=7,
    )  # fmt: skip
    found = gather_stones(form, spheres, body)
    assert found.contacts.pair.tolist() == [[1, 2]]
    assert found.wall_force["floor"].tolist() == [[3.0] * 3] * 2
    assert found.radius == pytest.approx(state.radius)
    moved = place.copy()
    moved[4, 0] += 1e-7
    with pytest.raises(NotCredible, match="6 spheres are not where 2 stones of 3"):
        gather_stones(form, replace(spheres, position=moved), body)


@pytest.mark.parametrize(
    ("overrides", "key", "what"),
    [
        (['sample.form="tetrahedro"'], "sample.form", "did you mean tetrahedron"),
        (['sample.form="stone.toml"'], "sample.form", "No such file"),
        (['sample.form="pair"', 'engine.name="yade"'], "engine.name", "yade carries no stones yet"),
        (['sample.form="pair"', 'procedure.relaxation="karrech2007"'], "procedure.relaxation",
         "for spheres"),
        (['sample.form="pair"', "sample.radius=0.006"], "sample.grain_radius", "do not fit"),
        (['sample.form="pair"', "material.wall.rolling_friction=0.1"],
         "material.wall.rolling_friction", "stands for the form of stones"),
    ],
)  # fmt: skip
def test_scenes_of_stones_that_are_refused(
    tmp_path: Path, overrides: list[str], key: str, what: str
) -> None:
    """Key and sentence of each; the same scene of spheres is valid."""
    scene = tmp_path / "scene.toml"
    scene.write_text(small_bed(k=10, h=8, total_cycles=50))
    with pytest.raises(SceneError, match=what) as error:
        load_scene(scene, ['engine.name="liggghts"', *overrides])
    assert key in str(error.value)
    load_scene(scene, [one for one in overrides if "form" not in one])


def test_a_stone_s_time_step_is_that_of_its_smallest_sphere(tmp_path: Path) -> None:
    """Rayleigh time over radius is the same; a scene that names no form is of spheres."""
    scene = tmp_path / "scene.toml"
    scene.write_text(small_bed(k=10, h=8, total_cycles=50))
    spheres = load_scene(scene, ['engine.name="liggghts"'])
    stones = load_scene(scene, ['engine.name="liggghts"', 'sample.form="wedge"'])
    assert stones.rayleigh_time == pytest.approx(find_form("wedge").least * spheres.rayleigh_time)
    assert load_scene(scene, ['sample.form="sphere"']).form is spheres.form


@pytest.mark.parametrize("name", GRADINGS)
def test_gradings_of_stones_keep_the_limits_of_their_standard(name: str, tmp_path: Path) -> None:
    """Ten sizes, with their masses and numbers as LIGGGHTS is given them: the mass of all stones is
    that of the spheres drawn, and each sieve is passed by what the standard allows."""
    text = re.sub("(rolling_friction|crib).*", "", read_template("ballast"))
    (tmp_path / "scene.toml").write_text(text)
    words = ['engine.name="liggghts"', 'sample.form="cube"', f'sample.grading="{name}"']
    scene = load_scene(tmp_path / "scene.toml", words)
    _, radius, height = draw_start(scene)
    rain = format_rain(scene, radius, height)
    patterns = r"mass (\S+)", r"stone_\d+ (0\S+)"
    mass, share = (np.array(re.findall(one, rain), float) for one in patterns)
    size = np.cbrt(6 * mass / (np.pi * scene.material.grain.density))
    count = np.round(share * len(radius)).astype(int)
    assert (len(size), count.sum()) == (10, len(radius))
    assert count @ size**3 == pytest.approx(8 * (radius**3).sum(), rel=1e-9)
    refuse_outside_limits(GRADINGS[name], np.repeat(size, count))


def test_stone_is_a_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Millimetres become metres; a form that is there is kept."""
    import meshio

    mesh, out = tmp_path / "cube.ply", tmp_path / "cube.toml"
    meshio.Mesh(20 * CORNER, [("triangle", TRIANGLE)]).write(mesh)
    words = ["stone", str(mesh), "--unit", "mm", "--spheres", "1", "--out", str(out)]
    assert command.main(words) == 0
    said = capsys.readouterr().out
    assert "volume 8e-06 m^3" in said
    assert read_form(str(out)).place.shape == (1, 3)
    assert command.main(words) == 2
    assert "not there yet" in capsys.readouterr().err


def test_words_that_stones_replace_stand_in_the_decks_of_spheres() -> None:
    """A word that a deck has no longer would leave a bed of spheres, and nobody would say so."""
    decks = b"".join(path.read_bytes() for path in Path(liggghts_inputs.__path__[0]).glob("*in*"))
    assert [old for old in WORDS if old not in decks] == []
