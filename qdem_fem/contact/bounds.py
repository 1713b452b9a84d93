"""The critical time step with contact: a bound that holds for any contacts there are.

Weyl's inequality: the highest eigenvalue of ``M^-1 (K + K_c)`` is at most the sum of both parts'.
``K_c`` is a network of springs of at most ``k_n`` (``k_t < k_n``), and the highest eigenvalue of
such a network is at most the greatest sum, over its springs, of both ends' ``(sum of k)/m``
(Anderson and Morley 1985); of a spring to a wall it is its one end's.

It holds for rigid bodies among the ends, with the highest ``omega^2`` of the body alone on its
springs, D, in place of ``(sum of k)/m``.  The Gram matrix of the springs' ends, ``k^1/2 J M^-1
J^T k^1/2``, is a sum over nodes and rigid bodies c of parts that are not negative, are at most
``D_c`` and are zero for the springs of others; so it is at most the diagonal matrix of the sums of
both ends' D.

`bound_contacts` holds for any contacts there may ever be, and pays for it: it gives the
lightest vertex of all as many as the scene allows, to another as light, and adds what elements do
to what contact does, though they do it elsewhere.  Bodies that lie together in a bed touch where
they touch.  Until pairs are looked for again, no contact acts that is not in the list of pairs; and
a spring of ``k_n`` along n and ``k_t < k_n`` across is at most one of ``k_n`` in all directions:

    k_n n n^T + k_t (1 - n n^T) <= k_n 1,   so   K_c <= K_near

for any of the listed pairs that touch, and any directions.  `find_near_step` finds the critical
step with ``K + K_near`` as that of the elements is found, by Lanczos iterations; it holds until the
list is renewed.  With rigid bodies, whose vertices have no mass of their own, it is that of the
elements with `bound_spring_network` of the springs near: lower, by no iterations.
"""

from collections.abc import Callable
from math import inf, sqrt

import numpy as np

from qdem_fem.contact.critical_step import find_critical_step
from qdem_fem.contact.system import System
from qdem_fem.files import Floats, Integers


def bound_spring_network(
    ends: Integers, stiffness: Floats, wall: Floats, inverse_mass: Floats,
    rigid: Callable[[Floats], Floats] = np.zeros_like,
) -> float:  # fmt: skip
    """Bound on omega^2 [1/s^2] of springs between nodes, and of nodes to walls.

    ``ends`` (p, 2) nodes of each spring, ``stiffness`` (p,) [N/m], ``wall`` (c,) [N/m] of each
    node to what does not move, ``inverse_mass`` (c,) [1/kg], zero of rigid bodies' nodes;
    ``rigid``: their D (c,) [1/s^2], zero for other nodes, by the springs (c,) [N/m] at each.
    """
    total = wall.copy()
    for end in ends.T:
        np.add.at(total, end, stiffness)
    each = total * inverse_mass + rigid(total)
    between = each[ends].sum(axis=1).max(initial=0.0)
    return float(max(between, each[wall > 0].max(initial=0.0)))


def bound_contacts(
    normal: Floats,
    inverse_mass: Floats,
    contacts: float,
    rigid: Callable[[Floats], Floats] = np.zeros_like,
) -> float:
    """Bound on omega^2 [1/s^2] while no vertex has more than so many contacts of its own ``k_n``.

    ``normal`` (c,) [N/m], ``inverse_mass`` (c,) [1/kg], ``rigid`` as in `bound_spring_network`; a
    wall counts as two contacts.  A rigid body may have them at all its vertices at once.
    """
    return 2 * contacts * float((normal * inverse_mass + rigid(normal)).max(initial=0.0))


def shorten_step_by_contact(step: float, stiffness: float, *, viscous: bool) -> float:
    """Critical step [s] where elements alone allow ``step`` and contact adds ``stiffness`` [1/s^2].

    ``dt^2 K + 2 dt C`` must stay below 4 M.  Without viscosity its part of the elements is
    ``4 (dt/step)^2``, with it at most ``4 dt/step``; contact adds ``dt^2 stiffness``.
    """
    if stiffness <= 0:
        return step
    if step == inf:
        return 2 / sqrt(stiffness)
    if not viscous:
        return 1 / sqrt(1 / step**2 + stiffness / 4)
    return 2 / (1 / step + sqrt(1 / step**2 + stiffness))


def find_near_step(
    run: System, near: tuple[Integers, Floats, Floats], nodes: Integers, inverse_mass: Floats,
    rigid: Callable[[Floats], Floats], elements: float,
) -> float:  # fmt: skip
    """Critical step [s] for any contacts there can be before pairs are looked for again.

    ``near``: ends (p, 2) and stiffness (p,) of springs between vertices, stiffness (c,) of those
    to walls [N/m]; ``nodes`` (c,), ``inverse_mass`` (c,) [1/kg]: of the vertices; ``rigid``: as in
    `bound_spring_network`; ``elements``: critical step of bodies that touch nothing [s].
    """
    ends, stiffness, wall = near
    if run.rigid is not None:
        bound = bound_spring_network(ends, stiffness, wall, inverse_mass, rigid)
        return shorten_step_by_contact(elements, bound, viscous=run.viscous)

    def apply_springs(u: Floats) -> Floats:
        """``-M^-1 K_near u`` [m/s^2], (n, 3)."""
        moved = u[nodes]
        pull = -wall[:, None] * moved
        of_pairs = stiffness[:, None] * (moved[ends[:, 1]] - moved[ends[:, 0]])
        np.add.at(pull, ends[:, 0], of_pairs)
        np.subtract.at(pull, ends[:, 1], of_pairs)
        change = np.zeros_like(u)
        change[nodes] = pull * inverse_mass[:, None]
        return change

    return find_critical_step(run, apply_springs).value
