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
  `minimum_norm_forces` computes it apart, by linear algebra, for contacts that stick.
- Where contacts slide while others hold (friction mobilised inside a jammed pile): equilibrium of
  springs and sliders loaded in one go from nothing.  Coulomb's law has no potential; uniqueness
  is not proved, and a history of sliding (`coulomb_slider`, MD) ends in other forces.
- Where bodies accelerate: displacements drift along the motion for ever, which opens what opens
  and slides what slides, and the forces of the contacts that hold are as above.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray
from scipy.sparse.linalg import splu

from rigid_lcp.friction_problem import FrictionProblem
from rigid_lcp.micro_displacements import (
    ElasticForces,
    bodies_of,
    contact_stiffness,
    coulomb_spring,
    free_motion,
    mass_free_jacobian,
    stiffest_mode,
)

Floats = NDArray[np.float64]
LONGEST_STEP = 1e6
"""Longest h in units of the stiffest mode's time while bodies move: h times the acceleration
enters xi, and with it round-off of ``LONGEST_STEP * 1e-16`` in the forces."""
LONGEST_STEP_AT_REST = 1e10


def elastic_limit(
    problem: FrictionProblem,
    stiffness: ArrayLike = 1.0,
    *,
    start: ArrayLike | None = None,
    tolerance: float = 1e-12,
    iterations_max: int = 500,
) -> ElasticForces:
    """Forces that springs at the contacts choose, in the limit of stiff springs.

    ``problem`` with bodies; ``stiffness`` [N/m], see `contact_stiffness` (ratios matter only);
    ``start``: deformations xi (nc, dim) to begin with (default: none); ``tolerance``: on the
    scale-free residual and on the relative change of the forces in a last step (where bodies
    accelerate, the change may stall at 1e-11 by round-off and is then accepted).
    ``iterations_max`` counts Newton steps.  Never raises for want of convergence.
    """
    bodies = bodies_of(problem)
    shape = (problem.contacts, problem.dim)
    k = contact_stiffness(problem, stiffness)
    jacobian, root = mass_free_jacobian(bodies)
    free = free_motion(jacobian, problem.offset)
    # springs scaled to the stiffest mode: h = 1 is then a step without overshoot
    mode = stiffest_mode(jacobian, k) or 1.0
    network = _Network(jacobian, free, k / mode, problem.friction)
    nil = np.zeros(shape)
    deformation = nil if start is None else np.asarray(start, dtype=float).reshape(shape)

    displacement, force = np.zeros(jacobian.shape[1]), nil
    residual, change, spent, h = np.inf, np.inf, 0, LONGEST_STEP
    solved = shape[0] == 0
    if solved:
        residual = 0.0
    while not solved and spent < iterations_max and h > 1e-3:
        move, newton_steps, converged = network.implicit_step(deformation, h)
        spent += newton_steps
        if not converged:
            h /= 30.0
            continue
        displacement = displacement + move
        deformation = deformation - (jacobian @ move).reshape(shape)
        previous, earlier = force, change
        force, _ = coulomb_spring(deformation, nil, network.stiffness, problem.friction)
        residual = problem.residual(force.ravel())
        size = float(np.linalg.norm(force))
        change = float(np.linalg.norm(force - previous)) / size if size > 0 else 0.0
        settled = change <= tolerance or (change < 1e-9 and change > 0.5 * earlier)
        solved = residual <= tolerance and settled
        h = min(10.0 * h, network.longest_step(move / h))
    message = "" if solved else (
        f"no equilibrium of elastic contacts was found in {spent} Newton steps (residual "
        f"{residual:.2g}, change of the forces {change:.2g}, asked: {tolerance:.2g})"
        "\n  -> ask for less, or take any solution of solve_friction: friction may be mobilised "
        "in more ways than one"
    )  # fmt: skip
    return ElasticForces(
        force.ravel(), root @ displacement / mode, nil, residual,
        "solved" if solved else "not converged", spent, message,
    )  # fmt: skip


def minimum_norm_forces(problem: FrictionProblem, stiffness: ArrayLike = 1.0) -> Floats:
    """``argmin sum f^2 / k`` with every contact closed and sticking, (nc * dim,) [N].

    By dense least squares, of order ``(nc dim)^3``: a check on `elastic_limit` for small problems.
    When not to use it: contacts that would pull or slide are not noticed; the residual tells.
    """
    bodies = bodies_of(problem)
    weight = np.sqrt(contact_stiffness(problem, stiffness).ravel())
    jacobian, _ = mass_free_jacobian(bodies)
    scaled = sp.csr_array(sp.diags_array(weight) @ jacobian).toarray()
    free = free_motion(jacobian, problem.offset)
    least, *_ = np.linalg.lstsq(scaled.T, -free, rcond=1e-12)
    return np.asarray(weight * least)


class _Network:
    """Elastic contacts on bodies of unit mass: residual and slope of one implicit step."""

    def __init__(
        self, jacobian: sp.csr_array, free: Floats, stiffness: Floats, friction: Floats
    ) -> None:
        self.jacobian, self.free = jacobian, free
        self.stiffness, self.friction = stiffness, friction
        self.slip = np.zeros_like(stiffness)
        self.identity = sp.eye_array(jacobian.shape[1], format="csc")

    def imbalance(self, deformation: Floats, move: Floats, h: float) -> Floats:
        """``d / h - Q - J^T f(xi - J d)``: zero for the move d of an implicit step."""
        moved = deformation - (self.jacobian @ move).reshape(deformation.shape)
        force, _ = coulomb_spring(moved, self.slip, self.stiffness, self.friction)
        return np.asarray(move / h - self.free - self.jacobian.T @ force.ravel())

    def slope(self, deformation: Floats, move: Floats, h: float) -> sp.csc_array:
        """Derivative of `imbalance`, ``1 / h + J^T f' J``."""
        moved = deformation - (self.jacobian @ move).reshape(deformation.shape)
        blocks = coulomb_spring_slope(moved, self.stiffness, self.friction)
        count, dim, _ = blocks.shape
        law = sp.bsr_array(
            (blocks, np.arange(count), np.arange(count + 1)), shape=(count * dim,) * 2
        )
        return sp.csc_array(self.identity / h + self.jacobian.T @ (law @ self.jacobian))

    def implicit_step(self, deformation: Floats, h: float) -> tuple[Floats, int, bool]:
        """Move d (ndof,) with ``d = h (Q + J^T f(xi - J d))``, Newton steps, whether found."""
        move = np.zeros(self.jacobian.shape[1])
        value = self.imbalance(deformation, move, h)
        scale = float(np.linalg.norm(self.free)) or 1.0
        error = float(np.linalg.norm(value))
        for step in range(40):
            if error <= 1e-14 * scale:
                return move, step, True
            direction = splu(self.slope(deformation, move, h)).solve(-value)
            length, best = 1.0, error
            while length > 1e-4:
                value_tried = self.imbalance(deformation, move + length * direction, h)
                best = float(np.linalg.norm(value_tried))
                if best < (1 - 1e-4 * length) * error:
                    break
                length /= 2
            if not best < error:
                # no descent left: round-off if the balance is as good as sums of forces can be
                return move, step + 1, error <= 1e-10 * scale
            move, value, error = move + length * direction, value_tried, best
        return move, 40, False

    def longest_step(self, acceleration: Floats) -> float:
        """Longest useful h: long where bodies rest, short enough where round-off would enter."""
        moving = float(np.linalg.norm(acceleration)) / (float(np.linalg.norm(self.free)) or 1.0)
        return LONGEST_STEP * min(LONGEST_STEP_AT_REST / LONGEST_STEP, 1.0 / max(moving, 1e-300))


def coulomb_spring_slope(deformation: Floats, stiffness: Floats, friction: Floats) -> Floats:
    """Derivative of `coulomb_spring` without slip, ``df / dxi`` (nc, dim, dim) [N/m].

    At a kink the derivative of the closed, sticking side.
    """
    count, dim = deformation.shape
    trial = stiffness * deformation
    closed = trial[:, 0] >= 0
    size = np.linalg.norm(trial[:, 1:], axis=1)
    allowed = friction * np.maximum(trial[:, 0], 0.0)
    slides = closed & (size > allowed)
    blocks = np.zeros((count, dim, dim))
    blocks[:, range(dim), range(dim)] = np.where(closed[:, None], stiffness, 0.0)
    along = trial[slides, 1:] / size[slides, None]
    share = allowed[slides] / size[slides]
    across = np.eye(dim - 1) - along[:, :, None] * along[:, None, :]
    blocks[slides, 1:, 0] = (friction * stiffness[:, 0])[slides, None] * along
    blocks[slides, 1:, 1:] = share[:, None, None] * across * stiffness[slides, None, 1:]
    # without friction there is no tangential force to begin with
    blocks[friction == 0, 1:, 1:] = 0.0
    return blocks
