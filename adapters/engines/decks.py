"""Input files of one LIGGGHTS run: static decks copied, what the scene names written beside them.

Static decks live in ``liggghts_inputs``; generated are ``parameters.in`` (numbers and the names
of the parts to include), ``scene.in`` (materials and walls), ``dump_states.in`` (columns),
``grains.data``, ``piston.stl``, ``moved.dump`` and the load samples.  A deck holds only what its
scene names.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping
from dataclasses import asdict
from importlib.resources import files
from pathlib import Path

import numpy as np

from adapters.bed import Container, FloatArray
from adapters.engines.contract import EngineStart
from adapters.engines.plan import plan_seating
from adapters.scene import Scene

LOOP_TIME = re.compile(r"^Loop time of (\S+) on", re.MULTILINE)
"""How LIGGGHTS and LAMMPS say how many seconds the time steps took."""

GRAIN, WALL, MIRROR = 1, 2, 3
"""Atom types: grains; walls, piston face and piston mass; mirror planes."""

MIRROR_YOUNG = 1e15
"""Young's modulus of a mirror plane [Pa]: a rigid frictionless plane under a sphere has the
stiffness and the damping of the mirrored pair exactly; a finite one is softer."""

PISTON_MARGIN = 1.0
"""By how much the piston's mesh is wider than the container, in greatest radii."""

PISTON_EDGE = 0.02
"""Least edge of a partial piston's mesh where a mirror cuts it, in its reach: LIGGGHTS refuses a
triangle with an angle below 0.0045 rad, half the edge in a fan about a corner."""

PARTS_PREPARE = ("in.prepare", "settings.in", "bed.in")
PARTS_CYCLES = ("in.cycles", "settings.in", "bed.in", "piston.in")


def copy_deck(
    folder: Path, parts: tuple[str, ...], package: str = "liggghts_inputs"
) -> dict[str, str]:
    """Copy the named static decks of a package into ``folder``; returns the SHA-256 of each."""
    digests = {}
    for name in parts:
        text = files(package).joinpath(name).read_bytes()
        (folder / name).write_bytes(text)
        digests[name] = hashlib.sha256(text).hexdigest()
    return digests


def format_parameters(parameters: Mapping[str, float | int | str]) -> str:
    """``parameters.in``: one ``variable NAME index VALUE`` a line; ``-var NAME VALUE`` beats it."""
    lines = ["# parameters.in : generated; SI units"]
    for name, value in parameters.items():
        text = f"{value:.17g}" if isinstance(value, float) else str(value)
        lines.append(f"variable {name} index {text}")
    return "\n".join(lines) + "\n"


def scene_text(
    container: Container,
    grain: tuple[float, float],
    wall: tuple[float, float],
    restitution: float,
    friction: tuple[float, float],
) -> str:
    """``scene.in``: material table and walls that the scene names.

    ``grain`` and ``wall`` are Young's modulus [Pa] and Poisson's ratio; ``friction`` is that
    between grains and that between grain and wall (both 0: no tangential law at all).
    """
    mirrors = bool(container.symmetry)
    young = [grain[0], wall[0]] + [MIRROR_YOUNG] * mirrors
    poisson = [grain[1], wall[1]] + [grain[1]] * mirrors
    types = len(young)
    pairs = np.zeros((types, types))
    pairs[0, 0] = friction[0]
    pairs[0, 1] = pairs[1, 0] = friction[1]

    def row(values: object) -> str:
        return " ".join(f"{v:.17g}" for v in np.ravel(values))  # type: ignore[call-overload]

    lines = [
        "# scene.in : generated; materials by atom type (1 grains, 2 walls"
        + (", 3 rigid mirror planes)" if mirrors else ")"),
        f"fix young all property/global youngsModulus peratomtype {row(young)}",
        f"fix poisson all property/global poissonsRatio peratomtype {row(poisson)}",
        "fix restitution all property/global coefficientRestitution peratomtypepair "
        f"{types} {row(np.full(types * types, restitution))}",
    ]
    if any(friction):
        lines.append(
            f"fix friction all property/global coefficientFriction peratomtypepair "
            f"{types} {row(pairs)}"
        )
    lines += ["pair_style gran model ${contact_model}", "pair_coeff * *"]
    for name, kind, shape in list_wall_primitives(container):
        # With friction 0 LIGGGHTS still damps a tangential velocity at the start of every run,
        # where a spring of length zero counts as sticking; a mirror knows no tangential force.
        model = "hertz" if kind == MIRROR else "${contact_model}"
        lines.append(
            f"fix {name} grains wall/gran model {model} primitive type {kind} {shape} "
            "store_force yes"
        )
    return "\n".join(lines) + "\n"


def list_wall_primitives(container: Container) -> list[tuple[str, int, str]]:
    """Name, atom type and LIGGGHTS primitive of every wall of the container."""
    walls = container.walls()
    primitives = [
        (name, MIRROR if mirror else WALL, _plane_text(point, normal))
        for name, mirror, point, normal in zip(
            walls.plane_name,
            walls.plane_frictionless,
            walls.plane_point,
            walls.plane_normal,
            strict=True,
        )
    ]
    if np.isfinite(walls.cylinder_radius):
        primitives.append(("cylinder", WALL, f"zcylinder {walls.cylinder_radius:.17g} 0.0 0.0"))
    return primitives


def _plane_text(point: FloatArray, normal: FloatArray) -> str:
    axis = int(np.argmax(np.abs(normal)))
    return f"{'xyz'[axis]}plane {point[axis]:.17g}"


def wall_names(container: Container, piston: bool) -> tuple[str, ...]:
    """Names of all walls in the order of the columns of ``states.dump``."""
    names = tuple(name for name, _, _ in list_wall_primitives(container))
    return (*names, "piston_wall") if piston else names


def format_dump_states(names: tuple[str, ...]) -> str:
    """``dump_states.in``: full-precision state of the grains at every cycle end."""
    columns = ["id", "x", "y", "z", "vx", "vy", "vz", "omegax", "omegay", "omegaz"]
    columns += ["radius", "mass"]
    columns += [f"f_force_{name}[{axis}]" for name in names for axis in (1, 2, 3)]
    return (
        "# dump_states.in : generated\n"
        f"dump states grains custom ${{steps_per_cycle}} states.dump {' '.join(columns)}\n"
        f'dump_modify states sort id first yes format "%d{" %.17g" * (len(columns) - 1)}"\n'
    )


def format_grains_data(
    position: FloatArray,
    radius: FloatArray,
    density: float,
    container: Container,
    height: float,
    piston_mass: float | None,
) -> str:
    """``grains.data``: centres (n, 3) and radii (n,) [m], density [kg/m^3], box to ``height`` [m].

    With a piston, one more atom of mass ``piston_mass`` [kg] is parked outside the container;
    it touches nothing and gives the piston face its inertia.
    """
    low, high = bound_box(container, radius, height)
    rows = [
        f"{i} {GRAIN} {2 * r:.17g} {density:.17g} {x[0]:.17g} {x[1]:.17g} {x[2]:.17g}"
        for i, (x, r) in enumerate(zip(position, radius, strict=True), 1)
    ]
    if piston_mass is not None:
        r = float(radius.min())
        x = (*place_piston_atom(container, radius), height)
        piston_density = piston_mass / (4 / 3 * np.pi * r**3)
        rows.append(
            f"{len(radius) + 1} {WALL} {2 * r:.17g} {piston_density:.17g} "
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


def write_piston_stl(path: Path, container: Container, reach: float, margin: float) -> None:
    """Mesh of the piston's face at height 0, normal down, as STL.

    A whole piston (``reach`` infinite) is a rectangle over the section and ``margin`` [m] more;
    a partial one a disc of radius ``reach`` [m], cut ``margin`` behind the mirror planes so
    that the mirrored edge is covered.
    """
    import meshio

    low, high = bound_section(container)
    if np.isinf(reach):
        (x0, y0), (x1, y1) = low, high
        corners = [(x0 - margin, y0 - margin), (x1 + margin, y0 - margin)]
        corners += [(x1 + margin, y1 + margin), (x0 - margin, y1 + margin)]
    else:
        angle = np.linspace(0.0, 2 * np.pi, 97)[:-1]
        circle = reach * np.column_stack([np.cos(angle), np.sin(angle)])
        floor = [-margin if axis in container.symmetry else -np.inf for axis in "xy"]
        cut = corners_apart(clip_convex(circle, floor), floor, PISTON_EDGE * reach)
        corners = [tuple(point) for point in cut]
    fan = [[0, i + 1, i] for i in range(1, len(corners) - 1)]
    points = np.column_stack([np.array(corners), np.zeros(len(corners))])
    meshio.Mesh(points, [("triangle", np.array(fan))]).write(path, file_format="stl", binary=False)


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


def corners_apart(polygon: FloatArray, floor: list[float], least: float) -> FloatArray:
    """Corners of a clipped polygon, shape (n, 2) [m], without those near to where it was cut.

    A corner of the polygon itself that is nearer than ``least`` [m] to one on ``floor`` goes.
    """
    on_floor = np.any(polygon == np.array(floor), axis=1)
    if not on_floor.any():
        return polygon
    distance = np.linalg.norm(polygon[:, None] - polygon[on_floor], axis=2).min(axis=1)
    return polygon[on_floor | (distance >= least)]


def write_grains(
    scene: Scene, position: FloatArray, radius: FloatArray, height: float, folder: Path
) -> None:
    """``grains.data`` of a rain from start positions [m], shape (n, 3), below ``height`` [m]."""
    piston_mass = None if scene.loading is None else scene.loading.piston_mass
    density = scene.material.grain.density
    text = format_grains_data(position, radius, density, scene.container, height, piston_mass)
    (folder / "grains.data").write_text(text)


def gather_cycle_parameters(
    scene: Scene,
    start: EngineStart,
    cycles: int,
    output_part: str,
    folder: Path,
    own: Mapping[str, float | int | str],
) -> dict[str, float | int | str]:
    """Parameters of a window, an engine's ``own`` among those that LIGGGHTS and LAMMPS share.

    A load series goes to ``folder``.
    """
    loading, steps = scene.loading, scene.steps_per_cycle
    assert loading is not None
    parameters: dict[str, float | int | str] = {
        "load_part": f"load_{loading.waveform}.in",
        "run_part": f"run_{loading.waveform}.in",
        "output_part": output_part,
        "start_part": f"start_{start.kind}.in",
        "seat_part": f"seat_{'first' if start.first else 'none'}.in",
        "steps_per_cycle": steps,
        "run_steps": cycles * steps,
        "track_steps": steps // scene.samples_per_cycle,
        "piston_atom": scene.grain_count + 1,
        **own,
    }
    if start.kind == "perturbed":
        parameters["perturbation"] = start.perturbation
    if start.first:
        seat = asdict(plan_seating(scene))
        parameters |= {
            name if "release" in name else f"seat_{name}": value for name, value in seat.items()
        }
    if loading.samples is not None:
        return parameters | {"steps_per_sample": _write_series(scene, cycles, folder)}
    assert loading.mean is not None
    assert loading.amplitude is not None
    return parameters | {
        "force_mean": loading.mean * scene.loaded_area,
        "force_amplitude": loading.amplitude * scene.loaded_area,
    }


def parts_named(parameters: Mapping[str, float | int | str]) -> tuple[str, ...]:
    """Static parts of a window's deck that depend on the scene or on where the window starts."""
    return tuple(str(value) for name, value in parameters.items() if name.endswith("_part"))


def _write_series(scene: Scene, cycles: int, folder: Path) -> int:
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
