"""One packing under the same load: the beds, the ways to compute them, one run of one way."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from adapters.bed.overlaps import find_pairs
from adapters.bed.radii import draw_radii
from adapters.bed.sample import (
    SURFACE_SHARE,
    draw_sample_start,
    measure_bed_height,
    measure_relative_density,
)
from adapters.bed.state import FloatArray
from adapters.engines.contract import Engine, EngineStart, get_engine
from adapters.files.window import Window, read_state, read_window
from adapters.procedure.checks import check_state, check_window
from adapters.scene.file import load_scene
from adapters.scene.tables import Scene
from trackbed.scenes import find_scene_file

CYCLES = 50
TWIN = 1e-9
"""By how much the first grain of the twin is aside [m]."""

LAST = 10
"""Cycle ends at the end of a run over which coordination number and density are averaged."""

FAST = ('engine.rayleigh_share="fast"',)
"""Twice the time step, as `trackbed run --fast` has it."""

SEEDS = tuple(range(1, 9))


@dataclass(frozen=True)
class Way:
    """An engine with its settings."""

    name: str
    engine: str
    settings: tuple[str, ...] = ()
    """Keys of the scene that differ."""
    aside: float = 0.0
    """By how much the first grain starts aside [m]."""

    def make_engine(self) -> Engine:
        """The engine itself."""
        return get_engine(self.engine)

    def scene(self, seed: int) -> Scene:
        """The scene of the bed of a seed, as this way has it."""
        return load_bed(seed, f'engine.name="{self.engine}"', *self.settings)


WAYS = (
    Way("liggghts", "liggghts"),
    Way("lammps", "lammps"),
    Way("yade", "yade"),
    Way("liggghts, twin", "liggghts", aside=TWIN),
    Way("liggghts, fast", "liggghts", FAST),
    Way("lammps, fast", "lammps", FAST),
    Way("yade, fast", "yade", FAST),
)
"""The three engines, the twin, twice the time step."""


@dataclass(frozen=True)
class Figures:
    """What a run gives."""

    settlement: float
    """Way down of the grains' mean height in the cycles, from the seated bed [m]."""
    settlement_after_first: float
    """The same without the first cycle [m]."""
    settlement_of_start: float
    """Way down from the common start until the piston is seated [m]."""
    coordination: float
    """Contacts of a grain with others, mean of the last `LAST` cycle ends."""
    density: float
    """Relative density below 0.9 of the common start's height, mean of the last cycle ends."""
    deflection: float
    """Elastic deflection of the piston in a cycle, mean of the last `LAST` [m]."""
    stiffness: float
    """Secant stiffness under the piston, of the same cycles [N/m]."""
    dissipated: float
    """Work of the piston on the bed in a cycle, mean of the last `LAST` [J]."""
    curve: tuple[float, ...]
    """Settlement after cycles 0, 1, ..., `CYCLES` [m]."""


def load_bed(seed: int, *extra: str) -> Scene:
    """The coarse scene of a seed, with ``extra`` keys."""
    return load_scene(find_scene_file("karrech-coarse"), [f"sample.seed={seed}", *extra])


def measure(window: Window, start: FloatArray, scene: Scene) -> Figures:
    """The figures of a window that began at the common ``start`` positions [m], shape (n, 3).

    ``scene`` gives container and cycle; a polygon's section counts as the cylinder's.
    """
    mean_height = window.position[:, :, 2].mean(axis=1)
    curve = mean_height[0] - mean_height
    top = SURFACE_SHARE * measure_bed_height(start, window.radius)
    walls = scene.container.walls()
    pairs, density = [], []
    for position in window.position[-LAST:]:
        pairs.append(int((find_pairs(position, window.radius, walls).second >= 0).sum()))
        density.append(measure_relative_density(position, window.radius, scene.container, top))
    steps, piston = scene.steps_per_cycle, window.piston
    force = (piston.contact_force[1:] + piston.contact_force[:-1]) / 2
    work = np.bincount(piston.cycles(steps)[1:], -force * np.diff(piston.height))
    return Figures(
        settlement=float(curve[-1]),
        settlement_after_first=float(curve[-1] - curve[1]),
        settlement_of_start=float(start[:, 2].mean() - mean_height[0]),
        coordination=2 * float(np.mean(pairs)) / len(window.radius),
        density=float(np.mean(density)),
        deflection=float(np.mean(piston.elastic_deflection(steps)[-LAST:])),
        stiffness=float(np.mean(piston.stiffness(steps)[-LAST:])),
        dissipated=float(np.mean(work[-LAST:])),
        curve=tuple(curve.tolist()),
    )


def pour_bed(seed: int, folder: Path) -> tuple[FloatArray, FloatArray]:
    """Positions (n, 3) and radii (n,) [m] of the settled bed of a seed, by LIGGGHTS' rain."""
    scene = load_bed(seed, 'engine.name="liggghts"')
    radius = draw_radii(scene.sample.radii, scene.grain_count, seed)
    position, height = draw_sample_start(
        radius, scene.container, scene.sample.relative_density_start, seed
    )
    engine = get_engine("liggghts")
    folder.mkdir(parents=True)
    decks = engine.write_preparation(scene, position, radius, height, folder)
    engine.run(scene, "in.prepare", folder, lambda: None, decks)
    return read_state(folder, engine.wall_names(scene, piston=False)).position, radius


def run_way(
    way: Way, seed: int, start: FloatArray, radius: FloatArray, folder: Path, cycles: int = CYCLES
) -> tuple[Figures, float]:
    """One way from the common ``start`` [m], (n, 3): its figures and the engine's CPU time [s].

    ``cycles`` load cycles; ``folder`` is made for it.  Raises `EngineFailed`, `NotCredible`,
    `NotConverged`.
    """
    scene, engine = way.scene(seed), way.make_engine()
    position = start.copy()
    position[0, 0] += way.aside
    settled, loaded = folder / "settled", folder / "loaded"
    for made in (settled, loaded):
        made.mkdir(parents=True)
    top = float((position[:, 2] + radius).max())
    decks = engine.write_preparation(scene, position, radius, top, settled)
    rest = engine.run(scene, "in.prepare", settled, lambda: None, decks)
    state = read_state(settled, engine.wall_names(scene, piston=False))
    check_state(scene, state)
    face = float((state.position[:, 2] + radius).max())
    begin = EngineStart(settled / "end.restart", state.time_step, 0, face, first=True)
    decks = engine.write_cycles(scene, begin, cycles, loaded)
    done = engine.run(scene, "in.cycles", loaded, lambda: None, decks)
    window = read_window(loaded, 0, engine.wall_names(scene, piston=True), face)
    check_window(scene, window, cycles)
    common = load_bed(seed, 'engine.name="liggghts"')
    figures = measure(window, start, common if way.engine == "yade" else scene)
    return figures, rest.cpu_s + done.cpu_s
