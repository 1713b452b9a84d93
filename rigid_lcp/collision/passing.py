"""Collisions that are passed on within a step: a ball hits the next one, and that the one after it.

Time stepping (`rigid_lcp.motion.time_stepping`) lets a contact bounce that approaches at the start
of a step and closes within it.  One that is open, does not close by itself, and is closed by the
impulse of another would end the step without restitution.  Here such contacts wait, and rounds
follow as in section 7 of the paper (`rigid_lcp.collision.impulses`): what closes and approaches
bounces, with the contacts that have closed before, until nothing does,

    u' = u + W p,    u_N' + e u_N >= 0 where it bounces (eq. 35),    u_N' + 2 g / h >= 0 elsewhere,

and what approaches still ends without restitution.  What parts takes no part in a round (section
4, point 3): in a row between two walls not all contacts can open at once.  Every round keeps the
energy or loses some, and at restitution 1 without friction keeps it to round-off.  Rounds stand for
the order in time; no time passes between them.

How many there are depends on the masses: a light disc between a wall and a heavy one takes
``pi sqrt(M / m)``.  At restitution 1 without friction they come to an end, and are awaited
(`PassingNumbers`).  With losses they need not (inelastic collapse, Zeno), and what a collapse
has left goes in its end: there ``lossy_rounds`` and ``lossy_work`` bound the work, and what still
approaches is closed without restitution.  `Impulses.cut_off` tells where either bound was met.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rigid_lcp.arrays import Bools, Floats
from rigid_lcp.friction.problem import BodySpace, FrictionSolution

Solve = Callable[[BodySpace, Floats, Floats], tuple[FrictionSolution, float]]
"""Impulses of the contacts of J with relative velocities q (nc, dim) and friction (nc,), and their
error [-]."""


@dataclass(frozen=True)
class PassingNumbers:
    """Rounds of a step, and round-off."""

    rounds: int = 20_000
    """At most [-], about 1 ms each where few bodies collide: a light disc between a wall and a
    heavy one takes as many at a mass ratio of 4e7."""
    lossy_rounds: int = 50  # of contacts with friction or a restitution below 1, always [-]
    lossy_work: int = 1_000  # contacts, summed over the rounds, until which they have more [-]
    speed_round_off: float = 1e-12  # over the largest velocity of a collision; of works too [-]


PASSING = PassingNumbers()


@dataclass(frozen=True)
class Closing:
    """Contacts of a time step as its contact law sees them."""

    restitution: Floats  # e, (nc,) [-]
    friction: Floats  # mu, (nc,) [-]
    gap: Floats  # at the midpoint, (nc,) [m]
    before: Floats  # normal velocities at the start of the step, (nc,) [m/s]
    offset: Floats  # relative velocities at its end without impulses, (nc, dim) [m/s]
    turning: Floats
    """What the turning of the bodies adds to ``u_N`` from the midpoint to the end, and takes from
    ``before``, (nc,) [m/s]."""
    slow: float
    """What gravity gives in a step [m/s]: an approach as slow cannot be distinguished from rest."""
    h: float  # length of the step [s]
    touching: float  # a gap this small is none [m]


@dataclass(frozen=True)
class Impulses:
    """Impulses of all contacts of a step, and how well they were found."""

    impulse: Floats  # p, (nc, dim) [N s]
    velocity: Floats  # u at the end of the step, (nc, dim) [m/s]
    error: float  # scale-free residual, the greatest of all rounds [-]
    message: str  # what the solver has to say of it
    cut_off: bool = False
    """Whether approaching contacts were closed without restitution as rounds were too many."""


def find_bouncing(closing: Closing) -> Bools:
    """Contacts (nc,) that close within the step and approach faster than ``slow``."""
    c = closing
    closes = c.gap + 0.5 * c.h * c.offset[:, 0] <= 0
    found: Bools = closes & (c.before < -c.slow) & (c.restitution > 0)
    return found


def find_contact_shift(closing: Closing, bounce: Bools, turning: Floats | float = 0.0) -> Floats:
    """What is added to u (nc, dim) so that ``u_N`` may not be negative [m/s].

    ``e u_N-`` where contacts ``bounce``, else ``2 g / h``: an open one may close, not more.
    ``turning``: inertial part of ``u_N+`` that is left out where it would ask bodies to part that
    come to rest within the step.
    """
    c = closing
    shift = np.zeros_like(c.offset)
    may_close = np.maximum(np.maximum(c.gap, 0.0) * 2 / c.h, -turning)
    shift[:, 0] = np.where(bounce, c.restitution * c.before, may_close)
    return shift


def find_hit_by_others(closing: Closing, bounce: Bools, found: Impulses, diagonal: Floats) -> Bools:
    """Contacts (nc,) that are open, do not ``bounce``, and were closed by the impulses of those
    that do, faster than ``slow``.

    ``diagonal`` W_NN of W [1/kg]: without its own impulse a contact's velocity would be
    ``u_N - W_NN p_N``, taken at the start of the step by the turning of the bodies.
    """
    c = closing
    apart = ~bounce & ((c.gap > c.touching) | (c.before > c.slow)) & (c.restitution > 0)
    push = found.impulse[:, 0]
    alone = found.velocity[:, 0] - 2.0 * c.turning - diagonal * push
    hit: Bools = apart & (push > 0) & (alone < -c.slow)
    return hit


def find_impulses_in_turn(bodies: BodySpace, closing: Closing, solve: Solve) -> Impulses:
    """Impulses of all rounds.

    At restitution 1 the velocities at the midpoint, on which an impulse works, are then opposite
    before and after it, and its work is none: before are those of the start of the step with the
    impulses of earlier rounds, and not yet what loads and turning add within the step.
    """
    within = closing.offset[:, 0] - closing.before
    least = PASSING.speed_round_off * float(np.abs(closing.offset).max(initial=0.0))
    now = replace(closing, slow=max(closing.slow, least))
    lossy = (closing.restitution < 1.0) | (closing.friction > 0.0)
    impulse = np.zeros_like(now.offset)
    worst, message, cut_off, work = 0.0, "", False, 0
    for turn in range(PASSING.rounds + 1):
        bounce = find_bouncing(now)
        if turn > 0:
            bounce &= needs_impulse(now, least)
            spent = turn >= PASSING.lossy_rounds and work >= PASSING.lossy_work
            if spent and (bounce & lossy).any():
                now = replace(now, restitution=np.where(lossy, 0.0, now.restitution))
                bounce &= ~lossy
                cut_off = True
        cut_off |= turn == PASSING.rounds and bool(bounce.any())
        last = turn > 0 and (turn == PASSING.rounds or not bounce.any())
        bounce &= not last
        resting = ((now.gap <= now.touching) | (now.restitution == 0.0)) & (now.offset[:, 0] <= 0.0)
        taking = np.flatnonzero(bounce | resting | last)
        work += len(taking)
        offset = (now.offset + find_contact_shift(now, bounce))[taking]
        solution, error = solve(bodies.select_contacts(taking), offset, now.friction[taking])
        push = np.zeros_like(impulse)
        push[taking] = solution.r.reshape(-1, impulse.shape[1])
        impulse += push
        velocity = now.offset + bodies.product(push.ravel()).reshape(impulse.shape)
        if error >= worst:
            worst, message = error, solution.message
        if last:
            break
        closed = np.where(bounce, np.minimum(now.gap, 0.0), now.gap)
        now = replace(now, gap=closed, offset=velocity, before=velocity[:, 0] - within)
    return Impulses(impulse, velocity, worst, message, cut_off)


def needs_impulse(closing: Closing, least: float) -> Bools:
    """Contacts (nc,) that do not part with ``-e u_N`` by themselves, to round-off ``least`` [m/s].

    Turning bodies may approach each other at the start of a step and part at its end as fast as
    that: no impulse answers to them, however many rounds there are.
    """
    needs: Bools = closing.offset[:, 0] + closing.restitution * closing.before < -least
    return needs
