"""The spheres of a state in ON-DEM VTKHDF, each fault named.

Sources: github.com/ON-DEM/ON-DEM-WG3-FileFormat; docs.vtk.org, "VTKHDF format specification".
``/VTKHDF`` is what ParaView reads, a point a body; ``/ONDEM`` has scene, materials and contacts.
"""

import struct
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adapters.bed import FloatArray
from adapters.errors import DumpError
from trackbed.errors import LibraryMissing

ENDING = ".vtkhdf"
UNITS = ("second", "meter", "kilogram")
"""The only units that are read and written; a file that names none is taken for SI."""
COLUMNS = {
    "body_id": ("id",), "radius": ("radius",), "mass": ("mass",), "velocity": ("vx", "vy", "vz"),
    "angular_velocity": ("omegax", "omegay", "omegaz"),
}  # fmt: skip
"""Field of the bodies -> its columns in a text dump; the first two must be there."""
MOST_PACKED = 1032
"""Greatest size of data over that of the file they are in: deflate packs no better."""


def load_h5py(path: Path) -> Any:
    """The module h5py; raises `LibraryMissing` where it is not installed."""
    try:
        import h5py
    except ImportError as error:
        what, do = "HDF5 files are read and written by h5py, which is missing", "pip install h5py"
        raise LibraryMissing(what, where=str(path), remedy=do) from error
    return h5py


def read_bodies(path: Path) -> tuple[int, tuple[str, ...], FloatArray]:
    """Step count, names of c columns as in a text dump, and a row a sphere, (n, c), by ``id``.

    Columns: ``x y z`` [m], and those of `COLUMNS` that are there: radius [m], mass [kg], velocities
    [m/s], angular velocities [rad/s].  The step is the scene's ``iteration``, else time over time
    step, else 0.  Bodies are one PolyData, as in draft 0.1, or blocks of it; contacts and walls are
    left out.  Raises `LibraryMissing` without h5py, `DumpError` for other shapes and units,
    missing or impossible numbers, and a damaged file.
    """
    h5py, most = load_h5py(path), MOST_PACKED * path.stat().st_size
    try:
        with h5py.File(path, "r") as file:
            scene, root = file.get("ONDEM/Scene", {}), file["VTKHDF"]
            if "units" in scene and (units := _read_words(path, scene["units"])) != UNITS:
                raise DumpError(f"the units are {' '.join(units)}, not {' '.join(UNITS)}")
            if "ONDEM/Bodies/sphere" in file:
                raise DumpError("its clumps stand apart, as in one draft of October 2026")
            groups = [root, *(root[name] for name in root if name != "Assembly")]
            blocks = [one for one in groups if np.bytes_(one.attrs.get("Type", "")) == b"PolyData"]
            parts = [_read_block(block, most) for block in blocks]
            (columns,) = {part[0] for part in parts}  # the same in every block
            rows = _check_rows(columns, np.concatenate([part[1] for part in parts]))
            said = dict(getattr(scene, "attrs", {}))
            step = said.get("iteration", said.get("time", 0.0) / said.get("timestep", 1.0))
            return round(float(step)), columns, rows
    except DumpError as error:
        remedy = "give spheres in SI units, as trackbed export RUN --to vtkhdf writes them"
        raise DumpError(error.what, where=str(path), remedy=remedy) from None
    except Exception as error:  # h5py raises many kinds for a file that is not whole
        what = f"this is no whole ON-DEM VTKHDF file ({error})"
        raise DumpError(what, where=str(path), remedy="write or copy it again") from error


def _read_words(path: Path, dataset: Any) -> tuple[str, ...]:
    """Words of any length, from HDF5's heap, where HDF5 itself hangs if it is damaged."""
    words, first = [], dataset.id.get_offset()
    with path.open("rb") as stream, mmap(stream.fileno(), 0, access=ACCESS_READ) as content:
        for place in range(first, first + 16 * len(dataset), 16):
            length, heap, number = struct.unpack_from("<IQI", content, place)
            at, found, size = heap, 0, 0  # a header of 16 bytes, then words behind one each
            while found != number:
                at += 16 + -(-size // 8) * 8
                found, size = struct.unpack_from("<H6xQ", content, at)
            words.append(content[at + 16 : at + 16 + length].decode())
    return tuple(words)


def _read_block(block: Any, most: int) -> tuple[tuple[str, ...], FloatArray]:
    """Columns, and rows of the spheres, of one block."""
    count, data = len(block["Points"]), block["PointData"]

    def read(parent: Any, name: str, width: int = 1) -> NDArray[Any]:
        if name not in parent:
            raise DumpError(f"there is no {name}; there are {' '.join(parent) or 'no fields'}")
        one, shape = parent[name], (count, width)[:width]
        if one.shape != shape or one.dtype.kind not in "iuf" or one.nbytes > most:
            raise DumpError(f"{name} is {one.shape} of {one.dtype}, not {shape} of numbers")
        return np.asarray(one[()])

    sphere = ~np.isnan(read(data, "radius"))
    # A bit each for three ways to move and three to turn: walls have all of them blocked.
    if not sphere.all() and (read(data, "blocked_dofs")[~sphere] != 0b111111).any():
        raise DumpError("bodies that can move are no spheres")
    if "clump_id" in data and (clumped := read(data, "clump_id")[sphere] >= 0).any():
        raise DumpError(f"{clumped.sum()} of {len(clumped)} spheres are parts of clumps")
    fields = [name for name in COLUMNS if name in data or name == "body_id"]
    values = [read(data, name, len(COLUMNS[name])) for name in fields]
    rows = np.column_stack([*values, read(block, "Points", 3)]).astype(float)
    return (*(word for name in fields for word in COLUMNS[name]), *"xyz"), rows[sphere]


def _check_rows(columns: tuple[str, ...], rows: FloatArray) -> FloatArray:
    """Rows by ``id``, the first column; raises `DumpError` for numbers that no sphere has."""
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    if not len(rows):
        raise DumpError("there are no spheres")
    wrong = ~np.isfinite(rows)
    for name in {"radius", "mass"} & {*columns}:
        wrong[:, columns.index(name)] |= rows[:, columns.index(name)] <= 0
    for row, column in np.argwhere(wrong)[:1]:
        raise DumpError(f"{columns[column]} of body {rows[row, 0]:.0f} is {rows[row, column]:g}")
    if len(twice := np.flatnonzero(np.diff(rows[:, 0]) == 0)):
        raise DumpError(f"body {rows[twice[0], 0]:.0f} is there twice")
    return rows
