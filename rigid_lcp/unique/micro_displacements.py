"""Static indeterminacy resolved by micro-displacements: section 8, eqs 37-40.

Rigid grains with more contact forces than degrees of freedom have many forces that fit.  The
paper takes the ones that an elastic contact would choose: the grains make infinitesimal
displacements dq on top of their positions, these deform the contacts, and the deformations are
relaxed, overdamped, until the forces are consistent (eq. 27):

    xi = D dq                     (37)  deformations, [m]
    f = f(xi)                     (38)  `rigid_lcp.unique.elastic_network.find_spring_forces`, or
    yours a = A f + b                   (26)  contact accelerations
    D (dq' - dq) = -h a           (40)  repeated until (27) holds

What the paper leaves open, and what is done here:

- The sign of xi is not printed.  "If the contact acceleration is negative the displacement will be
  larger, yielding a larger force": xi is positive under compression, so ``D = -dg/dq = -J``.
  (With ``D = +J`` eqs 37-40 hold as printed and run away from the solution.)
- D is said to be lengthy; in the coordinates of eqs 9 and 20 it is just ``-J``.
- "We have to project -h a into the image space of D": ``A f = J M^-1 J^T f`` is in the image of J
  by itself, so only b can have a part outside.  It is projected once, by least squares
  (`find_free_motion`), and eq. 40 is then solved exactly by ``dq' - dq = h M^-1 (Q + J^T f)``.
- "As many variables as degrees of freedom, i.e., the system is unique": so it is for forces that
  are an increasing function of xi, hence without friction or with all contacts sticking, where
  the limit is the weighted minimum-norm solution (`rigid_lcp.unique.elastic_limit`).  Coulomb's law
  where contacts slide is no such function: the state reached can then depend on where the
  relaxation begins, so it begins at no displacements.
- h is not given: `find_stable_step` derives it.  The number of iterations grows as the ratio of the
  stiffest to the softest mode; `find_elastic_limit` finds the same forces without that cost.
- The last line of eq. 27 lacks ``a_T f_T <= 0``: friction opposes sliding.  The residual has it.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike
from scipy.sparse.linalg import splu

from rigid_lcp.arrays import Floats
from rigid_lcp.errors import ProblemError
from rigid_lcp.friction.problem import BodySpace, FrictionProblem, Status, find_natural_residual
from rigid_lcp.unique.elastic_network import find_spring_forces

ForceLaw = Callable[[Floats, Floats, Floats], Floats]
"""Eq. 38: ``law(deformation, stiffness, friction) -> force``, see `find_spring_forces`."""


@dataclass(frozen=True)
class ElasticForces:
    """Forces that elastic contacts choose among all those that rigid grains allow."""

    r: Floats  # forces, (nc * dim,) [N] (impulses [N s] where the problem is one of impulses)
    displacement: Floats  # micro-displacements dq, (ndof,) [m, rad]
    residual: float  # scale-free natural residual of r: how well eqs 26 and 27 hold [-]
    status: Status
    iterations: int  # relaxation steps, or Newton steps in the direct method
    message: str = ""

    @property
    def solved(self) -> bool:
        """The tolerance was reached."""
        return self.status == "solved"


def require_stiffness(problem: FrictionProblem, stiffness: ArrayLike) -> Floats:
    """Stiffness of every contact and direction (nc, dim) [N/m] from one number, (nc,) or (nc, dim).

    Only ratios matter for the forces.  Raises `ProblemError` for what is not above zero.
    """
    shape = (problem.contacts, problem.dim)
    k = np.asarray(stiffness, dtype=float)
    if k.shape not in ((), shape[:1], shape):
        raise ProblemError(
            f"stiffness has shape {k.shape} for {shape[0]} contacts in {shape[1]}D",
            where="stiffness",
            remedy="give one number, one a contact, or one a contact and direction",
        )
    if not (np.isfinite(k).all() and (k > 0).all()):
        raise ProblemError(
            "a contact's stiffness is not a number above zero", where="stiffness",
            remedy="leave out contacts that carry nothing; use 1 for all if none is known",
        )  # fmt: skip
    if k.ndim == 2 and shape[1] == 3 and (k[:, 1] != k[:, 2]).any():
        raise ProblemError(
            "the two tangential stiffnesses of a contact differ", where="stiffness",
            remedy="give both the same: friction has no preferred direction",
        )  # fmt: skip
    return np.array(np.broadcast_to(k[:, None] if k.ndim == 1 else k, shape))


def scale_jacobian(bodies: BodySpace) -> tuple[sp.csr_array, sp.csr_array]:
    """``(J M^-1/2, M^-1/2)``: coordinates in which every body has unit mass, ``dq = M^-1/2 y``."""
    size, inverse = bodies.body_size, sp.coo_array(bodies.inverse_mass)
    row, column = inverse.coords
    blocks = np.zeros((inverse.shape[0] // size, size, size))
    np.add.at(blocks, (row // size, row % size, column % size), inverse.data)
    values, vectors = np.linalg.eigh(blocks)
    roots = np.einsum("bij,bj,bkj->bik", vectors, np.sqrt(np.maximum(values, 0.0)), vectors)
    pointer = np.arange(len(blocks) + 1)
    root = sp.csr_array(sp.bsr_array((roots, pointer[:-1], pointer), shape=inverse.shape))
    return sp.csr_array(bodies.jacobian @ root), root


def bound_stiffest_mode(jacobian: sp.csr_array, stiffness: Floats) -> float:
    """Bound from above on the greatest eigenvalue of ``K^1/2 A K^1/2`` [1/s^2].

    The greatest row sum of magnitudes (Gershgorin); ``jacobian`` is mass free.
    """
    scaled = sp.csr_array(sp.diags_array(np.sqrt(stiffness.ravel())) @ jacobian)
    sums = np.asarray(abs(scaled @ scaled.T).sum(axis=1))
    return float(sums.max(initial=0.0))


def find_stable_step(jacobian: sp.csr_array, stiffness: Floats) -> float:
    """Step h [s^2] of eq. 40 at which no mode of sticking or frictionless contacts overshoots.

    A step multiplies the error of a mode of ``K^1/2 A K^1/2`` with eigenvalue l by ``1 - h l``: it
    converges for ``h < 2 / l_max`` and without overshoot for ``h <= 1 / l_max``, taken here.  A
    sliding contact alone has ``l <= (1 + mu^2)^1/2 l_max``, below 2 up to ``mu = 1.7``; for
    several there is no proof.
    """
    mode = bound_stiffest_mode(jacobian, stiffness)
    return 1.0 / mode if mode > 0 else 1.0


def find_free_motion(jacobian: sp.csr_array, offset: Floats) -> Floats:
    """Mass-free accelerations y (ndof,) without contact forces: least squares of ``J y = b``.

    This is the projection before eq. 40, and the external forces Q that belong to b.
    """
    normal = sp.csc_array(jacobian.T @ jacobian)
    scale = float(normal.diagonal().max(initial=0.0)) or 1.0
    factor = splu(normal + 1e-8 * scale * sp.eye_array(normal.shape[0], format="csc"))
    motion = np.zeros(jacobian.shape[1])
    # the shift alone is off by 1e-8; repeated steps remove it (proximal point)
    for _ in range(20):
        step = factor.solve(jacobian.T @ (offset - jacobian @ motion))
        motion += step
        if np.linalg.norm(step) <= 1e-15 * np.linalg.norm(motion):
            break
    return motion


def require_bodies(problem: FrictionProblem) -> BodySpace:
    """The problem's bodies, which micro-displacements need; raises `ProblemError` without."""
    if problem.bodies is None:
        raise ProblemError(
            "the problem has a matrix W but no bodies that could be displaced", where="W",
            remedy="give W as a BodySpace, with its Jacobian and inverse mass",
        )  # fmt: skip
    return problem.bodies


def relax_displacements(
    problem: FrictionProblem, stiffness: ArrayLike = 1.0, step: float | None = None,
    tolerance: float = 1e-12, *, law: ForceLaw = find_spring_forces, iterations_max: int = 200_000,
) -> ElasticForces:  # fmt: skip
    """Contact forces by the paper's overdamped relaxation of micro-displacements, from none.

    ``problem`` with bodies; ``stiffness`` [N/m], see `find_contact_stiffness`; ``step`` h [s^2]
    (default: `find_stable_step`); ``tolerance`` on the scale-free residual; ``law``: eq. 38.  Never
    raises for want of convergence: see ``status``.  When not to use it: for many grains, where
    `rigid_lcp.unique.elastic_limit` has the same answer at a fraction of the cost.
    """
    bodies = require_bodies(problem)
    shape = (problem.contacts, problem.dim)
    k = require_stiffness(problem, stiffness)
    jacobian, root = scale_jacobian(bodies)
    free = root @ find_free_motion(jacobian, problem.offset)
    if step is None:
        step = find_stable_step(jacobian, k)
    displacement = np.zeros(len(free))
    lost = problem.offset - bodies.jacobian @ free

    best = (np.inf, np.zeros(shape), displacement)
    for iterations in range(iterations_max + 1):  # noqa: B007 (its last value is reported)
        deformation = -(bodies.jacobian @ displacement).reshape(shape)
        force = law(deformation, k, problem.friction)
        motion = bodies.inverse_mass @ (bodies.jacobian.T @ force.ravel()) + free
        acceleration = (bodies.jacobian @ motion + lost).reshape(shape)
        residual = find_natural_residual(force, acceleration, problem.friction, problem.rho)
        if not residual >= best[0]:
            best = (residual, force, displacement)
        if residual <= tolerance or not np.isfinite(residual):
            break
        displacement = displacement + step * motion
    residual, force, displacement = best
    solved = residual <= tolerance
    message = "" if solved else (
        f"the relaxation stopped after {iterations} steps at a residual of {residual:.2g} "
        f"(asked: {tolerance:.2g})\n  -> use elastic_limit, a smaller step, or ask for less"
    )  # fmt: skip
    return ElasticForces(
        force.ravel(), displacement, residual, "solved" if solved else "not converged", iterations,
        message,
    )  # fmt: skip
