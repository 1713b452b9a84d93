"""Scanned stones: what is read back, what is refused, and what thinning and meshing leave."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qdem_fem.files.errors import MeshError
from qdem_fem.grains.checks import check_surface, triangles_cutting
from qdem_fem.grains.hulls import corners_apart, find_hull_faces
from qdem_fem.grains.measures import find_surface_edges, polyhedron_integrals, quarter_faces
from qdem_fem.grains.meshing import radius_ratios
from qdem_fem.grains.scan import Scan, mesh_scan, read_scan, thin_scan
from qdem_fem.mesh.checks import FloatArray, IntArray
from qdem_fem.mesh.tetrahedra import element_gradients

Surface = tuple[FloatArray, IntArray]


def stone(halvings: int = 3) -> Surface:
    """A bumpy, mildly concave stone of about 5 cm [m]."""
    nodes = corners_apart(np.random.default_rng(0), 9)
    faces = find_hull_faces(nodes)
    for _ in range(halvings):
        edges = find_surface_edges(faces)
        nodes, faces = (
            np.vstack([nodes, nodes[edges.nodes].mean(axis=1)]), quarter_faces(faces, edges)
        )  # fmt: skip
    bumps = 1 + 0.15 * np.sin(3 * nodes[:, 0]) * np.cos(4 * nodes[:, 1])
    away = nodes / np.linalg.norm(nodes, axis=1)[:, None]
    return (nodes + away) / 2 * bumps[:, None] * [0.03, 0.025, 0.02], faces


def written(path: Path, nodes: FloatArray, faces: IntArray, binary: bool = True) -> Path:
    meshio.write(path, meshio.Mesh(nodes, [("triangle", faces)]), binary=binary)
    return path


@pytest.mark.parametrize("binary", [True, False])
def test_a_stone_is_read_from_stl(tmp_path: Path, binary: bool) -> None:
    """Volume to what STL holds: seven digits in binary files; nodes are joined again."""
    nodes, faces = stone()
    scan = read_scan(written(tmp_path / "stone.stl", 1e3 * nodes, faces, binary), unit=1e-3)
    assert (len(scan.nodes), len(scan.faces)) == (len(nodes), len(faces))
    assert scan.volume == pytest.approx(polyhedron_integrals(nodes, faces).volume, rel=1e-6)
    assert 0.85 < scan.sphericity < 1
    assert 0 < scan.roundness < 1


def opened(nodes: FloatArray, faces: IntArray) -> Surface:
    return nodes, faces[1:]


def inverted(nodes: FloatArray, faces: IntArray) -> Surface:
    return nodes, faces[:, ::-1]


def one_turned(nodes: FloatArray, faces: IntArray) -> Surface:
    faces = faces.copy()
    faces[7] = faces[7, ::-1]
    return nodes, faces


def winged(nodes: FloatArray, faces: IntArray) -> Surface:
    """A fin: a third triangle on an edge."""
    return np.vstack([nodes, [0.1, 0, 0]]), np.vstack([faces, [*faces[0, :2], len(nodes)]])


def cutting(nodes: FloatArray, faces: IntArray) -> Surface:
    """One node pulled through the far side."""
    nodes = nodes.copy()
    nodes[0] *= -1.5
    return nodes, faces


def doubled(nodes: FloatArray, faces: IntArray) -> Surface:
    return np.vstack([nodes, nodes + 0.2]), np.vstack([faces, faces + len(nodes)])


def touching(nodes: FloatArray, faces: IntArray) -> Surface:
    """Two stones that share one node only: their highest and lowest."""
    top, bottom = int(nodes[:, 0].argmax()), int(nodes[:, 0].argmin())
    other = np.arange(len(nodes)) + len(nodes)
    other[bottom] = top
    return np.vstack([nodes, nodes + nodes[top] - nodes[bottom]]), np.vstack([faces, other[faces]])


def flat(nodes: FloatArray, faces: IntArray) -> Surface:
    """A triangle whose corners lie on a line."""
    nodes = nodes.copy()
    a, b, c = faces[0]
    nodes[c] = (nodes[a] + nodes[b]) / 2
    return nodes, faces


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (opened, "the surface is open: 3 edges"),
        (inverted, "inside out"),
        (one_turned, "neighbours run against each other"),
        (winged, "more than two triangles"),
        (cutting, "the surface cuts itself"),
        (doubled, "2 separate shells"),
        (touching, "1 nodes where parts of the surface only touch"),
        (flat, "no area: triangle 0"),
    ],
)
def test_what_is_no_stone_is_refused(spoil: object, words: str) -> None:
    nodes, faces = spoil(*stone(1))  # type: ignore[operator]
    with pytest.raises(MeshError, match=words) as caught:
        check_surface(nodes, faces, "scan 'x.stl'")
    assert "scan 'x.stl'" in str(caught.value)
    assert "->" in str(caught.value)


def test_files_that_hold_no_stone_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "stone.stl"
    with pytest.raises(MeshError, match="no such file"):
        read_scan(path)
    path.write_bytes(b"solid nothing")
    with pytest.raises(MeshError, match=r"can not read|no triangles"):
        read_scan(path)
    line = meshio.Mesh(np.eye(3), [("line", np.array([[0, 1]]))])
    meshio.write(tmp_path / "line.vtu", line)
    with pytest.raises(MeshError, match="no triangles"):
        read_scan(tmp_path / "line.vtu")
    nodes, faces = stone(1)
    with pytest.raises(MeshError, match="open"):
        read_scan(written(path, nodes, faces[2:]))
    with pytest.raises(MeshError, match="unit"):
        read_scan(path, unit=0.0)


@settings(max_examples=10)
@given(seed=st.integers(0, 10**6))
def test_cuts_are_found_as_by_every_pair(seed: int) -> None:
    """Random triangles in a box: the sweep finds the pairs that a look at all pairs finds."""
    from qdem_fem.grains.checks import _pierced

    generator = np.random.default_rng(seed)
    start = generator.random((30, 3))
    nodes = (start[:, None] + 0.4 * generator.random((30, 3, 3))).reshape(-1, 3)
    faces = np.arange(90).reshape(30, 3)
    a, b = np.triu_indices(30, 1)
    cut = _pierced(nodes, faces[a], faces[b]) | _pierced(nodes, faces[b], faces[a])
    expected = {frozenset(pair) for pair in zip(a[cut].tolist(), b[cut].tolist(), strict=True)}
    got = {frozenset(pair) for pair in triangles_cutting(nodes, faces).tolist()}
    assert got == expected


@pytest.mark.peer("pyvista")
@pytest.mark.peer("gmsh")
def test_a_thinned_stone_keeps_its_volume_and_takes_a_hundred_tetrahedra() -> None:
    """Thinned to 50 triangles, then filled by gmsh: same volume, no flat tetrahedra."""
    nodes, faces = stone()
    scan = Scan(nodes, faces)
    thin = thin_scan(scan, 50)
    assert thin.volume == pytest.approx(scan.volume, rel=1e-12)
    assert len(thin.faces) == pytest.approx(50, abs=4)
    mesh = mesh_scan(thin)
    _, volumes = element_gradients(mesh.nodes, mesh.elements)
    assert volumes.sum() == pytest.approx(scan.volume, rel=1e-9)
    assert 50 < len(mesh.elements) < 200
    assert radius_ratios(mesh.nodes, mesh.elements).min() > 0.05
    assert set(mesh.node_sets["surface"]) == set(range(len(thin.nodes)))
    assert thin_scan(scan, 10**6) is scan
    with pytest.raises(MeshError, match="5 triangles"):
        thin_scan(scan, 5)
    with pytest.raises(MeshError, match="elements of 0"):
        mesh_scan(thin, 0.0)
