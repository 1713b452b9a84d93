"""What reading a damaged file raises, and the error that names the file."""

from __future__ import annotations

import lzma
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rigid_lcp.errors import ProblemError

DAMAGED = (
    OSError, EOFError, ValueError, LookupError, TypeError, AttributeError, RuntimeError,
    MemoryError, OverflowError, SyntaxError, tokenize.TokenError, struct.error, zipfile.BadZipFile,
    zlib.error, lzma.LZMAError,
)  # fmt: skip
"""What numpy and h5py raise as they read a damaged file: any byte of it may be wrong."""


@contextmanager
def describe_damage(path: Path) -> Iterator[None]:
    """Put the file's name before what the checks of a problem say."""
    try:
        yield
    except ProblemError as error:
        where = f"{path}: {error.where}" if error.where else str(path)
        raise ProblemError(error.what, where=where, remedy=error.remedy) from error


def name_missing_part(path: Path, name: str, have: list[str], why: str = "") -> ProblemError:
    """The error for a part that a file must have, with those that it has."""
    return ProblemError(
        f"it has no {name}" + (f"; {why}" if why else ""), where=str(path),
        remedy=f"it has {', '.join(have) or 'nothing'}; add {name}",
    )  # fmt: skip
