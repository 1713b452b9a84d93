"""LIGGGHTS (Debian's 3.8.0) as an engine: static decks, generated includes, fresh processes."""

from __future__ import annotations

import re
import shutil
from dataclasses import asdict
from pathlib import Path

import numpy as np

from adapters.bed import GRAVITY, FloatArray
from adapters.engines import decks
from adapters.engines.contract import EngineStart
from adapters.engines.plan import EQUILIBRIUM_RATIO, count_cycle_steps, frictional, plan_settling
from adapters.engines.process import ProcessEngine, Program
from adapters.files import Frame, write_dump
from adapters.scene import Scene

BANNER = re.compile(r"(LIGGGHTS-PUBLIC (\d+)\.(\d+)[^,)]*)")
PROGRAM = Program("LIGGGHTS", "-h", BANNER, (3, 8), "sudo apt-get install liggghts")


class LiggghtsEngine(ProcessEngine):
    """Writes the decks of a window, runs ``liggghts``, and knows its manners.

    LIGGGHTS exits 0 after SIGTERM, with lost atoms and with NaN; the deck's last line
    ``COMPLETE step N`` is the sentinel looked for here, `adapters.procedure.checks` does the rest.
    ``-screen none`` crashes where a mesh is read, so the screen goes to a file.
    """

    name = "liggghts"
    auto_order = 0
    begun, loop_time = BANNER, decks.LOOP_TIME
    launch = "launch it by the MPI it is linked to: Debian's by mpirun of Open MPI"
    ended_early = "SIGINT/SIGTERM caught"

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
        """Names of the walls whose forces ``states.dump`` holds; see
        `adapters.engines.contract.Engine`."""
        return decks.wall_names(scene.container, piston)

    def write_preparation(
        self, scene: Scene, position: FloatArray, radius: FloatArray, height: float, folder: Path
    ) -> dict[str, str]:
        """Write the rain of grains; see `adapters.engines.contract.Engine`."""
        decks.write_grains(scene, position, radius, height, folder)
        plan = plan_settling(scene, height)
        (folder / "dump_states.in").write_text(
            decks.format_dump_states(self.wall_names(scene, piston=False))
        )
        return self._write(
            scene,
            folder,
            (*decks.PARTS_PREPARE, f"output_{self._kind(scene)}.in"),
            {
                **asdict(plan),
                "equilibrium_ratio": EQUILIBRIUM_RATIO,
                "steps_per_cycle": count_cycle_steps(scene),
                "output_part": f"output_{self._kind(scene)}.in",
            },
        )

    def write_cycles(
        self, scene: Scene, start: EngineStart, cycles: int, folder: Path
    ) -> dict[str, str]:
        """Write a window of load cycles; see `adapters.engines.contract.Engine`."""
        assert scene.loading is not None
        shutil.copyfile(start.restart, folder / "start.restart")
        margin = decks.PISTON_MARGIN * scene.sample.grain_radius.greatest
        decks.write_piston_stl(folder / "piston.stl", scene.container, scene.piston_reach, margin)
        (folder / "dump_states.in").write_text(
            decks.format_dump_states(self.wall_names(scene, piston=True))
        )
        output = f"output_{self._kind(scene)}.in"
        own: dict[str, float | int | str] = {
            "piston_mesh": f"piston_{start.piston_mesh}", "piston_height": start.piston_height
        }  # fmt: skip
        if start.moved is not None:
            own["start_step"] = start.time_step
            self._write_moved(scene, start, folder)
        parameters = decks.gather_cycle_parameters(scene, start, cycles, output, folder, own)
        parts = decks.parts_named(parameters)
        return self._write(scene, folder, decks.PARTS_CYCLES + parts, parameters)

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
        (folder / "parameters.in").write_text(decks.format_parameters(shared | parameters))
        (folder / "scene.in").write_text(
            decks.scene_text(
                scene.container,
                (material.grain.young, material.grain.poisson),
                (material.wall.young, material.wall.poisson),
                scene.restitution,
                (material.grain.friction, material.wall.friction),
            )
        )
        return decks.copy_deck(folder, (*parts, f"contact_{self._kind(scene)}.in"))

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
            *decks.place_piston_atom(scene.container, moved.radius),
            start.piston_height,
            0.0,
            0.0,
            0.0,
            float(moved.radius.min()),
        ]
        columns = ("id", "type", "x", "y", "z", "vx", "vy", "vz", "radius")
        low, high = decks.bound_box(
            scene.container, moved.radius, float(moved.position[:, 2].max())
        )
        bounds = np.column_stack([low, high])
        write_dump(
            folder / "moved.dump", [Frame(start.time_step, columns, values, bounds, "atoms")]
        )


ENGINE = LiggghtsEngine()
