"""Scene files of lines: TOML to a `Line`, with every problem at once, each with line and key."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from track_line.beam import Track
from track_line.beds import Scatter, Zone
from track_line.laws import BedLoad, get_law, list_laws
from track_line.settling import Axle, Line, find_alert_limit, make_line
from trackbed.memory import refuse_more_memory
from trackbed.plausible import Quantity, describe_implausible
from trackbed.scene_files import (
    Guide,
    Name,
    NonNegative,
    Positive,
    Problem,
    Real,
    Table,
    read_scene,
    suggest_word,
)

GUIDE = Guide("line", "line.axles=1e7")
BYTES_A_BED = 250
"""Memory that a sleeper takes, for each realisation and kind of axle [bytes]; 140 measured."""

LEFT_OUT = (
    "dynamic wheel loads but those of an unsprung_mass on an even track: vehicles on their "
    "springs, wheels that are not round, sleepers as they pass",
    "axles near one another: each rolls by alone",
    "the other rail: no cant, no twist, no lateral forces",
    "unevenness of the rail itself, of welds and joints",
    "what tamping leaves behind: the memory of old voids, broken stones",
)
"""Physics that is not computed."""


class LineTable(Table):
    """How long, how many axles, how many lines."""

    length: Annotated[Real, Field(ge=60, le=20_000)]  # that counts [m]
    axles: Annotated[Real, Field(ge=1, le=1e9)]  # that roll by [-]
    speed: Positive  # of the line, which decides the limit [m/s]
    realisations: Annotated[int, Field(ge=1, le=10_000)] = 200  # lines with beds of their own
    seed: Annotated[int, Field(ge=0)] = 1  # of the beds
    limit: Positive | None = None  # standard deviation of D1 at which to tamp [m]


class LawTable(Table):
    """How beds settle."""

    name: Name  # a file of `track_line.laws`
    parameters: dict[Name, NonNegative] = Field({})  # in place of the law's own [SI]


class SceneTables(Table):
    """A whole scene file."""

    title: str = ""  # of the report
    line: LineTable
    track: Track = Track()
    axle: Annotated[list[Axle], Field(min_length=1, max_length=20)]
    scatter: Scatter = Scatter()
    law: LawTable
    zone: list[Zone] = Field([])


def find_faults(tables: SceneTables) -> Iterator[Problem]:
    """What the tables of a scene demand of one another."""
    law = tables.law
    if law.name not in list_laws():
        near = suggest_word(law.name, list_laws())
        yield Problem("law.name", f"there is no settlement law {law.name!r}{near}")
        return
    known = [one.name for one in fields(get_law(law.name))]  # type: ignore[arg-type]
    strange = [name for name in law.parameters if name not in known]
    for name in strange:
        yield Problem(f"law.parameters.{name}", f"unknown parameter{suggest_word(name, known)}")
    if not strange and not is_sound(tables):
        yield Problem("law.parameters", f"the law {law.name} finds no settlement with these")
    if tables.track.rail_mass == 0 and tables.track.sleeper_mass == 0:
        yield Problem("track", "a rail and sleepers without weight lie on no bed: give one a mass")
    place = np.arange(tables.line.length / tables.track.spacing + 1) * tables.track.spacing
    for i, zone in enumerate(tables.zone):
        if not 0 <= zone.begin <= zone.end <= tables.line.length:
            yield Problem(
                f"zone.{i}", f"from {zone.begin:g} to {zone.end:g} m is no part of the line, "
                f"which goes from 0 to {tables.line.length:g} m",
            )  # fmt: skip
        elif not zone.find_inside(place).any():
            yield Problem(f"zone.{i}", f"no sleeper lies from {zone.begin:g} to {zone.end:g} m")


def list_doubts(file: SceneFile) -> Iterator[str]:
    """Sentences on values that no track has: mostly numbers in another unit than SI."""
    track, line = file.tables.track, file.tables.line
    values: list[tuple[Quantity, float, str]] = [
        ("bending", track.bending, "track.bending"), ("stiffness", track.pad, "track.pad"),
        ("line_mass", track.rail_mass, "track.rail_mass"), ("stiffness", track.bed, "track.bed"),
        ("mass", track.sleeper_mass, "track.sleeper_mass"), ("speed", line.speed, "line.speed"),
        ("level", file.limit, "line.limit"),
    ]  # fmt: skip
    for i, one in enumerate(file.tables.axle):
        values += [
            ("axle", one.load, f"axle.{i}.load"),
            ("mass", one.unsprung_mass, f"axle.{i}.unsprung_mass"),
        ]
    yield from filter(None, (describe_implausible(*value) for value in values))


def is_sound(tables: SceneTables) -> bool:
    """Whether the law finds finite settlements under the wheels, of which some are above zero."""
    force = np.array([one.wheel for one in tables.axle])
    load = BedLoad(force, np.full_like(force, tables.track.bed))
    try:
        with np.errstate(all="ignore"):
            law = get_law(tables.law.name)(**tables.law.parameters)
            grown = law.advance(load, np.zeros_like(force), 0.0, tables.line.axles)
    except ArithmeticError:
        return False
    return bool(np.isfinite(grown).all() and (grown >= 0).all() and grown.any())


@dataclass(frozen=True)
class SceneFile:
    """A scene file as read and checked."""

    text: str
    tables: SceneTables

    @property
    def limit(self) -> float:
        """Standard deviation of D1 at which to tamp [m]."""
        line = self.tables.line
        return find_alert_limit(line.speed) if line.limit is None else line.limit

    @property
    def rolling_speed(self) -> float | None:
        """Speed where forces depend on it [m/s]; None where it decides the limit alone."""
        dynamic = any(one.unsprung_mass for one in self.tables.axle)
        return self.tables.line.speed if dynamic else None


def load_scene(path: Path | str, overrides: Sequence[str] = ()) -> SceneFile:
    """Read and check a scene file; ``overrides`` such as ``line.axles=1e7`` replace or add keys.

    Raises `UsageError` when the file or an override can not be read, `SceneError` with all
    problems when the scene is not valid.
    """
    text = read_scene(path, overrides, guide=GUIDE)
    text.check(SceneTables)
    text.refuse(text.problems)
    tables = SceneTables.model_validate(text.data)
    text.refuse(find_faults(tables))
    return SceneFile(text.text, tables)


def build_line(file: SceneFile, lines: int | None = None) -> Line:
    """The line of a scene, with its first ``lines`` realisations, or all of them.

    Raises `OutOfMemory` for more than there is room for.
    """
    tables = file.tables
    lines = tables.line.realisations if lines is None else lines
    beds = lines * tables.line.length / tables.track.spacing
    refuse_more_memory(
        BYTES_A_BED * beds * len(tables.axle), f"{lines} lines of {tables.line.length:g} m",
        "line.realisations", "ask for fewer realisations or a shorter line",
    )  # fmt: skip
    law = get_law(tables.law.name)(**tables.law.parameters)
    return make_line(
        tables.line.length, tables.track, law, tables.axle, tables.scatter, zones=tables.zone,
        lines=lines, seed=tables.line.seed, speed=tables.line.speed,
    )  # fmt: skip
