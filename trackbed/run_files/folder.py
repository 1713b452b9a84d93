"""The folder of one run: its only writer's lock, its manifest, what may be written over.

A run folder may come from anyone, so nothing in it is followed out of it: a symbolic link is
refused, and so is what has no end.  Files that are no run's are left alone.
"""

import fcntl
import json
import os
import re
import socket
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from fnmatch import fnmatch
from pathlib import Path
from typing import Any, ClassVar

from trackbed.errors import UsageError
from trackbed.run_files import whole

MANIFEST, RESULT, PLOT = "manifest.json", "result.json", "plot.png"
TABLES = "*.csv"
"""Files of a finished run whose digests its result keeps."""
FORMAT = 1
"""Of run folders; a manifest without one has the first."""


def refuse_links(path: Path) -> None:
    """Raise `UsageError` if there is a symbolic link in the folder, however deep, which what reads
    and writes there would follow, or a pipe or device, which has no end; or if it can not be read.
    What is no folder holds none."""
    folders, strange = [path], []
    with suppress(FileNotFoundError, NotADirectoryError):
        try:
            while folders:
                with os.scandir(folders.pop()) as entries:
                    for entry in entries:
                        if entry.is_dir(follow_symlinks=False):
                            folders.append(Path(entry.path))
                        elif not entry.is_file(follow_symlinks=False):
                            kind = "symbolic link" if entry.is_symlink() else "pipe or device"
                            strange.append((kind, str(Path(entry.path).relative_to(path))))
        except PermissionError as error:
            raise UsageError(
                "this folder can not be read", where=str(path), remedy="get leave to read it"
            ) from error
    for kind, name in sorted(strange)[:1]:
        raise UsageError(
            f"this run folder holds a {kind} ({name}), which may lead anywhere; nothing was read "
            "or changed there",
            where=str(path),
            remedy="remove it, or put the files themselves in its place",
        )


def refuse_format(path: Path, manifest: Mapping[str, Any]) -> None:
    """Raise `UsageError` for the run of a later trackbed, and say which one can go on with it."""
    found = manifest.get("format", FORMAT)
    if found != FORMAT:
        versions = manifest.get("versions") or manifest.get("provenance", {}).get("versions", {})
        maker = versions.get("trackbed", "that made it")
        raise UsageError(
            f"this run folder is of format {found!r:.20}, and this trackbed knows format {FORMAT}",
            where=str(path),
            remedy=f"go on with the trackbed {maker}, or start again in another folder",
        )


@contextmanager
def lock_folder(path: Path, name: str = ".lock") -> Iterator[os.stat_result]:
    """Make the folder if need be, and hold its only writer's lock, the file ``name`` in it.

    Gives the identity of the lock.  The system drops it with the process, however that ends.
    Raises `UsageError` when another process has it, when there is a symbolic link, or when the
    folder can not be written, and `DiskFull` when there is no room.
    """
    with whole.refuse_writing(path):
        path.mkdir(parents=True, exist_ok=True)
    refuse_links(path)
    with whole.refuse_writing(path):
        flags = os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
        stream = os.open(path / name, flags, 0o666)
    try:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            owner = os.read(stream, 200).decode(errors="replace").strip()
            raise UsageError(
                f"another process writes to this run ({owner})", where=str(path),
                remedy="wait for it, or stop it; nothing was changed",
            ) from error  # fmt: skip
        except OSError as error:
            raise UsageError(
                f"the disk of this folder has no locks ({error.strerror})", where=str(path),
                remedy="give a folder on another disk: without a lock two runs could mix",
            ) from error  # fmt: skip
        with whole.refuse_writing(path):
            os.truncate(stream, 0)
            os.write(stream, f"pid {os.getpid()} on {socket.gethostname()}".encode())
            for leftover in path.glob(".*.partial"):  # of a killed writer
                if leftover.is_file():
                    leftover.unlink()
        yield os.fstat(stream)
    finally:
        os.close(stream)


def is_written(path: Path, name: str = ".lock") -> bool:
    """Whether a process holds the folder's lock, the file ``name`` in it.

    The lock is tried only when the process that last took it may still live: a try can refuse,
    for its instant, a writer that starts.
    """
    try:
        with whole.open_unlinked(path / name, "rb") as stream:
            owner = stream.read(200).decode(errors="replace").strip()
            holder = re.fullmatch(r"pid (\d+) on (.+)", owner)
            here = holder is not None and holder[2] == socket.gethostname()
            if holder is not None and here and not Path(f"/proc/{holder[1]}").exists():
                return False
            fcntl.flock(stream, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False


class RunFolder:
    """The folder ``path``; made when it is locked first.  A story says what is in its own."""

    own: ClassVar[tuple[str, ...]] = ()
    """Patterns of the run's files; a fresh start removes these and no other."""
    states: ClassVar[str] = ""
    """Pattern of the saved states: where there is one, there was a manifest before it."""
    compared: ClassVar[tuple[str, ...]] = ("scene",)
    """Parts of the manifest that must be the same for a run to go on."""
    free: ClassVar[tuple[str, ...]] = ()
    """Dotted keys of the manifest that may change: no number of the run depends on them."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock: os.stat_result | None = None
        """Identity of the lock while we hold it."""

    @property
    def summary(self) -> dict[str, Any] | None:
        """What the run came to; None where it has not come to its end, report and all."""
        return whole.read_object(self.path / RESULT) or None

    @contextmanager
    def lock(self) -> Iterator[None]:
        """Hold the lock of the folder's only writer; see `lock_folder`."""
        with lock_folder(self.path) as self._lock:
            try:
                yield
            finally:
                self._lock = None

    def refuse_if_replaced(self) -> None:
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
                remedy="leave the folder of a run alone; start it again",
            )  # fmt: skip

    def prepare(
        self, manifest: Mapping[str, Any], scene: str, *, resume: bool, force: bool
    ) -> bool:
        """Make the folder ready for a run of ``manifest``; whether a run that is there goes on.

        An empty folder is taken.  One with another scene's run, a finished run, or an unfinished
        run without ``resume``, raises `UsageError` and is left as it is, unless ``force``: then
        the run's own files are removed.  So does a folder with files of other people and no run,
        always.  A run that goes on with other `free` keys gets their scene and manifest, and has no
        result until it has one for these.
        """
        goes_on = self._judge(manifest, resume=resume, force=force)
        if goes_on and self._is_same(manifest):
            return True
        with whole.refuse_writing(self.path):
            for pattern in (RESULT, PLOT) if goes_on else (*self.own, PLOT):
                for path in self.path.glob(pattern):
                    path.unlink()
        whole.write_whole(self.path / "scene.toml", scene)
        content = {"format": FORMAT, **manifest}
        whole.write_whole(self.path / MANIFEST, json.dumps(content, indent=1) + "\n")
        return goes_on

    def look_ahead(
        self, manifest: Mapping[str, Any], *, resume: bool, force: bool
    ) -> dict[str, Any] | None:
        """Raise what `prepare` would, before anything is compiled; the summary of a run that would
        go on and is finished, with the same `free` keys."""
        if not self.path.exists():
            return None
        with self.lock():
            goes_on = self._judge(manifest, resume=resume, force=force)
            return self.summary if goes_on and self._is_same(manifest) else None

    def _is_same(self, manifest: Mapping[str, Any]) -> bool:
        """Whether the run that is there has the same keys, `free` ones too."""
        there = whole.read_object(self.path / MANIFEST) or {}
        return all(there.get(part) == manifest.get(part) for part in self.compared)

    def _judge(self, manifest: Mapping[str, Any], *, resume: bool, force: bool) -> bool:
        there = whole.read_object(self.path / MANIFEST)
        if there is None:
            self._refuse_strangers()
            if any(self.path.glob(self.states) if self.states else ()):
                there = {}
        if there is not None and not force:
            self._refuse_other(there, manifest)
            if resume:
                return True
            state = "is not finished" if self.summary is None else "is finished"
            raise UsageError(
                f"this run is there already and {state}", where=str(self.path),
                remedy="--resume to go on with it, or --force to compute it again",
            )  # fmt: skip
        return False

    def find_extended(self, _before: Any, _after: Any) -> tuple[str, ...]:
        """Keys that may change too, where the run ``after`` is the run ``before`` made longer (both
        the `compared` parts of a manifest): none, unless a story says which."""
        return ()

    def _refuse_strangers(self) -> None:
        """Refuse a folder with files that are no run's: there may be anything behind a typo."""
        names = sorted(path.name for path in self.path.iterdir())
        own = (*self.own, PLOT, ".lock")
        strange = [name for name in names if not any(fnmatch(name, pattern) for pattern in own)]
        if strange:
            raise UsageError(
                f"this folder holds other files ({', '.join(strange[:3])})",
                where=str(self.path), remedy="give a new or empty folder: --run-folder",
            )  # fmt: skip

    def _refuse_other(self, there: Mapping[str, Any], now: Mapping[str, Any]) -> None:
        """Refuse a run that can not go on here: damaged, of another version, of another scene."""
        remedy = "give another --run-folder, or --force to lose that run"
        if not there:
            raise UsageError(
                f"the {MANIFEST} of this run is missing or can not be read",
                where=str(self.path), remedy=remedy,
            )  # fmt: skip
        refuse_format(self.path, there)
        before, after = ({part: one.get(part) for part in self.compared} for one in (there, now))
        free = (*self.free, *self.find_extended(before, after))
        if changes := list(list_differences("", before, after, free)):
            raise UsageError(
                "this folder holds the run of another scene:\n  " + "\n  ".join(changes),
                where=str(self.path), remedy=remedy,
            )  # fmt: skip


def list_differences(key: str, old: Any, new: Any, free: tuple[str, ...] = ()) -> Iterator[str]:
    """What differs between two values of JSON, one line for each dotted key below ``key``."""
    if old == new or key in free:
        return
    if isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        old, new = (dict(enumerate(one)) for one in (old, new))
    if isinstance(old, dict) and isinstance(new, dict):
        for name in dict.fromkeys([*old, *new]):
            inner = f"{key}.{name}" if key else str(name)
            yield from list_differences(inner, old.get(name), new.get(name), free)
    else:
        yield f"{key}: {_shorten(old)} there, {_shorten(new)} now"


def _shorten(value: Any) -> str:
    text = "nothing" if value is None else json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "..."


def write_result(path: Path, summary: dict[str, Any]) -> None:
    """Write the ``summary`` of a finished run in a folder, with digests of its tables, sealed."""
    digests = {one.name: whole.digest_file(one) for one in sorted(path.glob(TABLES))}
    record = whole.seal_record(summary | {"digests": digests})
    whole.write_whole(path / RESULT, json.dumps(record, indent=1) + "\n")


def list_changed_tables(path: Path, summary: dict[str, Any]) -> list[str]:
    """Tables of a run in ``path``, and its result, that changed since its ``summary`` was made."""
    known = summary.get("digests")
    now = {one.name: whole.digest_file(one) for one in path.glob(TABLES) if one.is_file()}
    kept = known.items() if isinstance(known, dict) else ()
    changed = [str(name) for name, digest in kept if now.get(name) != digest]
    if summary.get(whole.SEAL) not in (None, whole.seal_record(summary)[whole.SEAL]):
        changed.append(RESULT)
    return changed
