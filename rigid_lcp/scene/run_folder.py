"""What is in the folder of a rigid run: frames (states to go on from) and their table.

A frame is written whole or not at all, and the table of energies is written from the frames, so
whatever kills a run costs at most the time since its last frame.
"""

from __future__ import annotations

import io
from dataclasses import fields
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from rigid_lcp.contact import ContactForces
from rigid_lcp.errors import SceneError
from rigid_lcp.friction.files import DAMAGED
from rigid_lcp.motion import Motion, Pace
from rigid_lcp.scene.frame_bodies import pack_bodies, restore_bodies
from rigid_lcp.scene.simulation import Simulation
from trackbed.run_files import RESULT, write_whole
from trackbed.run_files import folder as run_folder

__all__ = ["FRAME", "RESULT", "RunFolder", "read_frame", "restore_frame"]

FRAME = "frame_{:06d}.npz"
COUNTERS = ("time", "steps", "worst_residual", "steps_above", "steps_scaled", "steps_cut_off")


class RunFolder(run_folder.RunFolder):
    """The folder of one rigid run; see `trackbed.run_files.folder.RunFolder`."""

    own: ClassVar[tuple[str, ...]] = (
        "scene.toml", "manifest.json", RESULT, "frame_*.npz", "history.csv", "report.html",
        "picture-*.png", "movie.gif", ".*.partial",
    )  # fmt: skip
    states = "frame_*.npz"

    def frame_write(self, number: int, run: Simulation, cpu: float) -> None:
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
    with path.open("rb") as stream, np.load(stream) as file:  # it leaves damaged ones open
        arrays = {name: file[name] for name in file.files}
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
