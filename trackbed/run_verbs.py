"""The verbs about a finished or stopped run, for every kind of run folder.

A settlement run is its story's; of the others, which are gone on with by the command that
started them, the same verbs say here how far they are and what to do.
"""

import argparse
import json
import os
import shlex
import sys
import tomllib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from trackbed import run_files
from trackbed.errors import UsageError


@dataclass(frozen=True)
class Kind:
    """A kind of run, by what its folder holds."""

    table: str  # a table of the scene that only this kind has
    verb: str  # the verb that runs such a scene
    states: str = ""
    """Pattern of its saved states; empty for a kind whose story has the verbs itself."""
    files: str = ""  # what its folder holds for other programs, as a sentence
    seed: str = ""  # key of its random numbers, which `trackbed sweep` counts up
    scenes: str = ""
    """Where it has both: room with ``load_scene`` of such a file, and ``draw_members`` for what a
    sweep's members came to."""


SETTLEMENT = Kind("sample", "run", seed="sample.seed")
KINDS = (
    Kind("deck", "run"),
    SETTLEMENT,
    Kind("simulation", "qdem", "checkpoint.npz", "fields.pvd opens in ParaView, probes.csv and "
         "energy.csv in a spreadsheet"),
    Kind("run", "rigid", "frame_*.npz", "history.csv opens in a spreadsheet, movie.gif in a "
         "browser, frame_*.npz in NumPy"),
    Kind("line", "line", "state.npz", "geometry.csv opens in a spreadsheet, state.npz in NumPy",
         "line.seed", "track_line.scene"),
)  # fmt: skip


def find_kind(path: Path) -> Kind | None:
    """The kind of the run in a folder; None where there is no manifest to tell it by."""
    manifest = run_files.read_object(path / run_files.MANIFEST) or {}
    scene = manifest.get("scene")
    return find_scene_kind(scene) if isinstance(scene, dict) else None


def find_scene_kind(scene: dict[str, Any]) -> Kind | None:
    """The kind of a scene, by a table that only it has; None for none of them."""
    return next((kind for kind in KINDS if kind.table in scene), None)


def find_file_kind(path: Path) -> Kind:
    """The kind of a scene file; that of settlement where it is none of them or can not be read."""
    with suppress(OSError, ValueError, RecursionError):
        return find_scene_kind(tomllib.loads(path.read_text(encoding="utf-8-sig"))) or SETTLEMENT
    return SETTLEMENT


def refuse_scene(path: Path, what: str, then: str = "") -> None:
    """Raise `UsageError` for a scene, ``what`` it is not; say how it is run, and what ``then``."""
    if path.suffix == ".toml":
        run = f"trackbed {find_file_kind(path).verb} {shlex.quote(str(path))}"
        raise UsageError(f"this is a scene, {what}", where=str(path), remedy=f"run it{then}: {run}")


def choose_command(arguments: argparse.Namespace) -> Callable[[argparse.Namespace], int]:
    """What does the verb that was asked for: that of the run's kind, where it is about a run."""
    command: Callable[[argparse.Namespace], int] = arguments.command
    if arguments.verb not in DOES:
        return command
    refuse_no_run(arguments.run_folder)
    run_files.refuse_links(arguments.run_folder)
    kind = find_kind(arguments.run_folder)
    if kind is None or not kind.states:
        return command
    return lambda given: DOES[given.verb](given, kind)


def refuse_no_run(path: Path) -> None:
    """Raise `UsageError` for a folder that is not there or holds no run, and say what is near."""
    if not path.is_dir():
        near = [f"{one.parent}" for one in sorted(path.parent.glob(f"*/{run_files.MANIFEST}"))[:3]]
        raise UsageError(
            "this is a file, not a run folder" if path.exists() else "there is no such folder",
            where=str(path), remedy=f"the runs beside it: {', '.join(near) or 'none'}",
        )  # fmt: skip
    if (path / run_files.MANIFEST).exists():
        return
    runs = [str(one.parent) for one in sorted(path.glob(f"*/{run_files.MANIFEST}"))[:3]]
    outer = next(
        (one for one in path.absolute().parents if (one / run_files.MANIFEST).exists()), None
    )
    if runs or outer:
        remedy = f"its runs: {', '.join(runs)}" if runs else f"it is a part of the run {outer}"
        raise UsageError("this is not a run folder", where=str(path), remedy=remedy)


def describe_run(path: Path, kind: Kind) -> dict[str, Any]:
    """How far a run is, by names that JSON and people read."""
    manifest = run_files.read_object(path / run_files.MANIFEST) or {}
    run_files.refuse_format(path, manifest)
    summary = run_files.read_object(path / run_files.RESULT) or {}
    states = len(list(path.glob(kind.states)))
    written = any(run_files.is_written(path, name) for name in (".lock", "lock"))
    state = "running" if written else "finished" if summary else "stopped"
    said = {
        "run_folder": str(path), "kind": kind.verb, "title": manifest["scene"].get("title", ""),
        "state": state, "saved_states": states,
        "damaged": ", ".join(run_files.list_changed_tables(path, summary)),
    }  # fmt: skip
    said |= {key: summary[key] for key in ("time", "steps", "result") if key in summary}
    next_step = {
        "running": f"trackbed status {shlex.quote(str(path))}",
        "finished": str(path / "report.html"),
        "stopped": _format_resume(manifest),
    }
    return said | {"next": next_step[state]}


def print_fields(content: dict[str, Any], as_json: bool) -> None:
    """Print values by name, as JSON or a line each; a number that is not finite is no JSON."""
    if as_json:
        print(json.dumps(content, indent=2, allow_nan=False))
    else:
        for key, value in content.items():
            print(f"{key.replace('_', ' '):28}{_format_value(value)}")


def _format_value(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return "; ".join(map(_format_value, value))
    if isinstance(value, dict):
        return "; ".join(f"{key} ({_format_value(each)})" for key, each in value.items())
    return "-" if value in (None, "") else str(value)


def show_page(path: Path, open_it: bool) -> None:
    """Print the path of a page; with ``open_it`` show it, where there is a display."""
    print(path)
    if open_it and (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        import webbrowser

        webbrowser.open(path.resolve().as_uri())


def _show_status(arguments: argparse.Namespace, kind: Kind) -> int:
    print_fields(describe_run(arguments.run_folder, kind), arguments.json)
    return 0


def _show_report(arguments: argparse.Namespace, kind: Kind) -> int:
    said = describe_run(arguments.run_folder, kind)
    path: Path = arguments.run_folder / "report.html"
    if said["state"] != "finished" or not path.is_file():
        raise UsageError(
            f"this {kind.verb} run is {said['state']}, and its report is written at its end",
            where=str(arguments.run_folder), remedy=f"first: {said['next']}",
        )  # fmt: skip
    if said["damaged"]:
        print(f"warning: changed since the run was finished: {said['damaged']}", file=sys.stderr)
    show_page(path, arguments.open)
    return 0


def _refuse_export(arguments: argparse.Namespace, kind: Kind) -> int:
    raise UsageError(
        f"only settlement runs are exported, and this is a {kind.verb} run",
        where=str(arguments.run_folder), remedy=f"its files are open already: {kind.files}",
    )  # fmt: skip


def _refuse_resume(arguments: argparse.Namespace, kind: Kind) -> int:
    said = describe_run(arguments.run_folder, kind)
    what = f"a {kind.verb} run goes on with the command that started it"
    raise UsageError(
        f"this run is {said['state']}; {what}" if said["state"] != "stopped" else what,
        where=str(arguments.run_folder), remedy=said["next"],
    )  # fmt: skip


def _format_resume(manifest: dict[str, Any]) -> str:
    """The command that goes on with a run that stopped, from where it was started."""
    origin = manifest.get("provenance", manifest)
    words = shlex.split(str(origin.get("command", "trackbed")))
    kept = [word for word in words if word not in ("--force", "--resume")]
    return shlex.join([*kept, "--resume"])


DOES = {
    "status": _show_status,
    "report": _show_report,
    "export": _refuse_export,
    "resume": _refuse_resume,
}
"""Verbs about a run, and what they do with one whose story has them not itself."""
