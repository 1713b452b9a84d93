"""Text dumps of LIGGGHTS and LAMMPS: a frame of named columns, written without loss."""

from __future__ import annotations

import gzip
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from adapters.bed import FloatArray
from adapters.errors import DumpError
from trackbed.run_files import replace_file

Kind = Literal["atoms", "entries"]


@dataclass(frozen=True)
class Frame:
    """One instant of a dump: n rows of named columns, in the units of the run (here SI)."""

    time_step: int
    """The engine's step count."""
    columns: tuple[str, ...]
    """Names as the header has them, such as ``x`` or ``c_contacts[1]``; c of them."""
    values: FloatArray
    """One row a grain or contact, shape (n, c); grains ascend by ``id`` where it is a column."""
    bounds: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    """Box, low and high [m], shape (3, 2); (3, 3) or (3, 4) for a tilted box, (0, 2) for none."""
    kind: Kind = "atoms"
    """"atoms" for grains (dump custom), "entries" for contacts and the like (dump local)."""
    boundary: str = "ff ff ff"
    """What the header says of the box's sides and tilt."""

    def column(self, name: str) -> FloatArray:
        """Values of one column, shape (n,); raises `DumpError` when there is none of this name."""
        return self.block(name)[:, 0]

    def block(self, *names: str) -> FloatArray:
        """Values of columns side by side, C-contiguous, shape (n, len(names)); as `column`."""
        missing = [name for name in names if name not in self.columns]
        if missing:
            raise DumpError(
                f"there is no column {', '.join(missing)}; there are {' '.join(self.columns)}",
                where=f"time step {self.time_step}",
                remedy="name it in the engine's dump command",
            )
        index = [self.columns.index(name) for name in names]
        return np.ascontiguousarray(self.values[:, index])


def write_dump(path: str | Path, frames: Iterable[Frame]) -> None:
    """Write frames as a text dump (``.gz`` by suffix), atomically; `read_frames` reads it back.

    Nothing is lost.  LIGGGHTS takes the file in
    ``read_dump FILE STEP x y z vx vy vz radius replace yes box no`` when it has the columns
    ``id`` and ``type`` too; without them it stops, and says nothing.
    """
    path = Path(path)
    open_bytes = gzip.open if path.suffix == ".gz" else open
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
