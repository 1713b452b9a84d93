"""An engine without mechanics: analytic residual displacements, the files of a real one.

It exists so that the whole procedure, its dumps and its checks included, runs in milliseconds.
Every grain settles by ``-a_beta ln(1 + N)`` in cycle N, or as `BED` says; grains in contact
keep their overlap.  Never use it for a result.
"""

import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from adapters.bed import FloatArray
from adapters.engines.contract import EngineRun, EngineStart
from adapters.engines.decks import STATE_COLUMNS
from adapters.files import Frame, write_dump
from adapters.scene import Scene

SETTLEMENT = 2e-5
"""Displacement a of the mean grain in u = -a ln(1 + N) [m]."""
SPACING = 0.9999
"""Distance of the lattice of grains over the diameter of the greatest: neighbours overlap."""
CYCLE_SAMPLES = 20
"""Samples of the piston's record in a cycle."""


def find_logarithm(cycle: FloatArray) -> FloatArray:
    """u = a ln(1 + N) [m]."""
    return np.asarray(SETTLEMENT * np.log1p(cycle))


@dataclass(frozen=True)
class FakeBed:
    """How the mean grain settles."""

    law: Callable[[FloatArray], FloatArray] = find_logarithm  # u(N) [m]
    sinking: float = field(default=0.0, kw_only=True)
    """What the piston sinks further than the mean grain, each cycle [m]."""

    def settlement(self, first: int, cycles: int) -> FloatArray:
        """u [m] at the ends of ``cycles`` cycles from ``first`` on, less u before them."""
        gain = np.diff(self.law(np.arange(first, first + cycles + 1.0)))
        return np.concatenate([[0.0], np.cumsum(gain)])


BED = FakeBed()
"""The bed of every run; tests put another in its place."""


class FakeEngine:
    """Writes what `adapters.engines.contract` asks for, from formulas; restart files are arrays."""

    name = "fake"
    auto_order = None
    grain_steps_per_s = 1e9  # it computes none

    def program(self) -> list[str] | None:
        """There is none."""
        return None

    def version(self) -> str:
        """Version banner."""
        return "fake 1"

    def command(self, scene: Scene, deck: str) -> list[str]:
        """There is no process to start: the command does nothing."""
        return ["true", deck]

    def wall_names(self, scene: Scene, piston: bool) -> tuple[str, ...]:
        """Only the floor is known here."""
        return ("floor",)

    def cycles_done(self, scene: Scene, start: EngineStart, folder: Path) -> int:
        """All at once, so nothing in between."""
        return 0

    def write_preparation(
        self, scene: Scene, position: FloatArray, radius: FloatArray, height: float, folder: Path
    ) -> dict[str, str]:
        """Keep the radii; the settled bed is a lattice, see `run`."""
        np.savez(folder / "input.npz", position=position, radius=radius)
        return {}

    def write_cycles(
        self, scene: Scene, start: EngineStart, cycles: int, folder: Path
    ) -> dict[str, str]:
        """Keep the start state and the number of cycles."""
        shutil.copyfile(start.restart, folder / "start.restart")
        with np.load(start.restart) as data:
            position = data["position"] if start.moved is None else start.moved.position
            position[0, 0] += start.perturbation
            np.savez(
                folder / "input.npz", position=position, radius=data["radius"], cycles=cycles,
                first_step=start.time_step,
                first_cycle=data["cycle"] if start.moved is None else start.moved.cycle,
                piston_height=start.piston_height,
            )  # fmt: skip
        return {}

    def run(
        self, scene: Scene, deck: str, folder: Path, watch: Callable[[], None],
        digests: dict[str, str],
    ) -> EngineRun:  # fmt: skip
        """Write the dumps of a preparation or of a window of load cycles."""
        started = time.process_time()
        watch()
        with np.load(folder / "input.npz") as data:
            values = {name: data[name] for name in data.files}
        if deck == "in.prepare":
            self._prepare(scene, values, folder)
        else:
            self._find_cycles(scene, values, folder)
        return EngineRun(("fake",), time.process_time() - started, 0.0, 0.0, digests)

    @staticmethod
    def _prepare(scene: Scene, values: dict[str, FloatArray], folder: Path) -> None:
        radius = values["radius"]
        position = place_lattice(scene, len(radius), float(radius.max()))
        write_dumps(folder, radius, position[None], [0])
        header = "step time_s kinetic_translational_J kinetic_rotational_J potential_J "
        header += "coordination_number floor_force_N"
        np.savetxt(folder / "history.txt", np.array([[0, 0, 1e-9, 0, 1, 4, 1]]), header=header)
        write_dump(folder / "rain.dump", [_make_frame(0, radius, position)])
        write_fake_restart(folder, radius, position, 0)

    @staticmethod
    def _find_cycles(scene: Scene, values: dict[str, FloatArray], folder: Path) -> None:
        cycles, first = int(values["cycles"]), int(values["first_cycle"])
        radius, start = values["radius"], values["position"]
        steps = int(values["first_step"]) + scene.steps_per_cycle * np.arange(cycles + 1)
        settled = BED.settlement(first, cycles)
        # Grains higher up settle more, as in a bed that compacts evenly.
        share = start[:, 2] / start[:, 2].mean()
        position = np.repeat(start[None], cycles + 1, axis=0)
        position[:, :, 2] -= settled[:, None] * share
        write_dumps(folder, radius, position, steps.tolist())
        write_fake_restart(folder, radius, position[-1], first + cycles)
        phase = np.arange(1, cycles * CYCLE_SAMPLES + 1) / CYCLE_SAMPLES
        force = scene.stress_at(phase) * scene.loaded_area
        height = values["piston_height"] - np.interp(phase, np.arange(cycles + 1), settled)
        height -= BED.sinking * phase
        step, energy = np.round(phase * scene.steps_per_cycle), np.full_like(phase, 1e-12)
        track = np.column_stack(
            [steps[0] + step, force, 1.001 * force, height - 1e-6 * force, energy, energy]
        )
        np.savetxt(folder / "piston.txt", track, fmt="%.17g", header="step ...")


def place_lattice(scene: Scene, count: int, radius: float) -> FloatArray:
    """Centres of a cubic lattice that fills the section from below [m], shape (count, 3)."""
    width = 2 * radius * SPACING
    size = scene.container.size_x if scene.container.shape == "box" else scene.container.radius
    ticks = np.arange(radius, size - radius, width)
    x, y = (grid.ravel() for grid in np.meshgrid(ticks, ticks))
    if scene.container.shape == "cylinder":
        inside = np.hypot(x, y) < size - radius
        x, y = x[inside], y[inside]
    layer = np.arange(count) // len(x)
    place = np.arange(count) % len(x)
    return np.column_stack([x[place], y[place], radius + layer * width])


def _make_frame(step: int, radius: FloatArray, position: FloatArray) -> Frame:
    names = (*STATE_COLUMNS.split(), *(f"f_force_floor[{axis}]" for axis in (1, 2, 3)))
    n = len(radius)
    still, mass = np.zeros((n, 6)), 4 / 3 * np.pi * 2710 * radius**3
    rows = [np.arange(1, n + 1), position, still, radius, mass, np.zeros((n, 3))]
    return Frame(step, names, np.column_stack(rows))


def write_dumps(folder: Path, radius: FloatArray, position: FloatArray, steps: list[int]) -> None:
    """``states.dump``, and a ``contacts.dump`` without contacts."""
    frames = [_make_frame(step, radius, x) for step, x in zip(steps, position, strict=True)]
    write_dump(folder / "states.dump", frames)
    names = tuple(f"c_contact[{i}]" for i in range(1, 13))
    empty = [Frame(step, names, np.empty((0, 12)), kind="entries") for step in steps]
    write_dump(folder / "contacts.dump", empty)


def write_fake_restart(folder: Path, radius: FloatArray, position: FloatArray, cycle: int) -> None:
    with (folder / "end.restart").open("wb") as stream:
        np.savez(stream, radius=radius, position=position, cycle=cycle)


ENGINE = FakeEngine()
