"""Collisions that are passed on within a step: a ball hits the next one, and that the one after it.

Time stepping (`rigid_lcp.time_stepping`) lets a contact bounce that approaches at the start of a
step and closes within it.  One that is open, does not close by itself, and is closed by the impulse
of another would end the step without restitution: of five balls in a row a tenth of a step's way
apart 5 % of the energy went so at restitution 1.  Here such contacts wait, and rounds follow as in
section 7 of the paper (`rigid_lcp.collisions`): what closes and approaches bounces, with the
contacts that have closed before, until nothing does,

    u' = u + W p,    u_N' + e u_N >= 0 where it bounces (eq. 35),    u_N' + 2 g / h >= 0 elsewhere,

and what approaches still ends without restitution.  What parts takes no part in a round (section
4, point 3): in a row between two walls not all contacts can open at once.  Every round keeps the
energy or loses some, and at restitution 1 without friction keeps it to round-off.  Rounds stand for
the order in time; no time passes between them.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.friction_problem import BodySpace, FrictionSolution

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Solve = Callable[[BodySpace, Floats, Floats], tuple[FrictionSolution, float]]
"""Impulses of the contacts of J with relative velocities q (nc, dim) and friction (nc,), and their
error [-]."""

ROUNDS = 50
"""Rounds until the rest ends without restitution: a row of balls takes one a ball."""
ROUND_OFF = 1e-12
"""Velocities this small against the largest are no approach."""


def bouncing(
    restitution: Floats, gap: Floats, before: Floats, free: Floats, slow: float, h: float
) -> Flags:
    """Contacts (nc,) that close within the step and approach faster than ``slow`` [m/s].

    ``gap`` [m] at the midpoint; ``before`` and ``free`` [m/s]: normal velocities at the start of
    the step, and at its end without impulses.
    """
    found: Flags = (gap + 0.5 * h * free <= 0) & (before < -slow) & (restitution > 0)
    return found


def hit_by_others(
    restitution: Floats, apart: Flags, push: Floats, after: Floats, diagonal: Floats, slow: float
) -> Flags:
    """Contacts (nc,) that other impulses closed faster than ``slow`` [m/s].

    ``apart``: those that are open and do not bounce; ``push`` [N s]: their own normal impulse;
    ``after`` [m/s]: normal velocities with it, at the start of the step by the turning of the
    bodies; ``diagonal`` of W [1/kg]: without its own impulse it would be ``u_N - W_NN p_N``.
    """
    found: Flags = apart & (restitution > 0) & (push > 0) & (after - diagonal * push < -slow)
    return found


def impulses_in_turn(
    bodies: BodySpace, solve: Solve, friction: Floats, restitution: Floats, gap: Floats,
    before: Floats, offset: Floats, turning: Floats, slow: float, h: float, touching: float,
) -> tuple[Floats, Floats, float, str]:  # fmt: skip
    """Impulses (nc, dim) [N s] of all rounds, velocities (nc, dim) after them, the greatest error
    and what its solution has to say.

    ``offset`` (nc, dim) [m/s]: relative velocities without impulses, ``turning`` (nc,) what the
    turning of the bodies adds to their normal parts from the midpoint to the end, and takes from
    ``before``; a gap of ``touching`` [m] or less is none; the rest as in `bouncing`.  At
    restitution 1 the velocities at the midpoint, on which an impulse works, are then opposite
    before and after it, and its work is none.
    """
    velocity, gap = offset.copy(), gap.copy()
    impulse = np.zeros_like(offset)
    slow = max(slow, ROUND_OFF * float(np.abs(offset).max(initial=0.0)))
    approach, worst, message = before, 0.0, ""
    for turn in range(ROUNDS + 1):
        bounce = bouncing(restitution, gap, approach, velocity[:, 0], slow, h)
        last = turn > 0 and (turn == ROUNDS or not bounce.any())
        bounce &= not last
        resting = ((gap <= touching) | (restitution == 0.0)) & (velocity[:, 0] <= 0.0)
        taking = np.flatnonzero(bounce | resting | last)
        shift = np.zeros_like(offset)
        shift[:, 0] = np.where(bounce, restitution * approach, np.maximum(gap, 0.0) * 2 / h)
        solution, error = solve(
            bodies.of_contacts(taking), (velocity + shift)[taking], friction[taking]
        )
        push = np.zeros_like(offset)
        push[taking] = solution.r.reshape(-1, offset.shape[1])
        impulse += push
        velocity = velocity + bodies.product(push.ravel()).reshape(offset.shape)
        if error >= worst:
            worst, message = error, solution.message
        if last:
            break
        gap[bounce] = np.minimum(gap[bounce], 0.0)  # it has closed
        approach = velocity[:, 0] - 2.0 * turning
    return impulse, velocity, worst, message
