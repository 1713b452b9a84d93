"""How compiled functions outside of the elements are compiled, and what their files are made of."""

from __future__ import annotations

import hashlib
from pathlib import Path
from types import ModuleType
from typing import Any

from numba import njit

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
