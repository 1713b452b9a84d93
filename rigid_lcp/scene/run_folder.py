"""What is in the folder of a rigid run: frames (states to go on from) and their table.

A frame is written whole or not at all, and the table of energies is written from the frames, so
whatever kills a run costs at most the time since its last frame.  Bodies that a run has changed,
worn or broken, are arrays of its frames; a run whose bodies are those of the scene file has none.
"""

from __future__ import annotations

import io
from dataclasses import astuple, fields, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from rigid_lcp.contact import ContactForces
from rigid_lcp.errors import SceneError
from rigid_lcp.friction.files import DAMAGED
from rigid_lcp.motion import Motion, Pace, Scene, make_world
from rigid_lcp.scene.simulation import Simulation
from rigid_lcp.wear import Broken, WearState, WornShape
from trackbed.memory import read_arrays
from trackbed.run_files import RESULT, write_whole
from trackbed.run_files import folder as run_folder

WORN = ("normal", "lost", "pending")


def pack_bodies(run: Simulation) -> dict[str, Any]:
    """Arrays of the bodies of a run that wears or breaks; none of one that does neither."""
    if run.wear is None and not run.broken:
        return {}
    scene = run.world.scene
    none = np.zeros((0, scene.dim))
    corners = [
        getattr(body.shape, "vertices", none) if body.movable else none for body in scene.bodies
    ]
    # the number of the body of the file's scene that each body is a part of
    whole = list(range(len(scene.bodies) - len(run.broken)))
    for event in run.broken:
        whole.append(whole[event.body])
    arrays: dict[str, Any] = {
        "body_corners": np.concatenate(corners),
        "body_count": np.array([len(each) for each in corners]),
        "body_mass": np.array([body.mass for body in scene.bodies]),
        "body_inertia": np.array([body.inertia for body in scene.bodies if body.movable]),
        "body_whole": np.array(whole),
        "broken": np.array([astuple(event) for event in run.broken])
        .reshape(-1, len(fields(Broken))),
    }  # fmt: skip
    worn = run.worn
    if worn is not None:
        grains = [grain for grain in worn.grains if grain is not None]
        arrays |= {
            "wear_sums": np.array([worn.volume, worn.work, worn.mass, worn.energy]),
            "wear_counts": np.array([-1 if g is None else len(g.lost) for g in worn.grains]),
        }
        for name in WORN if grains else ():
            arrays[f"wear_{name}"] = np.concatenate([getattr(grain, name) for grain in grains])
    return arrays


def restore_bodies(run: Simulation, frame: dict[str, Any]) -> None:
    """Give a run at its start the bodies of a frame; nothing where the frame holds none."""
    if "body_corners" not in frame:
        return
    run.world, _ = make_world(rebuild_frame_scene(frame, run.world.scene))
    run.broken = [
        Broken(float(t), int(body), int(part), float(tension), float(strength))
        for t, body, part, tension, strength in frame["broken"]
    ]
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
    ends = np.cumsum(frame["body_count"])
    made = Scene(scene.dim, scene.gravity)
    moving = 0
    for number, whole in enumerate(frame["body_whole"]):
        body = scene.bodies[whole]
        corners = frame["body_corners"][ends[number] - frame["body_count"][number] : ends[number]]
        if body.movable:
            inertia, moving = frame["body_inertia"][moving], moving + 1
            inertia = float(inertia) if scene.dim == 2 else inertia
            mass = float(frame["body_mass"][number])
            body = replace(body, mass=mass, inertia=inertia)
            if len(corners) and not np.array_equal(corners, body.shape.vertices):
                body = replace(body, shape=type(body.shape).from_corners(corners))
        made.bodies.append(body)
    return made


FRAME = "frame_{:06d}.npz"
COUNTERS = ("time", "steps", "worst_residual", "steps_above", "steps_scaled", "steps_cut_off")


class RunFolder(run_folder.RunFolder):
    """The folder of one rigid run; see `trackbed.run_files.folder.RunFolder`."""

    own: ClassVar[tuple[str, ...]] = (
        "scene.toml", "manifest.json", RESULT, "frame_*.npz", "history.csv", "report.html",
        "picture-*.png", "movie.gif", ".*.partial",
    )  # fmt: skip
    states = "frame_*.npz"

    def write_frame(self, number: int, run: Simulation, cpu: float) -> None:
        """Keep the state of a run as frame ``number``; ``cpu``: processor time so far [s].

        Raises as `write_whole`, and `UsageError` if the folder is not the one we locked.
        """
        self.refuse_if_replaced()
        arrays = {f"motion_{f.name}": getattr(run.motion, f.name) for f in fields(Motion)}
        arrays |= {
            f"contact_{f.name}": getattr(run.contacts, f.name) for f in fields(ContactForces)
        }
        arrays |= {name: np.asarray(getattr(run, name)) for name in COUNTERS}
        arrays |= {"energy": np.asarray(run.energy), "overlap": np.asarray(run.overlap)}
        arrays |= {f"pace_{f.name}": np.asarray(getattr(run.pace, f.name)) for f in fields(Pace)}
        arrays |= pack_bodies(run)
        buffer = io.BytesIO()
        np.savez_compressed(buffer, cpu=np.asarray(cpu), **arrays)
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
