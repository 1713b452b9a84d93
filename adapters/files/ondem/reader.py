"""The spheres of a state in ON-DEM VTKHDF, each fault named."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adapters.bed import BoolArray, FloatArray
from adapters.errors import DumpError
from adapters.files.ondem.layout import COLUMNS, UNITS, load_h5py

WALLS = {"wall", "facet"}
"""Shapes that are left out: the walls of a bed are its scene's."""
MOST_PACKED = 1032
"""Greatest size of data over that of the file they are in: deflate packs no better."""
DAMAGED = (OSError, ValueError, LookupError, TypeError, AttributeError, RuntimeError, MemoryError)
"""What h5py raises for a damaged file."""


def read_bodies(path: Path) -> tuple[int, tuple[str, ...], FloatArray]:
    """Step count, names of c columns as in a text dump, and a row a sphere, (n, c), by ``id``.

    Columns: ``x y z`` [m], and those of `COLUMNS` that are there: radius [m], mass [kg], velocities
    [m/s], angular velocities [rad/s].  The step is the scene's ``cycle`` or ``iteration``, else its
    time over its time step, else 0.  Bodies are one PolyData or, as in later drafts, its blocks;
    `WALLS` and contacts are left out.  Raises `LibraryMissing` without h5py, `DumpError` for other
    shapes, clumps and units, missing or doubtful numbers, and a damaged file.
    """
    h5py = load_h5py(path)
    try:
        with h5py.File(path, "r") as file:
            most = MOST_PACKED * path.stat().st_size
            scene = file.get("ONDEM/Scene", {})
            if "units" in scene and (units := _read_texts(scene["units"])) != UNITS:
                raise DumpError(f"the units are {' '.join(units)}, not {' '.join(UNITS)}")
            names = _read_texts(scene["shape_names"]) if "shape_names" in scene else ()
            parts = [_read_block(block, names, most) for block in _list_blocks(file["VTKHDF"])]
            columns = min((part[0] for part in parts), key=len)
            if any(part[0] != columns for part in parts):
                raise DumpError("its blocks do not have the same fields")
            rows = np.concatenate([part[1] for part in parts])
            return _find_step(getattr(scene, "attrs", {})), columns, _check_rows(columns, rows)
    except DumpError as error:
        remedy = "give a state of spheres in SI units, as trackbed export RUN --to vtkhdf writes it"
        raise DumpError(error.what, where=str(path), remedy=error.remedy or remedy) from None
    except DAMAGED as error:
        raise DumpError(
            f"this is no whole ON-DEM VTKHDF file ({error})", where=str(path),
            remedy="write or copy it again",
        ) from error  # fmt: skip


def _read_texts(dataset: Any) -> tuple[str, ...]:
    return tuple(dataset.asstr()[:].tolist())


def _find_step(scene: Any) -> int:
    for name in ("cycle", "iteration"):
        if name in scene:
            return int(scene[name])
    return round(float(scene["time"] / scene["timestep"])) if "timestep" in scene else 0


def _list_blocks(root: Any) -> Iterator[Any]:
    """The groups that hold points: the root itself, or those right below it."""
    for group in (root, *(root[name] for name in root if name != "Assembly")):
        if np.bytes_(group.attrs.get("Type", "")) == b"PolyData":
            yield group


def _read_block(
    block: Any, shapes: tuple[str, ...], most: int
) -> tuple[tuple[str, ...], FloatArray]:
    """Columns and rows of the spheres of one block."""
    count, data = len(block["Points"]), block["PointData"]

    def read(parent: Any, name: str, *width: int) -> NDArray[Any]:
        if name not in parent:
            raise DumpError(f"there is no {name}; there are {' '.join(parent) or 'no fields'}")
        one = parent[name]
        if one.shape != (count, *width) or one.dtype.kind not in "iuf" or one.nbytes > most:
            raise DumpError(f"{name} is {one.shape} of {one.dtype}, not numbers for {count} bodies")
        return np.asarray(one[()])

    radius = read(data, "radius")
    sphere = ~np.isnan(radius)
    if not sphere.all():
        _check_shapes(read(data, "shape_type")[~sphere], shapes)
    if "clump_id" in data:
        _check_clumps(read(data, "clump_id")[sphere] >= 0)
    fields = [name for name in COLUMNS if name in data or name == "body_id"]
    wide = [(len(COLUMNS[name]),) if len(COLUMNS[name]) > 1 else () for name in fields]
    values = [read(data, name, *width) for name, width in zip(fields, wide, strict=True)]
    columns = (*(word for name in fields for word in COLUMNS[name]), *"xyz")
    return columns, np.column_stack([*values, read(block, "Points", 3)])[sphere].astype(float)


def _check_shapes(kinds: NDArray[Any], shapes: tuple[str, ...]) -> None:
    """Raise `DumpError` for bodies that are neither spheres nor walls, by their shapes' numbers."""
    found = {shapes[kind] if 0 <= kind < len(shapes) else "unknown" for kind in set(kinds.tolist())}
    if found - WALLS:
        raise DumpError(f"bodies are no spheres: {' '.join(sorted(found - WALLS))}")


def _check_clumps(clumped: BoolArray) -> None:
    if clumped.any():
        raise DumpError(f"{clumped.sum()} of {len(clumped)} spheres are parts of clumps")


def _check_rows(columns: tuple[str, ...], rows: FloatArray) -> FloatArray:
    """Rows by ``id``, the first column; raises `DumpError` for numbers that no sphere has."""
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    if not len(rows):
        raise DumpError("there are no spheres")
    if len(wrong := np.argwhere(~np.isfinite(rows))):
        row, column = wrong[0]
        raise DumpError(f"{columns[column]} of body {rows[row, 0]:.0f} is {rows[row, column]}")
    if len(twice := np.flatnonzero(np.diff(rows[:, 0]) == 0)):
        raise DumpError(f"body {rows[twice[0], 0]:.0f} is there twice")
    for name in {"radius", "mass"} & {*columns}:
        if len(none := np.flatnonzero(rows[:, columns.index(name)] <= 0)):
            raise DumpError(f"{name} of body {rows[none[0], 0]:.0f} is not above 0")
    return rows
