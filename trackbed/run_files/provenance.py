"""Where a result comes from: commit, versions, machine, command and time."""

import os
import platform
import shlex
import subprocess
from collections.abc import Sequence
from contextlib import suppress
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

LIBRARIES = ("trackbed", "numpy", "scipy", "numba", "meshio", "scikit-fem")


def record_provenance(command: Sequence[str]) -> dict[str, Any]:
    """What is needed to make a result again; ``command`` is the command line that made it.

    Keys: ``commit``, ``versions`` (name -> version), ``machine``, ``command``, ``started`` (UTC).
    """
    return {
        "commit": find_commit(), "versions": list_versions(), "machine": describe_machine(),
        "command": shlex.join(command), "started": datetime.now(UTC).isoformat(timespec="seconds"),
    }  # fmt: skip


def find_commit() -> str:
    """Commit of the checkout this file lies in, "-modified" when it differs; else ""."""
    here = Path(__file__).resolve()

    def run_git(*words: str) -> str:
        return subprocess.run(
            ["git", "-C", str(here.parent), *words],
            capture_output=True, text=True, check=True, stdin=subprocess.DEVNULL,
        ).stdout.strip()  # fmt: skip

    try:
        run_git("ls-files", "--error-unmatch", here.name)  # installed inside a stranger's checkout?
        modified = run_git("status", "--porcelain", "--untracked-files=no")
        return run_git("rev-parse", "HEAD") + ("-modified" if modified else "")
    except (OSError, subprocess.CalledProcessError):
        return ""


def list_versions() -> dict[str, str]:
    """Versions of Python, trackbed and the libraries that compute; only what is installed."""
    found = {"python": platform.python_version()}
    for name in LIBRARIES:
        with suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found


def describe_machine() -> str:
    """Processor, number of its cores open to this process, and operating system."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    model = next((line.partition(":")[2].strip() for line in lines if "model name" in line), "")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return f"{model or platform.machine()}, {cores} cores, {platform.system()}"
