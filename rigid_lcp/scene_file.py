"""Scene files: TOML to a `Scene`, with every problem at once, each with its line and key."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ValidationError

from rigid_lcp.errors import SceneError, ShapeError, UsageError
from rigid_lcp.motion import Motion
from rigid_lcp.scene import Scene
from rigid_lcp.scene_input import Loads
from rigid_lcp.scene_types import BodyTable, Load, SceneTables

REMEDY = "correct these keys; scenes/pile.toml explains every key"


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
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")  # Windows editors put a mark at the begin
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(
            f"the scene can not be read ({error})", where=str(path), remedy="name a TOML file"
        ) from error
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise SceneError(
            f"this is no TOML ({error})", where=str(path), remedy="correct that line"
        ) from error
    for override in overrides:
        _override(data, override)
    try:
        tables = SceneTables.model_validate(data)
    except ValidationError as error:
        lines = [_problem(text, path, problem) for problem in error.errors()]
        head = "1 problem" if len(lines) == 1 else f"{len(lines)} problems"
        raise SceneError("\n  ".join([head, *lines]), where=str(path), remedy=REMEDY) from error
    return SceneFile(path, text, tables, tuple(overrides))


def _problem(text: str, path: Path, problem: Any) -> str:
    key = ".".join(str(part) for part in problem["loc"])
    line = key_line(text, [str(part) for part in problem["loc"]])
    if problem["type"] == "extra_forbidden":
        what, shown = f"unknown key{did_you_mean(problem['loc'])}", ""
    else:
        what = str(problem["msg"]).removeprefix("Value error, ")
        value = problem.get("input")
        shown = f", not {value!r}" if isinstance(value, bool | int | float | str) else ""
    return f"{path}{f':{line}' if line else ''}: {f'{key}: ' if key else ''}{what}{shown}"


def did_you_mean(key: Sequence[str | int]) -> str:
    """``; did you mean X?`` for the nearest of the keys of its table, or what they are.

    ``key``: the path to a key that the table has not, with the numbers of entries.
    """
    table: type[BaseModel] = SceneTables
    *tables, last = key
    for name in (part for part in tables if isinstance(part, str)):
        annotation = table.model_fields[name].annotation
        inner = [kind for kind in get_args(annotation) or (annotation,) if kind is not None]
        table = next(kind for kind in inner if issubclass(kind, BaseModel))
    near = get_close_matches(str(last).lower(), table.model_fields, n=1)
    return f"; did you mean {near[0]}?" if near else f"; known: {', '.join(table.model_fields)}"


def key_line(text: str, key: Sequence[str]) -> int:
    """Line of a key in a TOML text, or of the nearest table around it; 0 where there is none.

    ``key``: the path to it, with the number of the entry behind each list of tables.
    """
    lines: dict[tuple[str, ...], int] = {}
    entries: dict[str, int] = {}
    table: tuple[str, ...] = ()
    for number, line in enumerate(text.splitlines(), 1):
        if header := re.match(r"\s*(\[\[?)\s*([A-Za-z0-9_.-]+)\s*\]", line):
            name = header[2]
            table = tuple(name.split("."))
            if header[1] == "[[":
                entries[name] = entries.get(name, -1) + 1
                table += (str(entries[name]),)
            lines.setdefault(table, number)
        elif assigned := re.match(r"\s*([A-Za-z0-9_-]+)\s*=", line):
            lines.setdefault((*table, assigned[1]), number)
    paths = (tuple(key[:size]) for size in range(len(key), 0, -1))
    return next((lines[path] for path in paths if path in lines), 0)


def _override(data: dict[str, Any], override: str) -> None:
    key, equals, value = override.partition("=")
    if not equals or not key.strip():
        raise UsageError(
            f"--set {override!r} is no KEY=VALUE", remedy="write for example run.duration=0.1"
        )
    try:
        parsed = tomllib.loads(f"value = {value}")["value"]
    except (tomllib.TOMLDecodeError, RecursionError):
        parsed = value
    here: Any = data
    *tables, last = key.strip().split(".")
    try:
        for part in tables:
            here = here[int(part)] if isinstance(here, list) else here.setdefault(part, {})
        if isinstance(here, list):
            here[int(last)] = parsed
        else:
            here[last] = parsed
    except (IndexError, ValueError, AttributeError, TypeError) as error:
        raise UsageError(
            f"--set {override!r} names no key of the scene", remedy="entries of a list by number"
        ) from error


# --- to a scene ---------------------------------------------------------------------------------


def scene_build(file: SceneFile) -> Scene:
    """Bodies of the file: ground first, then named bodies, then grains.

    Raises `ShapeError` and `SceneError` with the name of the body.
    """
    from rigid_lcp.half_space import HalfSpace
    from rigid_lcp.pouring import grains_place

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
        with shape_named(f"ground {i}"):
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
        for shape, position, angle in grains_place(grains, tables.dimensions):
            scene.add(shape, density=grains.density, position=position, angle=angle, **own(grains))
    return scene


@contextmanager
def shape_named(where: str) -> Iterator[None]:
    """Put the name of what has the shape into a `ShapeError`."""
    try:
        yield
    except ShapeError as error:
        raise ShapeError(error.what, where=where, remedy=error.remedy) from error


def shape_of(body: BodyTable, dim: int) -> Any:
    """The shape that a body's table names.  Raises `ShapeError` with the body's name."""
    with shape_named(f"body {body.name}"):
        if dim == 2:
            from rigid_lcp.disc import Disc
            from rigid_lcp.polygon import Polygon

            if body.radius is not None:
                return Disc(body.radius)
            if body.box is not None:
                return Polygon.rectangle(*body.box)
            return Polygon(np.array(body.vertices))
        from rigid_lcp.polyhedron import Polyhedron, box
        from rigid_lcp.sphere import Sphere

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
