"""The table ``[contact]`` of a scene: how bodies touch."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from qdem_fem.contact_spheres import CONTACTS, ContactPlane, SphereContact
from qdem_fem.scene_types import Name, NonNegative, Positive, Table, Vector, number_or_table

NumberByBody = Annotated[
    Annotated[Positive, Tag("#number")] | Annotated[dict[Name, Positive], Tag("#table")],
    Discriminator(number_or_table),
]


class PlaneTable(Table):
    """A rigid wall that does not move."""

    point: Vector
    """[m]"""
    normal: Vector
    """To the side where bodies are."""
    friction: NonNegative | None = None
    """By default that between bodies."""


class ContactTable(Table):
    """Contact between all bodies; left out of the kernel when not given."""

    model: Literal["spheres"]
    """At the vertices of the surface, as in the paper."""
    radius: NumberByBody
    """[m]: a number, or by body."""
    normal_stiffness: NumberByBody
    """Of a pair of the body's material [N/m]: a number, or by body."""
    friction: NonNegative
    """Coulomb's coefficient."""
    skin: Positive | None = None
    """Of the neighbour list [m]."""
    contacts: Annotated[int, Field(ge=1, le=1000)] = CONTACTS
    """Contacts of a vertex at once that the time step allows for."""
    plane: Annotated[tuple[PlaneTable, ...], Field(strict=False)] = ()


def contact_of(table: ContactTable | None) -> SphereContact | None:
    """The contact that a scene asks for."""
    if table is None:
        return None
    return SphereContact(
        radius=table.radius,
        normal_stiffness=table.normal_stiffness,
        friction=table.friction,
        planes=tuple(ContactPlane(p.point, p.normal, p.friction) for p in table.plane),
        skin=table.skin,
        contacts=table.contacts,
    )


def contact_faults(
    table: ContactTable, simulation: Any, names: Sequence[str]
) -> Iterator[tuple[str, str]]:
    """Key and sentence of what does not fit the rest of the scene.

    ``simulation``: its `SimulationTable`, or None where that has a fault of its own; ``names`` of
    all bodies.
    """
    for quantity in ("radius", "normal_stiffness"):
        given = getattr(table, quantity)
        if isinstance(given, Mapping):
            for name in given:
                if name not in names:
                    yield f"contact.{quantity}.{name}", f"there is no body {name!r}"
            missing = [name for name in names if name not in given]
            if missing:
                yield f"contact.{quantity}", f"body {missing[0]!r} has none"
    for number, plane in enumerate(table.plane):
        if not any(plane.normal):
            yield f"contact.plane.{number}.normal", "has no direction"
    if simulation is None:
        return
    for key, wrong, said in (
        ("method", "static", "bodies in contact have no static answer here: march with viscosity"),
        ("precision", "float32", "contact is computed in double precision"),
        ("device", "cuda", "contact is computed on the processor"),
    ):
        if getattr(simulation, key) == wrong:
            yield f"simulation.{key}", said
