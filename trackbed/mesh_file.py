"""Mesh files of any format that meshio reads, and their groups.

meshio is loaded only to read a file.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from trackbed.errors import LibraryMissing, MeshError


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
    import meshio

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
