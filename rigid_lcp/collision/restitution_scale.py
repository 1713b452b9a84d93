"""Restitution scaled down where friction would let it make energy.

Newton's restitution acts on normal velocities, whatever friction does beside it.  Where a rod comes
down at a slant its normal impulse turns the slip round, friction then pushes along the first slip,
and the rod leaves with more than it came with (Kane's paradox).  Wedged bodies may have no impulses
at all that let them bounce.  Without restitution neither happens, so as much of it is kept as makes
no energy, found by bisection, contact by contact.

The work of the impulses p is ``p (u- + u+) / 2`` with the relative velocities u before and after
the step.  Without restitution that is at most ``sum M (h f / M)^2 / 8`` of the bodies that touch
each other: what loads f give within a step to bodies that come to rest in it.  So much is allowed.
"""

import numpy as np

from rigid_lcp.arrays import Bools, Floats
from rigid_lcp.collision.passing import PASSING, Closing, Impulses
from rigid_lcp.friction.auto import find_islands
from rigid_lcp.friction.problem import BodySpace, FrictionProblem

SHARE_RESOLUTION = 1 / 64
"""To which a share is found [-]; a smaller one is none."""


def gains_energy(
    bodies: BodySpace, closing: Closing, before: Floats, free: Floats, gained: Floats,
    found: Impulses, bounce: Bools,
) -> Bools:  # fmt: skip
    """Contacts (nc,) of the islands (`rigid_lcp.friction.auto.islands`) in which some ``bounce``
    and whose impulses make energy.

    ``before``: relative velocities at the start of the step, ``free``: at its end without impulses,
    (nc, dim) [m/s]; ``gained``: what loads give each movable body in it, (nb, size) [m/s, 1/s].
    """
    gains = np.zeros(len(bounce), dtype=bool)
    if not closing.friction.any():
        return gains
    impulse = found.impulse
    after = free + bodies.product(impulse.ravel()).reshape(impulse.shape)
    parts = 0.5 * (np.abs(impulse) * (np.abs(before) + np.abs(after))).sum(axis=1)
    work = 0.5 * (impulse * (before + after)).sum(axis=1)
    if not (work > PASSING.speed_round_off * parts.sum()).any():
        return gains
    allowed = 0.125 * np.einsum("bi,bij,bj->b", gained, bodies.mass_blocks, gained)
    dim = impulse.shape[1]
    problem = FrictionProblem(None, closing.offset.ravel(), closing.friction, dim, bodies)
    first, body, _ = problem.body_jacobians
    for island in find_islands(problem):
        touched = np.unique(np.concatenate([body[first[c] : first[c + 1]] for c in island]))
        most = allowed[touched].sum() + PASSING.speed_round_off * parts[island].sum()
        gains[island] = bounce[island].any() and work[island].sum() > most
    return gains


class Share:
    """The greatest share of the restitution of contacts that makes no energy, by bisection.

    No restitution makes none; it is taken that neither does a smaller share than one that makes
    none.  Where that is found wrong nothing is kept.
    """

    def __init__(self, count: int) -> None:
        self.now = np.ones(count)
        """What is to be tried next, (count,) [-]."""
        self._least, self._most = np.zeros(count), np.ones(count)

    def bisect(self, gains: Bools) -> bool:
        """Whether another share is to be tried, where those tried now made energy (count,)."""
        before = self.now
        self._most = np.where(gains, before, self._most)
        self._least = np.where(gains, self._least, before)
        wrong = gains & (before <= self._least)
        self._least[wrong] = self._most[wrong] = 0.0
        middle = 0.5 * (self._least + self._most)
        self.now = np.where(self._most - self._least > SHARE_RESOLUTION, middle, self._least)
        return bool((self.now != before).any())

    def leave_out(self) -> None:
        """No restitution, at the next trial and the last."""
        self.now = np.zeros_like(self.now)
        self._least, self._most = self.now.copy(), self.now.copy()
