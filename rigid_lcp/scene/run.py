"""A scene file run from its first frame to its last, and what came out of it."""

from __future__ import annotations

import time
from collections.abc import Callable
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np

from rigid_lcp.arrays import Floats
from rigid_lcp.errors import UsageError
from rigid_lcp.motion import Scene
from rigid_lcp.scene.file import SceneFile, build_scene, make_loads
from rigid_lcp.scene.run_folder import FRAME, RunFolder, read_frame, restore_frame
from rigid_lcp.scene.simulation import SIMULATION, Simulation
from rigid_lcp.wear import Breakage, Wear
from trackbed.run_files import write_whole

Progress = Callable[[float, float, Simulation], None]
"""Called at the start and after every frame: time reached, duration [s], the run."""

HISTORY = ("time", "energy", "contacts", "sliding", "overlap", "residual", "cpu")


def make_simulation(file: SceneFile) -> tuple[Scene, Simulation]:
    """The scene and its simulation at time zero.

    Raises `SceneError`, `ShapeError`, or `Overlapping` for bodies that overlap.
    """
    tables, scene = file.tables, build_scene(file)
    wear = None if tables.wear is None else Wear(**tables.wear.model_dump())
    run, strength, breakage = tables.run, tables.strength, None
    if strength is not None:
        breakage = Breakage(strength.tension, **strength.model_dump(exclude={"tension"}))
    return scene, Simulation(
        scene, run.method, step=run.step, tolerance=run.tolerance, loads=make_loads(file),
        wear=wear, breakage=breakage,
    )  # fmt: skip


def run_scene(
    file: SceneFile, run: Simulation, folder: RunFolder, *, resume: bool, progress: Progress
) -> None:
    """Compute frame after frame, from the last sound one on if ``resume``.

    Raises what the simulation raises; the frames before stay.
    """
    duration = file.tables.run.duration
    times = np.linspace(0.0, duration, file.tables.run.frames + 1)
    there = folder.frames() if resume else []
    spent = restore_frame(there[-1], run) if there else 0.0
    if not there:
        folder.write_frame(0, run, 0.0)
    began = time.process_time()
    progress(run.time, duration, run)
    for number in range(max(len(there), 1), len(times)):
        run.advance(float(times[number] - times[number - 1]))
        folder.write_frame(number, run, spent + time.process_time() - began)
        progress(run.time, duration, run)


def read_history(folder: RunFolder) -> dict[str, Floats]:
    """Time [s], energy [J], contacts that carry, those that slide, greatest overlap [m], worst
    residual [-] so far, processor time so far [s]: one number a frame."""
    rows = []
    for path in folder.frames():
        frame = read_frame(path)
        status = frame["contacts"].status
        rows.append((
            frame["time"], frame["energy"], float((status != "open").sum()),
            float((status == "slide").sum()), frame["overlap"], frame["worst_residual"],
            frame["cpu"],
        ))  # fmt: skip
    return dict(zip(HISTORY, np.array(rows).reshape(-1, len(HISTORY)).T, strict=True))


def write_history(path: Path, history: dict[str, Floats]) -> None:
    """Write the history as CSV."""
    rows = zip(*(column.tolist() for column in history.values()), strict=True)
    lines = [",".join(map(str, row)) for row in (history, *rows)]
    write_whole(path, "\n".join(lines) + "\n")


def plan_steps(file: SceneFile) -> tuple[int, float]:
    """Number of the steps of a whole run and the length of each [s]: equal steps, not longer than
    the scene's, that end at every frame.  At acceleration level the fewest and the longest."""
    table = file.tables.run
    span = table.duration / table.frames
    count = max(ceil(span / table.step - SIMULATION.time_round_off), 1)
    return count * table.frames, span / count


def count_unknowns(file: SceneFile) -> int:
    """Forces that are solved for at a contact: the normal one alone where no surface has friction,
    else one for each dimension."""
    return file.tables.dimensions if _has_any(file, "friction") else 1


def _has_any(file: SceneFile, property_: str) -> bool:
    tables = file.tables
    bodies: list[Any] = [tables.surface, *tables.ground, *tables.body, *tables.grains]
    return any(getattr(body, property_) for body in bodies)


def list_left_out(file: SceneFile) -> list[str]:
    """Physics that the scene does not name, and that is therefore not computed."""
    tables = file.tables
    absent = []
    if not _has_any(file, "friction"):
        absent.append("friction: no surface has any; one unknown a contact, no tangential forces")
    if not _has_any(file, "restitution"):
        absent.append("restitution: every impact is inelastic")
    if not tables.load:
        absent.append("loads: none but gravity")
    absent.append("elastic deformation: grains are rigid; forces where they are not unique are one "
                  "of many")  # fmt: skip
    if tables.wear is None:
        absent.append("abrasion: no corner wears")
    if tables.strength is None:
        absent.append("fragmentation: no grain breaks")
    return absent


def summarise_run(
    file: SceneFile, scene: Scene, run: Simulation, folder: RunFolder
) -> dict[str, Any]:
    """What a run came to, for people and for ``--json``.

    Raises `UsageError` if a frame is gone or damaged since it was written.
    """
    history = read_history(folder)
    contacts = run.contacts
    frames = file.tables.run.frames
    if len(history["time"]) <= frames:
        raise UsageError(
            "this frame is missing or damaged",
            where=str(folder.path / FRAME.format(len(history["time"]))),
            remedy="the same command with --resume computes it again",
        )
    summary = {
        "title": file.tables.title,
        "method": run.method,
        "bodies": int(run.world.movable.sum()),
        "time": run.time,
        "steps": run.steps,
        "step": run.time / max(run.steps, 1),
        "unknowns_a_contact": count_unknowns(file),
        "contacts": int((contacts.status != "open").sum()),
        "sliding": int((contacts.status == "slide").sum()),
        "largest_normal_force": float(contacts.normal_force.max(initial=0.0)),
        "energy": float(history["energy"][-1]),
        "overlap_largest": float(history["overlap"].max()),
        "tolerance": run.tolerance,
        "residual_worst": run.worst_residual,
        "steps_above": run.steps_above,
        "speed_largest": float(np.abs(run.velocities).max(initial=0.0)),
        "positions": {
            body.name: run.positions[n].tolist()
            for n, body in enumerate(scene.bodies)
            if body.name and body.movable
        },
        "cpu_s": float(history["cpu"][-1]),
        "cpu_a_step": float(history["cpu"][-1]) / max(run.steps, 1),
    }
    if _has_any(file, "restitution"):
        summary |= {"steps_scaled": run.steps_scaled, "steps_cut_off": run.steps_cut_off}
    if run.worn is not None:
        summary |= {
            "worn": run.worn.volume, "friction_work": run.worn.work, "worn_mass": run.worn.mass,
            "worn_energy": run.worn.energy,
        }  # fmt: skip
    if run.breakage is not None:
        summary["broken"] = len(run.broken)
    return summary | {
        "frames": frames, "last_frame": FRAME.format(frames), "left_out": list_left_out(file),
    }  # fmt: skip
