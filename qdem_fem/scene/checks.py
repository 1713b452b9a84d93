"""A scene checked as a whole: meshes, sets, nodes and series, all that is wrong at once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from qdem_fem import tables
from qdem_fem.element import MEASURES
from qdem_fem.files import Integers, MeshError, warn_user
from trackbed.scene_files import (
    Guide,
    Problem,
    SceneText,
    describe_error,
    read_scene,
    suggest_word,
)

if TYPE_CHECKING:
    from qdem_fem.mesh import TetMesh


GUIDE = Guide("cantilever", "simulation.duration=0.1")
HELD_MOST = 0.5  # share of a load's nodes that may be held, as those of an edge are, unwarned [-]
TRACK_GUIDE = Guide("track-small", "simulation.duration=0.1")
"""Of scenes with a table ``[track]``."""


def load_scene(path: Path | str, overrides: Sequence[str] = ()) -> tables.Prepared:
    """Read and check a whole scene with its meshes and series.

    Raises `SceneError` with all that is wrong (file, line, key and sentence of each), `UsageError`
    when the scene or an override can not be read.
    """
    text = read_scene(path, overrides, guide=GUIDE)
    if "track" in text.data:  # other scenes do not pay for its import
        from qdem_fem.track import TrackScene, check_track

        text.guide = TRACK_GUIDE
        text.check(TrackScene)
        return check_track(text)
    text.check(tables.Scene)
    problems = list(text.problems)
    folder = text.path.parent
    meshes, found = _make_meshes(text, folder)
    problems += found
    names = [entry["name"] for _, entry in _list_named_bodies(text)]
    conditions: list[tables.Step] = []
    for key, table in tables.list_tables(text, tables.Condition, tables.Periodic):
        if names and table.body not in names:
            near = suggest_word(table.body, names)
            problems.append(Problem(f"{key}.body", f"there is no body {table.body!r}{near}"))
        mesh = meshes.get(table.body)
        for step in _check_condition(key, table, mesh, folder):
            if isinstance(step, Problem):
                problems.append(step)
            else:
                conditions.append(step)
    problems += _find_vain_steps(conditions, meshes)
    probes: dict[str, tuple[str, Integers]] = {}
    for _, output in tables.list_tables(text, tables.Output):
        problems += _fill_probes(output, names, meshes, probes)
    problems += tables.find_output_faults(text)
    problems += find_motion_faults(text)
    for _, contact in tables.list_tables(text, tables.ContactTable):
        faults = tables.find_contact_faults(contact, text.tables.get("simulation"), names)
        problems += [Problem(*fault) for fault in faults]
    text.refuse(problems)
    scene = tables.Scene.model_validate(text.data)
    return tables.Prepared(
        scene, text, meshes, conditions, probes, dict(tables.list_named_files(text, folder))
    )


def _list_named_bodies(text: SceneText) -> Iterator[tuple[str, dict[str, Any]]]:
    """Key and entry of each body with a name, sound or not: a wrong one makes no other problem."""
    bodies = text.data.get("body")
    for index, entry in enumerate(bodies if isinstance(bodies, list) else []):
        if isinstance(entry, dict) and isinstance(entry.get("name"), str):
            yield f"body.{index}", entry


def _make_meshes(text: SceneText, folder: Path) -> tuple[dict[str, TetMesh], list[Problem]]:
    """The mesh of each body that has a sound one, and what is wrong with bodies."""
    meshes: dict[str, TetMesh] = {}
    problems: list[Problem] = []
    seen: dict[str, str] = {}
    for key, entry in _list_named_bodies(text):
        try:
            table = tables.Mesh.model_validate(entry.get("mesh"))
        except ValidationError:
            continue  # its faults are known
        name, body = entry["name"], text.tables.get(key)
        if name in seen:
            what = f"{seen[name]} has this name already"
            problems.append(Problem(f"{key}.name", what))
            continue
        seen[name] = key
        try:
            mesh = tables.make_body_mesh(table, folder, f"{key}.mesh")
        except tables.WrongKey as wrong:
            problems.append(wrong.problem)
            continue
        except MeshError as error:
            file = error.where if error.where.startswith("mesh file") else ""
            problems.append(Problem(f"{key}.mesh", describe_error(error), file))
            continue
        for region in body.regions if isinstance(body, tables.BodyTable) else ():
            if region not in mesh.element_sets:
                near = suggest_word(region, mesh.element_sets) or "; the mesh has no sets or groups"
                what = f"there is no element set {region!r}{near}"
                problems.append(Problem(f"{key}.regions.{region}", what))
        meshes[name] = mesh
    return meshes, problems


def _check_condition(
    key: str, table: Any, mesh: TetMesh | None, folder: Path
) -> Iterator[tables.Step | Problem]:
    """The call that a condition stands for, or everything that is wrong with it."""
    found: list[Problem] = []
    arguments: list[Any] = []  # of the method, in the order of the table's keys
    for name, value in dict(table).items():
        where = f"{key}.{name}"
        try:
            if isinstance(value, tables.Nodes):
                value = None if mesh is None else tables.find_named_nodes(value, mesh, where)
            elif name == "normal":
                value = tables.make_unit_vector(value, where)
            elif name in ("force", "pressure", "value"):
                value = tables.make_series(value, where, folder, vector=name == "force")
        except tables.WrongKey as wrong:
            found.append(wrong.problem)
        if name != "body":
            arguments.append(value)
    yield from found
    if not found and mesh is not None:
        yield tables.Step(key, type(table).__name__.lower(), table.body, tuple(arguments))


def _find_vain_steps(steps: list[tables.Step], meshes: dict[str, TetMesh]) -> Iterator[Problem]:
    """Motions prescribed where all is fixed; loads that mostly go into supports are warned of."""
    held = {name: np.zeros((len(mesh.nodes), 3), int) for name, mesh in meshes.items()}
    order = ("fix", "prescribe", "load", "pressure")
    for step in (one for verb in order for one in steps if one.verb == verb):
        own, nodes, given = held[step.body], *step.arguments[:2]
        if step.verb in order[:2]:
            at = np.ix_(nodes, ["xyz".index(letter) for letter in given])
            if step.verb == "prescribe" and (own[at] == 1).all():
                yield Problem(f"{step.key}.component", "[[fix]] keeps it at zero at all its nodes")
            own[at] = 1 + order.index(step.verb)
            continue
        still = own[nodes].all(axis=1, keepdims=True)  # whichever way a surface faces
        if step.verb == "load":
            still = own[nodes][:, given.values.any(axis=0)] > 0
        if (share := still.mean(axis=0).max(initial=0.0)) > HELD_MOST:
            warn_user(f"{step.key} acts on nodes of which {100 * share:.0f} % are held in its "
                      "direction: that share strains nothing")  # fmt: skip


def _fill_probes(
    output: tables.Output,
    names: Sequence[str],
    meshes: dict[str, TetMesh],
    probes: dict[str, tuple[str, Integers]],
) -> Iterator[Problem]:
    """Fill ``probes`` with name -> body and nodes."""
    for name, probe in output.probes.items():
        key = f"output.probes.{name}"
        body = probe.body or (names[0] if len(names) == 1 else None)
        if body is None:
            if names:
                yield Problem(f"{key}.body", "missing: there are several bodies")
        elif body not in names:
            if names:
                near = suggest_word(body, names)
                yield Problem(f"{key}.body", f"there is no body {body!r}{near}")
        elif body in meshes:
            try:
                probes[name] = (body, tables.find_named_nodes(probe, meshes[body], key))
            except tables.WrongKey as wrong:
                yield wrong.problem


def find_motion_faults(text: SceneText) -> Iterator[Problem]:
    """Bodies said to move at the start of what has no motion, or to turn in what can not."""
    simulation = text.tables.get("simulation")
    if not isinstance(simulation, tables.SimulationTable):
        return
    joined = {table.body for _, table in tables.list_tables(text, tables.Periodic)}
    turns = MEASURES[simulation.strain].OBJECTIVE
    for key, body in tables.list_tables(text, tables.BodyTable):
        if simulation.method == "static" and body.moves:
            name = "velocity" if body.velocity is not None else "spin"
            yield Problem(f"{key}.{name}", 'a static answer has no motion: method = "dynamic"')
        elif not turns and body.spin is not None and not body.rigid:
            what = "a body that turns is strained by it under strain = "
            what += f'"{simulation.strain}": take "finger"'
            yield Problem(f"{key}.spin", what)
        elif body.spin is not None and body.name in joined:
            yield Problem(
                f"{key}.spin", "a body that [[periodic]] joins to its images can not turn"
            )
