"""Mesh files of any format that meshio reads, their groups, and closed surfaces.

meshio is loaded only to read a file.
"""

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
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from trackbed.errors import LibraryMissing, MeshError
from trackbed.series_file import SI

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
MEND = "mend it, in MeshLab by Close Holes and Re-Orient all faces coherently, or scan it again"
PHYSICAL = "gmsh:physical"  # cell data of meshio with gmsh's physical groups
FLAT = 1e-9
"""Volume over the cube of the extent [-] that is round-off."""
LINES = 300
"""Lines across a surface along which it must be entered and left in turn: a fault over 1 % of the
surface as they see it goes unnoticed in 5 % of meshes."""


def list_groups(mesh: Any, kind: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Sets and groups (`find_marks`) of a meshio mesh by name: of nodes, of cells of one ``kind``.

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
    marks = find_marks(mesh)
    for block, tags in enumerate(mesh.cell_data.get(marks, [])):
        for tag in np.unique(tags):
            if tag or marks != PHYSICAL:  # there 0 is in no group
                name = names.get((mesh.cells[block].dim, int(tag)), str(int(tag)))
                add(name, block, np.flatnonzero(np.asarray(tags) == tag))
    return (
        {name: np.unique(np.concatenate(parts)) for name, parts in nodes.items()},
        {name: np.unique(np.concatenate(parts)) for name, parts in elements.items()},
    )


def find_marks(mesh: Any) -> str:
    """Name of the cell data that number groups: gmsh's, or else the only array of whole numbers,
    such as ``medit:ref`` or ``region``, of which some are alike; empty without one."""
    if PHYSICAL in mesh.cell_data:
        return PHYSICAL
    joined = {k: np.concatenate(v) for k, v in mesh.cell_data.items() if not k.startswith("gmsh:")}
    whole = [k for k, v in joined.items() if v.ndim == 1 and v.dtype.kind in "iu"]
    marks = [name for name in whole if len(np.unique(joined[name])) < len(joined[name])]
    return marks[0] if len(marks) == 1 else ""


def read_mesh_file(path: str | os.PathLike[str], where: str) -> Any:
    """The meshio.Mesh of a file; whatever meshio says or does on a bad one is in a `MeshError`."""
    if not Path(path).is_file():
        raise MeshError(
            "it is a directory" if Path(path).is_dir() else "there is no such file",
            where=where,
            remedy="give the path of a mesh file that meshio reads (.msh, .vtu, .inp, .stl, ...)",
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


@dataclass(frozen=True)
class Surface:
    """A closed surface of triangles that face outwards."""

    points: Floats  # corners [m], (p, 3), each there once
    triangles: Integers  # rows of ``points``, anticlockwise from outside, (t, 3)
    turned: bool  # whether all triangles of the file faced inwards


def read_surface(path: str | os.PathLike[str], unit: str) -> Surface:
    """The closed surface in a mesh file whose lengths are in ``unit``, m, cm or mm; polygons become
    triangles.

    Raises as `read_mesh_file`, and `MeshError` for a surface that does not bound one solid: open,
    in pieces, flat, with triangles that do not face alike, or one that crosses itself.
    """

    def refuse(what: str, place: Floats | None = None, remedy: str = MEND) -> MeshError:
        at = "" if place is None else ", as at ({:.5g}, {:.5g}, {:.5g}) ".format(*place) + unit
        return MeshError(what + at, where=str(path), remedy=remedy)

    mesh = read_mesh_file(path, str(path))
    fans = [
        np.stack([block.data[:, 0], block.data[:, k], block.data[:, k + 1]], axis=1)
        for block in mesh.cells if block.dim == 2
        for k in range(1, block.data.shape[1] - 1)
    ]  # fmt: skip
    corner = np.asarray(mesh.points, float)[np.concatenate(fans)] if fans else np.zeros((0, 3, 3))
    extent = float(np.ptp(corner.reshape(-1, 3), axis=0).max()) if corner.size else 0.0
    if any(block.dim == 3 for block in mesh.cells) or not (np.isfinite(extent) and extent > 0):
        what = "it is no surface of triangles with a finite extent"
        raise refuse(what, remedy="give the surface of one stone, such as a scan: STL, OBJ or PLY")
    scaled = np.round((corner - corner[0, 0]).reshape(-1, 3) / extent, 9)
    _, kept, same = np.unique(scaled, axis=0, return_index=True, return_inverse=True)
    points, triangles = corner.reshape(-1, 3)[kept], same.reshape(-1, 3)
    triangles = triangles[(triangles != np.roll(triangles, 1, axis=1)).all(axis=1)]

    ways = np.concatenate([triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    edges, which, count = np.unique(
        np.sort(ways, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    alike = np.bincount(which.ravel(), weights=np.sign(ways[:, 1] - ways[:, 0])) != 0
    for wrong, what in (
        (count == 1, "the surface is open: {} of {} edges bound one triangle alone"),
        (count > 2, "it bounds no single solid: {} of {} edges join more than two triangles"),
        (alike, "triangles beside one another face opposite sides at {} of {} edges"),
    ):
        if wrong.any():
            middle = points[edges[np.argmax(wrong)]].mean(axis=0)
            raise refuse(what.format(wrong.sum(), len(edges)), middle)
    linked = coo_array((np.ones(len(edges)), edges.T), shape=(len(points), len(points)))
    pieces, piece = connected_components(linked)
    if pieces > 1:
        other = points[np.argmax(piece != np.argmax(np.bincount(piece)))]
        raise refuse(f"it is {pieces} surfaces apart", other, "keep the one of the stone")
    local = points[triangles] - points[0]
    volume = float(np.einsum("ti,ti->", local[:, 0], np.cross(local[:, 1], local[:, 2]))) / 6
    if abs(volume) <= FLAT * extent**3:
        raise refuse("it is flat: it encloses no volume", remedy="give a closed scan of a stone")
    triangles = triangles[:, ::-1] if volume < 0 else triangles
    if (place := find_crossing(points, triangles)) is not None:
        raise refuse("it crosses itself, or a part of it is inside out", place)
    return Surface(SI[unit] * points, triangles, volume < 0)


def find_crossing(points: Floats, triangles: Integers) -> Floats | None:
    """A point (3,) where a line enters a closed surface from its inside, or leaves it from outside.

    None where each of `LINES` random lines along z enters and leaves the surface in turn.
    """
    corner = points[triangles]
    low, high = points.min(axis=0), points.max(axis=0)
    least, most = corner[:, :, :2].min(axis=1), corner[:, :, :2].max(axis=1)
    for line in np.random.default_rng(0).uniform(low[:2], high[:2], (LINES, 2)):
        near = corner[((least <= line) & (line <= most)).all(axis=1)]
        x, y = np.moveaxis(near[:, :, :2] - line, 2, 0)
        side = x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)
        enters, leaves = (side < 0).all(axis=1), (side > 0).all(axis=1)
        hit = np.flatnonzero(enters | leaves)
        share = np.roll(side[hit], -1, axis=1) / side[hit].sum(axis=1, keepdims=True)
        height = (share * near[hit, :, 2]).sum(axis=1)
        order = np.argsort(height)
        times = np.cumsum(np.where(enters, 1, -1)[hit[order]])
        wrong = (times < 0) | (times > 1)
        if wrong.any() and not times[-1]:  # a line through an edge counts one crossing too few
            return np.append(line, height[order[np.argmax(wrong)]])
    return None
