"""What the options of a simulation may be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from qdem_fem import kernel
from qdem_fem.body import Body
from qdem_fem.errors import ConditionError
from qdem_fem.series import is_real

PRECISIONS = ("float64", "float32")
DEVICES = ("cpu", "cuda")


def bodies_check(bodies: Sequence[Body]) -> None:
    """Raise `ConditionError` unless these are bodies, each once, that no simulation moves yet."""
    if not bodies or not all(isinstance(body, Body) for body in bodies):
        raise ConditionError("give a list of at least one Body", where="simulation")
    if len({id(body) for body in bodies}) < len(bodies):
        raise ConditionError("a body is listed twice", where="simulation")
    for body in bodies:
        if body._simulation is not None:
            raise ConditionError(
                f"{body.name} is in another simulation, which moves it",
                where="simulation",
                remedy="make another of the same mesh: Body(body.mesh, body.material)",
            )


def words_check(**given: Any) -> None:
    """Raise `ConditionError` for a ``strain``, ``precision`` or ``device`` that there is not."""
    known = {"strain": tuple(kernel.LAWS), "precision": PRECISIONS, "device": DEVICES}
    for name, value in given.items():
        if value not in known[name]:
            raise ConditionError(
                f"{value!r} is none of {', '.join(known[name])}", where=f"simulation, {name}"
            )


def numbers_check(**given: Any) -> None:
    """Raise `ConditionError` for an option that is a number and not above zero; None is left."""
    for name, number in given.items():
        if number is not None and not (is_real(number) and number > 0):
            raise ConditionError(f"{number!r} is not above zero", where=f"simulation, {name}")
