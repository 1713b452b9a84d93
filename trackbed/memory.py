"""How much memory there is, and what would need more: refused before it is taken."""

import os
import resource
import zipfile
from contextlib import suppress
from pathlib import Path
from typing import Any

from trackbed.errors import OutOfMemory

GROUP = Path("/sys/fs/cgroup/memory.max")
"""Where a container says what it may take; "max" or no file where there is no bound."""


def measure_memory() -> int:
    """Memory that this process may take at most [bytes]: the machine's, the container's, its own
    limit."""
    bounds = [os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")]
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit != resource.RLIM_INFINITY:
        bounds.append(limit)
    with suppress(OSError, ValueError):
        bounds.append(int(GROUP.read_text()))
    return min(bounds)


def refuse_more_memory(needed: float, what: str, where: str, remedy: str) -> None:
    """Raise `OutOfMemory` where ``what`` would need more bytes than there are."""
    there = measure_memory()
    if needed > there:
        raise OutOfMemory(
            f"{what} would need {needed / 1e9:.3g} GB of memory, and there are {there / 1e9:.3g}",
            where=where, remedy=remedy,
        )  # fmt: skip


def read_arrays(path: Path) -> dict[str, Any]:
    """Arrays of an ``.npz`` by name; no objects are unpacked.

    Raises `OutOfMemory` for more than there is room for, whatever its packed size, and what numpy
    raises for a damaged file, which are many kinds.
    """
    import numpy as np

    with path.open("rb") as stream:  # numpy leaves a damaged file open that it opened itself
        with zipfile.ZipFile(stream) as archive:
            needed = sum(entry.file_size for entry in archive.infolist())
        refuse_more_memory(needed, "its arrays", str(path), "give another file")
        stream.seek(0)
        with np.load(stream, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}


GROWTH = 20
"""Most memory that JSON takes as objects of Python over its size [-]: lists of short numbers."""


def read_bounded(path: Path, errors: str = "strict") -> str:
    """Text of a file that there is room for as objects; ``errors`` as `open` has it.

    Raises `OutOfMemory`, `OSError` and `UnicodeError`.
    """
    refuse_more_memory(GROWTH * path.stat().st_size, "this file", str(path), "give another file")
    return path.read_text(encoding="utf-8", errors=errors)
