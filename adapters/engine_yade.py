"""YADE (Debian's 2023.02a) as an engine: static scripts, one JSON file, fresh processes."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from adapters.decks import deck_copy
from adapters.engine import EngineRun, EngineStart, cycles_in_track
from adapters.engine_deck import deck_run
from adapters.engine_plan import EQUILIBRIUM_RATIO, seat_plan, settle_plan
from adapters.engine_program import Program
from adapters.scene import Scene
from adapters.state import FloatArray
from adapters.yade_parameters import piston_face, shared_parameters

SCRIPTS = {"in.prepare": "prepare.py", "in.cycles": "cycles.py"}
"""Script of each deck."""

PARAMETERS = "params.json"

BEGUN = re.compile("Running script")
LOOP_TIME = re.compile(r"^LOOP (\S+) s", re.MULTILINE)
BANNER = re.compile(r"Yade version: ((\d{4})\S*)")
PROGRAM = Program("YADE", "--version", BANNER, (2023,), "sudo apt-get install yade")
"""From 2023 on walls are known to be flat when asked (``hertzian``)."""


class YadeEngine:
    """Writes the parameters of a window, runs ``yade``, and knows its manners.

    YADE exits 0 with NaN and with escaped grains; the script's last line ``COMPLETE step N`` is
    the sentinel looked for here, `adapters.checks` does the rest.  ``-x`` has it exit 1 after an
    exception, ``-n`` open no window, ``-j1`` repeat itself bit for bit.
    """

    name = "yade"

    def version(self) -> str:
        """Version banner such as ``Yade 2023.02a``; raises `EngineMissing`."""
        path = shutil.which("yade")
        return f"Yade {PROGRAM.version(None if path is None else [path])}"

    def command(self, scene: Scene, deck: str) -> list[str]:
        """Command line that runs ``deck`` in its folder."""
        yade = ["yade", "-n", "-x", "-j1", SCRIPTS.get(deck, deck), PARAMETERS]
        return [*scene.engine.launcher, *yade]

    def wall_names(self, scene: Scene, piston: bool) -> tuple[str, ...]:
        """Names of the walls whose forces ``states.dump`` holds; see `adapters.engine.Engine`."""
        names = scene.container.walls().plane_name
        return (*names, "piston") if piston else names

    def cycles_done(self, scene: Scene, start: EngineStart, folder: Path) -> int:
        """Load cycles done so far, from ``piston.txt``."""
        return cycles_in_track(scene, folder)

    def write_preparation(
        self, scene: Scene, position: FloatArray, radius: FloatArray, height: float, folder: Path
    ) -> dict[str, str]:
        """Write the rain of grains; see `adapters.engine.Engine`."""
        content = shared_parameters(scene, height)
        content["settle"] = asdict(settle_plan(scene, height))
        content["settle"]["equilibrium_ratio"] = EQUILIBRIUM_RATIO
        content["grains"] = {"position": position.tolist(), "radius": radius.tolist()}
        return self._write(folder, "prepare.py", content)

    def write_cycles(
        self, scene: Scene, start: EngineStart, cycles: int, folder: Path
    ) -> dict[str, str]:
        """Write a window of load cycles; see `adapters.engine.Engine`."""
        assert scene.loading is not None
        shutil.copyfile(start.restart, folder / "start.restart")
        steps = scene.steps_per_cycle
        content = shared_parameters(scene, start.piston_height)
        content["piston"] = {
            "mass": scene.loading.piston_mass,
            "height": start.piston_height,
            **piston_face(scene.container, scene.piston_reach, scene.sample.grain_radius),
        }
        content["window"] = {
            "start": start.kind,
            "cycles": cycles,
            "steps_per_cycle": steps,
            "track_steps": steps // scene.samples_per_cycle,
            "load": _load(scene),
        }
        if start.first:
            content["window"]["seat"] = asdict(seat_plan(scene))
        if start.moved is not None:
            content["window"]["moved"] = start.moved.position.tolist()
        if start.kind == "perturbed":
            content["window"]["perturbation"] = start.perturbation
        return self._write(folder, "cycles.py", content)

    def run(
        self,
        scene: Scene,
        deck: str,
        folder: Path,
        watch: Callable[[], None],
        digests: dict[str, str],
    ) -> EngineRun:
        """Run a script; raises `EngineFailed`, `EngineMissing`, `NotConverged` (not settled)."""
        return deck_run(
            self.command(scene, deck),
            folder,
            watch,
            digests,
            begun=BEGUN,
            loop_time=LOOP_TIME,
            launch="launch it without MPI: YADE runs in one process",
        )

    @staticmethod
    def _write(folder: Path, script: str, content: dict[str, Any]) -> dict[str, str]:
        """The parameters and the static scripts; returns the digests of the scripts."""
        (folder / PARAMETERS).write_text(json.dumps(content, indent=1, allow_nan=False) + "\n")
        return deck_copy(folder, (script, "bed.py", "record.py"), "yade_scripts")


def _load(scene: Scene) -> dict[str, Any]:
    """The load as forces [N] on the piston: a mean and a sine, or a period of samples."""
    assert scene.loading is not None
    samples = scene.loading.samples
    if samples is not None:
        force = samples.stress * scene.loaded_area
        time = samples.time - samples.time[0]
        return {
            "waveform": "series",
            "mean_force": 0.0,
            "time": time.tolist(),
            "force": force.tolist(),
        }
    return {
        "waveform": "sine",
        "mean_force": scene.loading.mean * scene.loaded_area,  # type: ignore[operator]
        "amplitude": scene.loading.amplitude * scene.loaded_area,  # type: ignore[operator]
        "frequency": scene.loading.frequency,
    }
