"""The limit of the relaxation of section 8, computed directly.

Relaxation (eq. 40) is the overdamped motion ``dq' - dq = h M^-1 (Q + J^T f(-J dq'))``.  Taken
explicitly, as printed, h is bound by the stiffest contact; taken implicitly it may be as long as
wanted, and a few steps give the limit.  Each is a small system of elastic contacts, solved by a
semismooth Newton method in body space (3 or 6 unknowns a body, however many contacts).

What the limit is:

- Without friction, or where every contact is closed and sticks: among all forces that solve the
  rigid problem, the one that minimises ``sum f^2 / k`` (twice the elastic energy).  Proof: the
  Lagrangian of ``min sum f^2 / 2k`` subject to ``J^T f = c, f_N >= 0`` has its minimum at
  ``f = k (-J dq)`` where that is positive, with dq the multiplier: eqs 37 and 38.  It is strictly
  convex, so f is unique, whatever the order of contacts and bodies and whatever the start.
- Where contacts slide or open while others hold by friction (friction mobilised inside a jammed
  pile): equilibrium of springs and sliders loaded in one go from nothing.  Coulomb's law has no
  potential, and there is more than one such state (``begin``), all of eqs 26 and 27.  The unique
  forces are by definition those reached from no displacements.
- Where bodies accelerate: displacements drift along the motion for ever, which opens what opens
  and slides what slides, friction against the velocity, and the forces of the contacts that hold
  are as above.

Without friction the energy is convex.  With it, it is first asked whether all contacts hold
(`find_held_forces`), from one factorisation.  Else the relaxation is done from nothing.  Between
states that are near round-off may decide, so all is done in the problem's own order
(`reorder_problem`), and the way to the state with the load rounded to 1e-9: the same numbers,
whatever the order of contacts and bodies.  From there the last digits are found.

On large piles that slide the tangent of springs and sliders along the way has eigenvalues with
negative real parts, and the relaxation does not settle (`docs/rigid-indeterminacy.md`, with costs);
the answer then says so.

A time step has any of the impulses that fit.  What hangs on single forces (force chains, grains
that break) wants those that elastic contacts would choose at that moment (`find_unique_forces`).
"""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse.linalg import splu

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.contact import ContactForces
from rigid_lcp.errors import NotConverged, ProblemError
from rigid_lcp.friction.problem import BodySpace, FrictionProblem, make_problem
from rigid_lcp.motion import (
    Motion,
    World,
    find_contact_offset,
    make_body_space,
    make_contact_forces,
    replace_rates,
)
from rigid_lcp.unique.elastic_network import ElasticNetwork, find_slider_forces, find_spring_forces
from rigid_lcp.unique.micro_displacements import (
    ElasticForces,
    bound_stiffest_mode,
    find_free_motion,
    require_bodies,
    require_stiffness,
    scale_jacobian,
)


@dataclass(frozen=True)
class LimitNumbers:
    """Steps h in units of the stiffest mode's time, changes of the forces, and what is closed."""

    first_step: float = 1e3  # [-]
    longest_step: float = 1e6
    """While bodies move [-]: h times the acceleration enters xi, and with it round-off of
    ``longest_step * 1e-16`` in the forces."""
    longest_step_at_rest: float = 1e10  # and at rest [-]
    shortest_step: float = 1e-3  # [-]
    steps: int = 400  # at most [-]
    growth: float = 10.0  # of h after a step that was found, without friction [-],
    growth_sliding: float = 3.0  # and with it [-]
    rounded: float = 2.0**-30
    """Digits of the free motion that choose the state where contacts slide [-]: round-off of the
    order of sums is 1e-6 of the last and less."""
    turned_change: float = 1e-8  # of forces [-], below which springs that go on sliding turn
    sliding_growth: float = 1e-3  # part of their length [-] that these grow by in a step
    stalled_change: float = 1e-8  # of forces [-], below which one that does not halve is round-off
    settled_change: float = 1e-11  # of forces [-], below which it may end so
    held_step: float = 1e10  # of contacts that hold, proximal [-];
    held_steps: int = 8  # so many are made [-], each leaves 1e-10 over the softest mode
    outside_cone: float = 1e-3  # distance of such a force from its cone, over the greatest [-]
    closed_gap: float = 1e-6  # over the smallest body's size [-]: time steps leave such gaps
    tolerance: float = 1e-10  # of the forces at a state of a scene [-]


LIMIT = LimitNumbers()


def find_elastic_limit(
    problem: FrictionProblem, stiffness: ArrayLike = 1.0, *, begin: ArrayLike | None = None,
    tolerance: float = 1e-12, iterations_max: int = 2000,
) -> ElasticForces:  # fmt: skip
    """Forces that springs at the contacts choose, in the limit of stiff springs.

    ``problem`` with bodies; ``stiffness`` [N/m], see `find_contact_stiffness` (ratios matter only);
    ``tolerance``: on the scale-free residual and on the relative change of the forces in a last
    step (where bodies accelerate, the change may stall at 1e-11 by round-off and is then accepted).
    ``iterations_max`` counts Newton steps.  ``begin``: displacements (ndof,) [m, rad] at which the
    relaxation begins, to see whether a state is an equilibrium of eqs 37 and 38; not for the unique
    forces, which begin at none, as with friction each state may lead to its own.  Raises
    `ProblemError` for displacements that do not fit; never for want of convergence.
    """
    freedoms = require_bodies(problem).jacobian.shape[1]
    begun = np.zeros(freedoms) if begin is None else np.asarray(begin, dtype=float)
    if begun.shape != (freedoms,) or not np.isfinite(begun).all():
        raise ProblemError(
            f"begin is not {freedoms} finite displacements, one for each freedom", where="begin",
            remedy="give the displacement of an answer for the same bodies, or none",
        )  # fmt: skip
    mine, contact, row, column = reorder_problem(problem)
    jacobian, root = scale_jacobian(require_bodies(mine))
    k = require_stiffness(problem, stiffness)[contact]
    # a power of two: round-off of the mode is then none of the stiffness
    mode = 2.0 ** int(np.ceil(np.log2(bound_stiffest_mode(jacobian, k) or 1.0)))
    # in units of the stiffest mode: h = 1 is a step without overshoot
    network = ElasticNetwork(
        jacobian, find_free_motion(jacobian, mine.offset), k / mode, mine.friction
    )
    if problem.friction.any() and begin is None:
        found = find_held_forces(mine, network, tolerance)
        if found is None:
            found = _relax_from_nothing(mine, network, tolerance, iterations_max)
    else:
        # deformations of displacements: others would be a self-stress for good
        deformation = -mode * (require_bodies(mine).jacobian @ begun[column]).reshape(k.shape)
        found, _ = _relax(mine, network, deformation, LIMIT.first_step, tolerance, iterations_max)
    force, displacement = np.empty_like(found.r), begun.copy()
    force[row] = found.r
    displacement[column] += root @ found.displacement / mode
    return replace(found, r=force, displacement=displacement)


def reorder_problem(problem: FrictionProblem) -> tuple[FrictionProblem, Ints, Ints, Ints]:
    """The problem with contacts and bodies in an order that is theirs and not that of their
    numbers; the numbers of its contacts (nc,), forces (nc * dim,), freedoms (ndof,) in ``problem``.

    Where a problem has several solutions round-off decides between them, and round-off hangs on the
    order of sums.  Contacts are sorted by what q does to their normal velocities through W twice,
    bodies by how fast it moves them: numbers that no two have alike but by symmetry.
    """
    bodies = require_bodies(problem)
    dim, size = problem.dim, bodies.body_size
    once = bodies.product(problem.offset)
    contact = np.argsort(bodies.product(once)[::dim], kind="stable")
    speed = np.linalg.norm((bodies.spread @ once).reshape(-1, size), axis=1)
    body = np.argsort(speed, kind="stable")
    row = (contact[:, None] * dim + np.arange(dim)).ravel()
    column = (body[:, None] * size + np.arange(size)).ravel()
    jacobian = sp.csr_array(bodies.jacobian[row][:, column])
    inverse_mass = sp.csr_array(bodies.inverse_mass[column][:, column])
    for each in (jacobian, inverse_mass):
        each.sort_indices()
    space = BodySpace(jacobian, inverse_mass, size)
    mine = make_problem(space, problem.offset[row], problem.friction[contact], dim)
    return mine, contact, row, column


def find_held_forces(
    problem: FrictionProblem, network: ElasticNetwork, tolerance: float
) -> ElasticForces | None:
    """The answer, with mass-free displacements, where all contacts hold; None where they do not.

    Let every contact be closed and stick (a frictionless one carry its normal force), so that
    springs are linear, ``f = -K J dq``.  Balance ``J^T f + Q = 0`` then has one f: K is positive,
    and f is the force of least ``sum f^2 / k`` of all that balance, cones or no cones.  If it lies
    in the cones of friction it solves the rigid problem, is that of Coulomb's springs at rest, and
    the least there is in the cones as well.
    """
    jacobian, springs = network.jacobian, network.stiffness.copy()
    springs[problem.friction <= 0.0, 1:] = 0.0
    weighted = sp.csr_array(sp.diags_array(springs.ravel()) @ jacobian)
    identity = sp.eye_array(jacobian.shape[1], format="csc")
    solve = splu(sp.csc_array(identity / LIMIT.held_step + jacobian.T @ weighted)).solve
    displacement, trial = np.zeros(jacobian.shape[1]), np.zeros(springs.shape)
    for _ in range(LIMIT.held_steps):
        displacement = displacement + solve(network.free + jacobian.T @ trial.ravel())
        before, trial = trial, -(weighted @ displacement).reshape(springs.shape)
        force = find_slider_forces(trial, problem.friction * np.maximum(trial[:, 0], 0.0))
        if not np.abs(trial - force).max() <= LIMIT.outside_cone * np.abs(trial).max():
            return None
        change = float(np.linalg.norm(trial - before))
        if (
            change <= tolerance * float(np.linalg.norm(trial))
            and problem.residual(force.ravel()) <= tolerance
        ):
            deformation = -(jacobian @ displacement).reshape(springs.shape)
            r = find_spring_forces(deformation, network.stiffness, problem.friction).ravel()
            return ElasticForces(r, displacement, problem.residual(r), "solved", 1)
    return None


def _relax_from_nothing(
    problem: FrictionProblem, network: ElasticNetwork, tolerance: float, iterations_max: int
) -> ElasticForces:
    """Relaxation from no displacements: to the state of the load in `LIMIT`'s digits, which the
    round-off of q has no part in, and from there to that of the load itself."""
    free = round_numbers(network.free)
    rough = replace(problem, offset=network.jacobian @ free)
    near = ElasticNetwork(network.jacobian, free, network.stiffness, problem.friction)
    none = np.zeros(network.stiffness.shape)
    first, deformation = _relax(rough, near, none, LIMIT.first_step, tolerance, iterations_max)
    if not first.solved:
        return replace(first, residual=problem.residual(first.r))
    rest = max(iterations_max - first.iterations, 1)  # the forces of none would be zero
    last, _ = _relax(problem, network, deformation, LIMIT.longest_step, tolerance, rest)
    return replace(
        last, displacement=first.displacement + last.displacement,
        iterations=first.iterations + last.iterations,
    )  # fmt: skip


def round_numbers(numbers: Floats) -> Floats:
    """Numbers to so small a part as `LIMIT` has of the greatest of them."""
    unit = 2.0 ** np.ceil(np.log2(np.abs(numbers).max(initial=0.0) or 1.0)) * LIMIT.rounded
    return np.asarray(np.round(numbers / unit) * unit)


def _relax(
    problem: FrictionProblem, network: ElasticNetwork, deformation: Floats, h: float,
    tolerance: float, iterations_max: int,
) -> tuple[ElasticForces, Floats]:  # fmt: skip
    """Implicit relaxation from ``deformation`` (nc, dim), the first step of length ``h``; the
    forces with the mass-free displacements made, and the deformation at the end."""
    jacobian, shape = network.jacobian, network.stiffness.shape
    way, force = np.zeros(jacobian.shape[1]), np.zeros(shape)
    residual, change, longest = np.inf, np.inf, LIMIT.longest_step
    growth = LIMIT.growth_sliding if problem.friction.any() else LIMIT.growth
    solved = shape[0] == 0
    if solved:
        residual = 0.0
    for _ in range(LIMIT.steps):
        if solved or network.newton_steps >= iterations_max or h <= LIMIT.shortest_step:
            break
        move, converged = network.find_implicit_step(deformation, h)
        if not converged:
            h /= 4.0
            continue
        way = way + move
        deformation = deformation - (jacobian @ move).reshape(shape)
        previous, earlier = force, change
        force = find_spring_forces(deformation, network.stiffness, problem.friction)
        residual = problem.residual(force.ravel())
        size = float(np.linalg.norm(force))
        change = float(np.linalg.norm(force - previous)) / size if size > 0 else 0.0
        stalled = change < LIMIT.stalled_change and change > 0.5 * earlier
        settled = change <= tolerance or (stalled and change < LIMIT.settled_change)
        if residual > tolerance and change < LIMIT.turned_change:
            deformation = turn_deformation(deformation, -(jacobian @ move).reshape(shape))
        solved = residual <= tolerance and settled
        if stalled:
            # what is left is round-off, which a shorter step makes smaller
            longest /= 10.0
        moving = float(np.linalg.norm(move)) / (h * network.load)
        h = min(growth * h, LIMIT.longest_step_at_rest, longest / max(moving, 1e-300))
    spent = network.newton_steps
    message = "" if solved else (
        f"no equilibrium of elastic contacts was found in {spent} Newton steps (residual "
        f"{residual:.2g}, change of the forces {change:.2g}, asked: {tolerance:.2g})"
        "\n  -> ask for less, or take any solution of solve_friction: friction may be mobilised "
        "in more ways than one"
    )  # fmt: skip
    found = ElasticForces(
        force.ravel(), way, residual, "solved" if solved else "not converged", spent, message
    )  # fmt: skip
    return found, deformation


def turn_deformation(deformation: Floats, growth: Floats) -> Floats:
    """Deformations (nc, dim), those that go on sliding turned into their ``growth`` in a step.

    A spring that slides points along the whole way of its contact; in space it turns into the
    velocity as 1 over that way only, and its friction with it.
    """
    length = np.linalg.norm(deformation[:, 1:], axis=1)
    speed = np.linalg.norm(growth[:, 1:], axis=1)
    slides = speed > LIMIT.sliding_growth * length
    new = deformation.copy()
    new[slides, 1:] = growth[slides, 1:] * (length[slides] / speed[slides])[:, None]
    return new


def find_unique_forces(
    world: World, motion: Motion, loads: ArrayLike | None = None
) -> ContactForces:
    """Forces of elastic contacts at the state ``motion``, the same for any order and solver.

    ``loads`` (n, 3) or (n, 6) [N, N m].  All contacts are equally stiff.  For grains at rest or in
    slow motion: impacts are not in it.  Raises `NotConverged` where the limit is not found (many
    sliding contacts).
    """
    contacts = world.contacts(motion, 0.5 * LIMIT.closed_gap * world.length)
    none = np.zeros((len(contacts), motion.dim))
    if len(contacts) == 0:
        return make_contact_forces(contacts, none, None, 1.0)
    space = make_body_space(contacts, motion.position, world.columns, world.inverse_mass(motion))
    free = replace_rates(motion, world.accelerations(motion, loads))
    problem = make_problem(
        space, find_contact_offset(contacts, motion, free), contacts.friction, motion.dim
    )
    found = find_elastic_limit(problem, tolerance=LIMIT.tolerance)
    if not found.solved:
        raise NotConverged(
            f"the forces of elastic contacts were not found (residual {found.residual:.2g})",
            where="unique_forces", remedy=found.message,
        )  # fmt: skip
    return make_contact_forces(contacts, found.r.reshape(none.shape), None, 1.0)
