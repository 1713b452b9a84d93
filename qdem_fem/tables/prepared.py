"""A scene read and checked, and the checks that scenes of bodies and of a track share."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from qdem_fem.files import Integers
from qdem_fem.mesh import TetMesh
from qdem_fem.tables.keys import BodyTable, Output, Scene, SeriesTable, SimulationTable
from trackbed.run_files import digest_file
from trackbed.scene_files import Problem, SceneText, Table

ROWS_MOST = 100_000_000
"""Most rows of a table that is written."""


@dataclass(frozen=True)
class Step:
    """One call that puts a condition on the simulation."""

    key: str
    verb: str  # method of `qdem_fem.Simulation`
    body: str
    arguments: tuple[Any, ...]  # behind the body; values over time are `qdem_fem.Series`


@dataclass(frozen=True)
class Prepared:
    """A scene without a fault, and what it was checked with."""

    scene: Scene
    text: SceneText
    meshes: dict[str, TetMesh]
    conditions: list[Step]
    probes: dict[str, tuple[str, Integers]]  # name -> body and nodes
    files: dict[str, str]  # each file that the scene names, as it is written there, and its SHA-256


def list_tables(text: SceneText, *kinds: Any) -> Iterator[tuple[str, Any]]:
    """Key and table of every sound table of these kinds."""
    for key, table in text.tables.items():
        if isinstance(table, kinds):
            yield key, table


def find_output_faults(text: SceneText) -> Iterator[Problem]:
    """What duration, step and intervals demand of one another."""
    simulation = text.tables.get("simulation")
    output = text.tables.get("output", Output())
    if not isinstance(simulation, SimulationTable) or not isinstance(output, Output):
        return
    duration = simulation.duration
    if simulation.method == "static":
        if simulation.mass_scaling is not None:
            what = "a static answer has no time step, and the mass added would weigh: leave it out"
            yield Problem("simulation.mass_scaling", what)
        return
    if duration is None:
        yield Problem("simulation.duration", "missing: a dynamic run needs it")
        return
    if simulation.step is not None and simulation.step > duration:
        yield Problem("simulation.step", f"must not exceed the duration, {duration:g} s")
    for name in ("sampling", "energy_interval", "vtu_interval"):
        interval = getattr(output, name)
        if interval is None:
            continue
        most = 1e6 if name == "vtu_interval" else ROWS_MOST
        if interval > duration:
            yield Problem(f"output.{name}", f"must not exceed the duration, {duration:g} s")
        elif duration / interval > most:
            what = f"too short: it would be met {duration / interval:.3g} times"
            yield Problem(f"output.{name}", what)


def list_named_files(text: SceneText, folder: Path) -> Iterator[tuple[str, str]]:
    """Files that a sound scene names, and their SHA-256."""
    names = {body.mesh.file for _, body in list_tables(text, BodyTable) if body.mesh.file}
    for _, table in list_tables(text, Table):
        for series in dict(table).values():
            if isinstance(series, SeriesTable) and series.csv:
                names.add(series.csv)
    for name in sorted(names):
        yield name, digest_file(folder / name)
