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
is conserved exactly at eps = 1.  Erased contacts may approach afterwards; then the next round
follows, until nothing approaches.

With friction, Coulomb's law acts on the impulses.  ``newton``: eps on normal velocities only; with
several contacts, or oblique ones, energy can grow then (Kane's paradox).  ``moreau``: eps on normal
and tangential velocities (Moreau, Unilateral contact and dry friction in finite freedom dynamics,
1988): ``E' - E <= 0`` for one eps; for contacts of different eps neither is proved.  So energy is
watched, and eps scaled down where it would grow: at eps = 0 it can not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigid_lcp.errors import ProblemError, UsageError
from rigid_lcp.friction_problem import BodySpace, FrictionProblem, FrictionSolution, Status
from rigid_lcp.frictionless import frictionless
from rigid_lcp.problem_input import finite_numbers

Floats = NDArray[np.float64]
Law = Literal["newton", "moreau"]
Energy = Literal["safe", "watched"]

ROUNDS, ROUNDS_ROUGH = 500, 50
"""Rounds of a collision until the rest ends without restitution: without friction, where masses of
a factor of 1e3 that touch anywhere take some hundred; with it, where one in five of those has no
end, and energy is lost anyway."""
ROUND_OFF = 1e-12
"""Velocities this small against the largest of the collision are no approach; energies likewise."""


@dataclass(frozen=True)
class Collision:
    """What a collision did."""

    velocity: Floats
    """Velocities of the bodies after it, (ndof,)."""
    impulse: Floats
    """Impulses of the contacts over all rounds [N s], (nc * dim,)."""
    energy_change: float
    """Kinetic energy after less before [J]; with ``drive``, without the work of those walls."""
    residual: float
    """Largest scale-free residual of the rounds [-]."""
    status: Status
    rounds: int
    """Rounds until no contact approached."""
    restitution_scale: float
    """Smallest factor eps had to be multiplied by for energy not to grow; 1 without friction."""
    message: str = ""

    @property
    def solved(self) -> bool:
        """Nothing approaches any more, and every round reached its tolerance."""
        return self.status == "solved"


def collide(
    bodies: BodySpace,
    velocity: ArrayLike,
    restitution: ArrayLike,
    friction: ArrayLike = 0.0,
    *,
    law: Law = "moreau",
    energy: Energy = "safe",
    tolerance: float = 1e-12,
    max_rounds: int | None = None,
    still: float = 0.0,
    rest_speed: float = 0.0,
    drive: ArrayLike | None = None,
) -> Collision:
    """Velocities after a collision by eqs 33 to 36, and the impulses that change them.

    ``velocity`` (ndof,) of the bodies [m/s, 1/s]; ``restitution`` eps and ``friction`` mu, (nc,) or
    one number, eps in [0, 1].  ``law``: what eps acts on with friction.  ``energy``: ``safe``
    scales eps down until energy does not grow, ``watched`` says so in the message only.
    After ``max_rounds`` (None: 500, with friction 50) the rest is taken without restitution, which
    ends, costs energy also at eps = 1, and is said in the message.  ``still`` [m/s]: an approach
    not faster is none; ``rest_speed`` [m/s]: one not faster ends without a bounce, which cuts off
    bounces without end (Zeno).  ``drive`` (nc * dim,) [m/s]: relative velocities of the contacts
    while the bodies of J rest, those of walls that are moved from outside.

    Contacts are those of J: also touching ones with v = 0 take part, as they pass impulses on.
    Raises `ProblemError` for malformed input, `UsageError` for a choice that there is not.
    """
    dim, before = _moving(bodies, velocity)
    nc = bodies.jacobian.shape[0] // dim
    eps = _one_a_contact("restitution", restitution, 1.0, nc)
    mu = _one_a_contact("friction", friction, np.inf, nc)
    if max_rounds is None:
        max_rounds = ROUNDS_ROUGH if mu.any() else ROUNDS
    _check_choices(law, energy, tolerance, max_rounds, still, rest_speed)
    moved = np.zeros(nc * dim)
    if drive is not None:
        moved = _numbers_of("drive", drive, nc * dim, "one number a row of J")
    first = bodies.jacobian @ before + moved
    none = max(still, ROUND_OFF * float(np.abs(first).max(initial=0.0)))
    after, impulse = before.copy(), np.zeros(nc * dim)
    worst, rounds, factor, notes = 0.0, 0, 1.0, ""
    status: Status = "solved"
    while True:
        now = bodies.jacobian @ after + moved
        normal = now[::dim]
        if not (normal < -none).any():
            break
        if rounds > max_rounds:
            status, notes = "not converged", f"contacts still approach after {rounds} rounds"
            break
        last = rounds == max_rounds
        taking = np.arange(nc) if last else np.flatnonzero(normal <= none)
        bounce = np.where((normal < -rest_speed) & (not last), eps, 0.0)
        part, solution, used = collision_round(
            bodies, now, taking, bounce, mu, dim, law, energy, tolerance
        )
        impulse += part
        after = after + bodies.inverse_mass @ (bodies.jacobian.T @ part)
        worst, rounds, factor = max(worst, solution.residual), rounds + 1, min(factor, used)
        if not solution.solved:
            status, notes = solution.status, solution.message
            break
    # the work of the impulses at the mean velocity: no difference of large energies
    change = 0.5 * float(impulse @ (first + bodies.jacobian @ after + moved))
    size = float(np.abs(impulse) @ np.abs(first))
    if rounds > max_rounds and eps.any():
        notes = f"after {max_rounds} rounds the rest was taken without restitution" + notes
    if factor < 1.0:
        notes = f"restitution was scaled by {factor:.3g}, as energy would have grown" + notes
    if change > ROUND_OFF * size:
        notes = f"energy grew by {change:.3g} J\n  -> use energy='safe', or law='moreau'" + notes
    return Collision(after, impulse, change, worst, status, rounds, factor, notes)


def collision_round(
    bodies: BodySpace, velocity: Floats, taking: NDArray[np.int64], eps: Floats, mu: Floats,
    dim: int, law: Law, energy: Energy, tolerance: float,
) -> tuple[Floats, FrictionSolution, float]:  # fmt: skip
    """Impulses of one round on the contacts that take part; the solution; the factor of eps.

    ``velocity`` (nc * dim,): of all contacts before it [m/s].
    """
    rows = (dim * taking[:, None] + np.arange(dim)).ravel()
    part = bodies.of_contacts(taking)
    v = velocity[rows]
    factor = 1.0
    while True:
        used = factor * eps[taking]
        excess = v.reshape(-1, dim).copy()
        excess[:, 0] += used * v[::dim]  # (1 + eps) v: eq. 35
        if law == "moreau":
            excess[:, 1:] += used[:, None] * v.reshape(-1, dim)[:, 1:]
        problem = FrictionProblem(None, excess.ravel(), mu[taking], dim, part)
        solution = impulses_of(problem, tolerance)
        p = solution.r
        change = 0.5 * float(p @ (2.0 * v + part.product(p)))
        size = float(np.abs(p) @ np.abs(v))
        if energy != "safe" or change <= ROUND_OFF * size or factor == 0.0 or not used.any():
            break
        factor = 0.5 * factor if factor > 0.01 else 0.0
    impulse = np.zeros(bodies.jacobian.shape[0])
    impulse[rows] = p
    return impulse, solution, factor


def impulses_of(problem: FrictionProblem, tolerance: float) -> FrictionSolution:
    """Solve eq. 36 without friction, or Coulomb's law on impulses with it."""
    if not problem.friction.any():
        return frictionless(problem, None, tolerance)
    if problem.dim == 2 and problem.contacts <= 300:
        from rigid_lcp.pivoting import pivoting

        found = pivoting(problem, None, tolerance)
        if found.solved:
            return found
    from rigid_lcp.solver import solve_friction

    solution: FrictionSolution = solve_friction(
        problem.bodies, problem.offset, problem.friction, problem.dim, tolerance=tolerance
    )
    return solution


def _moving(bodies: BodySpace, velocity: ArrayLike) -> tuple[int, Floats]:
    """2 or 3 dimensions, and the velocities of the bodies; refuses what is neither."""
    if not isinstance(bodies, BodySpace):
        raise ProblemError(
            f"they are a {type(bodies).__name__}", where="bodies",
            remedy="give a BodySpace: a collision needs J and M^-1 apart",
        )  # fmt: skip
    if bodies.body_size not in (3, 6):
        raise ProblemError(
            f"a body has {bodies.body_size} freedoms", where="body_size",
            remedy="give 3 in 2D and 6 in 3D",
        )  # fmt: skip
    freedoms = bodies.jacobian.shape[1]
    before = _numbers_of("velocity", velocity, freedoms, "one number a freedom, as J has columns")
    return (2 if bodies.body_size == 3 else 3), before


def _numbers_of(name: str, values: ArrayLike, count: int, remedy: str) -> Floats:
    array = finite_numbers(values, name).ravel()
    if len(array) != count:
        raise ProblemError(
            f"{name} has {len(array)} numbers, not {count}", where=name, remedy=f"give {remedy}"
        )
    return array


def _one_a_contact(name: str, values: ArrayLike, upper: float, nc: int) -> Floats:
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
            remedy="give a number of 0 or more" + (", at most 1" if upper == 1.0 else ""),
        )  # fmt: skip
    return array


def _check_choices(
    law: str, energy: str, tolerance: float, max_rounds: int, still: float, rest_speed: float
) -> None:
    for name, given, known in (("law", law, get_args(Law)), ("energy", energy, get_args(Energy))):
        if given not in known:
            raise UsageError(
                f"{name} is {given!r}", where=name, remedy="give one of " + ", ".join(known)
            )
    least = {"tolerance": tolerance, "still": still, "rest_speed": rest_speed}
    for name, value in least.items():
        if not (0.0 <= value < np.inf) or (name == "tolerance" and value == 0.0):
            raise UsageError(f"{name} is {value!r}", where=name, remedy="give a positive number")
    if isinstance(max_rounds, bool) or max_rounds != int(max_rounds) or max_rounds < 0:
        raise UsageError(
            f"max_rounds is {max_rounds!r}", where="max_rounds", remedy="give a count of 0 or more"
        )
