"""YADE under the project's scripts at the paper's size: Python's share, cost, stability, seams."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import asdict, dataclass
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from scipy.integrate import trapezoid

from adapters import contact_law as law
from adapters.checks import check_window
from adapters.decks import PISTON_MARGIN
from adapters.engine import EngineStart, python_cpu_s
from adapters.engine_plan import seat_plan
from adapters.engine_yade import PARAMETERS, YadeEngine
from adapters.radii import radii_sample
from adapters.sample import sample_start
from adapters.scene import Scene
from adapters.scene_file import scene_load
from adapters.state import FloatArray
from adapters.window import Window, state_read, window_load, window_read, window_save
from adapters.yade_parameters import piston_triangles
from scenes import scene_path

ENGINE = YadeEngine()
SOFT_YOUNG = 5e8
"""Grains of the bed that is rained and seated, before they get the paper's stiffness [Pa]."""

SHRUNK = 0.999
"""What radii are multiplied with then, so that no grain is pushed off by a soft grain's overlap."""

SEAM_MEAN = 3 * np.pi / 16
"""Mean of (1 - x^2)^(3/2) over 0 < x < 1."""

BARE = """\
import os, sys, time
from yade import Omega
sys.path.insert(0, os.getcwd())
import bed, record
O = Omega()
parameters = bed.parameters_read()
window = parameters["window"]
record.scene_load()
piston = bed.Piston(parameters)
load = bed.load_engine(window["load"], piston)
bed.engines_set(parameters, [load])
piston.press(window["load"]["mean_force"], parameters["gravity"])
bed.forces_renew([load])
O.run(window["cycles"] * window["steps_per_cycle"], True)
record.scene_save()
print(f"COMPLETE step {O.iter}", flush=True)
"""
"""The same cycles in one piece: no records, no frames, nothing of Python in a step."""


def scene_of(name: str, *settings: str) -> Scene:
    """A shipped scene on YADE."""
    return scene_load(scene_path(name), ['engine.name="yade"', *settings])


@dataclass(frozen=True)
class Bed:
    """A bed in a folder, from which a window can start."""

    scene: Scene
    start: EngineStart


def changed(folder: Path, table: str, **values: object) -> None:
    """Change values of one table of the parameters in ``folder``."""
    path = folder / PARAMETERS
    content = json.loads(path.read_text())
    content[table] |= values
    path.write_text(json.dumps(content))


def rested(
    scene: Scene,
    position: FloatArray,
    radius: FloatArray,
    height: float,
    folder: Path,
    edit: Callable[[Path], None] = lambda folder: None,
) -> Bed:
    """Grains at ``position`` [m] below ``height`` [m] come to rest; ``edit`` changes the input.

    A ``folder`` where they have is read back.
    """
    if not (folder / "end.restart").exists():
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        digests = ENGINE.write_preparation(scene, position, radius, height, folder)
        edit(folder)
        ENGINE.run(scene, "in.prepare", folder, lambda: None, digests)
    state = state_read(folder, ENGINE.wall_names(scene, piston=False))
    face = float((state.position[:, 2] + state.radius).max())
    start = EngineStart(folder / "end.restart", state.time_step, 0, face, first=True)
    return Bed(scene, start)


def window(
    bed: Bed, cycles: int, folder: Path, edit: Callable[[Path], None] = lambda folder: None
) -> tuple[Window, float]:
    """``cycles`` load cycles of a bed, and the engine's CPU time [s]; the checks have been made."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    digests = ENGINE.write_cycles(bed.scene, bed.start, cycles, folder)
    edit(folder)
    done = ENGINE.run(bed.scene, "in.cycles", folder, lambda: None, digests)
    names = ENGINE.wall_names(bed.scene, piston=True)
    result = window_read(folder, 0, names, bed.start.piston_height)
    check_window(bed.scene, result, cycles)
    window_save(result, folder / "states.npz")
    return result, done.cpu_s


def soft_bed(home: Path, count: int) -> tuple[Bed, Window]:
    """A rained bed of ``count`` soft grains as deep as the paper's, and its first cycle.

    What of it is in ``home`` is read back.
    """
    radius = 0.075 * (count / 1085) ** 0.5
    scene = scene_of(
        "karrech",
        f"material.grain.young={SOFT_YOUNG!r}",
        f"sample.count={count}",
        f"sample.radius={radius!r}",
        f"loading.piston_mass={0.1 * count / 1085!r}",
    )
    radii = radii_sample(scene.sample.grain_radius.law, count, scene.sample.seed)
    position, height = sample_start(
        radii, scene.container, scene.sample.relative_density_start, scene.sample.seed
    )
    bed = rested(scene, position, radii, height, home / "rain")
    if (home / "first" / "states.npz").exists():
        return bed, window_load(home / "first" / "states.npz")
    first, _ = window(bed, 1, home / "first")
    return bed, first


def after(bed: Bed, made: Window, folder: Path) -> Bed:
    """The bed behind a window that was computed in ``folder``."""
    end = EngineStart(
        folder / "end.restart", int(made.time_step[-1]), 0, float(made.piston.height[-1])
    )
    return Bed(bed.scene, end)


@dataclass(frozen=True)
class Share:
    """CPU times of the same cycles, medians [s]."""

    bare_s: float
    """YADE alone, in one O.run, start-up included."""
    engine_s: float
    """YADE as the adapter runs it."""
    python_s: float
    """What the adapter's own Python takes beside it: writing input, reading, checking, saving."""

    @property
    def speed(self) -> float:
        """Speed through the adapter over that of the bare engine."""
        return self.bare_s / (self.engine_s + self.python_s)


def python_share(bed: Bed, cycles: int, repeats: int, home: Path) -> Share:
    """Alternate the bare engine and the adapter on one saved bed."""
    bare, engine, python = [], [], []
    for number in range(repeats):
        folder = home / f"bare_{number}"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        ENGINE.write_cycles(bed.scene, bed.start, cycles, folder)
        (folder / "bare.py").write_text(BARE)
        bare.append(_cpu_s(ENGINE.command(bed.scene, "bare.py"), folder))
        before = python_cpu_s()
        _, spent = window(bed, cycles, home / f"adapter_{number}")
        engine.append(spent)
        python.append(python_cpu_s() - before)
    return Share(median(bare), median(engine), median(python))


def _cpu_s(command: list[str], folder: Path) -> float:
    """CPU time of a command and its children, user and system [s]."""
    before = os.times()
    with (folder / "screen.txt").open("wb") as screen:
        subprocess.run(
            command, cwd=folder, stdin=subprocess.DEVNULL, stdout=screen, stderr=screen, check=True
        )
    now = os.times()
    return now.children_user + now.children_system - before.children_user - before.children_system


@dataclass(frozen=True)
class PaperScale:
    """1,085 grains of 46.9 GPa at the scene's own step."""

    steps_per_cycle: int
    cycle_s: float
    """CPU time of a load cycle [s], start-up and files shared out."""
    grain_steps: float
    """Grains times steps over the CPU time of the cycles [1/s]."""
    kinetic_share: float
    """Greatest kinetic energy in the last cycle over the piston's work in it."""
    kinetic_at_end_share: float
    """Kinetic energy at the last cycle's end over the same."""
    work: float
    """Work of the piston on the bed in the last cycle [J]."""
    force_error: float
    """Root mean square of piston force less target in the last cycle, over the peak."""
    overlap_share: float
    """Greatest overlap over the smallest radius."""


def paper_scale(seated: Window, cycles: int, home: Path) -> PaperScale:
    """Give a seated soft bed the paper's stiffness, let it rest, seat the piston, load it.

    It rests until its kinetic energy is 1e-5 of its potential one; seating takes one cycle, as bed
    and piston have met before.
    """
    scene = scene_of("karrech")
    steps = scene.steps_per_cycle
    radius = SHRUNK * seated.radius
    top = float((seated.position[-1, :, 2] + radius).max())

    def soon(folder: Path) -> None:
        still = {"equilibrium_ratio": 1e-5, "check_steps": steps, "minimum_steps": steps}
        changed(folder, "settle", **still, history_steps=steps // 4)

    def short(folder: Path) -> None:
        halves = {"steps": steps // 2, "release_steps": steps - steps // 2}
        changed(folder, "window", seat=asdict(seat_plan(scene)) | halves)

    bed = rested(scene, seated.position[-1], radius, top, home / "rest", soon)
    made, cpu_s = window(bed, cycles, home / "cycles", short)
    cycle_s = cpu_s / (1 + cycles)
    piston, last = made.piston, slice(-scene.samples_per_cycle, None)
    height = np.concatenate([[made.piston_heights()[-2]], piston.height[last]])
    force = np.concatenate([piston.contact_force[-1:], piston.contact_force[last]])
    work = -float(trapezoid(force, height))
    kinetic = piston.kinetic_translational + piston.kinetic_rotational
    return PaperScale(
        steps,
        cycle_s,
        scene.grain_count * steps / cycle_s,
        float(kinetic[last].max()) / work,
        float(kinetic[-1]) / work,
        work,
        float(piston.force_error(steps)[-1]),
        check_window(scene, made, cycles)["overlap_share"],
    )


# --- seams of a partial piston --------------------------------------------------------------


def seam_length(triangles: FloatArray, inside: Callable[[FloatArray], Any]) -> float:
    """Length [m] of the edges that two ``triangles`` (t, 3, 2) share, where grains can be.

    ``inside`` takes points (n, 2) [m] and says of each whether it is in the container.
    """
    sides = np.concatenate([triangles, triangles[:, :1]], axis=1)
    seen: set[frozenset[tuple[float, ...]]] = set()
    length = 0.0
    for corners in sides:
        for a, b in pairwise(corners):
            edge = frozenset(tuple(np.round(corner, 12).tolist()) for corner in (a, b))
            if edge in seen:
                between = a + np.linspace(0, 1, 1001)[:, None] * (b - a)
                length += float(np.linalg.norm(b - a) * np.mean(inside(between)))
            seen.add(edge)
    return length


def seam_force(distance: float | FloatArray, contact_radius: float) -> FloatArray:
    """Force on a grain at a ``distance`` [m] from a seam over that on a plane, same overlap.

    The nearest point of the other triangle is on the seam, so its overlap is
    delta - s^2/(2 R) = delta (1 - s^2/a^2), a = sqrt(2 R delta) the ``contact_radius``, and by
    eq. 5 it adds (1 - s^2/a^2)^(3/2).
    """
    depth = np.maximum(1 - np.square(distance) / contact_radius**2, 0.0)
    return np.asarray(1 + depth**1.5)


@dataclass(frozen=True)
class Seams:
    """What the seams of a scene's partial piston do."""

    touched: float
    """Share of the piston's contacts that are on a seam."""
    stiffness: float
    """By how much they raise the mean stiffness of the piston's contacts, over it."""


def seams_of(scene: Scene) -> Seams:
    """Seams of a scene's piston at the peak load, every grain of the mean radius.

    A square of two radii for each grain under the piston, of which half carry.
    """
    assert scene.loading is not None
    grain = scene.sample.grain_radius
    triangles = piston_triangles(
        scene.container, scene.piston_reach, PISTON_MARGIN * grain.greatest
    )
    mirrors = np.array([axis in scene.container.symmetry for axis in "xy"])
    length = seam_length(triangles, lambda points: ((points > 0) | ~mirrors).all(axis=1))
    peak = float(scene.stress_at(np.linspace(0, 1, 101)).max())
    force = peak * (2 * grain.mean) ** 2 / 0.5
    overlap = float(law.overlap_under_force(force, scene.stiffness.wall, grain.mean))
    touched = 2 * np.sqrt(2 * grain.mean * overlap) * length / scene.loaded_area
    return Seams(float(touched), float(SEAM_MEAN * touched))
