"""The compiled part of `qdem_fem.bodies.absorbing`: springs before the motion, dashpots behind
it."""

from __future__ import annotations

from typing import Any, NamedTuple

from qdem_fem.kernel import exact, inlined


class Absorber(NamedTuple):
    """D dashpots and S springs, each along one direction of one node; those of a node at right
    angles to each other and to what is held."""

    at: Any
    """(D,) first component of its node in the fields"""
    direction: Any
    """(D, 3)"""
    damping: Any
    """(D,) [N s/m]"""
    before: Any
    """(D,) velocity before the step [m/s]"""
    spring_at: Any
    """(S,)"""
    spring_force_at: Any
    """(S,) of its first component in the windows of forces"""
    spring_direction: Any
    """(S, 3)"""
    stiffness: Any
    """(S,) [N/m]"""
    taken: Any
    """(1,) energy that the dashpots took [J]"""


@inlined
def component(field: Any, at: int, direction: Any, i: int) -> float:  # pragma: no cover
    """Of the node at ``at``, along row i of ``direction``."""
    return (
        field[at] * direction[i, 0] + field[at + 1] * direction[i, 1]
        + field[at + 2] * direction[i, 2]
    )  # fmt: skip


@exact
def begin_absorber(
    a: Any, forces: Any, displacement: Any, velocity: Any
) -> None:  # pragma: no cover
    """Add the springs to the forces, and keep the velocity half a step ago."""
    for i in range(a.at.size):
        a.before[i] = component(velocity, a.at[i], a.direction, i)
    for i in range(a.spring_at.size):
        pull = a.stiffness[i] * component(displacement, a.spring_at[i], a.spring_direction, i)
        for k in range(3):
            forces[a.spring_force_at[i] + k] -= pull * a.spring_direction[i, k]


@exact
def end_absorber(
    a: Any, inverse_mass: Any, displacement: Any, velocity: Any, step: float
) -> None:  # pragma: no cover
    """``v+ = v* - r/(1 + r/2) (v- + v*)/2`` with r = dt c/m and v* what no dashpot slowed."""
    for i in range(a.at.size):
        at = a.at[i]
        mean = 0.5 * (a.before[i] + component(velocity, at, a.direction, i))
        rate = step * a.damping[i] * inverse_mass[at // 4]
        change = -rate / (1.0 + 0.5 * rate) * mean
        for k in range(3):
            velocity[at + k] += change * a.direction[i, k]
            displacement[at + k] += step * change * a.direction[i, k]
        a.taken[0] += step * a.damping[i] * (mean + 0.5 * change) ** 2
