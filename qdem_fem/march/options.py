"""What the options of a simulation may be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from qdem_fem.bodies import Body
from qdem_fem.element import MEASURES
from qdem_fem.files import ConditionError, is_real

PRECISIONS = ("float64", "float32")
DEVICES = ("cpu", "cuda")


def check_bodies(bodies: Sequence[Body]) -> None:
    """Raise `ConditionError` unless these are bodies, each once, that no simulation moves yet."""
    if not bodies or not all(isinstance(body, Body) for body in bodies):
        raise ConditionError("give a list of at least one Body", where="simulation")
    if len({id(body) for body in bodies}) < len(bodies):
        raise ConditionError("a body is listed twice", where="simulation")
    for body in bodies:
        if body.mover is not None:
            raise ConditionError(
                f"{body.name} is in another simulation, which moves it",
                where="simulation",
                remedy="make another of the same mesh: Body(body.mesh, body.material)",
            )


def number_bodies(bodies: Sequence[Body]) -> None:
    """Give bodies of one name numbers, "body 0", "body 1", ..., as messages name bodies."""
    names = [body.name for body in bodies]
    for number, body in enumerate(bodies):
        if names.count(body.name) > 1:
            body.name = f"{body.name} {number}"


def check_words(**given: Any) -> None:
    """Raise `ConditionError` for a ``strain``, ``precision`` or ``device`` that there is not."""
    known = {"strain": tuple(MEASURES), "precision": PRECISIONS, "device": DEVICES}
    for name, value in given.items():
        if value not in known[name]:
            raise ConditionError(
                f"{value!r} is none of {', '.join(known[name])}", where=f"simulation, {name}"
            )


def check_bounds(*, safety: float, threads: int | None) -> None:
    """Raise `ConditionError` for a share of the critical step above 1, or part of a thread."""
    if safety > 1:
        raise ConditionError(
            f"{safety!r} of the critical step is not stable",
            where="simulation, safety",
            remedy="take at most 1, or give step= to see what happens",
        )
    if threads is not None and threads != int(threads):
        raise ConditionError(f"{threads!r} is no number of threads", where="simulation, threads")


def check_numbers(**given: Any) -> None:
    """Raise `ConditionError` for an option that is a number and not above zero; None is left."""
    for name, number in given.items():
        if number is not None and not (is_real(number) and number > 0):
            raise ConditionError(f"{number!r} is not above zero", where=f"simulation, {name}")


def check_rigid_options(bodies: Sequence[Body], precision: str, device: str) -> None:
    """Raise `ConditionError` for rigid bodies where none are computed."""
    rigid = [body.name for body in bodies if body.rigid]
    if rigid and (precision != "float64" or device != "cpu"):
        raise ConditionError(
            f"{rigid[0]} is rigid: such bodies are computed in double precision on the processor",
            where="simulation, rigid",
            remedy='take precision="float64" and device="cpu"',
        )
