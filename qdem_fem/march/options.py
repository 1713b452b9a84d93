"""What the options of a simulation may be."""

from collections.abc import Iterable
from typing import Any

from qdem_fem.bodies import Body
from qdem_fem.contact.spheres import SphereContact
from qdem_fem.contact.surface import SurfaceContact
from qdem_fem.element import MEASURES
from qdem_fem.files import ConditionError, Driver, is_real

Contact = SphereContact | SurfaceContact
WORDS = {"strain": tuple(MEASURES), "precision": ("float64", "float32"), "device": ("cpu", "cuda")}


def list_bodies(bodies: Any) -> list[Body]:
    """The bodies of a simulation; those of one name get numbers: "body 0", "body 1", ...

    Raises `ConditionError` unless these are bodies, each once, that no simulation moves yet.
    """
    if not isinstance(bodies, Iterable):
        raise ConditionError(f"{bodies!r} is no list of bodies", where="simulation")
    own = list(bodies)
    if not own or not all(isinstance(body, Body) for body in own):
        raise ConditionError("give a list of at least one Body", where="simulation")
    if len({id(body) for body in own}) < len(own):
        raise ConditionError("a body is listed twice", where="simulation")
    names = [body.name for body in own]
    for number, body in enumerate(own):
        if body.mover is not None:
            raise ConditionError(
                f"{body.name} is in another simulation, which moves it",
                where="simulation",
                remedy="make another of the same mesh: Body(body.mesh, body.material)",
            )
        if names.count(body.name) > 1:
            body.name = f"{body.name} {number}"
    return own


def check_options(
    *, step: float | None, safety: float, threads: int | None, mass_scaling: float | None,
    **words: str,
) -> None:  # fmt: skip
    """Raise `ConditionError` for an option that there is not."""
    for name, word in words.items():
        if word not in WORDS[name]:
            raise ConditionError(
                f"{word!r} is none of {', '.join(WORDS[name])}", where=f"simulation, {name}"
            )
    numbers = {"step": step, "safety": safety, "threads": threads, "mass_scaling": mass_scaling}
    for name, number in numbers.items():
        if number is not None and not (is_real(number) and number > 0):
            raise ConditionError(f"{number!r} is not above zero", where=f"simulation, {name}")
    if safety > 1:
        raise ConditionError(
            f"{safety!r} of the critical step is not stable",
            where="simulation, safety", remedy="take at most 1, or give step= to see what happens",
        )  # fmt: skip
    if threads is not None and threads != int(threads):
        raise ConditionError(f"{threads!r} is no number of threads", where="simulation, threads")


def make_gravity(gravity: Any) -> Driver | None:
    """Gravity [m/s^2], three components; raises `ConditionError` for one that changes with time."""
    driver = None if gravity is None else Driver(gravity, 3, "gravity")
    if driver is not None and driver.varying is not None:
        raise ConditionError(
            "it does not change with time", where="gravity", remedy="load the bodies instead"
        )
    return driver


def check_contact(contact: Any, precision: str, device: str) -> None:
    """Raise `ConditionError` for a contact that such a simulation can not have."""
    if contact is None:
        return
    if not isinstance(contact, Contact):
        raise ConditionError(
            f"a {type(contact).__name__} is no contact",
            where="simulation, contact", remedy="give a SphereContact or a SurfaceContact",
        )  # fmt: skip
    if precision != "float64":
        raise ConditionError(
            "contact is computed in double precision",
            where="simulation, contact", remedy='take precision="float64"',
        )  # fmt: skip
    if device != "cpu" and not isinstance(contact, SphereContact):
        raise ConditionError(
            "contact of surfaces is computed on the processor",
            where="simulation, contact", remedy='take device="cpu", or a SphereContact',
        )  # fmt: skip


def check_elements(bodies: list[Body], device: str) -> None:
    """Raise `ConditionError` for elements that are not computed side by side, or not on a GPU."""
    kinds = {body.ELEMENT: body.name for body in bodies if not body.rigid}
    if len(kinds) > 1:
        (one, name), (other, second) = sorted(kinds.items())[:2]
        raise ConditionError(
            f"{name} is of {one} elements and {second} of {other} ones",
            where="simulation, element", remedy="give all bodies that deform one kind",
        )  # fmt: skip
    if device != "cpu" and set(kinds) - {"linear"}:
        raise ConditionError(
            f"{kinds['quadratic']} is of quadratic elements, which the processor computes",
            where="simulation, element", remedy='take device="cpu", or linear elements',
        )  # fmt: skip


def check_rigid(bodies: list[Body], precision: str, device: str) -> None:
    """Raise `ConditionError` for rigid bodies where none are computed."""
    rigid = [body.name for body in bodies if body.rigid]
    if rigid and (precision != "float64" or device != "cpu"):
        raise ConditionError(
            f"{rigid[0]} is rigid: such bodies are computed in double precision on the processor",
            where="simulation, rigid", remedy='take precision="float64" and device="cpu"',
        )  # fmt: skip
