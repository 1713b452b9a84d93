"""Rigid scene files: TOML to a `Scene`, with every problem at once, each with its line and key."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import product
from math import ceil, inf
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from rigid_lcp import shapes
from rigid_lcp.arrays import Floats
from rigid_lcp.errors import SceneError, ShapeError
from rigid_lcp.motion import Loads, Motion, Scene
from rigid_lcp.scene.types import (
    BodyTable,
    Grains,
    Load,
    Poured,
    SceneTables,
    Stones,
    find_faults,
    list_surfaces,
    plan_steps,
)
from trackbed.errors import MeshError
from trackbed.plausible import describe_implausible
from trackbed.scene_files import (
    Guide,
    Problem,
    describe_error,
    draw_sizes,
    make_grading,
    read_scene,
    refuse_outside_limits,
)

GUIDE = Guide("pile", "run.duration=0.1")
ENDINGS = (".stl", ".obj", ".ply")
"""Of mesh files, in a folder of them."""
GRID_SPACING = 1.05
"""Distance of the grid points of grains over their largest diameter."""


@dataclass(frozen=True)
class SceneFile:
    """A scene file as read and checked."""

    text: str
    tables: SceneTables
    scans: tuple[tuple[shapes.Scan, ...], ...] = ()
    """Of each table of ``stones``, its mesh files as they were read."""
    unused: tuple[str, ...] = ()  # sentences on files that are no meshes, in folders of meshes

    @property
    def digests(self) -> dict[str, str]:
        """Digests of the mesh files, by name."""
        return {str(scan.path): scan.digest for scans in self.scans for scan in scans}


def load_scene(path: Path | str, overrides: Sequence[str] = ()) -> SceneFile:
    """Read and check a scene file.

    ``overrides`` such as ``run.duration=0.1`` or ``body.0.density=2000`` replace or add keys;
    values in TOML, a bare word is a string.  Raises `UsageError` when the file or an override can
    not be read, `SceneError` with all problems when the scene is not valid.
    """
    text = read_scene(path, overrides, guide=GUIDE)
    text.check(SceneTables)
    text.refuse(text.problems)
    tables = SceneTables.model_validate(text.data)
    text.refuse(find_faults(tables))
    scans, unused = [], []
    for number, stones in enumerate(tables.stones or ()):
        try:
            paths, others = find_meshes(stones, text.path.parent)
            scans.append(tuple(read_scans(stones, paths)))
            unused += others
        except (MeshError, ShapeError) as error:
            text.problems.append(
                Problem(f"stones.{number}.mesh", describe_error(error), error.where)
            )
    text.refuse(text.problems)
    return SceneFile(text.text, tables, tuple(scans), tuple(unused))


def find_meshes(stones: Stones, folder: Path) -> tuple[list[Path], list[str]]:
    """Mesh files of a table, whose paths are from ``folder``, and what is not used of folders."""
    paths: list[Path] = []
    unused: list[str] = []
    for path in (folder / name for name in stones.mesh):
        inside = sorted(path.glob("[!.]*"))
        meshes = [one for one in inside if one.suffix.lower() in ENDINGS]
        paths += meshes or [path]
        if meshes and (others := [one.name for one in inside if one not in meshes]):
            unused.append(f"{path}: not used, as no {', '.join(ENDINGS)}: {', '.join(others)}")
    return paths, unused


def read_scans(stones: Stones, paths: Sequence[Path]) -> Iterator[shapes.Scan]:
    """The scans of a table.  Raises as `rigid_lcp.shapes.read_scan`, and `ShapeError` for a hull
    with too much volume that the scan has not."""
    for path in paths:
        scan = shapes.read_scan(path, stones.unit, stones.corners)
        if scan.hull.volume > stones.hull_excess:
            raise ShapeError(
                f"its convex hull has {scan.hull.volume:.1%} more volume, above hull_excess",
                where=str(path),
                remedy="raise hull_excess, or cut the stone into convex parts and give one a file",
            )
        yield scan


def build_scene(file: SceneFile) -> Scene:
    """Bodies of the file: ground first, then named bodies, then grains.

    Raises `ShapeError` and `SceneError` with the name of the body.
    """
    tables = file.tables
    scene = Scene(tables.dimensions, tables.gravity)

    def merge(table: Any) -> dict[str, Any]:
        given = table.model_dump(include={"friction", "restitution"}, exclude_none=True)
        return tables.surface.model_dump() | given

    for i, ground in enumerate(tables.ground):
        with name_shape(f"ground {i}"):
            plane = shapes.HalfSpace(ground.normal, ground.offset)
        scene.add(plane, name=f"ground {i}", surface=f"ground.{i}", **merge(ground))
    for body in tables.body:
        keys = {"density", "position", "angle", "velocity", "spin", "fixed", "name"}
        shape, given = make_shape(body, tables.dimensions), body.model_dump(include=keys)
        number = scene.add(shape, **given, **merge(body), surface=body.name)
        if body.inertia is not None:
            scene.bodies[number] = replace(scene.bodies[number], inertia=body.inertia)
    for number, grains in enumerate(tables.grains):
        for shape, position, angle in place_grains(grains, tables.dimensions):
            scene.add(
                shape, density=grains.density, position=position, angle=angle, **merge(grains),
                surface=f"grains.{number}",
            )  # fmt: skip
    for number, (stones, scans) in enumerate(zip(tables.stones or (), file.scans, strict=True)):
        try:
            for shape, position, angle in place_stones(stones, scans):
                scene.add(
                    shape, density=stones.density, position=position, angle=angle, **merge(stones),
                    surface=f"stones.{number}",
                )  # fmt: skip
        except SceneError as error:
            raise error.relocate(f"stones.{number}.grading") from error
    known = list_surfaces(tables)
    for pair in tables.pair or ():
        for one, other in product(*(known[word] for word in pair.between)):
            scene.set_pair(one, other, friction=pair.friction, restitution=pair.restitution)
    return scene


def place_stones(
    stones: Stones, scans: Sequence[shapes.Scan]
) -> Iterator[tuple[shapes.Polyhedron, Floats, Floats]]:
    """Shape, position (3,) [m] and quaternion (4,) of every scanned stone.

    As many of each scan, whatever their size; on the grid of `place_grains`.  The same seed gives
    the same stones.  Raises `SceneError` for fewer stones than meet the limits of a grading.
    """
    random, count = np.random.default_rng(stones.seed), stones.count
    which = random.permutation(count) % len(scans)
    sizes = np.array([scans[k].size for k in which])
    if stones.grading is not None:
        grading = make_grading(stones.grading)
        sizes = draw_sizes(grading, count, random)
        refuse_outside_limits(grading, sizes)
    elif stones.size is not None:
        sizes = random.uniform(stones.size[0], stones.size[1], count)
    made = [scans[k].shape.scale(d / scans[k].size) for k, d in zip(which, sizes, strict=True)]
    cell = 2 * GRID_SPACING * max(shape.reach for shape in made)
    for shape, place in zip(made, lay_grid(stones, cell), strict=True):
        yield shape, place, random.normal(size=4)


def lay_grid(poured: Poured, cell: float) -> Iterator[Floats]:
    """Middles (dim,) [m] of cells of a side [m], row by row from below, as many as bodies."""
    low, high = np.array(poured.region_low), np.array(poured.region_high)
    across = np.maximum(1, np.floor((high - low)[:-1] / cell).astype(int))
    for number in range(poured.count):
        place = np.array(np.unravel_index(number % across.prod(), across), dtype=float)
        level = number // across.prod()
        yield low + cell * np.append(place + 0.5, level + 0.5)


def place_grains(grains: Grains, dim: int) -> Iterator[tuple[Any, Floats, Any]]:
    """Shape, position (dim,) [m] and angle [rad] (3D: quaternion (4,)) of every grain.

    The grid fills ``region`` row by row from below, and goes on above it.  The same seed gives the
    same grains.
    """
    random, draw = np.random.default_rng(grains.seed), shapes.get_shape(grains.shape)
    for position in lay_grid(grains, GRID_SPACING * grains.size[1]):
        diameter = random.uniform(grains.size[0], grains.size[1])
        corners = int(random.integers(grains.corners[0], grains.corners[1], endpoint=True))
        stone = draw(random, diameter, corners, dim)
        if dim == 2:
            angle = random.uniform(0, 2 * np.pi)
            # what was drawn lies in its cell, not the centroid
            yield stone, position + shapes.make_rotation(np.array([angle])) @ stone.centroid, angle
        else:
            yield stone, position, random.normal(size=4)


@contextmanager
def name_shape(where: str) -> Iterator[None]:
    """Put the name of what has the shape into a `ShapeError`."""
    try:
        yield
    except ShapeError as error:
        raise ShapeError(error.what, where=where, remedy=error.remedy) from error


def make_shape(body: BodyTable, dim: int) -> Any:
    """The shape that a body's table names.  Raises `ShapeError` with the body's name."""
    with name_shape(f"body {body.name}"):
        if body.radius is not None:
            return shapes.Disc(body.radius) if dim == 2 else shapes.Sphere(body.radius)
        if body.box is not None:
            return shapes.Polygon.rectangle(*body.box) if dim == 2 else shapes.make_box(*body.box)
        given = np.array(body.vertices)
        if dim == 2:
            return shapes.Polygon(given)
        shape = shapes.Polyhedron(given)
        refuse_lost_vertices(given, shape)
        return shape


def refuse_lost_vertices(given: Floats, shape: shapes.Polyhedron) -> None:
    """Raise `ShapeError` for vertices (n, 3) [m] that are no corners of their hull ``shape``: mass
    and inertia would be those of another body, as of a channel with its lid on."""
    apart, _ = cKDTree(shape.vertices + shape.centroid).query(given)
    lost = np.flatnonzero(apart > shapes.FLATNESS * shape.reach)
    if len(lost):
        raise ShapeError(
            f"it is not convex, or has needless vertices: {', '.join(map(str, lost[:5]))} "
            f"({len(lost)} of {len(given)}, counted from 0) are no corners of the hull",
            remedy="take the body apart into convex ones, or leave these vertices out",
        )


def list_doubts(tables: SceneTables, scans: Sequence[Sequence[shapes.Scan]] = ()) -> list[str]:
    """Sentences on values that are likely in another unit than SI, and on what is not used."""
    named: list[tuple[str, Any]] = [("surface", tables.surface)]
    for kind in ("ground", "body", "grains", "stones", "pair"):
        named += [(f"{kind}.{i}", one) for i, one in enumerate(getattr(tables, kind) or ())]
    found: list[str | None] = []
    for key, one in named:
        for quantity in ("friction", "density"):
            if (value := getattr(one, quantity, None)) is not None:
                found.append(describe_implausible(quantity, value, f"{key}.{quantity}"))
        if isinstance(one, Poured) and one.size:
            found.append(describe_implausible("grain", one.size[1], f"{key}.size"))
        if isinstance(one, BodyTable):
            edges = one.box or np.ptp(one.vertices or [[0.0]], axis=0)
            size = max(2 * (one.radius or 0.0), *edges)
            found.append(describe_implausible("body", float(size), key))
    for i, (stones, read) in enumerate(zip(tables.stones or (), scans, strict=False)):
        if stones.size is None and stones.grading is None:
            largest = max(scan.size for scan in read)
            found.append(describe_implausible("grain", largest, f"stones.{i}.unit"))
    return [*(said for said in found if said), *list_unused(tables)]


def list_unused(tables: SceneTables) -> Iterator[str]:
    """Sentences on keys that are given and change nothing in the run."""
    steps, step = plan_steps(tables.run)
    for i, body in enumerate(tables.body):
        given = [k for k in ("density", "velocity", "spin") if np.any(getattr(body, k) or 0.0)]
        if body.fixed and given:
            yield f"body.{i}: not used, as {body.name} is fixed: {', '.join(given)}; leave them out"
    for i, load in enumerate(tables.load):
        if not is_felt(load, tables):
            said = f"the run, {steps} steps of {step:g} s, takes no force between its begin and end"
            yield f"load.{i}: not used, as {said}; change these, or run.duration"
    worn = tables.grains or tables.stones or [b for b in tables.body if not (b.fixed or b.radius)]
    for name, act in (("wear", "wear"), ("strength", "break")):
        if (table := getattr(tables, name)) and not (worn and table.every <= steps):
            said = f"discs and spheres never {act}, others every {table.every} of {steps} steps"
            yield f"{name}: not used, as {said}; give another every, or leave the table out"


def is_felt(load: Load, tables: SceneTables) -> bool:
    """Whether a load acts in the middle of a step, or at acceleration level before the end."""
    steps, step = plan_steps(tables.run)
    first = max(ceil(load.begin / step - 0.5), 0)
    felt = first < steps and (first + 0.5) * step <= (load.end or inf)
    return felt or (tables.run.method == "acceleration" and load.begin < tables.run.duration)


def make_loads(file: SceneFile) -> Loads | None:
    """Forces of the scene's loads at a time, or None if it has none."""
    tables = file.tables
    if not tables.load:
        return None
    names = [body.name for body in tables.body]
    rows = [len(tables.ground) + names.index(load.body) for load in tables.load]
    columns = 3 if tables.dimensions == 2 else 6

    def sum_loads(time: float, motion: Motion) -> Floats:
        forces = np.zeros((len(motion.position), columns))
        for row, load in zip(rows, tables.load, strict=True):
            forces[row, : tables.dimensions] += find_force(load, time)
        return forces

    return sum_loads


def find_force(load: Load, time: float) -> Floats:
    """Force of a load [N] at a time [s]: cyclic ones start at their least force, or its phase."""
    most = np.array(load.force)
    if time < load.begin or (load.end is not None and time > load.end):
        return np.zeros_like(most)
    if load.frequency is None:
        return most
    least = np.zeros_like(most) if load.least is None else np.array(load.least)
    angle = 2 * np.pi * load.frequency * (time - load.begin) + load.phase
    return np.asarray(least + (0.5 - 0.5 * np.cos(angle)) * (most - least))
