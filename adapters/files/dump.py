"""Text dumps of LIGGGHTS and LAMMPS: a frame of named columns, written without loss."""

import bz2
import gzip
import lzma
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np

from adapters.bed import FloatArray, IntArray
from adapters.errors import DumpError, UsageError
from trackbed.run_files import replace_file

Kind = Literal["atoms", "entries"]
EXTENSIONS = (".dump", ".lammpstrj", ".liggghts")
"""Endings of file names that are taken for text dumps; with one of `PACKED` behind them, too."""
PACKED: dict[str, Callable[..., Any]] = {".gz": gzip.open, ".bz2": bz2.open, ".xz": lzma.open}
"""Endings of packed files, and what opens them."""
OTHER_FORMATS = {
    b"\x1f\x8b": "gzip data: give the file a name that ends in .gz",
    b"BZh": "bzip2 data: give the file a name that ends in .bz2",
    b"\xfd7zXZ": "xz data: give the file a name that ends in .xz",
    b"\x28\xb5\x2f\xfd": "zstd data: unpack it first (zstd -d FILE)",
    b"\x89HDF": "HDF5 data: give an ON-DEM state a name that ends in .vtkhdf",
    b"PK\x03\x04": "a zip or npz archive: give the text dump, or a table named .xlsx",
    b"\xd0\xcf\x11\xe0": "an old spreadsheet: save it as .xlsx or .csv",
    b"\x89PNG": "a PNG image: give the text dump",
}
"""How other files begin, and what to do with them."""
PLACES = (("xu", "yu", "zu"), ("x", "y", "z"), ("xsu", "ysu", "zsu"), ("xs", "ys", "zs"))
"""Columns of places; u: not folded back into the box, s: in edges of the box."""
TILTS = {2: "ff ff ff", 3: "xy xz yz ff ff ff", 4: "abc origin ff ff ff"}
"""What a header says of bounds of so many columns; ff: sides that nothing passes."""


@dataclass(frozen=True)
class Frame:
    """One instant of a dump: n rows of named columns, in the units of the run (here SI)."""

    time_step: int  # the engine's step count
    columns: tuple[str, ...]
    """Names as the header has them, such as ``x`` or ``c_contacts[1]``; c of them."""
    values: FloatArray
    """One row a grain or contact, shape (n, c); grains ascend by ``id`` where it is a column."""
    bounds: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    """Box, low and high [m], shape (3, 2); (3, 3) or (3, 4) for a tilted box, (0, 2) for none."""
    kind: Kind = "atoms"
    """"atoms" for grains (dump custom), "entries" for contacts and the like (dump local)."""
    boundary: str = "ff ff ff"  # what the header says of the box's sides and tilt

    def column(self, name: str) -> FloatArray:
        """Values of one column, shape (n,); raises `DumpError` when there is none of this name."""
        return self.block(name)[:, 0]

    def block(self, *names: str) -> FloatArray:
        """Values of columns side by side, C-contiguous, shape (n, len(names)); as `column`."""
        missing = [name for name in names if name not in self.columns]
        if missing:
            raise DumpError(
                f"there is no column {', '.join(missing)}; there are {' '.join(self.columns)}",
                where=f"time step {self.time_step}", remedy="name it in the engine's dump command",
            )  # fmt: skip
        index = [self.columns.index(name) for name in names]
        return np.ascontiguousarray(self.values[:, index])

    def find_centres(self) -> FloatArray:
        """Places as they are without periods [m], (n, 3), from whichever of `PLACES` is there.

        Image flags ix, iy, iz count edges of the box.  Raises `DumpError` where there are no
        places, or no box to scale them with.
        """
        names = next((names for names in PLACES if set(names) <= set(self.columns)), None)
        if names is None:
            raise DumpError(
                f"there are no places x y z, only {' '.join(self.columns)}",
                where=f"time step {self.time_step}",
                remedy="give a dump of grains with x y z, xu yu zu or xs ys zs",
            )
        place, folded = self.block(*names), "u" not in names[0]
        scaled = "s" in names[0]
        images = np.zeros_like(place)
        for axis, flag in enumerate(("ix", "iy", "iz")):
            if folded and flag in self.columns:
                images[:, axis] = self.column(flag)
            if not scaled and (unfolded := PLACES[0][axis]) in self.columns:
                place[:, axis], images[:, axis] = self.column(unfolded), 0.0
        if not (scaled or images.any()):
            return place
        if not len(self.bounds):
            raise DumpError(
                f"there is no box for the places {' '.join(names)}",
                where=f"time step {self.time_step}", remedy="give the dump with BOX BOUNDS",
            )  # fmt: skip
        origin, edges = find_cell(self.bounds)
        return origin + (place + images) @ edges if scaled else place + images @ edges


class Header(NamedTuple):
    """What is above the rows of a frame."""

    label: str
    rows: int
    columns: tuple[str, ...]
    bounds: FloatArray
    boundary: str


def describe_format(head: bytes) -> str:
    """What a file of another format is by its first bytes, and what to do; empty for none known."""
    return next((said for mark, said in OTHER_FORMATS.items() if head.startswith(mark)), "")


def open_dump(path: Path) -> Any:
    """The unpacked bytes of a dump; raises `UsageError`, and `DumpError` where packed otherwise."""
    try:
        if path.suffix in PACKED and path.is_file():
            with path.open("rb") as stream:
                head = stream.read(8)
            if head and f"ends in {path.suffix}" not in (said := describe_format(head)):
                what = f"this cannot be read as {path.suffix}: it begins with {repr(head)[1:]}"
                name = f"of plain text leave {path.suffix} out of the name; else copy it again"
                raise DumpError(what, where=str(path), remedy=said or name)
        return PACKED.get(path.suffix, open)(path, "rb")
    except OSError as error:
        raise UsageError(
            f"the dump cannot be opened ({error.strerror})", where=str(path),
            remedy="give a file: check its name, and that the engine's dump came to its first step",
        ) from error  # fmt: skip


def list_grains(identifiers: IntArray) -> str:
    """At most ten identifiers as text, and how many there are."""
    text = ", ".join(map(str, identifiers[:10].tolist()))
    return text if len(identifiers) <= 10 else f"{text}, ... ({len(identifiers)} in all)"


def find_cell(bounds: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Origin (3,) and edges, a row each (3, 3), of a box as dumps have it [m]: low and high, with
    tilts xy, xz, yz behind the bounds of the whole, or each edge with the origin behind."""
    if bounds.shape[1] == 4:
        return bounds[:, 3], bounds[:, :3]
    xy, xz, yz = bounds[:, 2] if bounds.shape[1] == 3 else np.zeros(3)
    tilts_x, tilts_y = (0.0, xy, xz, xy + xz), (0.0, yz)
    low = bounds[:, 0] - [min(tilts_x), min(tilts_y), 0.0]
    high = bounds[:, 1] - [max(tilts_x), max(tilts_y), 0.0]
    tilt = [[0.0, 0.0, 0.0], [xy, 0.0, 0.0], [xz, yz, 0.0]]
    return low, np.diag(high - low) + tilt


def write_dump(path: str | Path, frames: Iterable[Frame]) -> None:
    """Write frames as a text dump (`PACKED` by suffix), atomically; `read_frames` reads it back.

    Nothing is lost.  LIGGGHTS takes the file in
    ``read_dump FILE STEP x y z vx vy vz radius replace yes box no`` when it has the columns
    ``id`` and ``type`` too; without them it stops, and says nothing.
    """
    path = Path(path)
    open_bytes = PACKED.get(path.suffix, open)
    with replace_file(path) as temporary, open_bytes(temporary, "wb") as stream:
        for frame in frames:
            stream.writelines(format_frame(frame))


def format_frame(frame: Frame) -> Iterator[bytes]:
    """A frame as text, in pieces of at most 10,000 rows."""
    rows, label = len(frame.values), frame.kind.upper()
    yield f"ITEM: TIMESTEP\n{frame.time_step}\nITEM: NUMBER OF {label}\n{rows}\n".encode()
    if len(frame.bounds):
        yield f"ITEM: BOX BOUNDS {frame.boundary}\n".encode()
        yield "".join(" ".join(f"{x:.17g}" for x in row) + "\n" for row in frame.bounds).encode()
    yield f"ITEM: {label} {' '.join(frame.columns)}\n".encode()
    row = " ".join(["%.17g"] * len(frame.columns)) + "\n"
    for start in range(0, rows, 10_000):
        part = frame.values[start : start + 10_000]
        yield ((row * len(part)) % tuple(part.ravel().tolist())).encode()
