"""Forces of the supports, from the equation of motion of what they hold."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from qdem_fem.bodies import Held, Roller
from qdem_fem.files import ConditionError, Driver, Floats
from qdem_fem.march.leapfrog import find_free_accelerations, find_velocity
from qdem_fem.march.state import State

if TYPE_CHECKING:
    from qdem_fem.rigid import RigidBodies


def find_reaction(run: State, condition: Held | Roller) -> Floats:
    """Total force of a support on the body now [N], (3,): ``sum m a - f`` over what it holds.

    ``f``: what elements, loads and gravity do to its nodes; ``a``: of the motion it prescribes.
    Of two conditions on one component both get all of it.  Raises `ConditionError` for what
    holds nothing in this simulation.
    """
    if not any(condition is known for known in (*run.conditions.held, *run.conditions.rollers)):
        raise ConditionError(
            "it holds nothing in this simulation",
            where="reaction",
            remedy="give what fix, prescribe or roller returned",
        )
    if run.rigid is not None and (b := run.rigid.number_of(condition.nodes[0])) >= 0:
        assert isinstance(condition, Held)
        return _rigid_reaction(run, run.rigid, b, condition)
    # the kernel's accelerations of what no element moves are none
    forces = run.assembly.mass[:, None] * find_free_accelerations(
        run, run.assembly.field("displacement"), find_velocity(run)
    )
    if isinstance(condition, Roller):
        nodes = np.unique(run.master[condition.nodes])
        return np.asarray(-(forces[nodes] @ condition.normal).sum() * condition.normal)
    nodes, first = np.unique(run.master[condition.nodes], return_index=True)
    total = np.zeros(3)
    chosen = list(condition.components)
    total[chosen] = -forces[nodes][:, chosen].sum(axis=0)
    if condition.driver is not None:
        bend = _bend(run, condition.driver)
        factor = np.ones(len(first)) if condition.factor is None else condition.factor[first]
        total[chosen] += bend * (run.assembly.mass[nodes] * factor).sum()
    return total


def _bend(run: State, driver: Driver) -> float:
    """Acceleration that a driver prescribes now [m/s^2], for a factor of one."""
    before, now, after = driver.sample(run.time + run.step * np.arange(-1.0, 2.0))[:, 0]
    return float((after - 2 * now + before) / run.step**2)


def _rigid_reaction(run: State, rigid: RigidBodies, b: int, condition: Held) -> Floats:
    """The same for what holds rigid body b: ``M a - F`` of its components, without the couple."""
    chosen, total = list(condition.components), np.zeros(3)
    total[chosen] = -rigid.forces(run.acting())[0][b][chosen]
    if condition.driver is not None:
        factor = 1.0 if condition.factor is None else float(condition.factor[0])
        total[chosen] += rigid.mass[b] * factor * _bend(run, condition.driver)
    return total
