"""What reading a damaged file raises, and errors that name the file and a part of it."""

import lzma
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from rigid_lcp.errors import ProblemError

DAMAGED = (
    OSError, EOFError, ValueError, LookupError, TypeError, AttributeError, RuntimeError,
    MemoryError, OverflowError, SyntaxError, tokenize.TokenError, struct.error, zipfile.BadZipFile,
    zlib.error, lzma.LZMAError,
)  # fmt: skip
"""What numpy and h5py raise as they read a damaged file: any byte of it may be wrong."""


@contextmanager
def refuse_damage(what: str, where: str, remedy: str) -> Iterator[None]:
    """Put a `ProblemError`, ``what`` can not be done, in place of what is `DAMAGED`."""
    try:
        yield
    except DAMAGED as error:
        raise ProblemError(f"{what}: {error}", where=where, remedy=remedy) from error


@contextmanager
def describe_damage(path: Path) -> Iterator[None]:
    """Put the file's name before what the checks of a problem say."""
    try:
        yield
    except ProblemError as error:
        where = f"{path}: {error.where}" if error.where else str(path)
        raise error.relocate(where) from error


def name_missing_part(path: Path, name: str, have: list[str], why: str = "") -> ProblemError:
    """The error for a part that a file must have, with those that it has."""
    return ProblemError(
        f"it has no {name}" + (f"; {why}" if why else ""), where=str(path),
        remedy=f"it has {', '.join(have) or 'nothing'}; add {name}",
    )  # fmt: skip


def refuse_unused_parts(path: Path, unused: Collection[str]) -> None:
    """Raise `ProblemError` for parts of a file that would change the problem, were they read."""
    if unused:
        raise ProblemError(
            f"{', '.join(sorted(unused))} would not be used", where=str(path),
            remedy="only contacts with sliding friction are known: eliminate what is more",
        )  # fmt: skip


def take_whole_number(values: NDArray[Any], where: str) -> int:
    """The one number of an array.  Raises `ProblemError` where it is not one whole number."""
    if values.size != 1 or values.dtype.kind not in "iuf" or values.item() % 1:
        raise ProblemError(
            f"it is {values.tolist()}, and not one whole number", where=where,
            remedy="give 2 in the plane, 3 in space",
        )  # fmt: skip
    return int(values.item())
