"""Scanned stones: hull, thinning, sizes by a grading, rest, and meshes that are no stones."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
from scipy.spatial import ConvexHull

from rigid_lcp.errors import SceneError
from rigid_lcp.scene import list_doubts, load_scene, make_simulation
from rigid_lcp.scene.file import place_stones
from rigid_lcp.shapes import make_rotation, normalise, read_scan
from trackbed.errors import MeshError
from trackbed.mesh_file import read_surface
from trackbed.scene_files import GRADINGS

AXES = np.array([30.0, 22.0, 18.0])
TURN = make_rotation(normalise(np.array([0.9, 0.3, -0.4, 0.2])))
SCENE = """\
dimensions = 3
[run]
duration = 0.5
step = 2e-3
tolerance = 1e-8
[surface]
friction = 0.6
[[ground]]
normal = [0, 0, 1]
[[stones]]
mesh = "scan.stl"
unit = "mm"
count = 300
grading = "EN 13450 31.5/50"
density = 2700.0
region_low = [-0.2, -0.2, 0.0]
region_high = [0.2, 0.2, 0.1]
"""


def make_ellipsoid(count: int, axes: np.ndarray = AXES) -> tuple[np.ndarray, np.ndarray]:
    """Points spread evenly on an ellipsoid, and triangles that face outwards."""
    height = 1 - (2 * np.arange(count) + 1) / count
    angle = np.pi * (3 - np.sqrt(5)) * np.arange(count)
    flat = np.sqrt(1 - height**2)
    point = np.column_stack([flat * np.cos(angle), flat * np.sin(angle), height])
    triangle = ConvexHull(point).simplices.copy()
    inwards = np.linalg.det(point[triangle]) < 0
    triangle[inwards] = triangle[inwards, ::-1]
    return axes * point, triangle


def write(path: Path, point: np.ndarray, triangle: np.ndarray) -> Path:
    meshio.write(path, meshio.Mesh(point, [("triangle", triangle)]))
    return path


def test_a_scan_in_millimetres_that_is_read_as_metres_is_named(tmp_path: Path) -> None:
    """Where no size is given, the scan's own is judged, with the unit that makes it one."""
    write(tmp_path / "scan.stl", *make_ellipsoid(60))
    own = SCENE.replace('grading = "EN 13450 31.5/50"\n', "")
    for text, doubts in (
        (own, 0),
        (own.replace('"mm"', '"m"'), 1),
        (SCENE.replace('"mm"', '"m"'), 0),
    ):
        (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
        file = load_scene(tmp_path / "scene.toml")
        found = list_doubts(file.tables, file.scans)
        assert len(found) == doubts
        assert all("stones.0.unit: a grain of" in one and "as mm it" in one for one in found)


def test_hull_tends_to_the_ellipsoid_and_thinning_to_the_hull(tmp_path: Path) -> None:
    """Volume 4/3 pi abc, moments m (b^2 + c^2)/5: an inscribed polyhedron of n corners lacks a
    share of order 1/n, so four times the corners leave a quarter (a third to a fifth allowed)."""
    a, b, c = AXES / 1e3
    volume = 4 / 3 * np.pi * a * b * c
    moments = volume / 5 * np.array([b**2 + c**2, a**2 + c**2, a**2 + b**2])
    path = write(tmp_path / "scan.ply", *make_ellipsoid(4000))
    scans = {n: read_scan(path, "mm", n) for n in (20, 40, 160, 5000)}
    whole = scans[5000].shape
    assert len(whole.vertices) == 4000
    assert whole.volume == pytest.approx(volume, rel=4e-3)
    assert np.sort(np.diag(whole.inertia)) == pytest.approx(np.sort(moments), rel=6e-3)
    assert scans[5000].hull.volume == pytest.approx(0.0, abs=1e-9)
    lacking = {n: 1 - (1 + scan.spread) ** -3 for n, scan in scans.items()}
    assert 3 < lacking[40] / lacking[160] < 5
    for n in (20, 40, 160):
        assert len(scans[n].shape.vertices) == n
        assert scans[n].shape.volume == pytest.approx(whole.volume, rel=1e-12)
        assert 2 * scans[n].shape.reach > scans[n].size
    assert scans[160].thinned.inertia < 0.02
    assert scans[160].thinned.centre < 0.01


def test_thinning_depends_on_no_axes_no_place_and_no_unit(tmp_path: Path) -> None:
    """Turned, moved and in metres a stone keeps volume, moments, size and corners to round-off."""
    bumps = np.random.default_rng(3).uniform(0.95, 1.05, (900, 1))
    point, triangle = make_ellipsoid(900)
    one = read_scan(write(tmp_path / "a.ply", bumps * point, triangle), "mm", 30)
    moved = (bumps * point) @ TURN.T / 1e3 + [1.0, 2.0, 3.0]
    other = read_scan(write(tmp_path / "b.ply", moved, triangle), "m", 30)
    assert 0.0 < one.hull.volume == pytest.approx(other.hull.volume, rel=1e-6)
    assert one.shape.volume == pytest.approx(other.shape.volume, rel=1e-9)
    moments = [np.linalg.eigvalsh(each.shape.inertia) for each in (one, other)]
    assert moments[0] == pytest.approx(moments[1], rel=1e-9)
    lengths = [np.sort(np.linalg.norm(each.shape.vertices, axis=1)) for each in (one, other)]
    assert lengths[0] == pytest.approx(lengths[1], rel=1e-9)
    # the search for the smallest hole begins at fixed rotations
    assert one.size == pytest.approx(other.size, rel=1e-3)


def test_scaled_stone_is_that_of_scaled_corners(tmp_path: Path) -> None:
    shape = read_scan(write(tmp_path / "a.ply", *make_ellipsoid(900)), "mm", 30).shape
    twice, again = shape.scale(2.0), type(shape)(2.0 * shape.vertices)
    assert (twice.reach, twice.width) == pytest.approx((again.reach, again.width))
    assert twice.mass_properties(3.0)[0] == pytest.approx(again.mass_properties(3.0)[0])
    assert twice.inertia == pytest.approx(again.inertia)
    assert np.sort(twice.distances) == pytest.approx(np.sort(again.distances))
    assert shape.volume == pytest.approx(twice.volume / 8)


def test_stones_follow_the_grading_by_mass(tmp_path: Path) -> None:
    """Mass passes each sieve as the curve says, to what a slice of equal number may lack."""
    point, triangle = make_ellipsoid(500)
    write(tmp_path / "scan.ply", point, triangle)
    write(tmp_path / "other.ply", point * [1.1, 1.0, 0.9], triangle)
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE.replace('"scan.stl"', '["scan.ply", "other.ply"]'), encoding="utf-8")
    file = load_scene(scene)
    made = list(place_stones(file.tables.stones[0], file.scans[0]))
    own = [scan.shape for scan in file.scans[0]]
    volume = np.array([shape.volume for shape, _, _ in made])
    which = np.array([min((0, 1), key=lambda k: abs(np.linalg.norm(
        shape.normals[:8] - own[k].normals[:8]))) for shape, _, _ in made])  # fmt: skip
    assert which.sum() == 150
    sizes = np.array([
        file.scans[0][k].size * (shape.volume / own[k].volume) ** (1 / 3)
        for k, (shape, _, _) in zip(which, made, strict=True)
    ])  # fmt: skip
    grading = GRADINGS["EN 13450 31.5/50"]
    passing = np.array([volume[sizes <= d].sum() for d in grading.sieves]) / volume.sum()
    # two slices of number at an end, and two forms whose volumes at one size differ
    apart = abs(own[0].volume / file.scans[0][0].size ** 3 / own[1].volume
                * file.scans[0][1].size ** 3 - 1)  # fmt: skip
    bound = 2 * volume.max() / volume.sum() + apart / 2
    assert np.abs(passing - grading.passing).max() < bound < 0.1


@pytest.mark.long
def test_twenty_stones_come_to_rest(tmp_path: Path) -> None:
    """Dropped stones lie still at last, on the ground, none below it."""
    bumps = np.random.default_rng(3).uniform(0.97, 1.03, (900, 1))
    point, triangle = make_ellipsoid(900)
    write(tmp_path / "scan.stl", bumps * point, triangle)
    scene = tmp_path / "scene.toml"
    text = SCENE.replace("count = 300", "count = 20").replace('grading = "EN 13450 31.5/50"', "")
    scene.write_text(text, encoding="utf-8")
    _, run = make_simulation(load_scene(scene, ["stones.0.corners=20"]))
    start = run.energy
    run.advance(1.5)
    assert np.abs(run.velocities).max() < 1e-2
    assert run.energy < start
    turned = np.array([
        (make_rotation(q) @ body.shape.vertices.T)[2].min()
        for q, body in zip(run.angles[1:], run.world.scene.bodies[1:], strict=True)
    ])  # fmt: skip
    assert (run.positions[1:, 2] + turned).min() > -1e-4


def break_surface(kind: str) -> tuple[np.ndarray, np.ndarray]:
    """An ellipsoid with a fault."""
    point, triangle = make_ellipsoid(3000 if kind == "overlapping" else 300)
    if kind in ("open", "none"):
        return point, triangle[: -1 if kind == "open" else 0]
    if kind == "turned":
        return point, np.vstack([triangle[:-1], triangle[-1:, ::-1]])
    if kind == "flat":
        return point * [1.0, 1.0, 0.0], triangle
    if kind == "apart":
        return np.vstack([point, point + 100.0]), np.vstack([triangle, triangle + len(point)])
    if kind == "crossing":  # a figure of eight: the far half is inside out
        x, y, z = point.T
        return np.column_stack([x, y * (x / 30 - 0.3), z]), triangle
    x, y, z = point.T  # bent by more than a full turn: the two ends share a place
    turn, radius = 1.4 * np.pi * x / 30, 60 + y
    return np.column_stack([radius * np.sin(turn), radius * np.cos(turn), z]), triangle


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        ("open", "the surface is open: 3 of .* edges .* at "),
        ("turned", "face opposite sides at 3 of "),
        ("flat", "it is flat"),
        ("apart", "it is 2 surfaces apart"),
        ("crossing", "it crosses itself, or a part of it is inside out, as at "),
        ("overlapping", "it crosses itself, or a part of it is inside out, as at "),
        ("none", "it is no surface of triangles"),
    ],
)
def test_what_bounds_no_stone_is_refused(tmp_path: Path, kind: str, said: str) -> None:
    path = write(tmp_path / "scan.ply", *break_surface(kind))
    with pytest.raises(MeshError, match=said) as caught:
        read_surface(path, "mm")
    assert caught.value.where == str(path)
    assert caught.value.remedy


def test_surface_that_faces_inwards_is_turned_and_said(tmp_path: Path) -> None:
    point, triangle = make_ellipsoid(300)
    scan = read_scan(write(tmp_path / "scan.ply", point, triangle[:, ::-1]), "mm", 30)
    assert scan.turned
    assert scan.hull.volume == pytest.approx(0.0, abs=1e-9)
    assert "faced inwards, turned" in scan.describe()


def test_hollow_stone_is_refused_with_its_file_and_key(tmp_path: Path) -> None:
    point, triangle = make_ellipsoid(900)
    waist = 1 - 0.75 * np.exp(-((point[:, :1] / 8.0) ** 2))
    write(tmp_path / "scan.stl", point * np.hstack([np.ones_like(waist), waist, waist]), triangle)
    scene = tmp_path / "scene.toml"
    scene.write_text(SCENE, encoding="utf-8")
    with pytest.raises(SceneError, match=r"scan.stl: stones.0.mesh: its convex hull has .* more"):
        load_scene(scene)
    assert load_scene(scene, ["stones.0.hull_excess=5.0"]).scans[0][0].hull.volume > 0.25
