"""Files that are written whole or not at all, and through no symbolic link."""

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from errno import EEXIST, ELOOP, ENOTDIR
from pathlib import Path
from typing import IO, Any
from xml.sax.saxutils import quoteattr

from trackbed.errors import NO_ROOM, DiskFull, UsageError
from trackbed.memory import read_bounded

NO_FOLDER = (EEXIST, ENOTDIR)
"""A file where the folder, or one above it, should be."""
SEAL = "seal"
"""Key of a record, such as an outcome, with the SHA-256 of the others; older ones have none."""


def open_unlinked(path: Path, mode: str) -> IO[Any]:
    """Open a file as `open` does, but raise `OSError` (ELOOP) where ``path`` is a symbolic link."""

    def open_descriptor(name: str, flags: int) -> int:
        return os.open(name, flags | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)

    return open(path, mode, encoding=None if "b" in mode else "utf-8", opener=open_descriptor)


@contextmanager
def refuse_writing(path: Path) -> Iterator[None]:
    """`DiskFull`, or `UsageError`, in place of what the system raises when it refuses to write."""
    try:
        yield
    except OSError as error:
        full = error.errno in NO_ROOM
        room = "make room" if full else "make room or get leave to write there"
        remedy = f"{room}, then try again (a run goes on with --resume); or give another folder"
        if error.errno in NO_FOLDER:
            remedy = "a file is where the folder should be: give another folder"
        if error.errno == ELOOP:
            remedy = "it is a symbolic link, which may lead anywhere: remove it"
        what = f"can not be written ({error.strerror or error})"
        kind = DiskFull if full else UsageError
        raise kind(what, where=str(path), remedy=remedy) from error


@contextmanager
def replace_file(path: Path) -> Iterator[Path]:
    """A name to write to that becomes ``path`` when the block ends well, and else is removed.

    Whatever kills the writer leaves the old file or the new, never a part; a symbolic link at
    ``path`` is replaced, not followed.  Raises `DiskFull` when there is no room, `UsageError` when
    the system refuses otherwise.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        with refuse_writing(path):
            yield temporary
            with temporary.open("rb") as stream:
                os.fsync(stream.fileno())
            temporary.replace(path)
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a text or bytes as `replace_file` does."""
    with replace_file(path) as temporary, open_unlinked(temporary, "wb") as stream:
        stream.write(content.encode() if isinstance(content, str) else content)


def write_csv(path: Path, names: Iterable[str], rows: Iterable[Iterable[object]]) -> None:
    """Write a table whole, its numbers with digits enough to read the same ones back."""
    lines = [",".join(map(str, row)) for row in (names, *rows)]
    write_whole(path, "\n".join(lines) + "\n")


def append_text(path: Path, text: str) -> None:
    """Append lines of text to a file; raises `OSError`, ELOOP for a symbolic link."""
    with open_unlinked(path, "a") as stream:
        stream.write(text)


def seal_file(path: Path) -> str:
    """Have the system write a file to the disk; its SHA-256.  Raises `OSError`."""
    with path.open("rb") as stream:
        os.fsync(stream.fileno())
    return digest_file(path)


def digest_file(path: Path) -> str:
    """SHA-256 of a file.  Raises `OSError`."""
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def seal_record(record: dict[str, Any]) -> dict[str, Any]:
    """A record of JSON with its seal, in place of one that it has, whatever its keys' order."""
    bare = json.loads(json.dumps({key: record[key] for key in record if key != SEAL}))
    text = json.dumps(bare, sort_keys=True)
    return bare | {SEAL: hashlib.sha256(text.encode()).hexdigest()}


def open_seal(record: dict[str, Any]) -> dict[str, Any]:
    """A record without its seal; raises `ValueError` where it is not the seal of this record."""
    if (seal := record.pop(SEAL, None)) is not None and seal != seal_record(record)[SEAL]:
        raise ValueError("changed since it was written")
    return record


def sync_folder(path: Path) -> None:
    """Have the system write the names in a folder to the disk, where it can."""
    with suppress(OSError):
        number = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def read_object(path: Path) -> dict[str, Any] | None:
    """An object of a JSON file; None where there is no file, empty when it can not be read."""
    try:
        content = json.loads(read_bounded(path))
    except FileNotFoundError:
        return None
    except (OSError, ValueError, RecursionError, MemoryError):
        return {}
    return content if isinstance(content, dict) else {}


def write_pvd(path: Path, files: Sequence[tuple[float, str]]) -> None:
    """Write a PVD file: the series of VTU ``files``, each (time [s] or cycle, path from there)."""
    lines = [
        '<?xml version="1.0"?>',
        '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">',
        "<Collection>",
        *(f'<DataSet timestep="{t}" group="" part="0" file={quoteattr(n)}/>' for t, n in files),
        "</Collection>",
        "</VTKFile>",
    ]
    write_whole(path, "\n".join(lines) + "\n")
