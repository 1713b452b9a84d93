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
  potential, and there is more than one such state: relaxed from another one
  (`relax_from`), the forces of a box of 46 discs with friction 1 or 5 differ by up to
  36 %, and in a wedge with a history of sliding by 8 times (sliders with memory, MD).  All obey eqs
  26 and 27.  The unique forces are by definition those reached from no displacements.
- Where bodies accelerate: displacements drift along the motion for ever, which opens what opens
  and slides what slides, friction against the velocity, and the forces of the contacts that hold
  are as above.

So an earlier answer (``start``) may change the cost and never the answer.  Without friction the
relaxation goes on from it, as the energy is convex.  With friction it is first asked whether all
contacts hold (`rigid_lcp.unique.held_contacts`: one factorisation, from the problem alone): then
this is the answer, and a start has nothing to add.  Else the relaxation is done from nothing: which
state it ends in hangs on where it begins, and no cheaper check tells it from its rivals.  Between
states that are near round-off may decide, so all is done in the problem's own order
(`rigid_lcp.unique.own_order`), and the way to the state with the load rounded to 1e-9: the same
numbers, whatever the order of contacts and bodies.  From there the last digits are found.

Measured, one thread, warm: towers of 10, 50 and 200 boxes (20 to 400 contacts) 0.01 to 0.1 s, a
frictionless pyramid of 465 discs (1,335 contacts) 0.6 s.  Pyramids between walls at
friction 0.3, a fourth to a third of their contacts sliding: 37 to 378 contacts, 0.04 to 1 s, and
not found with 592 and more.  On large piles that slide the tangent of springs and sliders along the
way has eigenvalues with negative real parts, and the relaxation does not settle
(`docs/rigid-indeterminacy.md`); the answer then says so.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from rigid_lcp.friction.problem import FrictionProblem
from rigid_lcp.unique.elastic_network import ElasticNetwork
from rigid_lcp.unique.held_contacts import find_held_displacement
from rigid_lcp.unique.micro_displacements import (
    ElasticForces,
    bodies_of,
    contact_stiffness,
    coulomb_spring,
    free_motion,
    keep_small_start,
    mass_free_jacobian,
    read_start_displacement,
    stiffest_mode,
)
from rigid_lcp.unique.own_order import OwnOrder, own_order

Floats = NDArray[np.float64]
FIRST_STEP = 1e3
"""First h in units of the stiffest mode's time."""
LONGEST_STEP = 1e6
"""Longest h in units of the stiffest mode's time while bodies move: h times the acceleration
enters xi, and with it round-off of ``LONGEST_STEP * 1e-16`` in the forces."""
LONGEST_STEP_AT_REST = 1e10
ROUNDED = 2.0**-30
"""Digits of the free motion that choose the state where contacts slide: round-off of the
order of sums is 1e-6 of the last and less."""
TURN, MOVES = 1e-8, 1e-3
"""Change of the forces below which springs of contacts that go on sliding are turned, and the part
of their length that these grow by in a step."""
STEPS_MAX = 400
STEP_GROWTH, STEP_GROWTH_SLIDING = 10.0, 3.0
"""Factors on h after a step that was found, without and with friction."""


def elastic_limit(
    problem: FrictionProblem,
    stiffness: ArrayLike = 1.0,
    *,
    start: ElasticForces | ArrayLike | None = None,
    tolerance: float = 1e-12,
    iterations_max: int = 2000,
) -> ElasticForces:
    """Forces that springs at the contacts choose, in the limit of stiff springs.

    ``problem`` with bodies; ``stiffness`` [N/m], see `contact_stiffness` (ratios matter only);
    ``start``: an earlier answer, or displacements (ndof,) [m, rad], which may save steps without
    friction and is of no effect with it (module docstring); ``tolerance``: on the
    scale-free residual and on the relative change of the forces in a last step (where bodies
    accelerate, the change may stall at 1e-11 by round-off and is then accepted).
    ``iterations_max`` counts Newton steps.  Raises `ProblemError` for a start that does not fit
    the problem; never raises for want of convergence.
    """
    bodies = bodies_of(problem)
    begun, _ = read_start_displacement(start, bodies, (problem.contacts, problem.dim))
    order, springs = _springs(problem, stiffness)
    network, begun = springs.network, begun[order.column]
    if problem.friction.any():
        held = find_held_displacement(
            order.problem, network.jacobian, network.free, network.stiffness, tolerance
        )
        if held is not None:
            return _restore_order(_held(order.problem, springs, held), order)
        return _restore_order(
            _relax_from_nothing(order.problem, springs, tolerance, iterations_max), order
        )
    begun = keep_small_start(
        begun, bodies_of(order.problem), springs.mode * network.stiffness, network.jacobian,
        network.free,
    )  # fmt: skip
    return _restore_order(_from(begun, order.problem, springs, tolerance, iterations_max), order)


def relax_from(
    problem: FrictionProblem,
    displacement: ArrayLike,
    stiffness: ArrayLike = 1.0,
    *,
    tolerance: float = 1e-12,
    iterations_max: int = 2000,
) -> ElasticForces:
    """Forces in the limit of the relaxation that begins at ``displacement`` (ndof,) [m, rad].

    Everything else as `elastic_limit` has it, which begins at none.  Use it to see whether a state
    (that of springs with a history, say) is an equilibrium of eqs 37 and 38; when not to use it:
    for the unique forces, as with friction each state may lead to its own.
    """
    begun, _ = read_start_displacement(
        displacement, bodies_of(problem), (problem.contacts, problem.dim)
    )
    order, springs = _springs(problem, stiffness)
    found = _from(begun[order.column], order.problem, springs, tolerance, iterations_max)
    return _restore_order(found, order)


@dataclass(frozen=True)
class _Springs:
    """The springs of a problem, scaled to the stiffest mode: h = 1 is a step without overshoot."""

    network: ElasticNetwork
    root: sp.csr_array
    """``M^-1/2``, (ndof, ndof)."""
    mode: float
    """The stiffest mode [1/s^2]."""


def _springs(problem: FrictionProblem, stiffness: ArrayLike) -> tuple[OwnOrder, _Springs]:
    """The problem in its own order, and its springs in that order."""
    k = contact_stiffness(problem, stiffness)
    order = own_order(problem, bodies_of(problem))
    jacobian, root = mass_free_jacobian(bodies_of(order.problem))
    free = free_motion(jacobian, order.problem.offset)
    k = k[order.contact]
    # a power of two: round-off of the mode is then none of the stiffness
    mode = 2.0 ** int(np.ceil(np.log2(stiffest_mode(jacobian, k) or 1.0)))
    network = ElasticNetwork(jacobian, free, k / mode, order.problem.friction)
    return order, _Springs(network, root, mode)


def _restore_order(found: ElasticForces, order: OwnOrder) -> ElasticForces:
    r, displacement = order.restored(found.r, found.displacement)
    return replace(found, r=r, displacement=displacement)


def _held(problem: FrictionProblem, springs: _Springs, displacement: Floats) -> ElasticForces:
    """The answer of contacts that all hold, at mass-free ``displacement`` (ndof,)."""
    network = springs.network
    nil = np.zeros(network.stiffness.shape)
    deformation = -(network.jacobian @ displacement).reshape(nil.shape)
    force, _ = coulomb_spring(deformation, nil, network.stiffness, problem.friction)
    return ElasticForces(
        force.ravel(), springs.root @ displacement / springs.mode, nil,
        problem.residual(force.ravel()), "solved", 1,
    )  # fmt: skip


def _from(
    begun: Floats, problem: FrictionProblem, springs: _Springs, tolerance: float,
    iterations_max: int,
) -> ElasticForces:  # fmt: skip
    """Relaxation from displacements ``begun`` (ndof,) [m, rad]."""
    # starting deformations are those of displacements: others would be a self-stress for good
    jacobian = bodies_of(problem).jacobian
    deformation = -springs.mode * (jacobian @ begun).reshape(springs.network.stiffness.shape)
    found, _ = _relax_steps(problem, springs, deformation, FIRST_STEP, tolerance, iterations_max)
    return replace(found, displacement=begun + found.displacement)


def _relax_from_nothing(
    problem: FrictionProblem, springs: _Springs, tolerance: float, iterations_max: int
) -> ElasticForces:
    """Relaxation from no displacements: to the state of the load in `ROUNDED` digits, which the
    round-off of q has no part in, and from there to that of the load itself."""
    network = springs.network
    free = rounded(network.free)
    rough = replace(problem, offset=network.jacobian @ free)
    near = replace(
        springs, network=ElasticNetwork(network.jacobian, free, network.stiffness, problem.friction)
    )
    none = np.zeros(network.stiffness.shape)
    first, deformation = _relax_steps(rough, near, none, FIRST_STEP, tolerance, iterations_max)
    if not first.solved:
        return replace(first, residual=problem.residual(first.r))
    rest = max(iterations_max - first.iterations, 1)  # the forces of none would be zero
    last, _ = _relax_steps(problem, springs, deformation, LONGEST_STEP, tolerance, rest)
    return replace(
        last, displacement=first.displacement + last.displacement,
        iterations=first.iterations + last.iterations,
    )  # fmt: skip


def rounded(numbers: Floats) -> Floats:
    """Numbers to `ROUNDED` of the greatest of them."""
    unit = 2.0 ** np.ceil(np.log2(np.abs(numbers).max(initial=0.0) or 1.0)) * ROUNDED
    return np.asarray(np.round(numbers / unit) * unit)


def _relax_steps(
    problem: FrictionProblem, springs: _Springs, deformation: Floats, h: float, tolerance: float,
    iterations_max: int,
) -> tuple[ElasticForces, Floats]:  # fmt: skip
    """Implicit relaxation from ``deformation`` (nc, dim), the first step of length ``h``; the
    forces with the displacements made, and the deformation at the end."""
    network, mode = springs.network, springs.mode
    jacobian, shape = network.jacobian, network.stiffness.shape
    nil = np.zeros(shape)
    way, force = np.zeros(jacobian.shape[1]), nil
    residual, change, longest = np.inf, np.inf, LONGEST_STEP
    growth = STEP_GROWTH_SLIDING if problem.friction.any() else STEP_GROWTH
    solved = shape[0] == 0
    if solved:
        residual = 0.0
    for _ in range(STEPS_MAX):
        if solved or network.newton_steps >= iterations_max or h <= 1e-3:
            break
        move, converged = network.implicit_step(deformation, h)
        if not converged:
            h /= 4.0
            continue
        way = way + move
        deformation = deformation - (jacobian @ move).reshape(shape)
        previous, earlier = force, change
        force, _ = coulomb_spring(deformation, nil, network.stiffness, problem.friction)
        residual = problem.residual(force.ravel())
        size = float(np.linalg.norm(force))
        change = float(np.linalg.norm(force - previous)) / size if size > 0 else 0.0
        stalled = change < 1e-8 and change > 0.5 * earlier
        settled = change <= tolerance or (stalled and change < 1e-11)
        if residual > tolerance and change < TURN:
            deformation = turned(deformation, -(jacobian @ move).reshape(shape))
        solved = residual <= tolerance and settled
        if stalled:
            # what is left is round-off, which a shorter step makes smaller
            longest /= 10.0
        moving = float(np.linalg.norm(move)) / (h * network.load)
        h = min(growth * h, LONGEST_STEP_AT_REST, longest / max(moving, 1e-300))
    spent = network.newton_steps
    message = "" if solved else (
        f"no equilibrium of elastic contacts was found in {spent} Newton steps (residual "
        f"{residual:.2g}, change of the forces {change:.2g}, asked: {tolerance:.2g})"
        "\n  -> ask for less, or take any solution of solve_friction: friction may be mobilised "
        "in more ways than one"
    )  # fmt: skip
    found = ElasticForces(
        force.ravel(), springs.root @ way / mode, nil, residual,
        "solved" if solved else "not converged", spent, message,
    )  # fmt: skip
    return found, deformation


def turned(deformation: Floats, growth: Floats) -> Floats:
    """Deformations (nc, dim), those that go on sliding turned into their ``growth`` in a step.

    A spring that slides points along the whole way of its contact; in space it turns into the
    velocity as 1 over that way only, and its friction with it.
    """
    length = np.linalg.norm(deformation[:, 1:], axis=1)
    speed = np.linalg.norm(growth[:, 1:], axis=1)
    slides = speed > MOVES * length
    new = deformation.copy()
    new[slides, 1:] = growth[slides, 1:] * (length[slides] / speed[slides])[:, None]
    return new
