"""The folder of one run: its scene, its frames (states to go on from), its table, its lock.

A frame is written whole or not at all, and the table of energies is made anew from the frames, so
whatever kills a run costs at most the time since its last frame.
"""

from __future__ import annotations

import fcntl
import io
import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import fields
from errno import EDQUOT, EEXIST, EFBIG, ENOSPC, ENOTDIR
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import numpy as np

from rigid_lcp.contacts import ContactForces
from rigid_lcp.damaged_files import DAMAGED
from rigid_lcp.errors import DiskFull, SceneError, UsageError
from rigid_lcp.frame_bodies import bodies_arrays, bodies_restore
from rigid_lcp.motion import Motion
from rigid_lcp.runge_kutta import Pace
from rigid_lcp.simulation import Simulation

FRAME = "frame_{:06d}.npz"
RESULT, MANIFEST = "result.json", "manifest.json"
OURS = (
    "scene.toml", MANIFEST, RESULT, "frame_*.npz", "history.csv", "report.html", "picture-*.png",
    "movie.gif", ".*.partial",
)  # fmt: skip
"""Files of a run; what starts anew removes these and no other."""
COUNTERS = ("time", "steps", "worst_residual", "steps_above", "steps_scaled", "steps_cut_off")
NO_ROOM = (ENOSPC, EDQUOT, EFBIG)
"""No space on the disk, none left in the user's quota, or a longer file than is allowed."""
NO_FOLDER = (EEXIST, ENOTDIR)
"""A file where the folder, or one above it, should be."""


@contextmanager
def refusal_told(path: Path) -> Iterator[None]:
    """`DiskFull`, or `UsageError`, in place of what the system raises when it refuses to write."""
    try:
        yield
    except OSError as error:
        full = error.errno in NO_ROOM
        refusal = DiskFull if full else UsageError
        room = "make room" if full else "get leave to write there"
        remedy = (
            f"{room}, then the same command with --resume goes on from the last frame; "
            "or give another --run-folder"
        )
        if error.errno in NO_FOLDER:
            remedy = "a file is where the folder should be: give another --run-folder"
        raise refusal(
            f"can not be written ({error.strerror or error})", where=str(path), remedy=remedy
        ) from error


def write_whole(path: Path, content: bytes | str) -> None:
    """Write a file: whatever kills the writer leaves the old file or the new, never a part.

    Raises `DiskFull` when there is no room, `UsageError` when the system refuses otherwise.
    """
    partial = path.with_name(f".{path.name}.{os.getpid()}.partial")
    try:
        with refusal_told(path):
            with partial.open("wb") as stream:
                stream.write(content.encode() if isinstance(content, str) else content)
                stream.flush()
                os.fsync(stream.fileno())
            partial.replace(path)
    finally:
        with suppress(OSError):
            partial.unlink(missing_ok=True)


class RunFolder:
    """The folder ``path``; made when it is locked first."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock: os.stat_result | None = None
        """Identity of the lock while we hold it."""

    @property
    def summary(self) -> dict[str, Any] | None:
        """What the run came to; None where it has not come to its end, report and all."""
        return _json_object(self.path / RESULT) or None

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Hold the lock of the folder's only writer; the system drops it with the process.

        Raises `UsageError` when another process has it, or the folder can not be written, and
        `DiskFull` when there is no room.
        """
        lock = self.path / ".lock"
        with refusal_told(self.path):
            self.path.mkdir(parents=True, exist_ok=True)
            stream = os.open(lock, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            with refusal_told(self.path):
                try:
                    fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError as error:
                    owner = os.read(stream, 200).decode(errors="replace").strip()
                    raise UsageError(
                        f"another process writes to this run ({owner})", where=str(self.path),
                        remedy="wait for it, or stop it; nothing was changed",
                    ) from error  # fmt: skip
                os.truncate(stream, 0)
                os.write(stream, f"pid {os.getpid()} on {socket.gethostname()}".encode())
                for leftover in self.path.glob(".*.partial"):  # of a killed writer
                    leftover.unlink()
            self._lock = os.fstat(stream)
            yield
        finally:
            self._lock = None
            os.close(stream)

    def _refuse_if_replaced(self) -> None:
        """Raise `UsageError` if the folder whose lock we hold is not the one that is there now."""
        if self._lock is None:
            return
        try:
            same = os.path.samestat(self._lock, os.stat(self.path / ".lock"))
        except OSError:
            same = False
        if not same:
            raise UsageError(
                "this folder was removed or replaced while the run went on", where=str(self.path),
                remedy="leave the folder of a run alone; start it anew",
            )  # fmt: skip

    def settle(self, manifest: dict[str, Any], scene: str, *, resume: bool, force: bool) -> bool:
        """Make the folder ready for a run of ``manifest``; whether a run that is there goes on.

        Another scene's run, or an unfinished one without ``resume``, raises `UsageError` and is
        left as it is, unless ``force``: then the run's own files are removed.  So does a folder
        with other people's files, always.
        """
        names = sorted(path.name for path in self.path.iterdir())
        strangers = [
            name for name in names
            if name != ".lock" and not any(fnmatch(name, pattern) for pattern in OURS)
        ]  # fmt: skip
        if strangers:
            raise UsageError(
                f"this folder has files that are no run's ({', '.join(strangers[:3])})",
                where=str(self.path), remedy="give an empty --run-folder",
            )  # fmt: skip
        there = _json_object(self.path / MANIFEST)
        if there is None and any(fnmatch(name, "frame_*.npz") for name in names):
            there = {}  # frames are written after it: it was there
        if there is not None and not force:
            if not there:
                raise UsageError(
                    f"the {MANIFEST} of this run is missing or can not be read",
                    where=str(self.path),
                    remedy="give another --run-folder, or --force to lose that run",
                )  # fmt: skip
            if there.get("scene") != manifest["scene"]:
                raise UsageError(
                    "this folder holds the run of another scene", where=str(self.path),
                    remedy="give another --run-folder, or --force to lose that run",
                )  # fmt: skip
            if resume:
                return True
            state = "is not finished" if self.summary is None else "is finished"
            raise UsageError(
                f"this run is there already and {state}", where=str(self.path),
                remedy="--resume to go on with it, or --force to compute it anew",
            )  # fmt: skip
        with refusal_told(self.path):
            for pattern in OURS:
                for path in self.path.glob(pattern):
                    path.unlink()
        write_whole(self.path / "scene.toml", scene)
        write_whole(self.path / MANIFEST, json.dumps(manifest, indent=1) + "\n")
        return False

    # --- frames ---------------------------------------------------------------------------------

    def frame_write(self, number: int, run: Simulation, cpu: float) -> None:
        """Keep the state of a run as frame ``number``; ``cpu``: processor time so far [s].

        Raises as `write_whole`, and `UsageError` if the folder is not the one we locked.
        """
        self._refuse_if_replaced()
        arrays = {f"motion_{f.name}": getattr(run.motion, f.name) for f in fields(Motion)}
        arrays |= {
            f"contact_{f.name}": getattr(run.contacts, f.name) for f in fields(ContactForces)
        }
        arrays |= {name: np.asarray(getattr(run, name)) for name in COUNTERS}
        arrays |= {"energy": np.asarray(run.energy), "overlap": np.asarray(run.overlap)}
        arrays |= {f"pace_{f.name}": np.asarray(getattr(run.pace, f.name)) for f in fields(Pace)}
        arrays |= bodies_arrays(run)
        buffer = io.BytesIO()
        np.savez_compressed(buffer, cpu=np.asarray(cpu), **arrays)
        write_whole(self.path / FRAME.format(number), buffer.getvalue())

    def frames(self) -> list[Path]:
        """Frames that can be read, in order, up to the first that is missing or damaged."""
        sound: list[Path] = []
        while (path := self.path / FRAME.format(len(sound))).exists():
            try:
                frame_read(path)
            except DAMAGED:
                break
            sound.append(path)
        return sound


def _json_object(path: Path) -> dict[str, Any] | None:
    """An object of a JSON file; None where there is no file, empty when it can not be read."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def frame_read(path: Path) -> dict[str, Any]:
    """Arrays of a frame by name, with ``motion``, ``contacts`` and ``pace`` put together, counters
    as numbers.  Raises one of `DAMAGED` if it can not be read, or is of another version."""
    with path.open("rb") as stream, np.load(stream) as file:  # it leaves damaged ones open
        arrays = {name: file[name] for name in file.files}
    arrays |= {name: arrays[name].item() for name in (*COUNTERS, "energy", "overlap", "cpu")}
    arrays["pace"] = Pace(**{f.name: arrays[f"pace_{f.name}"].item() for f in fields(Pace)})
    arrays["motion"] = Motion(**{f.name: arrays[f"motion_{f.name}"] for f in fields(Motion)})
    arrays["contacts"] = ContactForces(
        **{f.name: arrays[f"contact_{f.name}"] for f in fields(ContactForces)}
    )
    return arrays


def frame_restore(path: Path, run: Simulation) -> float:
    """Put a run into a frame's state; returns the processor time that it had taken [s].

    Raises `SceneError` if the frame is of other bodies.
    """
    frame = frame_read(path)
    bodies_restore(run, frame)
    bodies = len(run.world.scene.bodies)
    if len(frame["motion"].position) != bodies or frame["motion"].dim != run.motion.dim:
        raise SceneError(
            f"the frame has {len(frame['motion'].position)} bodies, the scene {bodies}",
            where=str(path), remedy="--force to compute it anew",
        )  # fmt: skip
    for name in ("motion", "contacts", "pace", *COUNTERS):
        setattr(run, name, frame[name])
    return float(frame["cpu"])
