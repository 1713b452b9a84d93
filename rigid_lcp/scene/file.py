"""Rigid scene files: TOML to a `Scene`, with every problem at once, each with its line and key."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.errors import ShapeError
from rigid_lcp.motion import Loads, Motion, Scene
from rigid_lcp.scene.types import BodyTable, Load, SceneTables, find_faults
from trackbed.scene_files import Guide, read_scene

GUIDE = Guide("pile", "run.duration=0.1")


@dataclass(frozen=True)
class SceneFile:
    """A scene file as read and checked."""

    path: Path
    text: str
    tables: SceneTables
    overrides: tuple[str, ...] = ()


def scene_read(path: Path | str, overrides: Sequence[str] = ()) -> SceneFile:
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
    return SceneFile(text.path, text.text, tables, tuple(overrides))


# --- to a scene ---------------------------------------------------------------------------------


def scene_build(file: SceneFile) -> Scene:
    """Bodies of the file: ground first, then named bodies, then grains.

    Raises `ShapeError` and `SceneError` with the name of the body.
    """
    from rigid_lcp.scene.pouring import place_grains
    from rigid_lcp.shapes import HalfSpace

    tables = file.tables
    scene = Scene(tables.dimensions, tables.gravity)

    def own(table: Any) -> dict[str, Any]:
        return {
            name: value
            if (value := getattr(table, name)) is not None
            else getattr(tables.surface, name)
            for name in ("friction", "restitution")
        }

    for i, ground in enumerate(tables.ground):
        with name_shape(f"ground {i}"):
            plane = HalfSpace(ground.normal, ground.offset)
        scene.add(plane, name=f"ground {i}", **own(ground))
    for body in tables.body:
        given: dict[str, Any] = {
            key: value
            for key in ("density", "position", "angle", "velocity", "spin")
            if (value := getattr(body, key)) is not None
        }
        shape = shape_of(body, tables.dimensions)
        number = scene.add(shape, fixed=body.fixed, name=body.name, **given, **own(body))
        if body.inertia is not None:
            scene.bodies[number] = replace(scene.bodies[number], inertia=body.inertia)
    for grains in tables.grains:
        for shape, position, angle in place_grains(grains, tables.dimensions):
            scene.add(shape, density=grains.density, position=position, angle=angle, **own(grains))
    return scene


@contextmanager
def name_shape(where: str) -> Iterator[None]:
    """Put the name of what has the shape into a `ShapeError`."""
    try:
        yield
    except ShapeError as error:
        raise ShapeError(error.what, where=where, remedy=error.remedy) from error


def shape_of(body: BodyTable, dim: int) -> Any:
    """The shape that a body's table names.  Raises `ShapeError` with the body's name."""
    with name_shape(f"body {body.name}"):
        if dim == 2:
            from rigid_lcp.shapes import Disc, Polygon

            if body.radius is not None:
                return Disc(body.radius)
            if body.box is not None:
                return Polygon.rectangle(*body.box)
            return Polygon(np.array(body.vertices))
        from rigid_lcp.shapes import Polyhedron, Sphere, box

        if body.radius is not None:
            return Sphere(body.radius)
        if body.box is not None:
            return box(*body.box)
        return Polyhedron(np.array(body.vertices))


def loads_of(file: SceneFile) -> Loads | None:
    """Forces of the scene's loads at a time, or None if it has none."""
    tables = file.tables
    if not tables.load:
        return None
    first = len(tables.ground)
    names = [body.name for body in tables.body]
    rows = [first + names.index(load.body) for load in tables.load]
    columns = 3 if tables.dimensions == 2 else 6

    def loads(time: float, motion: Motion) -> NDArray[np.float64]:
        forces = np.zeros((len(motion.position), columns))
        for row, load in zip(rows, tables.load, strict=True):
            forces[row, : tables.dimensions] += force_at(load, time)
        return forces

    return loads


def force_at(load: Load, time: float) -> NDArray[np.float64]:
    """Force of a load [N] at a time [s]: cyclic ones start at their least force, or its phase."""
    most = np.array(load.force)
    if time < load.begin or (load.end is not None and time > load.end):
        return np.zeros_like(most)
    if load.frequency is None:
        return most
    least = np.zeros_like(most) if load.least is None else np.array(load.least)
    angle = 2 * np.pi * load.frequency * (time - load.begin) + load.phase
    return np.asarray(least + (0.5 - 0.5 * np.cos(angle)) * (most - least))
