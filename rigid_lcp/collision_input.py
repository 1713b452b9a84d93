"""What a collision may be made of: bodies, velocities, restitution, choices."""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigid_lcp.errors import ProblemError, UsageError
from rigid_lcp.friction_problem import BodySpace
from rigid_lcp.problem_input import (
    check_factors,
    finite_numbers,
    in_range,
    one_number,
    whole_number,
)

Floats = NDArray[np.float64]
Law = Literal["newton", "moreau"]
Energy = Literal["safe", "watched"]


def moving_bodies(bodies: BodySpace, velocity: ArrayLike) -> tuple[int, Floats]:
    """2 or 3 dimensions, and the velocities of the bodies; refuses what is neither."""
    if not isinstance(bodies, BodySpace):
        raise ProblemError(
            f"they are a {type(bodies).__name__}", where="bodies",
            remedy="give a BodySpace: a collision needs J and M^-1 apart",
        )  # fmt: skip
    check_factors(bodies)
    dim = 2 if bodies.body_size == 3 else 3
    rows, freedoms = bodies.jacobian.shape
    if rows % dim:
        raise ProblemError(
            f"jacobian has {rows} rows, which are not {dim} a contact", where="bodies",
            remedy="give a contact 2 rows where a body has 3 freedoms, and 3 where it has 6",
        )  # fmt: skip
    before = numbers_of("velocity", velocity, freedoms, "one number a freedom, as J has columns")
    in_range(before, "velocity", least=0.0)
    return dim, before


def numbers_of(name: str, values: ArrayLike, count: int, remedy: str) -> Floats:
    """``values`` as (count,); `ProblemError`, with ``name``, for another number of them."""
    array = finite_numbers(values, name).ravel()
    if len(array) != count:
        raise ProblemError(
            f"{name} has {len(array)} numbers, not {count}", where=name, remedy=f"give {remedy}"
        )
    return array


def one_a_contact(name: str, values: ArrayLike, upper: float, nc: int) -> Floats:
    """``values`` as (nc,), each from 0 to ``upper``; `ProblemError`, with ``name``, for others."""
    array = finite_numbers(values, name)
    if array.shape not in ((), (nc,)):
        raise ProblemError(
            f"{name} has shape {array.shape} for {nc} contacts", where=name,
            remedy="give one number, or one a contact",
        )  # fmt: skip
    array = np.broadcast_to(array, (nc,)).copy()
    bad = np.flatnonzero(~((array >= 0.0) & (array <= upper)))
    if len(bad):
        raise ProblemError(
            f"{name} is {array[bad[0]]:g}", where=f"{name}, contact {bad[0]}",
            remedy=f"give 0 to {upper:g}",
        )  # fmt: skip
    return array


def check_choices(
    law: str, energy: str, tolerance: float, max_rounds: int, still: float, rest_speed: float
) -> None:
    """Raise `UsageError` for what `rigid_lcp.collisions.collide` can not be asked."""
    for name, given, known in (("law", law, get_args(Law)), ("energy", energy, get_args(Energy))):
        if given not in known:
            raise UsageError(
                f"{name} is {given!r}", where=name, remedy="give one of " + ", ".join(known)
            )
    one_number(tolerance, "tolerance")
    one_number(still, "still", zero=True)
    one_number(rest_speed, "rest_speed", zero=True)
    whole_number(max_rounds, "max_rounds")
