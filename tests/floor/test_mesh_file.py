"""Mesh files: units, parts, and what is said of those that are none."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

from trackbed.errors import MeshError
from trackbed.mesh_file import find_scale, list_groups, read_surface

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def stones(path: Path) -> Path:
    """Two tetrahedra apart, corners repeated as STL does, and a triangle without area."""
    triangles = np.concatenate([CORNERS[FACES], CORNERS[FACES[:3]] + 5.0])
    flat = np.array([[CORNERS[0], CORNERS[0], CORNERS[1]]])
    points = np.concatenate([triangles, flat]).reshape(-1, 3)
    cells = np.arange(len(points)).reshape(-1, 3)
    meshio.Mesh(points, [("triangle", cells)]).write(path)
    return path


@pytest.mark.parametrize(("unit", "scale"), [(1.0, 1.0), ("mm", 1e-3), (0.5, 0.5), ("in", 0.0254)])
def test_a_surface_is_read_in_metres_and_falls_into_its_parts(
    tmp_path: Path, unit: float | str, scale: float
) -> None:
    """Corners at one place are one node; the greatest part comes first."""
    surface = read_surface(stones(tmp_path / "a.ply"), unit)
    assert (len(surface.nodes), len(surface.faces)) == (8, 7)
    first, second = surface.split_parts()
    assert (len(first.faces), len(second.faces)) == (4, 3)
    np.testing.assert_allclose(first.nodes.max(axis=0), [scale] * 3)
    assert second.nodes.min() == pytest.approx(5 * scale)


@pytest.mark.parametrize("unit", [0.0, -1.0, np.nan, np.inf, "furlong"])
def test_units_that_are_none_are_named(unit: float | str) -> None:
    """With what may stand there."""
    with pytest.raises(MeshError, match=r"unit[\s\S]*one of m, cm, mm"):
        find_scale(unit, "mesh")


def test_files_that_are_no_surfaces_are_refused(tmp_path: Path) -> None:
    """No file, a folder, no triangles, coordinates that are not finite."""
    with pytest.raises(MeshError, match="no such file"):
        read_surface(tmp_path / "none.stl")
    with pytest.raises(MeshError, match="is a directory"):
        read_surface(tmp_path)
    meshio.Mesh(CORNERS, [("line", [[0, 1]])]).write(tmp_path / "a.vtk")
    with pytest.raises(MeshError, match="no triangles"):
        read_surface(tmp_path / "a.vtk")
    meshio.Mesh(CORNERS * np.nan, [("triangle", FACES)]).write(tmp_path / "b.ply")
    with pytest.raises(MeshError, match="not finite"):
        read_surface(tmp_path / "b.ply")


def test_groups_are_named_for_any_kind_of_cell() -> None:
    """A set of cells of the kind asked for keeps their numbers, any other one is its nodes."""
    mesh = meshio.Mesh(
        CORNERS, [("triangle", FACES), ("tetra", [[0, 1, 2, 3]])],
        cell_sets={"foot": [np.array([0]), None], "core": [None, np.array([0])]},
    )  # fmt: skip
    nodes, cells = list_groups(mesh, "triangle")
    assert cells["foot"].tolist() == [0]
    assert nodes["core"].tolist() == [0, 1, 2, 3]
    nodes, cells = list_groups(mesh, "tetra")
    assert nodes["foot"].tolist() == [0, 1, 2]
    assert cells["core"].tolist() == [0]
