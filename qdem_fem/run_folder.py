"""The folder of one QDEM run: its manifest, its lock, what may be written over."""

from __future__ import annotations

import fcntl
import json
import os
import platform
import shlex
import socket
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from qdem_fem.errors import UsageError
from qdem_fem.output import can_not_write, write_whole

MANIFEST, RESULT, CHECKPOINT = "manifest.json", "result.json", "checkpoint.npz"
OURS = (
    "scene.toml", "manifest.json", "result.json", "checkpoint.npz", "cost.json", "probes.csv",
    "energy.csv", "fields.pvd", "fields_*.vtu", "report.html", "picture-*.png", "video.gif",
    ".*.partial",
)  # fmt: skip
"""Files of a run; what starts anew removes these and no other."""
COMPARED = ("scene", "files")
"""Parts of the manifest that must be the same for a run to go on."""
FREE = (
    "scene.title", "scene.simulation.threads", "scene.output.checkpoint_interval",
    "scene.output.audit", "scene.output.modes", "scene.output.video",
)  # fmt: skip
"""Keys that may change: no number of the record depends on them."""


class RunFolder:
    """The folder ``path``; made when it is locked first."""

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def finished(self) -> bool:
        """Whether the run came to its end, report and all."""
        return (self.path / RESULT).exists()

    @property
    def checkpoint(self) -> Path:
        """Where the last saved state is."""
        return self.path / CHECKPOINT

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Hold the lock of the folder's only writer.

        Raises `UsageError` when another process has it, or the folder can not be written.  The
        system drops the lock with the process, however it ends.
        """
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            lock = (self.path / ".lock").open("a+", encoding="utf-8")
        except OSError as error:
            raise can_not_write(self.path, error) from error
        with lock as stream:
            try:
                fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                stream.seek(0)
                raise UsageError(
                    f"another process writes to this run ({stream.read().strip()})",
                    where=str(self.path),
                    remedy="wait for it, or stop it; nothing was changed",
                ) from error
            stream.truncate(0)
            stream.write(f"pid {os.getpid()} on {socket.gethostname()}")
            stream.flush()
            yield

    def settle(self, manifest: Mapping[str, Any], scene: str, *, resume: bool, force: bool) -> bool:
        """Make the folder ready for a run of ``manifest``; whether a run that is there goes on.

        An empty folder is taken.  One with another scene's run, a finished run, or an unfinished
        run without ``resume``, raises `UsageError` and is left as it is, unless ``force``: then
        the run's own files are removed.  So does a folder with files of other people, always.
        """
        there = self._manifest()
        if there is None:
            self._only_ours()
        elif not force:
            if changes := list(differences(there, manifest)):
                raise UsageError(
                    "this folder holds the run of another scene:\n  " + "\n  ".join(changes),
                    where=str(self.path),
                    remedy="give another --run-folder, or --force to lose that run",
                )
            if resume:
                return True
            state = "is finished" if self.finished else "is not finished"
            raise UsageError(
                f"this run is there already and {state}",
                where=str(self.path),
                remedy="--resume to go on with it, or --force to compute it anew",
            )
        for pattern in OURS:
            for path in self.path.glob(pattern):
                path.unlink()
        write_whole(self.path / "scene.toml", scene)
        write_whole(self.path / MANIFEST, json.dumps(manifest, indent=1) + "\n")
        return False

    def _manifest(self) -> dict[str, Any] | None:
        """The manifest that is there; None without one, empty when it can not be read."""
        path = self.path / MANIFEST
        if not path.exists():
            return None
        try:
            content = json.loads(path.read_text(encoding="utf-8"))
            return content if isinstance(content, dict) else {}
        except (OSError, ValueError):
            return {}

    def _only_ours(self) -> None:
        """Refuse a folder with files that are no run's: there may be anything behind a typo."""
        ours = {path for pattern in (*OURS, ".lock") for path in self.path.glob(pattern)}
        strange = sorted(path.name for path in self.path.iterdir() if path not in ours)
        if strange:
            raise UsageError(
                f"this folder holds other files ({', '.join(strange[:3])})",
                where=str(self.path),
                remedy="give a new or empty --run-folder",
            )


def differences(there: Mapping[str, Any], now: Mapping[str, Any]) -> Iterator[str]:
    """What differs between two manifests, one line for each key."""
    before, after = ({part: one.get(part) for part in COMPARED} for one in (there, now))
    yield from _different("", before, after)


def _different(key: str, before: Any, after: Any) -> Iterator[str]:
    if before == after or key in FREE:
        return
    if isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        before, after = (dict(enumerate(one)) for one in (before, after))
    if isinstance(before, dict) and isinstance(after, dict):
        for name in dict.fromkeys([*before, *after]):
            inner = f"{key}.{name}" if key else str(name)
            yield from _different(inner, before.get(name), after.get(name))
    else:
        yield f"{key}: {_brief(before)} there, {_brief(after)} now"


def _brief(value: Any) -> str:
    text = "nothing" if value is None else json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."


def manifest_of(
    parameters: dict[str, Any], files: dict[str, str], overrides: Sequence[str], argv: Sequence[str]
) -> dict[str, Any]:
    """What a result can be made again from: effective scene, files, versions, machine, command."""
    made: dict[str, Any] = {
        "format": 1,
        "scene": parameters,
        "files": files,
        "overrides": list(overrides),
        "command": shlex.join(argv),
        "versions": versions(),
        "machine": machine(),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
    }
    return dict(json.loads(json.dumps(made)))


def versions() -> dict[str, str]:
    """Versions of Python and of the libraries that compute; only what is installed."""
    found = {"python": platform.python_version()}
    for name in ("trackbed", "numpy", "scipy", "numba", "meshio", "scikit-fem"):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    return found


def machine() -> str:
    """Processor, number of its cores open to this process, and operating system."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    model = next((line.partition(":")[2].strip() for line in lines if "model name" in line), "")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return f"{model or platform.machine()}, {cores} cores, {platform.system()}"
