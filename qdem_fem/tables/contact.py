"""The table ``[contact]`` of a scene: how bodies touch."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import Field, Tag

from qdem_fem.contact.search import PeriodicWidth
from qdem_fem.contact.spheres import NEAR, ContactPlane, SphereContact, check_planes_along
from qdem_fem.contact.surface import SurfaceContact
from qdem_fem.files import ConditionError
from qdem_fem.march import Contact
from qdem_fem.tables.types import Vector, make_discriminator
from trackbed.scene_files import Name, NonNegative, Positive, Table

NumberByBody = Annotated[
    Annotated[Positive, Tag("#number")] | Annotated[dict[Name, Positive], Tag("#table")],
    make_discriminator("#number", "#table"),
]


class PlaneTable(Table):
    """A rigid wall that does not move."""

    point: Vector  # on the wall [m]
    normal: Vector  # to the side where bodies are [-]
    friction: NonNegative | None = None  # by default that between bodies [-]


class PeriodicTable(Table):
    """A layer that repeats along an axis; bodies touch across its sides."""

    axis: Literal["x", "y", "z"]  # across its sides
    width: Positive  # along the axis [m]


class ContactTable(Table):
    """Contact between all bodies; left out of the kernel when not given."""

    model: Literal["spheres", "surface"]
    """Spheres at the vertices of the surface, as in the paper, or the surfaces themselves."""
    friction: NonNegative  # Coulomb's coefficient [-]
    contacts: Annotated[int, Field(ge=1, le=1000)] | Literal["near"] | None = None
    """Contacts of a vertex at once that the time step allows for, or those near it at first."""
    plane: Annotated[tuple[PlaneTable, ...], Field(strict=False)] = ()
    periodic: PeriodicTable | None = None
    """The width that contact repeats in; bodies have no sides to touch across when not given."""
    radius: NumberByBody | None = None  # of spheres [m]: a number, or by body
    normal_stiffness: NumberByBody | None = None
    """Of a pair of spheres of the body's material [N/m]: a number, or by body."""
    skin: Positive | None = None  # of the neighbour list of spheres [m]
    modulus: NumberByBody | None = None
    """Of two surfaces of the body's material [Pa/m]: a number, or by body."""
    points: Annotated[int, Field(ge=1, le=20)] | None = None
    """A face of a surface has that many points squared."""
    depth: Positive | None = None  # greatest depth of a surface in another [m]


NEEDED = {"spheres": ("radius", "normal_stiffness"), "surface": ("modulus",)}
"""Keys of each model that have no default."""
OPTIONS = {"spheres": ("skin", "contacts"), "surface": ("points", "depth", "contacts")}


def choose_contact(table: ContactTable | None) -> Contact | None:
    """The contact that a scene asks for."""
    if table is None:
        return None
    names = [*NEEDED[table.model], *OPTIONS[table.model]]
    given = {name: getattr(table, name) for name in names if getattr(table, name) is not None}
    planes = tuple(ContactPlane(p.point, p.normal, p.friction) for p in table.plane)
    if table.model == "spheres" and table.periodic is not None:
        given["periodic"] = PeriodicWidth(table.periodic.axis, table.periodic.width)
    made = SphereContact if table.model == "spheres" else SurfaceContact
    return made(friction=table.friction, planes=planes, **given)


def find_contact_faults(
    table: ContactTable, simulation: Any, names: Sequence[str]
) -> Iterator[tuple[str, str]]:
    """Key and sentence of what does not fit the rest of the scene.

    ``simulation``: its `SimulationTable`, or None where that has a fault of its own; ``names`` of
    all bodies.
    """
    known = {*NEEDED[table.model], *OPTIONS[table.model]}
    for key in sorted({key for keys in (*NEEDED.values(), *OPTIONS.values()) for key in keys}):
        if getattr(table, key) is not None and key not in known:
            yield f"contact.{key}", f"the model {table.model!r} does not use it"
    for quantity in NEEDED[table.model]:
        given = getattr(table, quantity)
        if given is None:
            yield f"contact.{quantity}", f"missing: the model {table.model!r} needs it"
        if isinstance(given, Mapping):
            for name in given:
                if name not in names:
                    yield f"contact.{quantity}.{name}", f"there is no body {name!r}"
            missing = [name for name in names if name not in given]
            if missing:
                yield f"contact.{quantity}", f"body {missing[0]!r} has none"
    if table.model == "surface" and table.contacts == NEAR:
        yield "contact.contacts", "'near' is for spheres: give a number"
    if table.model == "surface" and table.periodic is not None:
        yield "contact.periodic", "a width is for spheres: take walls or rollers at its sides"
    for number, plane in enumerate(table.plane):
        if not any(plane.normal):
            yield f"contact.plane.{number}.normal", "has no direction"
        elif table.periodic is not None:
            try:
                check_planes_along(
                    PeriodicWidth(table.periodic.axis, table.periodic.width),
                    [ContactPlane(plane.point, plane.normal)],
                )
            except ConditionError as error:
                yield f"contact.plane.{number}.normal", error.what
    if simulation is None:
        return
    if simulation.method == "static":
        what = "bodies in contact have no static answer here: march with viscosity"
        yield "simulation.method", what
    if simulation.precision == "float32":
        yield "simulation.precision", "contact is computed in double precision"
    if table.model == "surface" and simulation.device == "cuda":
        yield "simulation.device", "contact of surfaces is computed on the processor"
