"""A run folder as its report reads it: as far as the run has come, changing nothing."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from adapters.bed import FloatArray, State, load_state
from adapters.errors import EngineFailed, SceneError, UsageError
from adapters.files import Outcome, RunFolder, Window, load_window
from adapters.jumps import Band, estimate_band
from adapters.procedure.history import FailedJump, History, list_failed_jumps, make_history
from adapters.scene import MEMBERS_MOST, Scene, load_scene
from trackbed.run_files import list_differences

CONTROL = "control"
"""Folder inside a run that holds the full run beside it."""
MEMBERS = "members"
"""Folder inside a run that holds the members beside it, number 0: ``members/1``, and so on."""
LENGTHS = ("scene.procedure.total_cycles", "scene.procedure.h")
"""What may differ between a run that was extended and its members, until they go on."""
DECISION, CHECK = "decision", "jump checked"
"""Events of a controlled run: what was decided and why; a jump beside what was computed behind."""
Event = dict[str, Any]
AWAY = "move this folder away: trackbed resume computes the member again"


@dataclass(frozen=True)
class Track:
    """One run of the scene: the procedure, or the full run beside it."""

    folder: RunFolder
    outcomes: tuple[Outcome, ...]  # finished stages in order, failed jumps left out
    names: tuple[str, ...]  # their folders
    failed_jumps: tuple[FailedJump, ...]
    discarded: tuple[str, ...]
    """Stages whose unfinished or superseded work was moved away; empty folders left out."""
    events: tuple[Event, ...]
    exchanged: str = ""  # grains that came, went and wore in a user's deck, for a sentence

    @cached_property
    def history(self) -> History:
        """The table of the run, with the CPU time at each row."""
        lost, start = [(j.first_cycle, j.lost_s) for j in self.failed_jumps], nan
        name, first = next(iter(self.windows), ("", None))
        if first is not None and first.rows and "loaded_body" not in first.rows[0]:
            with suppress(UsageError, EngineFailed):  # a damaged window is named elsewhere
                start = self.window(name).piston_start
        return make_history(self.outcomes, lost, start)

    @property
    def preparation(self) -> Outcome | None:
        """The outcome of the rain of grains, once it is done."""
        return next((o for o in self.outcomes if o.stage == "preparation"), None)

    def stages(self, kind: str) -> list[tuple[str, Outcome]]:
        """Folder and outcome of every finished stage of a kind."""
        pairs = zip(self.names, self.outcomes, strict=True)
        return [(name, outcome) for name, outcome in pairs if outcome.stage == kind]

    @property
    def jumps(self) -> list[tuple[str, Outcome]]:
        """Folder and outcome of every jump that was kept."""
        return self.stages("jump")

    @property
    def windows(self) -> list[tuple[str, Outcome]]:
        """Folder and outcome of every window."""
        return self.stages("window")

    @property
    def spans(self) -> list[tuple[int, int]]:
        """Cycles before and after each jump."""
        return [(jump.first_cycle, jump.last_cycle) for _, jump in self.jumps if jump.rows]

    @property
    def decisions(self) -> list[Event]:
        """Decisions in the order of the run, each once; fields of `adapters.jumps.Decision`."""
        made = (one for one in self.events if one["event"] == DECISION)
        return list({(e["cycle"], e["attempt"], e["action"]): e for e in made}.values())

    @property
    def checks(self) -> dict[tuple[int, int], Event]:
        """Checks by first cycle and attempt of a jump; fields of `adapters.jumps.check.Check`."""
        return {(e["cycle"], e["attempt"]): e for e in self.events if e["event"] == CHECK}

    def estimate_band(self) -> Band | None:
        """Settlement where the run is, with its band; None for a run without a tolerance."""
        if not self.decisions or not len(self.history.cycle):
            return None
        kept = [check for check in self.checks.values() if check["accepted"]]
        last = int(self.history.cycle[-1]), float(self.history.settlement[-1])
        return estimate_band(*last, kept)

    def start(self) -> State:
        """The bed before the first load cycle."""
        return load_state(self._find_sound("preparation") / "state.npz")

    def _find_sound(self, name: str) -> Path:
        """Folder of a stage whose states are as the run left them; raises `UsageError` else."""
        if self.folder.outcome(name) is None:
            raise UsageError(
                "the states of this stage were changed since they were written",
                where=str(self.folder.path / name),
                remedy=f"trackbed resume {self.folder.path} computes it again",
            )
        return self.folder.path / name

    def window(self, name: str) -> Window:
        """States and piston of one window."""
        return load_window(self._find_sound(name) / "states.npz")

    def position(self, cycle: int) -> FloatArray:
        """Centres at the end of a cycle [m], shape (n, 3); raises `UsageError` for a jumped one."""
        if cycle == 0:
            return self.start().position
        for name, outcome in self.windows:
            if outcome.first_cycle < cycle <= outcome.last_cycle:
                return self.window(name).state(cycle - outcome.first_cycle).position
        for name, outcome in self.jumps:
            if outcome.last_cycle == cycle:
                return load_state(self._find_sound(name) / "relaxed.npz").position
        raise UsageError(
            f"no state was computed at cycle {cycle}", where=str(self.folder.path),
            remedy="where a stage is damaged or gone, trackbed resume RUN computes it again",
        )  # fmt: skip


@dataclass(frozen=True)
class Record:
    """All that the report shows."""

    path: Path
    manifest: dict[str, Any]
    scene: Scene
    run: Track
    control: Track | None  # none when there is none, or it has not yet a cycle of its own
    members: tuple[Record, ...]  # beside this one, as far as they have begun
    asked: int  # members in all, this one counted

    @property
    def comparable_cycle(self) -> int:
        """The last cycle that run and control both have; 0 when the control is not past the first
        jump.

        Before the first jump they share their stages, so there is nothing to compare.
        """
        if self.control is None:
            return 0
        common = np.intersect1d(self.run.history.cycle, self.control.history.cycle)
        cycle, spans = int(common.max(initial=0)), self.run.spans
        return 0 if spans and cycle <= spans[0][0] else cycle

    @cached_property
    def damaged(self) -> tuple[str, ...]:
        """Stages and records of the run, of the full run beside it and of its members that are not
        as they were left; see `RunFolder.list_damaged`."""
        full = RunFolder(self.path / CONTROL).list_damaged()
        found = [*self.run.folder.list_damaged(), *(f"{CONTROL}/{name}" for name in full)]
        for one in self.members:
            found += [f"{MEMBERS}/{one.path.name}/{name}" for name in one.damaged]
        return tuple(found)


def read_run_record(path: Path) -> Record:
    """Read the run folder ``path``; raises `UsageError` when it is none, `SceneError` when a member
    in it is another run's."""
    folder = RunFolder(path)
    manifest = folder.manifest()
    scene = load_scene(path / "scene.toml", manifest["overrides"])
    control = read_track(RunFolder(path / CONTROL))
    has_control = len(control.history.cycle) > 0
    members, (_, asked) = [], read_members(folder)
    for number in range(1, asked):
        inner = RunFolder(path / MEMBERS / str(number))
        if (inner.path / "manifest.json").exists():
            refuse_other_member(manifest, inner, number)
            members.append(read_run_record(inner.path))
    return Record(
        path, manifest, scene, read_track(folder), control if has_control else None,
        tuple(members), asked,
    )  # fmt: skip


def read_members(folder: RunFolder) -> tuple[int, int]:
    """Which member a run is, 0 for one that is not beside another, and how many it asks for.

    Raises `UsageError` for a manifest that does not say so in numbers.
    """
    manifest = folder.manifest()
    number, asked = manifest.get("member", 0), manifest.get(MEMBERS, 1)
    if type(number) is type(asked) is int and 0 <= number < MEMBERS_MOST >= asked > 0:
        return number, asked
    raise UsageError(
        f"this manifest.json is damaged: it is of member {number!r:.20} of {asked!r:.20}",
        where=str(folder.path), remedy="take the run from a copy, or start it again elsewhere",
    )  # fmt: skip


def refuse_other_member(whole: dict[str, Any], inner: RunFolder, number: int) -> None:
    """Raise `SceneError` where a folder is not member ``number`` of the run that has the manifest
    ``whole``."""
    try:
        there = inner.manifest()
    except UsageError as error:
        raise UsageError(error.what, where=error.where, remedy=AWAY) from error
    old = {"scene": there["scene"], "member": there.get("member")}
    new = {"scene": whole["scene"], "member": number}
    if lines := list(list_differences("", old, new, LENGTHS)):
        raise SceneError(
            f"this is not member {number} of the run that it lies in:\n  " + "\n  ".join(lines),
            where=str(inner.path), remedy=AWAY,
        )  # fmt: skip


def read_track(folder: RunFolder) -> Track:
    """One run's finished stages, failures and events."""
    stages = [
        (stage, outcome)
        for stage in folder.stage_names()
        if (outcome := folder.outcome(stage, verify=False)) is not None
        and not folder.failure(stage)
    ]
    home = folder.path / "discarded"
    discarded = sorted(p.name for p in home.iterdir() if any(p.iterdir())) if home.exists() else []
    return Track(
        folder=folder, outcomes=tuple(outcome for _, outcome in stages),
        names=tuple(stage for stage, _ in stages), failed_jumps=list_failed_jumps(folder),
        discarded=tuple(discarded), events=tuple(folder.events()),
    )  # fmt: skip
