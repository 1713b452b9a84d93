"""Files of one LIGGGHTS run: materials and walls, columns, the piston's mesh, moved grains."""

from pathlib import Path

import numpy as np

from adapters.bed import WHOLE, Container, FloatArray
from adapters.engines import decks
from adapters.engines.contract import EngineStart
from adapters.files import Frame, write_dump
from adapters.scene import Scene

MIRROR_YOUNG = 1e15
"""Young's modulus of a mirror plane [Pa]: a rigid frictionless plane under a sphere has the
stiffness and the damping of the mirrored pair exactly; a finite one is softer."""
PISTON_EDGE = 0.02
"""Least edge of a partial piston's mesh where a mirror cuts it, in its reach: LIGGGHTS refuses a
triangle with an angle below 0.0045 rad, half the edge in a fan about a corner."""


def format_scene(scene: Scene) -> str:
    """``scene.in``: material table and walls that the scene names.

    Without friction between grains and at walls there is no tangential law at all.
    """
    grain, wall = scene.material.grain, scene.material.wall
    mirrors = bool(scene.container.symmetry)
    young = [grain.young, wall.young] + [MIRROR_YOUNG] * mirrors
    poisson = [grain.poisson, wall.poisson] + [grain.poisson] * mirrors
    types = len(young)
    friction, rolling = np.zeros((2, types, types))
    friction[0, 0] = grain.friction
    friction[0, 1] = friction[1, 0] = wall.friction
    rolling[0, 0] = grain.rolling_friction or 0.0
    rolling[0, 1] = rolling[1, 0] = wall.rolling_friction or 0.0

    def format_row(values: object) -> str:
        return " ".join(f"{v:.17g}" for v in np.ravel(values))  # type: ignore[call-overload]

    lines = [
        "# scene.in : generated; materials by atom type (1 grains, 2 walls"
        + (", 3 rigid mirror planes)" if mirrors else ")"),
        f"fix young all property/global youngsModulus peratomtype {format_row(young)}",
        f"fix poisson all property/global poissonsRatio peratomtype {format_row(poisson)}",
        "fix restitution all property/global coefficientRestitution peratomtypepair "
        f"{types} {format_row(np.full(types * types, scene.restitution))}",
    ]
    for name, matrix in (("Friction", friction), ("RollingFriction", rolling)):
        if matrix.any():
            lines.append(
                f"fix {name.lower()} all property/global coefficient{name} peratomtypepair "
                f"{types} {format_row(matrix)}"
            )
    lines += ["pair_style gran model ${contact_model}", "pair_coeff * *"]
    walls = scene.container.walls()
    primitives = [
        (name, mirror, f"{'xyz'[axis]}plane {place:.17g}")
        for name, mirror, axis, place, _ in walls.planes()
    ]
    if np.isfinite(walls.cylinder_radius):
        primitives.append(("cylinder", False, f"zcylinder {walls.cylinder_radius:.17g} 0.0 0.0"))
    for name, mirror, shape in primitives:
        # With friction 0 LIGGGHTS still damps a tangential velocity at the start of every run,
        # where a spring of length zero counts as sticking; a mirror knows no tangential force.
        model, kind = ("hertz", decks.MIRROR) if mirror else ("${contact_model}", decks.WALL)
        lines.append(
            f"fix {name} grains wall/gran model {model} primitive type {kind} {shape} "
            "store_force yes"
        )
    return "\n".join(lines) + "\n"


def format_dump_states(names: tuple[str, ...]) -> str:
    """``dump_states.in``: full-precision state of the grains at every cycle end."""
    columns = decks.STATE_COLUMNS.split()
    columns += [f"f_force_{name}[{axis}]" for name in names for axis in (1, 2, 3)]
    return (
        "# dump_states.in : generated\n"
        f"dump states grains custom ${{steps_per_cycle}} states.dump {' '.join(columns)}\n"
        f'dump_modify states sort id first yes format "%d{" %.17g" * (len(columns) - 1)}"\n'
    )


def write_piston_stl(
    path: Path, container: Container, reach: float, margin: float,
    edges: tuple[float, float, float, float] = WHOLE,
) -> None:  # fmt: skip
    """Mesh of the piston's face at height 0, normal down, as STL.

    A whole piston (``reach`` infinite) is a rectangle over the section and ``margin`` [m] more, or
    ends at the ``edges`` [m] of a block; a partial one is a disc of radius ``reach`` [m], cut
    ``margin`` behind the mirror planes so that the mirrored edge is covered.
    """
    import meshio

    if np.isinf(reach):
        corners = decks.cover_rectangle(container, edges, margin)
    else:
        angle = np.linspace(0.0, 2 * np.pi, 97)[:-1]
        circle = reach * np.column_stack([np.cos(angle), np.sin(angle)])
        floor = [-margin if axis in container.symmetry else -np.inf for axis in "xy"]
        cut = drop_near_corners(decks.clip_convex(circle, floor), floor, PISTON_EDGE * reach)
        corners = [tuple(point) for point in cut]
    fan = [[0, i + 1, i] for i in range(1, len(corners) - 1)]
    points = np.column_stack([np.array(corners), np.zeros(len(corners))])
    meshio.Mesh(points, [("triangle", np.array(fan))]).write(path, file_format="stl", binary=False)


def drop_near_corners(polygon: FloatArray, floor: list[float], least: float) -> FloatArray:
    """Corners of a clipped polygon, shape (n, 2) [m], without those near to where it was cut.

    A corner of the polygon itself that is nearer than ``least`` [m] to one on ``floor`` goes.
    """
    on_floor = np.any(polygon == np.array(floor), axis=1)
    if not on_floor.any():
        return polygon
    distance = np.linalg.norm(polygon[:, None] - polygon[on_floor], axis=2).min(axis=1)
    return polygon[on_floor | (distance >= least)]


def write_moved(container: Container, start: EngineStart, folder: Path) -> None:
    """``moved.dump``: grains at rest at their new places, the piston's atom at its height."""
    assert start.moved is not None
    moved = start.moved
    count = len(moved.radius)
    values = np.zeros((count + 1, 9))
    values[:-1, 0] = moved.identifier
    values[:-1, 1] = decks.GRAIN
    values[:-1, 2:5] = moved.position
    values[:-1, 8] = moved.radius
    x, y = decks.place_piston_atom(container, moved.radius)
    radius = float(moved.radius.min())
    values[-1] = [count + 1, decks.WALL, x, y, start.piston_height, 0.0, 0.0, 0.0, radius]
    columns = ("id", "type", "x", "y", "z", "vx", "vy", "vz", "radius")
    box = decks.bound_box(container, moved.radius, float(moved.position[:, 2].max()))
    frame = Frame(start.time_step, columns, values, np.column_stack(box), "atoms")
    write_dump(folder / "moved.dump", [frame])
