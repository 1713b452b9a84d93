"""The critical step for all contacts that may form near where vertices are now.

`qdem_fem.contact.bound_allowed_contacts` holds for any contacts there may ever be, and pays for it:
it gives the lightest vertex of all as many as the scene allows, to another as light, and adds what
elements do to what contact does, though they do it elsewhere.  Bodies that lie together in a bed
touch where they touch.  Until pairs are looked for again, no contact acts that is not in the list
of pairs; and a spring of ``k_n`` along n and ``k_t < k_n`` across is at most one of ``k_n`` in all
directions:

    k_n n n^T + k_t (1 - n n^T) <= k_n 1,   so   K_c <= K_near

for any of the listed pairs that touch, and any directions.  The critical step with ``K + K_near``
is found as that of the elements is, by Lanczos iterations.  It holds until the list is renewed, and
is found again then.  With rigid bodies, whose vertices have no mass of their own, it is that of the
elements with `qdem_fem.contact.bound_spring_network` of the springs near: lower, by no iterations.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from qdem_fem.contact.bounds import bound_spring_network, shorten_step_by_contact
from qdem_fem.contact.critical_step import find_critical_step
from qdem_fem.contact.system import System
from qdem_fem.files import Unstable

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


def near_step(
    run: System,
    near: tuple[Integers, Floats, Floats],
    nodes: Integers,
    inverse_mass: Floats,
    rigid: Callable[[Floats], Floats],
    elements: float,
) -> float:
    """Critical step [s] for any contacts there can be before pairs are looked for again.

    ``near``: ends (p, 2) and stiffness (p,) of springs between vertices, stiffness (c,) of those
    to walls [N/m]; ``nodes`` (c,), ``inverse_mass`` (c,) [1/kg]: of the vertices; ``rigid``: as in
    `bound_spring_network`; ``elements``: critical step of bodies that touch nothing [s].
    """
    ends, stiffness, wall = near
    if run.rigid is not None:
        bound = bound_spring_network(ends, stiffness, wall, inverse_mass, rigid)
        return shorten_step_by_contact(elements, bound, viscous=run.viscous)

    def springs(u: Floats) -> Floats:
        """``-M^-1 K_near u`` [m/s^2], (n, 3)."""
        moved = u[nodes]
        pull = -wall[:, None] * moved
        of_pairs = stiffness[:, None] * (moved[ends[:, 1]] - moved[ends[:, 0]])
        np.add.at(pull, ends[:, 0], of_pairs)
        np.subtract.at(pull, ends[:, 1], of_pairs)
        change = np.zeros_like(u)
        change[nodes] = pull * inverse_mass[:, None]
        return change

    return find_critical_step(run, springs).value


def check_near(step: float, near: float, where: str) -> None:
    """Raise `Unstable` where a ``step`` [s] is above that for the contacts that are near now."""
    if step > near:
        raise Unstable(
            f"vertices have come near each other whose contacts make the critical step {near:.4g} "
            f"s; the step is {step:.4g} s, for those that were near when the march began",
            where=where,
            remedy='begin again with a number of contacts in place of "near", or with a lower '
            "safety",
        )
