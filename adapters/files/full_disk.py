"""A full disk under a run: the sentence that says what is safe."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from adapters.errors import EngineFailed, NotCredible
from trackbed.errors import NO_ROOM, DiskFull

FREE_LEAST = 2**20
"""Free space below which a disk counts as full when an engine has failed [bytes]."""


@contextmanager
def explain_full_disk(path: Path) -> Iterator[None]:
    """Turn the system's "no space left" into a sentence that says what is safe.

    An engine does not always notice: what it left is cut short, and the disk tells why.
    """
    try:
        yield
    except OSError as error:
        if error.errno not in NO_ROOM:
            raise
        raise _make_disk_error(path, str(error.strerror)) from error
    except DiskFull as error:
        raise _make_disk_error(path, f"{error.where} {error.what}") from error
    except (EngineFailed, NotCredible) as error:
        free = shutil.disk_usage(path).free
        if free >= FREE_LEAST or (isinstance(error, EngineFailed) and error.from_outside):
            raise
        raise _make_disk_error(path, f"{free} bytes left") from error


def _make_disk_error(path: Path, why: str) -> EngineFailed:
    full = EngineFailed(
        f"the disk is full ({why})",
        where=str(path),
        remedy="free some space, then: trackbed resume RUN; finished windows are whole",
    )
    full.from_outside = True
    return full
