"""Where a run comes from: command, versions, machine, time."""

from __future__ import annotations

import platform
import shlex
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib import metadata


def provenance(command: Sequence[str]) -> dict[str, object]:
    """What is needed to make a run again: ``command``, ``versions``, ``machine``, ``started``."""
    found = {"python": platform.python_version()}
    for name in ("trackbed", "numpy", "scipy", "numba"):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return {
        "command": shlex.join(command),
        "versions": found,
        "machine": f"{platform.machine()}, {platform.system()} {platform.release()}",
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
    }
