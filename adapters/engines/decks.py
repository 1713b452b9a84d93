"""Input files of LIGGGHTS and LAMMPS: static decks copied, what the scene names written beside.

Static decks live in ``liggghts_inputs`` and ``lammps_inputs``.  Generated for both are
``parameters.in`` (numbers and the names of the parts to include), ``scene.in`` (contact law and
walls), ``dump_states.in`` (columns), ``grains.data`` and the load samples; the rest is in
`liggghts_decks` and `lammps_decks`.  A deck holds only what its scene names.
"""

import hashlib
import re
import shutil
from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import asdict
from importlib.resources import files
from pathlib import Path

import numpy as np

from adapters.bed import GRAVITY, Container, FloatArray
from adapters.engines.contract import EngineStart
from adapters.engines.crib import find_crib_forces, load_settled
from adapters.engines.plan import PLAN, count_cycle_steps, plan_seating, plan_settling
from adapters.engines.taps import TappingEngine
from adapters.scene import Scene

LOOP_TIME = re.compile(r"^Loop time of (\S+) on (\d+) procs", re.MULTILINE)
"""How LIGGGHTS and LAMMPS say how many seconds the time steps took on how many processes."""
GRAIN, WALL, MIRROR = 1, 2, 3
"""Atom types: grains; walls, piston face and piston mass; mirror planes."""
PISTON_MARGIN = 1.0
"""By how much the piston's mesh is wider than the container, in greatest radii."""
STATE_COLUMNS = "id x y z vx vy vz omegax omegay omegaz radius mass"
"""Columns of ``states.dump`` before the forces of the walls."""

CRIB_WORDS = {b"include bed.in": b"include bed.in\ninclude crib.in"}
"""Words of ``in.cycles``, and what ballast beside a block needs in their place."""

Parameters = dict[str, float | int | str]


def copy_deck(
    folder: Path, parts: tuple[str, ...], package: str, changes: Mapping[bytes, bytes] | None = None
) -> dict[str, str]:
    """Copy the named static decks of a package into ``folder``, with ``changes`` of their words;
    returns the SHA-256 of each."""
    digests = {}
    for name in parts:
        text = files(package).joinpath(name).read_bytes()
        for old, new in (changes or {}).items():
            text = text.replace(old, new)
        (folder / name).write_bytes(text)
        digests[name] = hashlib.sha256(text).hexdigest()
    return digests


def format_parameters(parameters: Parameters) -> str:
    """``parameters.in``: one ``variable NAME index VALUE`` a line; ``-var NAME VALUE`` beats it."""
    lines = ["# parameters.in : generated; SI units"]
    for name, value in parameters.items():
        text = f"{value:.17g}" if isinstance(value, float) else str(value)
        lines.append(f"variable {name} index {text}")
    return "\n".join(lines) + "\n"


PARTS_PREPARE = ("in.prepare", "settings.in", "bed.in")
PARTS_CYCLES = ("in.cycles", "settings.in", "bed.in", "piston.in")


class DeckEngine(TappingEngine):
    """What LIGGGHTS and LAMMPS share: static decks copied, what the scene names written beside."""

    package: str  # where the static decks are
    loop_time = LOOP_TIME
    stone_words: Mapping[bytes, bytes]  # what stones need in place of words of the static decks
    crib_words: tuple[str, str, str]
    """How a number of each grain is declared, set and read."""

    @abstractmethod
    def format_scene(self, scene: Scene, piston: bool) -> dict[str, str]:
        """Texts of ``scene.in``, ``dump_states.in`` and what else the scene alone says, by name."""

    @abstractmethod
    def write_start(self, scene: Scene, start: EngineStart, folder: Path) -> Parameters:
        """Files of a window's start besides the restart file; the engine's own parameters."""

    @abstractmethod
    def name_parts(self, scene: Scene) -> Parameters:
        """Names of the parts that depend on which contacts have friction."""

    def write_preparation(
        self, scene: Scene, position: FloatArray, radius: FloatArray, height: float, folder: Path
    ) -> dict[str, str]:
        """Write the rain of grains; see `adapters.engines.contract.Engine`."""
        piston_mass = None if scene.loading is None else scene.loading.piston_mass
        density = scene.material.grain.density
        if scene.stones:  # the engine itself puts them in, and wants an atom before
            position, piston_mass = position[:0], piston_mass or 1.0
        text = format_grains_data(position, radius, density, scene.container, height, piston_mass)
        (folder / "grains.data").write_text(text)
        parameters: Parameters = {
            **asdict(plan_settling(scene, height)),
            "equilibrium_ratio": PLAN.equilibrium_ratio,
            "steps_per_cycle": count_cycle_steps(scene),
        }
        return self._write(scene, folder, PARTS_PREPARE, parameters, piston=False)

    def write_cycles(
        self, scene: Scene, start: EngineStart, cycles: int, folder: Path
    ) -> dict[str, str]:
        """Write a window of load cycles; see `adapters.engines.contract.Engine`."""
        shutil.copyfile(start.restart, folder / "start.restart")
        own = self.write_start(scene, start, folder)
        if scene.loading and scene.loading.crib:
            force = find_crib_forces(scene, load_settled(start.restart))
            (folder / "crib.in").write_text(format_crib(force, *self.crib_words))
        parameters = gather_cycle_parameters(scene, start, cycles, folder, own)
        return self._write(scene, folder, PARTS_CYCLES, parameters, piston=True)

    def _write(
        self, scene: Scene, folder: Path, parts: tuple[str, ...], parameters: Parameters,
        piston: bool,
    ) -> dict[str, str]:  # fmt: skip
        """Static parts and the generated ones of every run; returns the digests of the parts."""
        shared: Parameters = {
            "time_step": scene.time_step,
            "gravity": GRAVITY,
            "skin": 0.3 * scene.sample.radii.mean,
        }
        parameters = shared | parameters | self.name_parts(scene)
        texts = {"parameters.in": format_parameters(parameters), **self.format_scene(scene, piston)}
        for name, text in texts.items():
            (folder / name).write_text(text)
        named = (str(value) for name, value in parameters.items() if name.endswith("_part"))
        changes = self.stone_words if scene.stones else None
        if piston and scene.loading and scene.loading.crib:
            changes = CRIB_WORDS
        return copy_deck(folder, (*parts, *named), self.package, changes)


def format_grains_data(
    position: FloatArray, radius: FloatArray, density: float, container: Container, height: float,
    piston_mass: float | None,
) -> str:  # fmt: skip
    """``grains.data``: centres (n, 3) and radii (n,) [m], density [kg/m^3], box to ``height`` [m].

    No centres where the engine itself puts the grains in.
    With a piston, one more atom of mass ``piston_mass`` [kg] is parked outside the container;
    it touches nothing and gives the piston face its inertia.
    """
    low, high = bound_box(container, radius, height)
    rows = [
        f"{i} {GRAIN} {2 * r:.17g} {density:.17g} {x[0]:.17g} {x[1]:.17g} {x[2]:.17g}"
        for i, (x, r) in enumerate(zip(position, radius, strict=False), 1)
    ]
    if piston_mass is not None:
        r = float(radius.min())
        x = (*place_piston_atom(container, radius), height)
        piston_density = piston_mass / (4 / 3 * np.pi * r**3)
        rows.append(
            f"{len(position) + 1} {WALL} {2 * r:.17g} {piston_density:.17g} "
            f"{x[0]:.17g} {x[1]:.17g} {x[2]:.17g}"
        )
    types = MIRROR if container.symmetry else WALL
    header = ["grains.data : generated; id type diameter density x y z", "", f"{len(rows)} atoms"]
    header += [f"{types} atom types"]
    header += [
        f"{lo:.17g} {hi:.17g} {axis}lo {axis}hi"
        for lo, hi, axis in zip(low, high, "xyz", strict=True)
    ]
    return "\n".join([*header, "", "Atoms", "", *rows]) + "\n"


def format_crib(force: FloatArray, declared: str, set_: str, read: str) -> str:
    """``crib.in``: constant ``force`` [N] down on each grain, shape (n,), in an engine's words."""
    return "\n".join([
        "# crib.in : generated; weight of the ballast beside the block",
        f"fix crib all property/atom {declared}",
        *(f"set atom {i} {set_} {-f:.17g}" for i, f in enumerate(force, 1) if f),
        f"variable crib atom {read}",
        "fix crib_weight grains addforce 0.0 0.0 v_crib\n",
    ])  # fmt: skip


def bound_box(
    container: Container, radius: FloatArray, height: float
) -> tuple[FloatArray, FloatArray]:
    """Corners of the simulation box [m], shape (3,) each: the container and a margin about it."""
    margin = 4 * float(radius.max())
    low, high = bound_section(container)
    return np.array([*low, 0.0]) - margin, np.array([*high, height]) + margin


def place_piston_atom(container: Container, radius: FloatArray) -> tuple[float, float]:
    """Where the atom of the piston's mass is parked [m]: in the box, beyond the piston's mesh.

    LIGGGHTS aborts without a word when an atom's centre lies in a mesh, of its group or not.
    """
    _, high = bound_section(container)
    away = PISTON_MARGIN + 1.5
    return high[0] + away * float(radius.max()), high[1] + away * float(radius.max())


def bound_section(container: Container) -> tuple[tuple[float, float], tuple[float, float]]:
    """Lower and upper corner of the horizontal section [m]."""
    if container.shape == "box":
        return (0.0, 0.0), (container.size_x, container.size_y)
    radius = container.radius
    low = [0.0 if axis in container.symmetry else -radius for axis in "xy"]
    return (low[0], low[1]), (radius, radius)


def cover_rectangle(
    container: Container, edges: tuple[float, float, float, float], margin: float
) -> list[tuple[float, float]]:
    """Corners [m] of the part of the section between ``edges`` [m], anticlockwise from the lowest;
    ``margin`` [m] wider where there is no edge."""
    low, high = bound_section(container)
    x0, y0 = (max(edge, end - margin) for edge, end in zip(edges[::2], low, strict=True))
    x1, y1 = (min(edge, end + margin) for edge, end in zip(edges[1::2], high, strict=True))
    return [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]


def clip_convex(polygon: FloatArray, floor: list[float]) -> FloatArray:
    """Part of a convex polygon, shape (n, 2), above ``floor`` along x and along y."""
    for axis in (0, 1):
        if np.isinf(floor[axis]):
            continue
        kept: list[FloatArray] = []
        for a, b in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
            if a[axis] >= floor[axis]:
                kept.append(a)
            if (a[axis] - floor[axis]) * (b[axis] - floor[axis]) < 0:
                share = (floor[axis] - a[axis]) / (b[axis] - a[axis])
                kept.append(a + share * (b - a))
        polygon = np.array(kept)
    return polygon


def gather_cycle_parameters(
    scene: Scene, start: EngineStart, cycles: int, folder: Path, own: Parameters
) -> Parameters:
    """Parameters of a window, an engine's ``own`` among those that LIGGGHTS and LAMMPS share.

    A load series goes to ``folder``.
    """
    loading, steps = scene.loading, scene.steps_per_cycle
    assert loading is not None
    parameters: Parameters = {
        "load_part": f"load_{loading.waveform}.in", "run_part": f"run_{loading.waveform}.in",
        "start_part": f"start_{start.kind}.in",
        "seat_part": f"seat_{'first' if start.first else 'none'}.in", "steps_per_cycle": steps,
        "run_steps": cycles * steps, "track_steps": steps // scene.samples_per_cycle,
        "piston_atom": 1 if scene.stones else scene.grain_count + 1, **own,
    }  # fmt: skip
    if start.kind == "perturbed":
        parameters["perturbation"] = start.perturbation
    if start.first:
        seat = asdict(plan_seating(scene))
        parameters |= {
            name if "release" in name else f"seat_{name}": value for name, value in seat.items()
        }
    if loading.samples is not None:
        force = loading.samples.stress * scene.loaded_area
        return parameters | {"steps_per_sample": _write_series(scene, force, cycles, folder)}
    assert loading.mean is not None
    assert loading.amplitude is not None
    return parameters | {
        "force_mean": loading.mean * scene.loaded_area,
        "force_amplitude": loading.amplitude * scene.loaded_area,
    }


def _write_series(scene: Scene, force: FloatArray, cycles: int, folder: Path) -> int:
    """Samples of a window's ``force`` [N], one a line, and their slopes a step; steps between
    samples."""
    steps = scene.steps_per_cycle // (len(force) - 1)
    # One sample more than segments: the next one is drawn after the last segment too.
    samples = np.append(np.tile(force[:-1], cycles), force[0])
    slopes = np.append(np.tile(np.diff(force) / steps, cycles), 0.0)
    np.savetxt(folder / "force.txt", samples, fmt="%.17g")
    np.savetxt(folder / "slope.txt", slopes, fmt="%.17g")
    return steps
