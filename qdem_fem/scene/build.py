"""A scene becomes a simulation: its meshes, its materials by element, its conditions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from qdem_fem.files import ConditionError, QdemError, Series
from qdem_fem.scene.doubts import warn_of_unused, warn_of_values
from qdem_fem.tables import BodyTable, choose_contact
from trackbed.scene_files import Problem, describe_error

if TYPE_CHECKING:
    from qdem_fem.bodies import Body
    from qdem_fem.mesh import TetMesh
    from qdem_fem.tables import Prepared

OPTIONS = (
    "strain", "precision", "step", "safety", "gravity", "threads", "device", "mass_scaling",
)  # fmt: skip
"""Keys of the table ``[simulation]`` that are options of a `qdem_fem.Simulation`."""


def make_simulation(prepared: Prepared) -> tuple[Any, dict[str, Any]]:
    """The `qdem_fem.Simulation` of a scene and its bodies by name.

    In a static scene each series gives its last value.  Raises `SceneError` with every condition
    that the simulation refuses.
    """
    from qdem_fem.bodies import Body, QuadraticBody
    from qdem_fem.march import Simulation, check_held

    warn_of_unused(prepared)
    if "track" in prepared.text.data:  # other scenes do not pay for its import
        from qdem_fem.track import TrackPrepared, enter_track

        assert isinstance(prepared, TrackPrepared)
        run, bodies = enter_track(prepared)
        warn_of_values(prepared.scene, bodies)
        return run, bodies
    scene, table = prepared.scene, prepared.scene.simulation
    bodies = {}
    for body in scene.body:
        mesh = prepared.meshes[body.name]
        kind = QuadraticBody if body.element == QuadraticBody.ELEMENT else Body
        bodies[body.name] = kind(mesh, _make_material(body, mesh), body.name, rigid=body.rigid)
    warn_of_values(scene, bodies)
    options: dict[str, Any] = {name: getattr(table, name) for name in OPTIONS}
    run = Simulation(list(bodies.values()), contact=choose_contact(scene.contact), **options)
    problems = []
    for step in prepared.conditions:
        arguments = [_choose_argument(value, table.method) for value in step.arguments]
        try:
            getattr(run, step.verb)(bodies[step.body], *arguments)
        except QdemError as error:
            problems.append(Problem(step.key, describe_error(error)))
    for number, moving in enumerate(scene.body):
        try:
            begin_motion(bodies[moving.name], moving)
        except QdemError as error:
            problems.append(Problem(f"body.{number}", describe_error(error)))
    prepared.text.refuse(problems)
    try:
        run.pack_lists()  # rollers against prescribed motions, what holds rigid bodies
        if table.method == "static":
            check_held(run)
        if scene.contact is not None and scene.contact.periodic is not None:
            contacts: Any = run.contacts  # of spheres: others have no width
            if (position := contacts.positions()) is not None:
                contacts.check_images(position)
    except ConditionError as error:
        where = error.where.replace("relax", "fix")
        if where in bodies:
            where = f"body.{list(bodies).index(where)}"
        prepared.text.refuse([Problem(where, describe_error(error))])
    return run, bodies


def begin_motion(body: Body, table: BodyTable) -> None:
    """Give a body the motion at the start that its table names: ``v + omega x (x - centre)``."""
    if not table.moves:
        return
    velocity, spin = (
        np.zeros(3) if v is None else np.array(v) for v in (table.velocity, table.spin)
    )
    body.velocity = velocity + np.cross(spin, body.nodes - body.rigid_mass.centre)


def _choose_argument(value: Any, method: str) -> Any:
    """What the simulation takes for an argument: the last value of a series that does not vary."""
    constant = isinstance(value, Series) and (method == "static" or len(value.times) == 1)
    return value.values[-1] if constant else value


def _make_material(body: BodyTable, mesh: TetMesh) -> Any:
    """Material of a body: uniform, or by element where regions differ."""
    from qdem_fem.element import Material

    values: dict[str, Any] = body.material.model_dump()
    for name, region in body.regions.items():
        for key, value in region.model_dump(exclude_none=True).items():
            if np.ndim(values[key]) == 0:
                values[key] = np.full(len(mesh.elements), values[key])
            values[key][mesh.element_sets[name]] = value
    return Material(**values)
