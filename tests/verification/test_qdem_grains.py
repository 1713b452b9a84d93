"""Shape of closed surfaces, sieve sizes, gradings and random grains against closed forms."""

from __future__ import annotations

from math import pi, sqrt
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from qdem_fem.files.arrays import Floats, Integers
from qdem_fem.files.errors import MeshError
from qdem_fem.grains.hulls import (
    HULLS,
    GrainRecipe,
    draw_grain,
    find_hull_faces,
    place_corners_apart,
)
from qdem_fem.grains.measures import (
    find_edge_angles,
    find_inscribed_sphere,
    find_node_areas,
    find_roundness,
    find_sphericity,
    find_surface_area,
    find_surface_edges,
    integrate_polyhedron,
    quarter_faces,
)
from qdem_fem.grains.meshing import find_radius_ratios, make_grain_tetrahedra
from qdem_fem.grains.sets import BALLAST, GrainSet, load_grains, make_grains, save_grains
from qdem_fem.mesh.surface import find_surface_faces
from qdem_fem.mesh.tetrahedra import find_gradients
from trackbed.command import main
from trackbed.errors import SceneError
from trackbed.scene_files.grading import Grading, draw_sizes
from trackbed.scene_files.sieving import find_sieve_size

CUBE = np.array([[i, j, k] for i in (0.0, 1.0) for j in (0.0, 1.0) for k in (0.0, 1.0)]) - 0.5
TETRAHEDRON = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
GOLDEN = (1 + sqrt(5)) / 2
ICOSAHEDRON = np.array([[0, i, j * GOLDEN] for i in (-1, 1) for j in (-1, 1)]) / sqrt(1 + GOLDEN**2)
ICOSAHEDRON = np.vstack([np.roll(ICOSAHEDRON, shift, axis=1) for shift in range(3)])
TURN = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()


def halved(nodes: Floats, faces: Integers, sphere: bool) -> tuple[Floats, Integers]:
    """Every face cut into four; new nodes pushed onto the unit sphere where asked."""
    edges = find_surface_edges(faces)
    finer = np.vstack([nodes, nodes[edges.nodes].mean(axis=1)])
    if sphere:
        finer /= np.linalg.norm(finer, axis=1)[:, None]
    return finer, quarter_faces(faces, edges)


def sphericity(nodes: Floats, faces: Integers) -> float:
    return find_sphericity(integrate_polyhedron(nodes, faces)[0], find_surface_area(nodes, faces))


# --- surfaces -----------------------------------------------------------------------------------


def test_box_volume_and_centroid_are_exact_wherever_it_lies() -> None:
    size = np.array([3.0, 2.0, 0.5])
    nodes = (CUBE * size) @ TURN.T + [10.0, -4.0, 2.0]
    volume, centroid = integrate_polyhedron(nodes, find_hull_faces(CUBE))
    assert volume == pytest.approx(size.prod(), rel=1e-13)
    np.testing.assert_allclose(centroid, [10, -4, 2], rtol=1e-13)


@pytest.mark.parametrize(
    ("nodes", "psi", "inscribed"),
    [
        (CUBE, (pi / 6) ** (1 / 3), 0.5),
        (TETRAHEDRON, (pi / (6 * sqrt(3))) ** (1 / 3), 1 / sqrt(3)),
    ],
)  # fmt: skip
def test_sphericity_and_inscribed_sphere(nodes: Floats, psi: float, inscribed: float) -> None:
    """Closed forms, at any place, size and orientation."""
    faces = find_hull_faces(nodes)
    for size, shift in ((1.0, 0.0), (1e-3, 1.0), (1e3, -5e3)):
        moved = size * nodes @ TURN.T + shift
        # relative round-off of coordinates: shift/size in units of 1e-16
        assert sphericity(moved, faces) == pytest.approx(psi, rel=1e-12)
        assert find_inscribed_sphere(moved, faces)[1] == pytest.approx(size * inscribed, rel=1e-11)


def test_sphere_has_roundness_and_sphericity_one_in_the_limit() -> None:
    """Sphericity of an inscribed polyhedron is 1 - O(h^2); its roundness 1 - O(h).

    H^2 - K, zero on a sphere, is O(h^2) here, and the root of it enters the curvature.
    """
    nodes, faces = ICOSAHEDRON, find_hull_faces(ICOSAHEDRON)
    lacks = []
    for _ in range(5):
        lacks.append((1 - sphericity(nodes, faces), 1 - find_roundness(nodes, faces)))
        nodes, faces = halved(nodes, faces, sphere=True)
    orders = np.log2(np.array(lacks[-2]) / lacks[-1])
    np.testing.assert_allclose(orders, [2, 1], atol=0.1)
    assert lacks[-1][1] < 0.02
    assert find_node_areas(nodes, faces).sum() == pytest.approx(
        find_surface_area(nodes, faces), rel=1e-12
    )


def test_rounded_cube_has_the_roundness_of_its_edges() -> None:
    """A cube of half-width 1 - q with a ball of radius q rolled around it: roundness q.

    Its surface is that of a finely cut cube, each node moved to the nearest point of the rounded
    one; corners and ridges come within the 10 % that the mesh size leaves.
    """
    nodes, faces, sharp = 2 * CUBE, find_hull_faces(CUBE), []
    for _ in range(5):
        nodes, faces = halved(nodes, faces, sphere=False)
        sharp.append(find_roundness(nodes, faces))
    assert sharp[-1] / sharp[-2] == pytest.approx(0.5, abs=0.05)  # that of the mesh size alone
    assert sharp[-1] < 0.08
    for q in (0.6, 0.8):
        core = np.clip(nodes, -(1 - q), 1 - q)
        away = nodes - core
        rounded = core + q * away / np.linalg.norm(away, axis=1)[:, None]
        assert find_inscribed_sphere(rounded, faces)[1] == pytest.approx(1, rel=1e-3)
        assert find_roundness(rounded, faces) == pytest.approx(q, rel=0.1)


@settings(max_examples=15)
@given(seed=st.integers(0, 10**6), count=st.integers(6, 30))
def test_inscribed_sphere_touches_four_planes_and_cuts_none(seed: int, count: int) -> None:
    """The optimum of the linear programme, by its own conditions."""
    nodes = place_corners_apart(np.random.default_rng(seed), count) * [1.5, 1.0, 0.6]
    faces = find_hull_faces(nodes)
    assert find_node_areas(nodes * [4.0, 1.0, 1.0], faces).min() > 0  # with obtuse triangles
    centre, radius = find_inscribed_sphere(nodes, faces)
    a, b, c = nodes[faces].transpose(1, 0, 2)
    normal = np.cross(b - a, c - a)
    distance = np.einsum("fi,fi->f", a - centre, normal) / np.linalg.norm(normal, axis=1)
    assert distance.min() == pytest.approx(radius, rel=1e-9)
    assert (distance < radius * (1 + 1e-9)).sum() >= 4


# --- sieves and gradings ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("nodes", "size"),
    [
        (CUBE, 1.0),
        (TETRAHEDRON, 2.0),  # edge 2 sqrt(2), over sqrt(2)
        (CUBE * [3, 2, 1], 2.0),
        (CUBE * [3, 2, 0.5], 2.5 / sqrt(2)),  # a flat one passes along the diagonal
        (CUBE * [2, 1.5, 0.2], 1.7 / sqrt(2)),
    ],
)
def test_sieve_size_closed_forms(nodes: Floats, size: float) -> None:
    """To 5e-5, about twice the last random turn of the search."""
    assert find_sieve_size(nodes @ TURN.T + 3.0) == pytest.approx(size, rel=5e-5)


def test_sieve_size_of_a_sphere_and_scaling() -> None:
    """A polyhedron with corners on a sphere passes 2 r at most; lengths scale."""
    nodes = place_corners_apart(np.random.default_rng(1), 300)
    size = find_sieve_size(nodes)
    assert 1.9 < size <= 2
    assert find_sieve_size(0.01 * nodes) == pytest.approx(0.01 * size, rel=1e-6)


def test_default_curve_is_within_the_standard() -> None:
    """EN 13450:2013, Table 1, 31.5/50 A: shares that pass, and half the mass from 31.5 to 50 mm."""
    least, most = [0.00, 0.01, 0.30, 0.70, 1.00], [0.03, 0.25, 0.65, 0.99, 1.00]
    assert ((least <= BALLAST.passing) & (BALLAST.passing <= most)).all()
    between = np.diff(np.interp([0.0315, 0.050], BALLAST.sieves, BALLAST.passing))
    assert between[0] >= 0.5


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6), count=st.integers(300, 3000))
def test_drawn_sizes_meet_the_curve(seed: int, count: int) -> None:
    """Of n slices one size each: the mass below a sieve is off by two grains at most.

    The heaviest grain is (63/22.4)^3 = 22 times the lightest; one slice is cut by a sieve, and
    sizes move within slices.
    """
    sizes = draw_sizes(BALLAST, count, np.random.default_rng(seed))
    mass = sizes**3
    got = np.array([mass[sizes <= sieve].sum() for sieve in BALLAST.sieves]) / mass.sum()
    assert np.abs(got - BALLAST.passing).max() < 3 * mass.max() / mass.sum()


@pytest.mark.parametrize(
    ("sieves", "passing"),
    [([0.02], [0.0]), ([0.02, 0.01], [0, 1]), ([0.01, 0.02], [0.1, 1]), ([0.01, 0.02], [0, 0.9]),
     ([0.01, 0.02, 0.03], [0, 1]), ([0.0, 0.02], [0, 1]), ([0.01, np.nan], [0, 1])],
)  # fmt: skip
def test_a_curve_that_is_none_is_refused(sieves: list[float], passing: list[float]) -> None:
    with pytest.raises(SceneError, match="no grading curve"):
        Grading(np.array(sieves), np.array(passing))


# --- random grains ------------------------------------------------------------------------------


@settings(max_examples=12)
@given(seed=st.integers(0, 10**6), psi=st.floats(0.78, 0.86), roundness=st.floats(0.64, 0.7))
def test_a_grain_is_what_was_asked(seed: int, psi: float, roundness: float) -> None:
    """Sphericity to the last digits, roundness to its tolerance; convex; no sliver;
    tetrahedra fill the polyhedron and share its surface."""
    recipe = GrainRecipe(psi, 0.0, roundness, 0.0)
    form = draw_grain(np.random.default_rng(seed), recipe)
    corners = int(form.corner_faces.max()) + 1
    faces = quarter_faces(form.corner_faces, find_surface_edges(form.corner_faces))
    surface = form.nodes[: 4 * corners - 6]
    assert sphericity(surface, faces) == pytest.approx(psi, rel=1e-9)
    assert find_roundness(surface, faces) == pytest.approx(roundness, abs=HULLS.roundness_within)
    _, angle = find_edge_angles(surface, faces, find_surface_edges(faces))
    # 1e-9 before the stretch, which may magnify it by the squared ratio of the axes, e^7.2
    assert angle.min() > -2e-6
    mesh = make_grain_tetrahedra(form.nodes, form.corner_faces)
    assert len(mesh.elements) == 8 * (2 * corners - 4)
    assert find_radius_ratios(mesh.nodes, mesh.elements).min() >= HULLS.ratio
    _, volumes = find_gradients(mesh.nodes, mesh.elements)
    volume, centroid = integrate_polyhedron(surface, faces)
    assert volumes.sum() == pytest.approx(volume, rel=1e-12)
    np.testing.assert_allclose(centroid, 0, atol=1e-12)
    outer = {tuple(np.roll(f, -f.argmin())) for f in find_surface_faces(mesh.elements)}
    assert outer == {tuple(np.roll(f, -f.argmin())) for f in faces}


def test_radius_ratio_closed_forms() -> None:
    """1 for a regular tetrahedron; corner of a cube: 3 r/R = 3 (3 - sqrt 3)/6 / (sqrt 3/2)."""
    nodes = np.vstack([TETRAHEDRON, np.zeros(3), np.eye(3)])
    ratios = find_radius_ratios(nodes, np.array([[0, 1, 2, 3], [4, 5, 6, 7]]))
    np.testing.assert_allclose(np.abs(ratios), [1, (3 - sqrt(3)) / sqrt(3)], rtol=1e-12)
    assert find_radius_ratios(nodes, np.array([[4, 6, 5, 7]])) == pytest.approx(-ratios[1])


@pytest.mark.long
def test_out_of_reach_says_what_was_reached() -> None:
    recipe = GrainRecipe(roundness=0.98, roundness_scatter=0.0)
    with pytest.raises(MeshError, match=r"roundness 0\.980 .*reached was roundness 0\."):
        draw_grain(np.random.default_rng(0), recipe)
    assert HULLS.greatest_lift > 1


@pytest.mark.parametrize(
    "wrong",
    [{"sphericity": 1.2}, {"roundness": -1.0}, {"corners": (5, 4)},
     {"sphericity_scatter": -0.1}, {"sphericity": float("nan")}],
)  # fmt: skip
def test_a_recipe_of_no_grain_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(MeshError, match="no grain has"):
        GrainRecipe(**wrong)  # type: ignore[arg-type]


# --- sets ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def some() -> GrainSet:
    return make_grains(40, 3)


def same(one: GrainSet, other: GrainSet) -> bool:
    names = ("corners", "nodes", "corner_faces", "sizes", "sphericity", "roundness")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


def test_another_seed_makes_other_grains() -> None:
    assert not np.array_equal(make_grains(2, 4).nodes, make_grains(2, 3).nodes)


@pytest.mark.long
def test_grains_have_the_sizes_that_were_drawn(some: GrainSet) -> None:
    for grain in (0, 17, 39):
        nodes, _ = some.parts(grain)
        assert find_sieve_size(nodes) == pytest.approx(some.sizes[grain], rel=1e-9)
        assert len(some.mesh(grain).elements) == some.tetrahedra[grain]


def test_saved_and_loaded_to_the_last_digit(some: GrainSet, tmp_path: Path) -> None:
    path = tmp_path / "grains.npz"
    save_grains(path, some)
    assert same(load_grains(path), some)
    assert path.stat().st_size < 1200 * len(some) + 5000


def test_files_that_hold_no_grains_are_refused(some: GrainSet, tmp_path: Path) -> None:
    path = tmp_path / "grains.npz"
    save_grains(path, some)
    whole = path.read_bytes()
    for content in (whole[: len(whole) // 2], b"", b"solid stone"):
        path.write_bytes(content)
        with pytest.raises(MeshError, match="not a set of grains"):
            load_grains(path)
    with pytest.raises(MeshError, match="not a set of grains"):
        load_grains(tmp_path / "none.npz")
    with path.open("wb") as stream:
        np.savez(stream, format=1, corners=[8], nodes=np.zeros((3, 3)), corner_faces=np.zeros(3),
                 shape=np.zeros((3, 1)))  # fmt: skip
    with pytest.raises(MeshError, match="nodes"):
        load_grains(path)


def test_command_makes_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["grains", "--count", "3", "--seed", "3", "--out", str(tmp_path / "g.npz")]) == 0
    assert "3 grains" in capsys.readouterr().out
    assert len(load_grains(tmp_path / "g.npz")) == 3


@pytest.mark.parametrize(("verb", "name"), [("grains", "g.stl"), ("train", "t.xlsx")])
def test_command_refuses_the_name_of_another_kind_of_file(tmp_path, capsys, verb, name):
    assert main([verb, "--out", str(tmp_path / name)]) == 2
    assert f"{name} does not end with ." in capsys.readouterr().err


def test_command_refuses_more_grains_than_there_is_memory_for(tmp_path, capsys):
    assert main(["grains", "--count", "1000000000", "--out", str(tmp_path / "g.npz")]) == 5
    assert "1000000000 grains would need 5e+03 GB of memory" in capsys.readouterr().err


def test_command_makes_grains_between_two_sieves(tmp_path: Path) -> None:
    out = tmp_path / "g.npz"
    assert main(["grains", "--count", "4", "--sizes", "0.045", "0.055", "--out", str(out)]) == 0
    sizes = load_grains(out).sizes
    assert ((sizes >= 0.045) & (sizes <= 0.055)).all()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--count", "-1"], "-1 grains"),
        (["--count", "2", "--seed", "-4"], "seed of 0 or more"),
        (["--sphericity", "nan"], "no grain has sphericity nan"),
        (["--sizes", "0.05", "0.04"], "no grading curve"),
    ],
)
def test_command_refuses_in_a_sentence(words: list[str], sentence: str, tmp_path, capsys) -> None:
    assert main(["grains", *words, "--out", str(tmp_path / "g.npz")]) == 3
    assert sentence in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
