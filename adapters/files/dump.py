"""Text dumps of LIGGGHTS and LAMMPS: frames of named columns, read and written without loss."""

from __future__ import annotations

import gzip
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from adapters.errors import UsageError
from adapters.files.dump_frame import Frame, Kind

__all__ = ["Frame", "Kind", "read_frames", "write_dump"]


def read_frames(
    path: str | Path, *, expected_ids: Iterable[int] | None = None, allow_nan: bool = False
) -> Iterator[Frame]:
    """Frames of a text dump (``.gz`` too), in order; memory for one frame and a block of text.

    Every number is the float64 nearest to its decimal text.  ``expected_ids`` are grains that
    must be in every frame; without them, a grain that was in a frame must be in all later ones.
    ``allow_nan`` lets nan and infinity pass.  Raises `DumpError` at the first fault, after the
    whole frames before it; `UsageError` when the file cannot be opened.
    Not for ``.bin``, VTK or image dumps, nor for text columns such as ``element``.
    """
    from adapters.files.dump_reader import Reader  # loads the compiler

    path = Path(path)
    try:
        stream = (
            gzip.open(path) if path.suffix == ".gz" else path.open("rb", buffering=0)  # noqa: SIM115
        )
    except OSError as error:
        raise UsageError(
            f"the dump cannot be opened ({error.strerror})",
            where=str(path),
            remedy="check the name, and that the engine's dump command came to its first step",
        ) from error
    with stream:
        reader = Reader(path, stream, expected_ids, allow_nan)
        while (frame := reader.read_frame()) is not None:
            yield frame


def write_dump(path: str | Path, frames: Iterable[Frame], format: str = "%.17g") -> None:
    """Write frames as a text dump (``.gz`` by suffix), atomically; `read_frames` reads it back.

    ``format`` is one printf format for all columns, or one for each, separated by blanks, as in
    the engine's ``dump_modify format``; the default loses nothing.  LIGGGHTS takes the file in
    ``read_dump FILE STEP x y z vx vy vz radius replace yes box no`` when it has the columns
    ``id`` and ``type`` too; without them it stops, and says nothing.
    """
    path = Path(path)
    temporary = path.with_name(path.name + ".partial")
    try:
        compressed = path.suffix == ".gz"
        with gzip.open(temporary, "wb") if compressed else temporary.open("wb") as stream:
            for frame in frames:
                stream.writelines(format_frame(frame, format.split()))
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def format_frame(frame: Frame, formats: Sequence[str]) -> Iterator[bytes]:
    """A frame as text, in pieces of at most 10,000 rows."""
    shape = (len(frame.values), len(frame.columns))
    if len(formats) not in (1, shape[1]) or frame.values.shape != shape:
        raise UsageError(
            f"{len(formats)} formats and values of shape {frame.values.shape}"
            f" for {shape[1]} columns",
            where=f"time step {frame.time_step}",
            remedy="give one format, or one for each column",
        )
    label = frame.kind.upper()
    yield f"ITEM: TIMESTEP\n{frame.time_step}\nITEM: NUMBER OF {label}\n{shape[0]}\n".encode()
    if len(frame.bounds):
        yield f"ITEM: BOX BOUNDS {frame.boundary}\n".encode()
        yield "".join(" ".join(f"{x:.17g}" for x in row) + "\n" for row in frame.bounds).encode()
    yield f"ITEM: {label} {' '.join(frame.columns)}\n".encode()
    row = " ".join(formats if len(formats) > 1 else [*formats] * shape[1]) + "\n"
    for start in range(0, shape[0], 10_000):
        part = frame.values[start : start + 10_000]
        yield ((row * len(part)) % tuple(part.ravel().tolist())).encode()
