"""A sweep: a scene with several values of its keys, several seeds; every member a run of its own.

A member is known by its settings: its folder is named after them, so that the same command goes on
with what it finds, and one with more values or seeds adds to it.
"""

import hashlib
import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from adapters.errors import SceneError, UsageError
from adapters.files import RunFolder
from adapters.procedure import refuse_differences, refuse_unloaded
from adapters.scene import flatten_keys, load_scene, record_scene
from trackbed.run_files import MANIFEST, read_object, refuse_writing
from trackbed.run_verbs import SETTLEMENT, Kind, find_file_kind

SEEDS_MOST = 10_000
NAME_LONGEST = 120
"""Longest name of a member's folder [characters]; a longer one is cut, with a digest."""


@dataclass(frozen=True)
class Member:
    """One run of a sweep."""

    name: str  # name of its folder, from its settings
    settings: Mapping[str, str]
    """Dotted key -> value as TOML text, of the keys swept over; the seed is kept apart."""
    seed: int
    overrides: tuple[str, ...]  # KEY=VALUE of everything that differs from the scene file
    scene: Any  # the scene, checked: its tables, where it is another story's
    record: dict[str, Any]  # the scene as the manifest of its run keeps it


@dataclass(frozen=True)
class Sweep:
    """What a sweep is to run."""

    scene_path: Path
    folder: Path
    members: tuple[Member, ...]
    kind: Kind  # of the scene: which verb runs it, and the key that ``--seeds`` counts up

    @property
    def settles(self) -> bool:
        """Whether members are runs of this story."""
        return not self.kind.states

    def list_words(self, member: Member, more: Sequence[str] = ()) -> list[str]:
        """What behind ``trackbed`` runs a member with ``more`` overrides, or goes on with it."""
        folder = str(self.run_folder(member).absolute())
        verb = ["run"] if self.settles else [self.kind.verb, "--resume"]
        settings = [word for one in (*member.overrides, *more) for word in ("--set", one)]
        return [*verb, str(self.scene_path), "--run-folder", folder, *settings]

    def run_folder(self, member: Member) -> Path:
        """Where a member runs."""
        return self.folder / "members" / member.name

    def log(self, member: Member) -> Path:
        """Folder of what a member printed, the last time it ran."""
        return self.folder / "logs" / member.name

    @property
    def stop_file(self) -> Path:
        """Where it exists, the members stop, wherever they run."""
        return self.folder / "stop"

    def groups(self) -> dict[str, list[Member]]:
        """Members that differ by their seed alone, by the settings in which groups differ."""
        first = self.members[0].settings
        varied = {k for one in self.members for k, v in one.settings.items() if v != first[k]}
        found: dict[str, list[Member]] = {}
        for member in self.members:
            settings = {key: value for key, value in member.settings.items() if key in varied}
            found.setdefault(format_settings(settings), []).append(member)
        return found


def format_settings(settings: Mapping[str, str]) -> str:
    """Settings in one line; ``the scene`` when there is none."""
    return ", ".join(f"{key}={value}" for key, value in settings.items()) or "the scene"


def split_values(text: str) -> list[str]:
    """The values of ``10,20,50``: TOML texts between commas outside brackets, braces and quotes.

    Raises `UsageError` for an empty value, or one given twice.
    """
    values, start, depth, quote = [], 0, 0, ""
    for place, character in enumerate(text):
        if quote:
            quote = "" if character == quote else quote
        elif character in "\"'":
            quote = character
        elif character in "[{":
            depth += 1
        elif character in "]}":
            depth -= 1
        elif character == "," and depth == 0:
            values.append(text[start:place].strip())
            start = place + 1
    values.append(text[start:].strip())
    for value in values:
        if not value or values.count(value) > 1:
            what = f"the value {value} is given twice" if value else "a value is empty"
            raise UsageError(
                f"{what} in {text!r}", where="--set",
                remedy="write table.key=value,value, such as --set loading.frequency=10,20,50",
            )  # fmt: skip
    return values


def parse_axes(assignments: Sequence[str]) -> dict[str, list[str]]:
    """Key -> values of every ``KEY=V1,V2,...``; raises `UsageError` for a key given twice."""
    axes: dict[str, list[str]] = {}
    for assignment in assignments:
        key, equals, text = (part.strip() for part in assignment.partition("="))
        if not equals or not key:
            raise UsageError(
                f"cannot read {assignment!r}", where="--set",
                remedy="write table.key=value,value, such as --set loading.frequency=10,20,50",
            )  # fmt: skip
        if key in axes:
            raise UsageError(
                f"{key} is given twice", where="--set", remedy="give all its values at once"
            )
        axes[key] = split_values(text)
    return axes


def name_member(settings: Mapping[str, str], seed: int, key: str = SETTLEMENT.seed) -> str:
    """A folder's name: the settings and the seed, whose ``key`` is given, with a digest where they
    cannot all be part of it."""
    text = ",".join([*(f"{key}={value}" for key, value in settings.items()), f"{key}={seed}"])
    name = re.sub(r"[^\w.,=+-]", "-", text)[:NAME_LONGEST]
    return name if name == text else f"{name}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"


def plan_sweep(
    scene_path: Path, folder: Path, assignments: Sequence[str], seeds: int | None,
    fixed: Sequence[str] = (),
) -> Sweep:  # fmt: skip
    """The members: the product of all values of ``assignments``, each with ``seeds`` seeds.

    Seeds count up from the scene's own; ``fixed`` overrides hold for every member and are no part
    of its name.  Every member's scene is checked.  Raises `UsageError`, or `SceneError` that names
    the member.
    """
    axes = parse_axes(assignments)
    if seeds is not None and not 1 <= seeds <= SEEDS_MOST:
        raise UsageError(f"there must be 1 to {SEEDS_MOST} seeds, not {seeds}", where="--seeds")
    kind = find_file_kind(scene_path)
    if seeds is not None and kind.seed in axes:
        raise UsageError(f"--seeds sets {kind.seed}", where="--set", remedy="give one of the two")
    own_seeds = axes.pop(kind.seed, None)
    members = []
    for values in itertools.product(*axes.values()):
        settings = dict(zip(axes, values, strict=True))
        overrides = [*fixed, *(f"{key}={value}" for key, value in settings.items())]
        if own_seeds is None:
            first = _load_member(kind, scene_path, overrides, settings).seed
            chosen = [str(first + number) for number in range(seeds or 1)]
        else:
            chosen = own_seeds
        for seed in chosen:
            with_seed = [*overrides, f"{kind.seed}={seed}"]
            members.append(_load_member(kind, scene_path, with_seed, settings))
    _refuse_twins(members)
    return Sweep(scene_path.absolute(), folder, tuple(members), kind)


def _load_member(
    kind: Kind, path: Path, overrides: Sequence[str], settings: Mapping[str, str]
) -> Member:
    """A member, its scene checked; one that settles must have load cycles to compare."""
    other = import_module(kind.scenes) if kind.scenes else None
    try:
        scene = other.load_scene(path, overrides).tables if other else load_scene(path, overrides)
    except SceneError as error:
        raise SceneError(
            f"member {format_settings(settings)} is not valid: {error.what}",
            where=error.where, remedy=error.remedy,
        ) from error  # fmt: skip
    if other is None:
        refuse_unloaded(scene, path)
    record = scene.model_dump(mode="json") if other else record_scene(scene)
    seed = int(flatten_keys(record)[kind.seed])
    name = name_member(settings, seed, kind.seed)
    return Member(name, settings, seed, tuple(overrides), scene, record)


def _refuse_twins(members: Sequence[Member]) -> None:
    """Raise `UsageError` for two members with the same scene, such as ``10`` and ``10.0``."""
    seen: dict[str, Member] = {}
    for member in members:
        twin = seen.setdefault(repr(member.record), member)
        if twin is not member:
            raise UsageError(
                f"{twin.name} and {member.name} are the same scene", where="--set",
                remedy="give each value once",
            )  # fmt: skip


def check_folder(sweep: Sweep) -> None:
    """Raise when the folder cannot be that of this sweep, or holds members that differ.

    `UsageError` for a folder of something else, `SceneError` with the differences where the scene
    was changed since a member was started.
    """
    folder = sweep.folder
    if not folder.exists():
        return
    with refuse_writing(folder):
        strangers = sorted(path.name for path in folder.iterdir())
    if strangers and not (folder / "sweep.json").exists() and set(strangers) != {"lock"}:
        raise UsageError(
            f"the folder holds something else ({', '.join(strangers[:3])}), no sweep",
            where=str(folder), remedy="give an empty or new folder: --into FOLDER",
        )  # fmt: skip
    for member in sweep.members:
        path, now = sweep.run_folder(member), member.record
        if not (path / MANIFEST).exists():
            continue
        if not sweep.settles:
            before = (read_object(path / MANIFEST) or {}).get("scene")
            if not isinstance(before, dict):
                raise SceneError(
                    "the manifest of a member can not be read", where=str(path / MANIFEST),
                    remedy="remove that run folder: the member is computed again",
                )  # fmt: skip
        else:
            before = RunFolder(path).manifest()["scene"]
            if now["engine"]["name"] == "auto":  # the run has the name it stood for
                now = now | {"engine": now["engine"] | {"name": before["engine"]["name"]}}
        refuse_differences(before, now, path)


def find_pinned_engine(sweep: Sweep) -> str | None:
    """What ``auto`` stood for when members of this sweep were started; None if none was."""
    for member in sweep.members:
        path = sweep.run_folder(member)
        if (path / "manifest.json").exists():
            record: dict[str, Any] = RunFolder(path).manifest()["scene"]
            return str(record["engine"]["name"])
    return None
