"""LIGGGHTS (Debian's 3.8.0) as an engine: static decks, generated includes, fresh processes."""

from __future__ import annotations

import re
import shutil
import signal
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np

from adapters import decks
from adapters.dump import Frame, dump_write
from adapters.engine import (
    EngineRun,
    EngineStart,
    cycles_in_track,
    engine_failure,
)
from adapters.engine_deck import deck_run
from adapters.engine_plan import (
    EQUILIBRIUM_RATIO,
    cycle_steps,
    frictional,
    seat_plan,
    settle_plan,
)
from adapters.engine_program import Program
from adapters.sample import GRAVITY
from adapters.scene import Scene
from adapters.state import FloatArray

PARTS = ("load", "run", "output", "start", "seat")
"""Parts of a window's deck that depend on the scene or on where the window starts."""

LOOP_TIME = re.compile(r"^Loop time of (\S+) on", re.MULTILINE)
BANNER = re.compile(r"(LIGGGHTS-PUBLIC (\d+)\.(\d+)[^,)]*)")
PROGRAM = Program("LIGGGHTS", "-h", BANNER, (3, 8), "sudo apt-get install liggghts")


class LiggghtsEngine:
    """Writes the decks of a window, runs ``liggghts``, and knows its manners.

    LIGGGHTS exits 0 after SIGTERM, with lost atoms and with NaN; the deck's last line
    ``COMPLETE step N`` is the sentinel looked for here, `adapters.checks` does the rest.
    ``-screen none`` crashes where a mesh is read, so the screen goes to a file.
    """

    name = "liggghts"

    def version(self) -> str:
        """Version banner such as ``LIGGGHTS-PUBLIC 3.8.0``; raises `EngineMissing`."""
        path = shutil.which("liggghts")
        return PROGRAM.version(None if path is None else [path])

    def command(self, scene: Scene, deck: str) -> list[str]:
        """Command line that runs ``deck`` in its folder.

        ``stdbuf`` has the screen written line by line: MPI_ABORT throws away what is buffered,
        and with it the reason.
        """
        unbuffered = ["stdbuf", "-oL"] if shutil.which("stdbuf") else []
        return [
            *scene.engine.launcher,
            *unbuffered,
            "liggghts",
            "-in",
            deck,
            "-log",
            "log.liggghts",
        ]

    def wall_names(self, scene: Scene, piston: bool) -> tuple[str, ...]:
        """Names of the walls whose forces ``states.dump`` holds; see `adapters.engine.Engine`."""
        return decks.wall_names(scene.container, piston)

    def cycles_done(self, scene: Scene, start: EngineStart, folder: Path) -> int:
        """Load cycles done so far, from ``piston.txt``."""
        return cycles_in_track(scene, folder)

    def write_preparation(
        self, scene: Scene, position: FloatArray, radius: FloatArray, height: float, folder: Path
    ) -> dict[str, str]:
        """Write the rain of grains; see `adapters.engine.Engine`."""
        piston_mass = None if scene.loading is None else scene.loading.piston_mass
        (folder / "grains.data").write_text(
            decks.grains_data_text(
                position,
                radius,
                scene.material.grain.density,
                scene.container,
                height,
                piston_mass,
            )
        )
        plan = settle_plan(scene, height)
        (folder / "dump_states.in").write_text(
            decks.dump_states_text(self.wall_names(scene, piston=False))
        )
        return self._write(
            scene,
            folder,
            (*decks.PARTS_PREPARE, f"output_{self._kind(scene)}.in"),
            {
                **asdict(plan),
                "equilibrium_ratio": EQUILIBRIUM_RATIO,
                "steps_per_cycle": cycle_steps(scene),
                "output_part": f"output_{self._kind(scene)}.in",
            },
        )

    def write_cycles(
        self, scene: Scene, start: EngineStart, cycles: int, folder: Path
    ) -> dict[str, str]:
        """Write a window of load cycles; see `adapters.engine.Engine`."""
        assert scene.loading is not None
        shutil.copyfile(start.restart, folder / "start.restart")
        margin = decks.PISTON_MARGIN * scene.sample.grain_radius.greatest
        decks.piston_stl_write(folder / "piston.stl", scene.container, scene.piston_reach, margin)
        (folder / "dump_states.in").write_text(
            decks.dump_states_text(self.wall_names(scene, piston=True))
        )
        steps = scene.steps_per_cycle
        waveform = scene.loading.waveform
        parameters: dict[str, float | int | str] = {
            "load_part": f"load_{waveform}.in",
            "run_part": f"run_{waveform}.in",
            "output_part": f"output_{self._kind(scene)}.in",
            "start_part": f"start_{start.kind}.in",
            "seat_part": f"seat_{'first' if start.first else 'none'}.in",
            "steps_per_cycle": steps,
            "run_steps": cycles * steps,
            "track_steps": steps // scene.samples_per_cycle,
            "piston_atom": scene.grain_count + 1,
            "piston_mesh": f"piston_{start.piston_mesh}",
            "piston_height": start.piston_height,
        }
        if start.kind == "perturbed":
            parameters["perturbation"] = start.perturbation
        if start.moved is not None:
            parameters["start_step"] = start.time_step
        if start.first:
            seat = seat_plan(scene)
            parameters |= {
                "seat_force": seat.force,
                "seat_speed": seat.speed,
                "seat_steps": seat.steps,
                "release_force": seat.release_force,
                "release_steps": seat.release_steps,
            }
        if waveform == "sine":
            parameters |= {
                "force_mean": scene.loading.mean * scene.loaded_area,  # type: ignore[operator]
                "force_amplitude": scene.loading.amplitude * scene.loaded_area,  # type: ignore[operator]
            }
        else:
            parameters |= self._write_series(scene, cycles, folder)
        if start.moved is not None:
            self._write_moved(scene, start, folder)
        parts = tuple(str(parameters[f"{name}_part"]) for name in PARTS)
        return self._write(scene, folder, decks.PARTS_CYCLES + parts, parameters)

    def run(
        self,
        scene: Scene,
        deck: str,
        folder: Path,
        watch: Callable[[], None],
        digests: dict[str, str],
    ) -> EngineRun:
        """Run a deck; raises `EngineFailed`, `EngineMissing`, `NotConverged` (not settled)."""

        def refuse(status: int, text: str) -> None:
            if status == 0 and "SIGINT/SIGTERM caught" in text:
                raise engine_failure(-signal.SIGTERM, folder)

        return deck_run(
            self.command(scene, deck),
            folder,
            watch,
            digests,
            begun=BANNER,
            loop_time=LOOP_TIME,
            launch="launch it by the MPI it is linked to: Debian's by mpirun of Open MPI",
            refuse=refuse,
        )

    @staticmethod
    def _kind(scene: Scene) -> str:
        return "frictional" if frictional(scene) else "frictionless"

    def _write(
        self,
        scene: Scene,
        folder: Path,
        parts: tuple[str, ...],
        parameters: dict[str, float | int | str],
    ) -> dict[str, str]:
        """Static parts, ``scene.in`` and ``parameters.in``; returns the digests of the parts."""
        material = scene.material
        shared: dict[str, float | int | str] = {
            "time_step": scene.time_step,
            "gravity": GRAVITY,
            "skin": 0.3 * scene.sample.grain_radius.mean,
            "contact_part": f"contact_{self._kind(scene)}.in",
        }
        (folder / "parameters.in").write_text(decks.parameters_text(shared | parameters))
        (folder / "scene.in").write_text(
            decks.scene_text(
                scene.container,
                (material.grain.young, material.grain.poisson),
                (material.wall.young, material.wall.poisson),
                scene.restitution,
                (material.grain.friction, material.wall.friction),
            )
        )
        return decks.deck_copy(folder, (*parts, f"contact_{self._kind(scene)}.in"))

    @staticmethod
    def _write_series(scene: Scene, cycles: int, folder: Path) -> dict[str, float | int | str]:
        """Load samples of the window, one a line, and their slopes a step."""
        assert scene.loading is not None
        assert scene.loading.samples is not None
        force = scene.loading.samples.stress * scene.loaded_area
        steps = scene.steps_per_cycle // (len(force) - 1)
        # One sample more than segments: LIGGGHTS draws the next one after the last segment too.
        samples = np.append(np.tile(force[:-1], cycles), force[0])
        slopes = np.append(np.tile(np.diff(force) / steps, cycles), 0.0)
        np.savetxt(folder / "force.txt", samples, fmt="%.17g")
        np.savetxt(folder / "slope.txt", slopes, fmt="%.17g")
        return {"steps_per_sample": steps}

    @staticmethod
    def _write_moved(scene: Scene, start: EngineStart, folder: Path) -> None:
        """``moved.dump``: grains at rest at their new places, the piston's atom at its height."""
        assert start.moved is not None
        moved = start.moved
        values = np.zeros((len(moved.radius) + 1, 9))
        values[:-1, 0] = moved.identifier
        values[:-1, 1] = decks.GRAIN
        values[:-1, 2:5] = moved.position
        values[:-1, 8] = moved.radius
        values[-1] = [
            len(moved.radius) + 1,
            decks.WALL,
            *decks.piston_atom_place(scene.container, moved.radius),
            start.piston_height,
            0.0,
            0.0,
            0.0,
            float(moved.radius.min()),
        ]
        columns = ("id", "type", "x", "y", "z", "vx", "vy", "vz", "radius")
        low, high = decks.box_bounds(
            scene.container, moved.radius, float(moved.position[:, 2].max())
        )
        bounds = np.column_stack([low, high])
        dump_write(
            folder / "moved.dump", [Frame(start.time_step, columns, values, bounds, "atoms")]
        )
