"""Files of one LAMMPS run that depend on the scene: contact laws, walls, columns, moves, contacts.

Besides what `adapters.engines.decks` writes for LIGGGHTS too: ``piston_wall.in``, ``moved_x.txt``
and its sisters.
"""

from collections.abc import Iterator
from math import isinf, sqrt
from pathlib import Path

import numpy as np

from adapters.bed import WHOLE, Container, FloatArray, IntArray, State, contact_law
from adapters.engines.decks import PISTON_MARGIN, STATE_COLUMNS, cover_rectangle, place_piston_atom
from adapters.engines.plan import find_rolling_stiffness
from adapters.files import Frame, read_frames
from adapters.scene import Scene

TANGENTIAL = "mindlin_rescale/force"
"""What becomes of the tangential force when the normal force changes: the paper's rule.  LIGGGHTS'
is what LAMMPS calls ``mindlin``, YADE's ``mindlin/force``."""


def format_contact(
    modulus: float, shear: float, restitution: float, friction: float, rolling: str = ""
) -> str:
    """Words of a granular contact law: eqs 5 to 7 for E* = ``modulus`` and G* = ``shear`` [Pa].

    K_n = 4/3 E*, K_t = 8 G*; the damping is that of the ``restitution``, see
    `adapters.bed.contact_law`; along the tangent it is larger by sqrt(k_t/S_n) = sqrt(4 G*/E*), so
    that both have the same alpha.  Without ``friction`` there is no tangential force at all.
    ``rolling`` are words of `format_rolling`.
    """
    if friction > 0:
        ratio = sqrt(4 * shear / modulus)
        tangential = f"{TANGENTIAL} {8 * shear:.17g} {ratio:.17g} {friction:.17g}"
    else:
        tangential = "linear_nohistory 0.0 0.0"
    normal = f"hertz {4 / 3 * modulus:.17g} {restitution:.17g}"
    return f"{normal} tangential {tangential}{rolling} damping coeff_restitution"


def format_rolling(scene: Scene, friction: float | None) -> str:
    """Words of a spring and a slider that resist rolling: at most mu_r R* F_n; "" without."""
    spring = find_rolling_stiffness(scene)
    return f" rolling sds {spring:.17g} 0.0 {friction:.17g}" if friction else ""


def format_wall_contact(scene: Scene) -> str:
    """`format_contact` between a grain and a wall."""
    grain, wall = scene.material.grain, scene.material.wall
    shear = contact_law.combine_shear_moduli(grain.young, grain.poisson, wall.young, wall.poisson)
    rolling = format_rolling(scene, wall.rolling_friction)
    return format_contact(scene.stiffness.wall, shear, scene.restitution, wall.friction, rolling)


def find_shear_modulus(scene: Scene) -> float:
    """G* between two grains [Pa]."""
    one = scene.material.grain.young, scene.material.grain.poisson
    return contact_law.combine_shear_moduli(*one, *one)


def format_scene(scene: Scene) -> str:
    """``scene.in``: contact law between grains, and every wall that stands still.

    The cylinder is curved for LAMMPS, which takes
    1/R* = 1/R - 1/(2 R_c) with its radius R_c where LIGGGHTS takes 1/R* = 1/R.
    """
    grain = scene.material.grain
    between = format_contact(
        scene.stiffness.grain, find_shear_modulus(scene), scene.restitution, grain.friction,
        format_rolling(scene, grain.rolling_friction),
    )  # fmt: skip
    wall = format_wall_contact(scene)
    mirror = format_contact(scene.stiffness.mirror, 0.0, scene.restitution, 0.0)
    lines = [
        "# scene.in : generated; contact laws: 4/3 E*, restitution; tangential rule, 8 G*, damping"
        " ratio, friction",
        f"pair_coeff * * {between}",
    ]
    walls = scene.container.walls()
    for name, frictionless, axis, place, sense in walls.planes():
        sides = f"{place:.17g} NULL" if sense > 0 else f"NULL {place:.17g}"
        law = mirror if frictionless else wall
        lines.append(
            f"fix {name} grains wall/gran granular {law} {'xyz'[axis]}plane {sides} contacts"
        )
    if np.isfinite(walls.cylinder_radius):
        lines += [
            f"region cylinder cylinder z 0.0 0.0 {walls.cylinder_radius:.17g} INF INF units box",
            f"fix cylinder grains wall/gran/region granular {wall} region cylinder contacts",
        ]
    return "\n".join(lines) + "\n"


def format_piston_wall(scene: Scene) -> str:
    """``piston_wall.in``: the piston's face at height 0, moved by ``v_piston_position``.

    A whole piston is a plane, a partial one the end of a cylinder of radius ``piston_reach``, or of
    a block.
    """
    motion = "move NULL NULL v_piston_position units box"
    if scene.piston_edges != WHOLE:
        margin = PISTON_MARGIN * scene.sample.radii.greatest
        (x0, y0), _, (x1, y1), _ = cover_rectangle(scene.container, scene.piston_edges, margin)
        ends = f"{x0:.17g} {x1:.17g} {y0:.17g} {y1:.17g}"
        region = f"block {ends} 0.0 INF side out {motion}"
    elif isinf(scene.piston_reach):
        region = f"plane 0.0 0.0 0.0 0.0 0.0 -1.0 {motion}"
    else:
        region = f"cylinder z 0.0 0.0 {scene.piston_reach:.17g} 0.0 INF side out {motion}"
    return (
        "# piston_wall.in : generated\n"
        f"region piston {region}\n"
        "fix piston_wall grains wall/gran/region granular "
        f"{format_wall_contact(scene)} region piston contacts\n"
    )


def format_dump_states(names: tuple[str, ...]) -> str:
    """``dump_states.in``: full-precision state of the grains at every cycle end.

    The force of a wall on a grain is in columns 2 to 4 of its fix.
    """
    columns = STATE_COLUMNS.split()
    first = len(columns) + 1
    forces = [(name, axis) for name in names for axis in (1, 2, 3)]
    columns += [f"f_{name}[{axis + 1}]" for name, axis in forces]
    renamed = " ".join(
        f"colname {first + i} f_force_{name}[{axis}]" for i, (name, axis) in enumerate(forces)
    )
    return (
        "# dump_states.in : generated\n"
        f"dump states grains custom ${{steps_per_cycle}} states.dump {' '.join(columns)}\n"
        f"dump_modify states sort id first yes format float %.17g {renamed}\n"
    )


def write_moved(folder: Path, container: Container, moved: State) -> None:
    """``moved_x.txt``, ``moved_y.txt``, ``moved_z.txt``: new places of grains and piston by id."""
    piston = (*place_piston_atom(container, moved.radius), moved.piston_height)
    identifier = np.append(moved.identifier, moved.identifier.max() + 1)
    for axis, name in enumerate("xyz"):
        rows = zip(identifier, [*moved.position[:, axis], piston[axis]], strict=True)
        text = "".join(f"{i} {place:.17g}\n" for i, place in rows)
        (folder / f"moved_{name}.txt").write_text(f"{len(identifier)}\n{text}")


COLUMNS = tuple(f"c_contact[{i}]" for i in range(1, 13))
"""Pair, normal and tangential force on the first grain, tangential spring, overlap."""


def convert_contact_frames(scene: Scene, folder: Path) -> Iterator[Frame]:
    """Frames of ``contacts.dump`` from ``pairs.dump`` and ``states.dump``; raises `DumpError`."""
    states = read_frames(folder / "states.dump")
    for pairs, grains in zip(read_frames(folder / "pairs.dump"), states, strict=True):
        values = convert_contacts(scene, pairs.values, grains)
        columns = COLUMNS if values.shape[1] == len(COLUMNS) else COLUMNS[:6]
        yield Frame(pairs.time_step, columns, values, pairs.bounds, "entries", pairs.boundary)


def convert_contacts(scene: Scene, pairs: FloatArray, grains: Frame) -> FloatArray:
    """Rows of `COLUMNS`, shape (m, 12); without friction pair, normal force, overlap, (m, 6).

    ``pairs``, shape (m, 9) or (m, 6): identifiers, normal force and, with friction, tangential
    force on the first grain [N], distance of the centres [m]; ``grains`` of the same instant.
    """
    held = np.searchsorted(grains.column("id"), pairs[:, :2])
    radius = grains.column("radius")[held]
    overlap = radius.sum(axis=1) - pairs[:, -1]
    if pairs.shape[1] == 6:
        return np.column_stack([pairs[:, :5], overlap])
    spring = find_elastic_displacement(scene, pairs[:, 5:8], overlap, grains, held)
    return np.column_stack([pairs[:, :8], spring, overlap])


def find_elastic_displacement(
    scene: Scene, force: FloatArray, overlap: FloatArray, grains: Frame, held: IntArray
) -> FloatArray:
    """Displacement delta_t that carries the elastic part of F_t = -k_t delta_t - c_t v_t [m].

    ``force`` F_t on the first grain [N], shape (m, 3); ``overlap`` [m]; ``held`` rows of the two
    grains, shape (m, 2).  LAMMPS keeps a force, or a displacement, and shows neither.
    """
    shear = find_shear_modulus(scene)
    radius, mass = grains.column("radius")[held], grains.column("mass")[held]
    reduced = radius.prod(axis=1) / radius.sum(axis=1)
    stiffness = contact_law.find_tangential_stiffness(overlap, shear, reduced)
    alpha = contact_law.find_alpha(scene.restitution)
    reduced_mass = mass.prod(axis=1) / mass.sum(axis=1)
    damping = 2 * contact_law.DAMPING_FACTOR * alpha * np.sqrt(reduced_mass * stiffness)
    position, velocity = grains.block("x", "y", "z")[held], grains.block("vx", "vy", "vz")[held]
    spin = grains.block("omegax", "omegay", "omegaz")[held]
    normal = position[:, 0] - position[:, 1]
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    approach = velocity[:, 0] - velocity[:, 1]
    sliding = approach - np.einsum("ma,ma->m", approach, normal)[:, None] * normal
    sliding -= np.cross(np.einsum("mi,mia->ma", radius, spin), normal)
    return -(force + damping[:, None] * sliding) / stiffness[:, None]
