"""Mesh files of any format that meshio reads: units, groups, and surfaces in their parts.

meshio is loaded only to read a file.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackbed.errors import LibraryMissing, MeshError

LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "ft": 0.3048}
"""Units that coordinates may be in, and their length [m]."""


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles of a file, checked for nothing but numbers."""

    nodes: NDArray[np.float64]
    """[m], (n, 3), none twice."""
    faces: NDArray[np.int64]
    """(k, 3), of three different nodes each."""

    def split_parts(self) -> list[Surface]:
        """The parts that hang together by nodes, greatest first: one a stone."""
        from scipy.sparse import coo_matrix
        from scipy.sparse.csgraph import connected_components

        a, b, c = self.faces.T
        pairs = np.concatenate([a, b]), np.concatenate([b, c])
        size = len(self.nodes)
        graph = coo_matrix((np.ones(len(pairs[0])), pairs), shape=(size, size))
        _, label = connected_components(graph, directed=False)
        of_face = label[a]
        numbers, counts = np.unique(of_face, return_counts=True)
        parts = []
        for number in numbers[np.argsort(-counts, kind="stable")]:
            used, faces = np.unique(self.faces[of_face == number], return_inverse=True)
            parts.append(Surface(self.nodes[used], faces.reshape(-1, 3).astype(np.int64)))
        return parts


def find_scale(unit: float | str, where: str) -> float:
    """Length [m] of a unit, a name of `LENGTHS` or a number; raises `MeshError`."""
    scale = LENGTHS.get(unit, 0.0) if isinstance(unit, str) else float(unit)
    if not (np.isfinite(scale) and scale > 0):
        raise MeshError(
            f"a unit of {unit} m" if not isinstance(unit, str) else f"{unit} is no unit of length",
            where=where,
            remedy=f"give 1e-3 for a mesh in mm, or one of {', '.join(LENGTHS)}",
        )
    return scale


def read_surface(
    path: str | os.PathLike[str], unit: float | str = 1.0, *, where: str = ""
) -> Surface:
    """The triangles of a file (STL, PLY, OBJ, ...); ``unit`` as for `find_scale`.

    Corners of the same coordinates become one node, as STL repeats them, and triangles that lose a
    corner by that are left out.  Raises `MeshError` for a file that can not be read, has no
    triangles, or coordinates that are not finite.
    """
    where = where or f"mesh {os.fspath(path)!r}"
    scale = find_scale(unit, where)
    mesh = read_mesh_file(path, where)
    blocks = [np.asarray(block.data) for block in mesh.cells if block.type == "triangle"]
    if not sum(map(len, blocks)):
        raise MeshError(
            "there are no triangles", where=where, remedy="export the surface as triangles"
        )
    points = np.asarray(mesh.points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 3 or not np.isfinite(points).all():
        raise MeshError(
            f"coordinates of shape {points.shape}, or not finite", where=where,
            remedy="give three finite coordinates for each node",
        )  # fmt: skip
    nodes, place = np.unique(points, axis=0, return_inverse=True)
    faces = place.reshape(-1)[np.concatenate(blocks)].astype(np.int64)
    a, b, c = faces.T
    return Surface(nodes * scale, faces[(a != b) & (b != c) & (c != a)])


def list_groups(mesh: Any, kind: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Sets and physical groups of a meshio mesh by name: of nodes, and of cells of one ``kind``.

    Cells are counted over all blocks of that kind, such as ``tetra``; a group of other cells is
    the set of their nodes.  Raises `ValueError` and others where cells and sets do not fit.
    """
    nodes: dict[str, list[Any]] = {k: [np.asarray(v)] for k, v in mesh.point_sets.items()}
    elements: dict[str, list[Any]] = {}
    starts = np.cumsum([0, *(len(b.data) if b.type == kind else 0 for b in mesh.cells)])

    def add(name: str, block: int, cells: Any) -> None:
        if mesh.cells[block].type == kind:
            if cells.min() < 0 or cells.max() >= len(mesh.cells[block].data):
                raise ValueError(f"set '{name}' names cells that block {block} does not have")
            elements.setdefault(name, []).append(starts[block] + cells)
        else:
            nodes.setdefault(name, []).append(np.unique(mesh.cells[block].data[cells]))

    for name, of_blocks in mesh.cell_sets.items():
        if name.startswith("gmsh:"):  # meshio's own notes on the geometry, no groups of the user
            continue
        for block, cells in enumerate(of_blocks):
            if cells is not None and len(cells):
                add(name, block, np.asarray(cells, dtype=np.int64))
    names = {
        (int(entry[1]), int(entry[0])): name
        for name, entry in mesh.field_data.items()
        if np.shape(entry) == (2,)
    }
    for block, tags in enumerate(mesh.cell_data.get("gmsh:physical", [])):
        for tag in np.unique(tags):
            if tag:  # 0: in no group
                name = names.get((mesh.cells[block].dim, int(tag)), str(int(tag)))
                add(name, block, np.flatnonzero(np.asarray(tags) == tag))
    return (
        {name: np.unique(np.concatenate(parts)) for name, parts in nodes.items()},
        {name: np.unique(np.concatenate(parts)) for name, parts in elements.items()},
    )


def read_mesh_file(path: str | os.PathLike[str], where: str) -> Any:
    """The meshio.Mesh of a file; whatever meshio says or does on a bad one is in a `MeshError`."""
    if not Path(path).is_file():
        raise MeshError(
            "it is a directory" if Path(path).is_dir() else "there is no such file",
            where=where,
            remedy="give the path of a mesh file that meshio reads (.msh, .vtu, .inp, .mesh, ...)",
        )
    try:
        import meshio
    except ImportError as error:
        raise LibraryMissing(
            "reading a mesh file needs meshio", where=where, remedy="pip install meshio"
        ) from error
    said = io.StringIO()
    try:
        with (
            warnings.catch_warnings(),
            contextlib.redirect_stdout(said),
            contextlib.redirect_stderr(said),
        ):
            warnings.simplefilter("ignore")  # deprecations inside meshio are not the user's
            mesh = meshio.read(path)
    except ImportError as error:  # of h5py or netCDF4, which meshio needs for some formats
        raise LibraryMissing(
            f"meshio can not read this format without {error.name}",
            where=where,
            remedy=f"pip install {error.name}",
        ) from error
    except (Exception, SystemExit) as error:  # meshio leaves Python altogether on some files
        reason = "" if isinstance(error, SystemExit) else f"{type(error).__name__}: {error}"
        text = " ".join(f"{said.getvalue()} {reason}".split())
        raise MeshError(
            f"meshio can not read it ({text})",
            where=where,
            remedy="check that the file is whole and that its name ends as its format demands",
        ) from error
    sys.stderr.write(said.getvalue())
    return mesh
