"""Collisions (section 7): impulses of hard grains that approach at their contacts, all at once.

Where a contact approaches, no finite force stops it in time, only an impulse (eq. 32).  The paper's
assumptions: all pairs collide at once; impulses push; a contact leaves at least at ``-eps v``; one
that leaves faster had no impulse.  With the excess velocity ``dv = v' + eps v`` (eq. 34) that is

    dv = (1 + eps) v + A dp,   dv >= 0,   dp >= 0,   dv dp = 0.       (35, 36)

What it means: the stiffness went to infinity with every pair loaded at the same time.  The answer
does not depend on an order of pairs, and differs from a chain of pair collisions: in Newton's
cradle of three the last ball leaves with 2/3, not with all.

Energy: ``E' - E = sum (1 - eps_c) dp_c v_c / 2``.  Contacts that part already (v > 0) are erased
first (section 4, point 3), so every ``v_c <= 0``: energy never grows, also with different eps, and
is conserved to round-off at eps = 1.  Erased contacts may approach afterwards; then the next round
follows, until nothing approaches.

With friction, Coulomb's law acts on the impulses.  ``newton``: eps on normal velocities only; with
several contacts, or oblique ones, energy can grow then (Kane's paradox).  ``moreau``: eps on normal
and tangential velocities (Moreau, Unilateral contact and dry friction in finite freedom dynamics,
1988): ``E' - E <= 0`` for one eps; for contacts of different eps neither is proved.  So energy is
watched, and eps scaled down where it would grow: at eps = 0 it can not.  Nor need there be
impulses at all that let three oblique contacts part at their eps (``newton``, or ``moreau`` with
different eps): eps is scaled down there too, as at eps = 0 there always are.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.collision.passing import PASSING
from rigid_lcp.collision.restitution_scale import Share
from rigid_lcp.errors import ProblemError, UsageError
from rigid_lcp.friction.auto import solve_auto
from rigid_lcp.friction.methods import solve_pivoting
from rigid_lcp.friction.problem import (
    FORCE_ROUND_OFF,
    MOST_FRICTION,
    BodySpace,
    FrictionProblem,
    FrictionSolution,
    Status,
    check_factors,
    judge_forces,
    norm,
    require_finite,
    require_number,
    require_one_a_contact,
    require_range,
    require_whole,
)


@dataclass(frozen=True)
class CollisionNumbers:
    """Rounds of a collision, and how well their impulses have to be found."""

    rounds: int = 500
    """Rounds without friction, after which restitution is left out [-]: bodies whose masses differ
    by a factor of 1e3 take some hundred."""
    rounds_with_friction: int = 50
    """The same with friction [-]: one in five has no end, and energy is lost anyway."""
    least_tolerance: float = 1e-16  # the smallest residual that is asked for [-]
    most_error: float = 1e-6  # (`find_round_error`) of impulses that change velocities [-]
    pivoting_contacts: int = 300  # up to so many in 2D are solved by pivoting first [-]


COLLISION = CollisionNumbers()


@dataclass(frozen=True)
class Collision:
    """What a collision did."""

    velocity: Floats  # velocities of the bodies after it, (ndof,)
    impulse: Floats  # impulses of the contacts over all rounds [N s], (nc * dim,)
    energy_change: float
    """Kinetic energy after less before [J]; with ``drive``, without the work of those walls."""
    residual: float  # largest error of the rounds (`find_round_error`) [-]
    status: Status
    rounds: int  # rounds until no contact approached
    restitution_scale: float
    """Smallest factor eps had to be multiplied by for impulses to exist and energy not to grow; 1
    without friction."""
    message: str = ""
    cut_off: bool = False  # whether rounds ran out, and the rest was taken without restitution

    @property
    def solved(self) -> bool:
        """Nothing approaches any more, and every round reached its tolerance."""
        return self.status == "solved"


def collide(
    bodies: BodySpace, velocity: ArrayLike, restitution: ArrayLike, friction: ArrayLike = 0.0, *,
    law: Law = "moreau", tolerance: float = 1e-12, max_rounds: int | None = None,
    still: float = 0.0, rest_speed: float = 0.0, drive: ArrayLike | None = None,
) -> Collision:  # fmt: skip
    """Velocities after a collision by eqs 33 to 36, and the impulses that change them.

    ``velocity`` (ndof,) of the bodies [m/s, 1/s]; ``restitution`` eps and ``friction`` mu, (nc,) or
    one number, eps in [0, 1].  ``law``: what eps acts on with friction, where it is scaled down
    until there are impulses and energy does not grow.  A round whose impulses are not found changes
    no velocity.
    After ``max_rounds`` (None: 500, with friction 50) the rest is taken without restitution, which
    ends, costs energy also at eps = 1, and is said in the message.  ``still`` [m/s]: an approach
    not faster is none; ``rest_speed`` [m/s]: one not faster ends without a bounce, which cuts off
    bounces without end (Zeno).  ``drive`` (nc * dim,) [m/s]: relative velocities of the contacts
    while the bodies of J rest, those of walls that are moved from outside.

    Contacts are those of J: also touching ones with v = 0 take part, as they pass impulses on.
    Raises `ProblemError` for malformed input, `UsageError` for a choice that there is not.
    """
    dim, before = check_moving_bodies(bodies, velocity)
    nc = bodies.jacobian.shape[0] // dim
    eps = require_one_a_contact(restitution, "restitution", 1.0, nc)
    mu = require_one_a_contact(friction, "friction", MOST_FRICTION, nc)
    if max_rounds is None:
        max_rounds = COLLISION.rounds_with_friction if mu.any() else COLLISION.rounds
    if law not in get_args(Law):
        remedy = "give one of " + ", ".join(get_args(Law))
        raise UsageError(f"law is {law!r}", where="law", remedy=remedy)
    require_number(tolerance, "tolerance")
    require_number(still, "still", zero=True)
    require_number(rest_speed, "rest_speed", zero=True)
    require_whole(max_rounds, "max_rounds")
    moved = np.zeros(nc * dim)
    if drive is not None:
        moved = require_numbers("drive", drive, nc * dim, "one number a row of J")
    first = bodies.jacobian @ before + moved
    none = max(still, PASSING.speed_round_off * float(np.abs(first).max(initial=0.0)))
    after, impulse = before.copy(), np.zeros(nc * dim)
    worst, rounds, factor = 0.0, 0, 1.0
    notes: list[str] = []
    status: Status = "solved"
    while True:
        now = bodies.jacobian @ after + moved
        normal = now[::dim]
        if not (normal < -none).any():
            break
        last = rounds == max_rounds
        taking = np.arange(nc) if last else np.flatnonzero(normal <= none)
        bounce = np.where((normal < -rest_speed) & (not last), eps, 0.0)
        part, solution, error, used = run_collision_round(
            bodies, now, taking, bounce, mu, dim, law, tolerance
        )
        worst, rounds, factor = max(worst, error), rounds + 1, min(factor, used)
        if not solution.solved or error > COLLISION.most_error:
            status = "not converged" if solution.solved else solution.status
            notes.append(
                solution.message or f"impulses of {np.abs(part).max():.1g} N s were found, which"
                f" leave velocities wrong by {error:.1g} of them"
            )  # fmt: skip
        if error > COLLISION.most_error:
            break
        impulse += part
        after = after + bodies.inverse_mass @ (bodies.jacobian.T @ part)
        if status != "solved" or last or not part.any():
            break  # what approaches still does so within the tolerance
    # the work of the impulses at the mean velocity: no difference of large energies
    change = 0.5 * float(impulse @ (first + bodies.jacobian @ after + moved))
    cut_off = rounds > max_rounds and bool(eps.any())
    if cut_off:
        notes.insert(0, f"after {max_rounds} rounds the rest was taken without restitution")
    if factor < 1.0:
        notes.insert(
            0, f"restitution was scaled by {factor:.3g}, as energy would have grown, or no impulses"
            " were found"
        )  # fmt: skip
    return Collision(
        after, impulse, change, worst, status, rounds, factor, "; ".join(notes), cut_off
    )  # fmt: skip


def run_collision_round(
    bodies: BodySpace, velocity: Floats, taking: Ints, eps: Floats, mu: Floats,
    dim: int, law: Law, tolerance: float,
) -> tuple[Floats, FrictionSolution, float, float]:  # fmt: skip
    """Impulses of one round on the contacts that take part; the solution, its error; the factor of
    eps.

    ``velocity`` (nc * dim,): of all contacts before it [m/s].
    """
    rows = (dim * taking[:, None] + np.arange(dim)).ravel()
    part = bodies.select_contacts(taking)
    v = velocity[rows]
    share = Share(1)
    while True:
        used = share.now * eps[taking]
        excess = v.reshape(-1, dim).copy()
        excess[:, 0] += used * v[::dim]  # (1 + eps) v: eq. 35
        if law == "moreau":
            excess[:, 1:] += used[:, None] * v.reshape(-1, dim)[:, 1:]
        problem = FrictionProblem(None, excess.ravel(), mu[taking], dim, part)
        solution = find_round_impulses(problem, tolerance)
        p, error = solution.r, find_round_error(problem, solution)
        if not (used.any() and problem.friction.any()):
            break  # without friction energy can not grow
        change = 0.5 * float(p @ (2.0 * v + part.product(p)))
        grows = error > COLLISION.most_error or change > estimate_round_off(part, p, v)
        if not share.bisect(np.array([grows])):
            break
    impulse = np.zeros(bodies.jacobian.shape[0])
    impulse[rows] = p
    return impulse, solution, error, float(share.now[0])


def find_round_error(problem: FrictionProblem, solution: FrictionSolution) -> float:
    """Residual of a round's impulses, or the share of the velocities that they leave wrong, where
    that is more than `COLLISION`'s: impulses without bound make any residual small [-]."""
    speed = norm(problem.offset)
    left = max(solution.residual, FORCE_ROUND_OFF) * norm(solution.r) / problem.rho
    return left / speed if left > COLLISION.most_error * speed else solution.residual


def estimate_round_off(bodies: BodySpace, impulse: Floats, velocity: Floats) -> float:
    """Round-off of the work of impulses p (nc * dim,) [N s] at contacts that approached with
    ``velocity`` (nc * dim,) [m/s]: a growth of energy [J] that is none.

    A light body between heavy ones makes ``p W p`` a small difference of large numbers, each of
    the size ``p_c^2 W_cc``.
    """
    own = FORCE_ROUND_OFF * float(impulse**2 @ bodies.diagonal)
    return PASSING.speed_round_off * float(np.abs(impulse) @ np.abs(velocity)) + own


def find_round_impulses(problem: FrictionProblem, tolerance: float) -> FrictionSolution:
    """Solve eq. 36 without friction, or Coulomb's law on impulses with it.

    The residual is relative to impulses; beside those of heavy bodies it hides the velocities of
    light ones, so that it is asked to be as small beside the velocities too.
    """
    found = _find_impulses_at(problem, tolerance)
    error = found.residual * norm(found.r) / problem.rho
    if found.solved and error > (most := tolerance * norm(problem.offset)):
        finer = max(found.residual * most / error, COLLISION.least_tolerance)
        again = _find_impulses_at(problem, finer)
        if again.residual < found.residual:
            found = judge_forces(problem, again.r, tolerance, again.method, again.work)
    return found


def _find_impulses_at(problem: FrictionProblem, tolerance: float) -> FrictionSolution:
    few = problem.contacts <= COLLISION.pivoting_contacts
    if problem.friction.any() and problem.dim == 2 and few:
        found = solve_pivoting(problem, None, tolerance)
        if found.solved:
            return found
    return solve_auto(problem, None, tolerance)


Law = Literal["newton", "moreau"]


def check_moving_bodies(bodies: BodySpace, velocity: ArrayLike) -> tuple[int, Floats]:
    """2 or 3 dimensions, and the velocities of the bodies; refuses what is neither."""
    if not isinstance(bodies, BodySpace):
        raise ProblemError(
            f"they are a {type(bodies).__name__}", where="bodies",
            remedy="give a BodySpace: a collision needs J and M^-1 apart",
        )  # fmt: skip
    check_factors(bodies.jacobian, bodies.inverse_mass, bodies.body_size)
    dim = 2 if bodies.body_size == 3 else 3
    rows, freedoms = bodies.jacobian.shape
    if rows % dim:
        raise ProblemError(
            f"jacobian has {rows} rows, which are not {dim} a contact", where="bodies",
            remedy="give a contact 2 rows where a body has 3 freedoms, and 3 where it has 6",
        )  # fmt: skip
    before = require_numbers(
        "velocity", velocity, freedoms, "one number a freedom, as J has columns"
    )
    require_range(before, "velocity", least=0.0)
    return dim, before


def require_numbers(name: str, values: ArrayLike, count: int, remedy: str) -> Floats:
    """``values`` as (count,); `ProblemError`, with ``name``, for another number of them."""
    array = require_finite(values, name).ravel()
    if len(array) != count:
        raise ProblemError(
            f"{name} has {len(array)} numbers, not {count}", where=name, remedy=f"give {remedy}"
        )
    return array
