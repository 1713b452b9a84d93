"""A scene file run from its first frame to its last, its folder, and what came out of it.

A frame, a state to go on from, is written whole or not at all, and the table of energies is written
from the frames, so whatever kills a run costs at most the time since its last frame.  Bodies that a
run has changed, worn or broken, are arrays of its frames; a run whose bodies are those of the scene
file has none.
"""

import io
import time
from collections.abc import Callable
from dataclasses import astuple, fields, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from rigid_lcp.arrays import Floats
from rigid_lcp.contact import ContactForces
from rigid_lcp.errors import SceneError, UsageError
from rigid_lcp.friction.files import DAMAGED
from rigid_lcp.motion import Motion, Pace, Scene, make_world
from rigid_lcp.scene.file import SceneFile, build_scene, is_felt, list_unused, make_loads
from rigid_lcp.scene.simulation import Simulation
from rigid_lcp.wear import Breakage, Broken, Wear, WearState, WornShape
from trackbed.memory import read_arrays
from trackbed.run_files import RESULT, write_whole
from trackbed.run_files import folder as run_folder

Progress = Callable[[float, float, Simulation], None]
"""Called at the start and after every frame: time reached, duration [s], the run."""

HISTORY = ("time", "energy", "contacts", "sliding", "overlap", "residual", "cpu")
WORN = ("normal", "lost", "pending")
FRAME = "frame_{:06d}.npz"
COUNTERS = ("time", "steps", "worst_residual", "steps_above", "steps_scaled", "steps_cut_off")


def pack_bodies(run: Simulation) -> dict[str, Any]:
    """Arrays of the bodies of a run that wears or breaks; none of one that does neither."""
    if run.wear is None and not run.broken:
        return {}
    scene = run.world.scene
    none = np.zeros((0, scene.dim))
    corners = [getattr(b.shape, "vertices", none) if b.movable else none for b in scene.bodies]
    # the number of the body of the file's scene that each body is a part of
    whole = list(range(len(scene.bodies) - len(run.broken)))
    for event in run.broken:
        whole.append(whole[event.body])
    arrays: dict[str, Any] = {
        "body_corners": np.concatenate(corners),
        "body_count": [len(each) for each in corners],
        "body_mass": [body.mass for body in scene.bodies],
        "body_inertia": [body.inertia for body in scene.bodies if body.movable],
        "body_whole": whole,
        "broken": np.reshape([astuple(event) for event in run.broken], (-1, len(fields(Broken)))),
    }
    if (worn := run.worn) is not None:
        grains = [grain for grain in worn.grains if grain is not None]
        arrays["wear_sums"] = [worn.volume, worn.work, worn.mass, worn.energy]
        arrays["wear_counts"] = [-1 if g is None else len(g.lost) for g in worn.grains]
        for name in WORN if grains else ():
            arrays[f"wear_{name}"] = np.concatenate([getattr(grain, name) for grain in grains])
    return {name: np.asarray(one) for name, one in arrays.items()}


def restore_bodies(run: Simulation, frame: dict[str, Any]) -> None:
    """Give a run at its start the bodies of a frame; nothing where the frame holds none."""
    if "body_corners" not in frame:
        return
    run.world, _ = make_world(rebuild_frame_scene(frame, run.world.scene))
    broken = frame["broken"].tolist()
    run.broken = [Broken(t, int(body), int(part), *why) for t, body, part, *why in broken]
    if "wear_counts" in frame:
        grains: list[WornShape | None] = []
        ends = np.cumsum(np.maximum(frame["wear_counts"], 0))
        for body, n, end in zip(run.world.scene.bodies, frame["wear_counts"], ends, strict=True):
            mine = (frame[f"wear_{name}"][end - n : end] for name in WORN)
            grains.append(None if n < 0 else WornShape(body.shape, *mine))
        run.worn = WearState(grains, *map(float, frame["wear_sums"]))


def rebuild_frame_scene(frame: dict[str, Any], scene: Scene) -> Scene:
    """The bodies of a frame, where ``scene`` is the one of the file; itself if none has changed."""
    if "body_corners" not in frame:
        return scene
    made = scene.replace_bodies(())
    inertias = iter(frame["body_inertia"])
    each = np.split(frame["body_corners"], np.cumsum(frame["body_count"])[:-1])
    for whole, mass, corners in zip(frame["body_whole"], frame["body_mass"], each, strict=True):
        body = scene.bodies[whole]
        if body.movable:
            inertia = next(inertias)
            inertia = float(inertia) if scene.dim == 2 else inertia
            body = replace(body, mass=float(mass), inertia=inertia)
            if len(corners) and not np.array_equal(corners, body.shape.vertices):
                body = replace(body, shape=type(body.shape).from_corners(corners))
        made.bodies.append(body)
    return made


class RunFolder(run_folder.RunFolder):
    """The folder of one rigid run; see `trackbed.run_files.folder.RunFolder`."""

    own: ClassVar[tuple[str, ...]] = (
        "scene.toml", "manifest.json", RESULT, "frame_*.npz", "history.csv", "report.html",
        "picture-*.png", "movie.gif", ".*.partial",
    )  # fmt: skip
    states = "frame_*.npz"
    compared = ("scene", "files")

    def find_extended(self, before: Any, after: Any) -> tuple[str, ...]:
        """Duration and frames, where frames stay as far apart: the steps are the same then."""
        try:
            old, new = before["scene"]["run"], after["scene"]["run"]
            alike = old["duration"] / old["frames"] == new["duration"] / new["frames"]
            longer = new["duration"] > old["duration"]
        except (LookupError, TypeError, ArithmeticError):  # no manifest of ours
            return ()
        return ("scene.run.duration", "scene.run.frames") if alike and longer else ()

    def write_frame(self, number: int, run: Simulation, cpu: float) -> None:
        """Keep the state of a run as frame ``number``; ``cpu``: processor time so far [s].

        Raises as `write_whole`, and `UsageError` if the folder is not the one we locked.
        """
        self.refuse_if_replaced()
        arrays = {f"motion_{f.name}": getattr(run.motion, f.name) for f in fields(Motion)}
        arrays |= {
            f"contact_{f.name}": getattr(run.contacts, f.name) for f in fields(ContactForces)
        }
        arrays |= {f"pace_{f.name}": getattr(run.pace, f.name) for f in fields(Pace)}
        arrays |= {name: getattr(run, name) for name in (*COUNTERS, "energy", "overlap")}
        buffer = io.BytesIO()
        np.savez_compressed(buffer, cpu=cpu, **arrays, **pack_bodies(run))
        write_whole(self.path / FRAME.format(number), buffer.getvalue())

    def frames(self) -> list[Path]:
        """Frames that can be read, in order, up to the first that is missing or damaged."""
        sound: list[Path] = []
        while (path := self.path / FRAME.format(len(sound))).exists():
            try:
                read_frame(path)
            except DAMAGED:
                break
            sound.append(path)
        return sound


def read_frame(path: Path) -> dict[str, Any]:
    """Arrays of a frame by name, with ``motion``, ``contacts`` and ``pace`` put together, counters
    as numbers.  Raises one of `DAMAGED` if it can not be read, or is of another version."""
    arrays = read_arrays(path)
    if arrays.get("wear_counts", np.zeros(0)).ndim != 1:
        raise ValueError("its corners wore as those of an earlier version did")
    arrays |= {name: arrays[name].item() for name in (*COUNTERS, "energy", "overlap", "cpu")}
    arrays["pace"] = Pace(**{f.name: arrays[f"pace_{f.name}"].item() for f in fields(Pace)})
    arrays["motion"] = Motion(**{f.name: arrays[f"motion_{f.name}"] for f in fields(Motion)})
    arrays["contacts"] = ContactForces(
        **{f.name: arrays[f"contact_{f.name}"] for f in fields(ContactForces)}
    )
    return arrays


def restore_frame(path: Path, run: Simulation) -> float:
    """Put a run into a frame's state; returns the processor time that it had taken [s].

    Raises `SceneError` if the frame is of other bodies.
    """
    frame = read_frame(path)
    restore_bodies(run, frame)
    bodies = len(run.world.scene.bodies)
    if len(frame["motion"].position) != bodies or frame["motion"].dim != run.motion.dim:
        raise SceneError(
            f"the frame has {len(frame['motion'].position)} bodies, the scene {bodies}",
            where=str(path), remedy="--force to compute it again",
        )  # fmt: skip
    for name in ("motion", "contacts", "pace", *COUNTERS):
        setattr(run, name, frame[name])
    return float(frame["cpu"])


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


def count_unknowns(file: SceneFile) -> int:
    """Forces that are solved for at a contact: the normal one alone where no surface has friction,
    else one for each dimension."""
    return file.tables.dimensions if _has_any(file, "friction") else 1


def _has_any(file: SceneFile, property_: str) -> bool:
    tables = file.tables
    bodies: list[Any] = [tables.surface, *tables.ground, *tables.body, *tables.grains]
    return any(getattr(body, property_) for body in (*bodies, *(tables.stones or ())))


def describe_scans(file: SceneFile) -> dict[str, list[str]]:
    """How scanned stones differ from their scans, a sentence each; nothing without any."""
    said = [scan.describe() for scans in file.scans for scan in scans]
    return {"scans": [*said, *file.unused]} if said else {}


def list_left_out(file: SceneFile) -> list[str]:
    """Physics that the scene does not name, or gives in vain: it is not computed."""
    tables = file.tables
    missing = [
        (not _has_any(file, "friction"),
         "friction: no surface has any; one unknown a contact, no tangential forces"),
        (not _has_any(file, "restitution"), "restitution: every impact is inelastic"),
        (not any(is_felt(load, tables) for load in tables.load), "loads: none but gravity"),
        (True, "elastic deformation: grains are rigid; forces where they are not unique are one "
               "of many"),
        (tables.wear is None, "abrasion: no corner wears"),
        (tables.strength is None, "fragmentation: no grain breaks"),
    ]  # fmt: skip
    return [*list_unused(tables), *(text for absent, text in missing if absent)]


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
    return summary | describe_scans(file) | {
        "frames": frames, "last_frame": FRAME.format(frames), "left_out": list_left_out(file),
    }  # fmt: skip
