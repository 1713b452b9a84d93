"""Mesh files: the groups of their nodes and cells."""

from __future__ import annotations

import meshio
import numpy as np

from trackbed.mesh_file import find_marks, list_groups

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


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


def test_whole_numbers_of_cells_are_groups() -> None:
    """Of Medit or a VTU the only array of them, 0 too; numbers of the cells themselves are none."""

    def mark(**data: list[float]) -> meshio.Mesh:
        held = {name: [np.array(values)] for name, values in data.items()}
        return meshio.Mesh(CORNERS, [("triangle", FACES)], cell_data=held)

    mesh = mark(region=[0, 2, 2, 0], young=[1.0, 1.0, 2.0, 2.0], number=[0, 1, 2, 3])
    cells = list_groups(mesh, "triangle")[1]
    assert {name: found.tolist() for name, found in cells.items()} == {"0": [0, 3], "2": [1, 2]}
    assert find_marks(mark(region=[0, 2, 2, 0], material=[1, 1, 2, 2])) == ""
    assert list_groups(mark(number=[0, 1, 2, 3]), "triangle") == ({}, {})
