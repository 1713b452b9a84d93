"""Text dumps of LIGGGHTS and LAMMPS as a format of meshio: importing this module registers it.

>>> import adapters.files.meshio_dump, meshio  # doctest: +SKIP
>>> bed = meshio.read("states.dump")     # doctest: +SKIP

Names that end in one of `EXTENSIONS` are known by it; for others, such as ``dump.10000``, say so:
``meshio.read(path, file_format="lammps-dump")``.
"""

import re
from collections.abc import Iterator
from itertools import groupby
from os import PathLike

import meshio
import numpy as np
from numpy.typing import NDArray

from adapters.errors import DumpError, UsageError
from adapters.files.dump import EXTENSIONS, PACKED, TILTS, Frame, write_dump
from adapters.files.dump_reader import read_frames, read_last_frame

FORMAT = "lammps-dump"
"""Name of the format in meshio."""
STEP, BOX = "time_step", "box"
"""Keys of ``Mesh.field_data``: the step count, (1,), and the box as in `Frame.bounds` [m]."""
WHOLE = ("id", "type", "mol")
"""Columns of whole numbers."""
_COMPONENT = re.compile(r"(\[\d+\]|[xyz])$")
"""What a component has behind the name of its vector."""
_REFERENCE = re.compile(r"[cfdi]2?_")
"""How an engine's name of a compute, a fix or a property begins: its components are name[1], ..."""


def read_dump_meshes(path: str | PathLike[str]) -> Iterator[meshio.Mesh]:
    """Every frame of a text dump (`PACKED` too) as a mesh, in order.

    ``points`` are the columns x, y, z [m], or others of `PLACES` unfolded, ``cells`` one vertex a
    grain, in ascending ``id``.
    ``point_data`` holds the other columns by name: vx, vy, vz as ``v``, shape (n, 3), and
    f_force[1], f_force[2], f_force[3] as ``f_force``; ``field_data`` the `STEP` and the `BOX`.
    Raises `DumpError` and `UsageError` as `adapters.files.read_frames`, and for a dump without
    places (a "dump local" of contacts).
    """
    for frame in read_frames(str(path)):
        yield _make_mesh(frame, str(path))


def read_dump_mesh(path: str | PathLike[str]) -> meshio.Mesh:
    """The last frame of a text dump, as `read_dump_meshes`: a mesh is one instant."""
    return _make_mesh(read_last_frame(str(path)), str(path))


def write_dump_mesh(path: str | PathLike[str], mesh: meshio.Mesh) -> None:
    """Write a mesh's points and their data as a dump of one frame; `read_dump_mesh` gives them
    back.

    Vectors become columns as they were read; ``id`` counts from 1 where the mesh has none.
    Cells, and data of cells, are left out.  Raises `UsageError` for points that are not (n, 3).
    """
    points = np.asarray(mesh.points, float)
    if points.ndim != 2 or points.shape[1] != 3:
        raise UsageError(f"points of shape {points.shape}, not (n, 3)", where=str(path))
    columns: dict[str, NDArray[np.generic]] = {"id": np.arange(1, len(points) + 1)} | dict(
        zip("xyz", points.T, strict=True)
    )
    for name, values in mesh.point_data.items():
        columns |= _split_columns("_".join(name.split()), np.asarray(values))
    step = int(np.ravel(mesh.field_data.get(STEP, 0))[0])
    bounds = np.asarray(mesh.field_data.get(BOX, np.empty((0, 2))), float)
    values, tilt = np.column_stack([*columns.values()]), TILTS.get(bounds.shape[-1], "")
    frame = Frame(step, tuple(columns), values, bounds, boundary=tilt)
    write_dump(str(path), [frame])


def _make_mesh(frame: Frame, path: str) -> meshio.Mesh:
    if frame.kind != "atoms":
        raise DumpError(
            f"there are no places x y z, only {' '.join(frame.columns)}",
            where=f"{path}, time step {frame.time_step}",
            remedy="give a dump of grains; contacts are not a mesh by themselves",
        )
    axes = {"x", "y", "z"} <= set(frame.columns)
    points = frame.block("x", "y", "z") if axes else frame.find_centres()
    data = dict(gather_point_data(frame))
    cells = [("vertex", np.arange(len(points))[:, None])]
    field: dict[str, NDArray[np.generic]] = {STEP: np.array([frame.time_step])}
    if len(frame.bounds):
        field[BOX] = frame.bounds
    return meshio.Mesh(points, cells, point_data=data, field_data=field)


def gather_point_data(frame: Frame) -> Iterator[tuple[str, NDArray[np.generic]]]:
    """Columns by name, neighbours that are components of one vector as (n, k)."""
    others = [column for column in frame.columns if column not in ("x", "y", "z")]
    for name, group in groupby(others, lambda column: _COMPONENT.sub("", column) or column):
        family = list(group)
        ends = [column.removeprefix(name) for column in family]
        numbers = [f"[{i}]" for i in range(1, len(ends) + 1)]
        if name not in others and (ends == list("xyz") or (len(ends) > 1 and ends == numbers)):
            yield name, frame.block(*family)
            continue
        for column in family:
            values = frame.column(column)
            yield column, values.astype(np.int64) if column in WHOLE else values


def _split_columns(name: str, values: NDArray[np.generic]) -> dict[str, NDArray[np.generic]]:
    """Columns of a scalar, or of a vector, under the names `gather_point_data` joins again."""
    if values.ndim == 1:
        return {name: values}
    rows = values.reshape(len(values), -1).T
    if len(rows) == 3 and not _REFERENCE.match(name):
        return {name + axis: row for axis, row in zip("xyz", rows, strict=True)}
    return {f"{name}[{i}]": row for i, row in enumerate(rows, 1)}


meshio.register_format(
    FORMAT,
    [ending + packed for ending in EXTENSIONS for packed in ("", *PACKED)],
    read_dump_mesh,
    {FORMAT: write_dump_mesh},
)
