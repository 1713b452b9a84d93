"""A scene file run from its first frame to its last, and what came out of it."""

from __future__ import annotations

import csv
import io
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.breakage import Breakage
from rigid_lcp.run_folder import FRAME, RunFolder, frame_read, frame_restore, write_whole
from rigid_lcp.scene import Scene
from rigid_lcp.scene_file import SceneFile, loads_of, scene_build
from rigid_lcp.simulation import Simulation
from rigid_lcp.wear import Wear

Floats = NDArray[np.float64]
Progress = Callable[[float, float, Simulation], None]
"""Told after every frame: time reached, duration [s], the run."""

HISTORY = ("time", "energy", "contacts", "sliding", "overlap", "residual", "cpu")


def simulation_of(file: SceneFile) -> tuple[Scene, Simulation]:
    """The scene and its simulation at time zero.

    Raises `SceneError`, `ShapeError`, or `Overlapping` for bodies that overlap.
    """
    run = file.tables.run
    scene = scene_build(file)
    return scene, Simulation(
        scene, run.method, step=run.step, tolerance=run.tolerance, loads=loads_of(file),
        wear=wear_of(file), breakage=breakage_of(file),
    )  # fmt: skip


def wear_of(file: SceneFile) -> Wear | None:
    """How grains wear, or None where the scene does not say."""
    table = file.tables.wear
    if table is None:
        return None
    return Wear(table.coefficient, table.every, table.volume_scale)


def breakage_of(file: SceneFile) -> Breakage | None:
    """When grains break, or None where the scene does not say."""
    table = file.tables.strength
    if table is None:
        return None
    return Breakage(
        table.tension, table.every, table.smallest, table.modulus, table.reference_volume,
        table.unique,
    )  # fmt: skip


def frame_times(duration: float, frames: int) -> Floats:
    """Times of the frames [s], (frames + 1,): the start and ``frames`` equal spans."""
    return np.linspace(0.0, duration, frames + 1)


def scene_run(
    file: SceneFile, run: Simulation, folder: RunFolder, *, resume: bool, progress: Progress
) -> None:
    """Compute frame after frame, from the last sound one on if ``resume``.

    Raises what the simulation raises; the frames before stay.
    """
    duration = file.tables.run.duration
    times = frame_times(duration, file.tables.run.frames)
    there = folder.frames() if resume else []
    spent = frame_restore(there[-1], run) if there else 0.0
    if not there:
        folder.frame_write(0, run, 0.0)
    began = time.process_time()
    for number in range(max(len(there), 1), len(times)):
        run.advance(float(times[number] - times[number - 1]))
        folder.frame_write(number, run, spent + time.process_time() - began)
        progress(run.time, duration, run)


def history_of(folder: RunFolder) -> dict[str, Floats]:
    """Time [s], energy [J], contacts that carry, those that slide, greatest overlap [m], worst
    residual [-] so far, processor time so far [s]: one number a frame."""
    rows = []
    for path in folder.frames():
        frame = frame_read(path)
        status = frame["contacts"].status
        rows.append((
            float(frame["time"]), float(frame["energy"]), float((status != "open").sum()),
            float((status == "slide").sum()), float(frame["overlap"]),
            float(frame["worst_residual"]), float(frame["cpu"]),
        ))  # fmt: skip
    return dict(zip(HISTORY, np.array(rows).T, strict=True))


def history_write(path: Path, history: dict[str, Floats]) -> None:
    """Write the history as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(history)
    writer.writerows(zip(*(column.tolist() for column in history.values()), strict=True))
    write_whole(path, text.getvalue())


def left_out(file: SceneFile) -> list[str]:
    """Physics that the scene does not name, and that is therefore not computed."""
    tables = file.tables
    bodies: list[Any] = [tables.surface, *tables.ground, *tables.body, *tables.grains]
    absent = []
    if not any(body.friction for body in bodies):
        absent.append("friction: no surface has any; one unknown a contact is solved for")
    if not any(body.restitution for body in bodies):
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


def summary_of(file: SceneFile, scene: Scene, run: Simulation, folder: RunFolder) -> dict[str, Any]:
    """What a run came to, for people and for ``--json``."""
    history = history_of(folder)
    contacts = run.contacts
    frames = len(history["time"]) - 1
    moves = int(run.world.movable.sum())
    return {
        "title": file.tables.title,
        "method": run.method,
        "bodies": moves,
        "time": run.time,
        "steps": run.steps,
        "step": file.tables.run.step,
        "contacts": int((contacts.status != "open").sum()),
        "sliding": int((contacts.status == "slide").sum()),
        "largest_normal_force": float(contacts.normal_force.max(initial=0.0)),
        "energy": float(history["energy"][-1]),
        "overlap_largest": float(history["overlap"].max()),
        "residual_worst": run.worst_residual,
        "speed_largest": float(np.abs(run.velocities).max(initial=0.0)),
        "positions": {
            body.name: run.positions[n].tolist()
            for n, body in enumerate(scene.bodies)
            if body.name and body.movable
        },
        "cpu_s": float(history["cpu"][-1]),
        "cpu_a_step": float(history["cpu"][-1]) / max(run.steps, 1),
        **({} if run.worn is None else {"worn": run.worn.volume, "friction_work": run.worn.work}),
        **({} if run.breakage is None else {"broken": len(run.broken)}),
        "frames": frames,
        "last_frame": FRAME.format(frames),
        "left_out": left_out(file),
    }
