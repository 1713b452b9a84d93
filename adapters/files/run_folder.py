"""The run folder: finished stages, the manifest, the events, one writer at a time.

A stage (``preparation``, ``window_000020``, ``jump_000040_1``) is worked in ``partial/`` and
renamed to its place when its ``outcome.json`` is written: what stands in its place is whole.
Nothing is overwritten; what does not belong any more is moved to ``discarded/``.  A folder of
another name, such as a copy of a stage, is no stage and is left alone.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import time
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime
from itertools import count, takewhile
from pathlib import Path
from typing import Any

from adapters.errors import UsageError
from trackbed import run_files
from trackbed.memory import read_bounded

EXCHANGE = ("grains_came", "mass_came", "grains_went", "mass_went", "mass_worn")
"""Columns of a user's deck that has grains come, go and wear in a cycle: numbers, masses [kg]."""
COLUMNS = {
    "cycle": "cycle", "loaded_body_settlement": "loaded_body", "stiffness": "stiffness",
    "elastic_deflection": "elastic_deflection", "mean_grain_settlement": "settlement",
    **{name: name for name in (
        "kind", "coordination_number", "relative_density", "piston_height", "force_error",
        "maximum_overlap", "kinetic_translational", "kinetic_rotational", "mean_rotation",
        *EXCHANGE,
    )},
}  # fmt: skip
"""Columns of ``settlement.csv`` and their names in `Outcome.rows`: SI units, settlement since the
preparation; kind is ``computed``, ``healing`` or ``jumped``."""


@dataclass(frozen=True)
class Outcome:
    """What a finished stage left behind, besides its files."""

    stage: str  # ``preparation``, ``window`` or ``jump``
    first_cycle: int  # cycles done before the stage
    last_cycle: int  # and after it
    rows: list[dict[str, Any]]
    """One row of ``settlement.csv`` for each cycle end, by the names that `COLUMNS` gives."""
    cost: dict[str, float]
    """CPU time by purpose [s]: engine, start_up (part of engine), parse, fit, relax, other."""
    checks: dict[str, float] = field(default_factory=dict)  # figures the validators judged
    notes: dict[str, Any] = field(default_factory=dict)
    """What else the report tells: time step, piston mesh, command, relaxation."""


NEEDED = ("*.npz", "end.restart")
"""Files of a stage that a run goes on from; the others may be removed to save space."""
MANIFEST = ("scene", "overrides", "control")
"""What a manifest must hold for its run to be resumed."""
EVENTS = "events.jsonl"
ASKED_ON = "asked to go on cycle by cycle"
"""Event of a run whose user wants every cycle computed where no jump is allowed."""
STAGES = ("preparation", "jump", "window")
"""Kinds of stages; at one cycle in this order: a jump of h = 0 comes before its window."""
STAGE = re.compile(r"preparation|jump_\d{6,}_\d+|window_\d{6,}")
"""Name of a stage's folder."""


@dataclass
class Listing:
    """What is in a folder whose lock we hold: nobody else makes or moves stages there, so it is
    read once, and a further stage costs as much as the first."""

    names: list[str]  # of all stages, in order
    finished: dict[str, Outcome]  # those finished, in order, without failed jumps
    table: tuple[int, ...] = ()  # identity of the ``settlement.csv`` that has all their rows


def place_stage(name: str) -> tuple[int, int, str]:
    """Sorting key of a stage's name: its first cycle, its kind, its attempt."""
    kind, *numbers = name.split("_")
    return (int(numbers[0]) if numbers else -1, STAGES.index(kind), name)


class RunFolder:
    """Finished stages of one run under ``path``."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._known: dict[str, tuple[list[tuple[str, tuple[int, ...]]], bool, Outcome, str]] = {}
        """Of stages read before: identities of files, whether digests were seen, outcome, rows."""
        self._listing: Listing | None = None

    @contextmanager
    def lock(self) -> Iterator[None]:
        """Hold the folder's only writer's lock; see `trackbed.run_files.lock_folder`."""
        with run_files.lock_folder(self.path, "lock"):
            self._listing = self._list_stages()
            try:
                yield
            finally:
                self._listing = None

    def enter(self, variant: str) -> RunFolder:
        """The folder of a ``variant`` inside, made if need be, for who holds the lock of this."""
        inner = RunFolder(self.path / variant)
        inner.path.mkdir(exist_ok=True)
        inner._listing = inner._list_stages()
        return inner

    def add_event(self, what: str, **details: object) -> None:
        """Append one line to ``events.jsonl``."""
        now = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
        line = json.dumps(run_files.seal_record({"time": now, "event": what, **details}))
        run_files.append_text(self.path / EVENTS, line + "\n")

    def keep_cycle_by_cycle(self, now: bool) -> bool:
        """Whether this run was asked to compute where it may not jump, ``now`` or ever before."""
        before = any(event["event"] == ASKED_ON for event in self.events())
        if now and not before:
            self.add_event(ASKED_ON)
        return now or before

    def events(self) -> list[dict[str, Any]]:
        """All events; a line cut short by a crash, or changed since, is left out."""
        return [event for event in self._read_events() if event]

    def _read_events(self) -> list[dict[str, Any]]:
        """An event a line, empty where the line is not one that we wrote."""
        try:
            text = read_bounded(self.path / EVENTS, errors="replace")
        except FileNotFoundError:
            return []
        return [_read_event(line) for line in text.splitlines()]

    def list_damaged(self) -> list[str]:
        """What in the folder is not as it was left: stages, which count for nothing then, and
        the records beside them.  Reads all that has a digest: about a second a gigabyte."""
        path = self.path / "settlement.csv"
        text = read_bounded(path, errors="replace") if path.exists() else ""  # may grow meanwhile
        listing = self._list_stages(verify=True)
        names = [n for n in listing.names if n not in listing.finished and not self.failure(n)]
        if not all(self._read_events()[:-1]):  # a crash cuts the last one
            names.append(EVENTS)
        titles = text.partition("\n")[0].split(",")[: len(COLUMNS)]  # 0.2 had fewer: names in rows
        keys = [COLUMNS.get(title, title) for title in titles]
        rows = "".join(_format_rows(one.rows, keys) for one in listing.finished.values())
        table = ",".join(titles) + "\n" + rows
        if rows and not names and not (text and table.startswith(text)):  # a kill may miss a row
            names.append("settlement.csv")
        return names

    def outcome(self, name: str, *, verify: bool = True) -> Outcome | None:
        """Outcome of a finished stage; None when it is not there, or not as it was left.

        ``verify`` looks into the files that a run goes on from, once for this `RunFolder`; else
        their sizes are all that is compared.
        """
        folder = self.path / name
        try:
            if name in self._known:
                files, verified, outcome, _ = self._known[name]
                looked_at = files if verify else files[:1]
                same = all(_identify(path) == found for path, found in looked_at)
                if same and verified >= verify:
                    return outcome
            record = json.loads(read_bounded(folder / "outcome.json"))
            outcome = Outcome(**run_files.open_seal(record))
            names = ("outcome.json", *outcome.notes.get("files", ()))
            files = [(path, _identify(path)) for path in (f"{folder}/{one}" for one in names)]
            found = _list_sizes(folder)
            whole = outcome.notes.get("files", found) == found
            digests = outcome.notes.get("digests", {}) if verify and whole else {}
            whole &= all(
                run_files.digest_file(folder / one) == digest for one, digest in digests.items()
            )
        except (OSError, ValueError, TypeError, AttributeError):
            whole = False
        if not whole:
            self._known.pop(name, None)
            if self._listing is not None:
                self._listing.finished.pop(name, None)
            return None
        self._known[name] = files, verify, outcome, _format_rows(outcome.rows, COLUMNS.values())
        return outcome

    def stage_names(self) -> list[str]:
        """Names of all stage folders in the order of the run."""
        if self._listing is not None:
            return list(self._listing.names)
        if not self.path.exists():
            return []
        with os.scandir(self.path) as entries:
            names = [
                entry.name for entry in entries
                if STAGE.fullmatch(entry.name) and entry.is_dir(follow_symlinks=False)
            ]  # fmt: skip
        return sorted(names, key=place_stage)

    def outcomes(self) -> list[Outcome]:
        """Outcomes of all finished stages in order; failed jumps are left out."""
        return list((self._listing or self._list_stages()).finished.values())

    def _list_stages(self, verify: bool = False) -> Listing:
        names = self.stage_names()
        kept = (name for name in names if not (name.startswith("jump") and self.failure(name)))
        found = {name: self.outcome(name, verify=verify) for name in kept}
        return Listing(names, {name: one for name, one in found.items() if one is not None})

    def failure(self, name: str) -> str:
        """Why a jump was given up, or an empty text."""
        if not (self.path / name / "failed.json").exists():
            return ""
        why = run_files.read_object(self.path / name / "failed.json") or {}
        return str(why.get("why", "the record of its failure is damaged"))

    def failure_details(self, name: str) -> dict[str, Any]:
        """What `give_up` noted of a failed jump besides the reason; empty when that is all."""
        details = run_files.read_object(self.path / name / "failed.json") or {}
        return {key: value for key, value in details.items() if key != "why"}

    def give_up(self, name: str, why: str, **details: object) -> None:
        """Mark a jump as failed, for good: its attempt is not made again on resume.

        ``details`` are kept with the reason; see `failure_details`.
        """
        folder = self.path / name
        folder.mkdir(exist_ok=True)
        run_files.write_whole(folder / "failed.json", json.dumps({"why": why, **details}) + "\n")
        if self._listing is not None:
            self._listing.finished.pop(name, None)
            if name not in self._listing.names:
                self._listing.names.append(name)
        self.add_event("jump failed", stage=name, why=why)
        self.write_settlement()

    def begin(self, name: str) -> Path:
        """An empty folder to work stage ``name`` in.

        What is there already is unfinished, damaged, or comes after it: it is moved away.
        """
        behind = takewhile(
            lambda other: place_stage(other) >= place_stage(name), reversed(self.stage_names())
        )
        for other in reversed(list(behind)):
            self.discard(self.path / other)
        partial = self.path / "partial"
        if partial.exists():
            for leftover in sorted(partial.iterdir()):
                self.discard(leftover)
        folder = partial / name
        folder.mkdir(parents=True)
        return folder

    def finish(self, folder: Path, outcome: Outcome) -> Path:
        """Write the outcome and move the stage to its place; then rewrite ``settlement.csv``.

        The outcome's notes get the sizes and digests of the `NEEDED` files, which `outcome` looks
        for; all of it is on the disk when the stage is in its place.
        """
        sizes = _list_sizes(folder)
        digests = {name: run_files.seal_file(folder / name) for name in sizes}
        outcome = replace(outcome, notes=outcome.notes | {"files": sizes, "digests": digests})
        text = json.dumps(run_files.seal_record(asdict(outcome)), indent=1)
        run_files.write_whole(folder / "outcome.json", text + "\n")
        run_files.sync_folder(folder)
        place = self.path / folder.name
        folder.rename(place)
        run_files.sync_folder(self.path)
        self._known.pop(folder.name, None)
        self._add_rows(folder.name)
        return place

    def discard(self, folder: Path) -> None:
        """Move ``folder`` to ``discarded/`` under a free name, if it exists."""
        if not folder.exists():
            return
        home = self.path / "discarded"
        home.mkdir(exist_ok=True)
        names = (f"{folder.name}.{number}" for number in count(1))
        name = next(one for one in names if not (home / one).exists())
        folder.rename(home / name)
        if self._listing is not None and folder.parent == self.path:
            self._listing.names.remove(folder.name)
            self._listing.finished.pop(folder.name, None)
        self.add_event("discarded", stage=folder.name, to=f"discarded/{name}")

    def write_settlement(self) -> None:
        """Write ``settlement.csv`` from the outcomes of all finished stages."""
        listing = self._listing or self._list_stages()
        rows = [self._known[name][3] for name in listing.finished]
        path = self.path / "settlement.csv"
        run_files.write_whole(path, ",".join(COLUMNS) + "\n" + "".join(rows))
        listing.table = _identify(str(path))

    def _add_rows(self, name: str) -> None:
        """Put a stage's rows behind those in ``settlement.csv``, where that is as we left it."""
        path, listing = self.path / "settlement.csv", self._listing
        found = self.outcome(name, verify=False)
        if listing is not None and found is not None:  # `begin` has left none behind it
            listing.names.append(name)
            listing.finished[name] = found
            if listing.table and path.exists() and _identify(str(path)) == listing.table:
                run_files.append_text(path, self._known[name][3])
                listing.table = _identify(str(path))
                return
        self.write_settlement()

    def manifest(self) -> dict[str, Any]:
        """The manifest; raises `UsageError` when this is no run folder."""
        content = run_files.read_object(self.path / "manifest.json") or {}
        if not content.keys() >= set(MANIFEST):
            raise UsageError(
                "this is not a run folder (no readable manifest.json)", where=str(self.path),
                remedy="give the folder that trackbed run made; if it was stopped in its first "
                "second, start it again: trackbed run SCENE",
            )  # fmt: skip
        run_files.refuse_format(self.path, content)
        return content

    def share_start(self, other: RunFolder, last_cycle: int) -> None:
        """Link the stages of ``other`` up to ``last_cycle`` into this run: same work, same bits."""
        for name in other.stage_names():
            outcome = other.outcome(name)
            here = self.path / name
            if outcome is None or outcome.stage == "jump" or outcome.last_cycle > last_cycle:
                continue
            if here.exists():
                continue
            temporary = self.path / f".{name}.linked"
            shutil.rmtree(temporary, ignore_errors=True)
            shutil.copytree(other.path / name, temporary, copy_function=_link)
            temporary.rename(here)
        if self._listing is not None:
            self._listing = None
            self._listing = self._list_stages()
        self.write_settlement()


def _read_event(line: str) -> dict[str, Any]:
    try:
        event = run_files.open_seal(json.loads(line))
        datetime.fromisoformat(event["time"])
        return event if isinstance(event["event"], str) else {}
    except (ValueError, TypeError, AttributeError, KeyError):
        return {}


def _identify(path: str) -> tuple[int, ...]:
    """What tells a file from a changed one, without reading it."""
    found = os.lstat(path)
    return found.st_ino, found.st_size, found.st_mtime_ns


def _list_sizes(folder: Path) -> dict[str, int]:
    """Size of each of the `NEEDED` files [bytes]."""
    paths = sorted(path for pattern in NEEDED for path in folder.glob(pattern))
    return {path.name: path.stat().st_size for path in paths}


def _link(source: str, target: str) -> None:
    try:
        os.link(source, target)
    except OSError:  # another file system, or one without hard links
        shutil.copy2(source, target)


def _format_rows(rows: Iterable[dict[str, Any]], keys: Collection[str]) -> str:
    """Lines of ``settlement.csv``: the shortest numbers that come back bit for bit."""
    cells = ([row.get(key) for key in keys] for row in rows)
    lines = (",".join("" if cell is None else str(cell) for cell in line) for line in cells)
    return "".join(f"{line}\n" for line in lines)
