"""The compiled step of the elements, on processors and on a GPU.

Here is how functions outside of the elements are compiled, what their files are made of, and the
vectors that they compute with: tuples of three numbers.
"""

import hashlib
from pathlib import Path
from types import ModuleType
from typing import Any

from numba import njit

__all__ = ["cross", "digest_sources", "dot", "exact", "inlined", "read_row"]

exact: Any = njit(error_model="numpy")
"""No fast mathematics: a force and its reaction are the same number."""
inlined: Any = njit(error_model="numpy", forceinline=True)


def digest_sources(*sources: str | ModuleType) -> str:
    """SHA-256 of modules or of files: a part of the key on disk of what is compiled from them."""
    digest = hashlib.sha256()
    for source in sources:
        file = source if isinstance(source, str) else source.__file__
        assert file is not None
        digest.update(Path(file).read_bytes())
    return digest.hexdigest()


@inlined
def read_row(a: Any, i: int) -> Any:  # pragma: no cover
    """Row i of ``a`` (..., 3)."""
    return a[i, 0], a[i, 1], a[i, 2]


@inlined
def dot(a: Any, b: Any) -> float:  # pragma: no cover
    """a . b"""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def cross(a: Any, b: Any) -> Any:  # pragma: no cover
    """a x b"""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
