"""The friction problem: relative velocities ``u = W r + q`` under Coulomb's law, and its answer.

The same form serves forces and accelerations (eq. 26), impulses and velocities of a time step,
and collisions (eq. 35).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.errors import ProblemError
from rigid_lcp.friction.problem import checks
from rigid_lcp.friction.problem.cones import find_natural_map, find_natural_residual, norm
from rigid_lcp.sparse import (
    find_diagonal_blocks,
    find_row_forms,
    multiply_csr,
    multiply_factors,
    split_csr,
    split_jacobian,
)

Status = Literal["solved", "not converged", "no solution", "cycled", "singular", "out of time"]
"""What became of a problem: ``no solution`` is a proof (a ray), the others are not."""


MOST_FRICTION = 1e6
"""Largest coefficient of friction [-]: the residual shows ``rho |u_N| / mu`` of an approach."""
SHARE_LEFT = 0.1
"""Part of the error without forces that a solution may leave, where its forces are huge [-]."""
BODY_SIZE = {2: 3, 3: 6}
"""Freedoms of a body by dimension."""
FORCE_ROUND_OFF = 1e-15
"""Relative round-off of a force: what it leaves even where the residual is zero [-]."""


@dataclass(frozen=True)
class BodySpace:
    """W by its factors, ``W = J M^-1 J^T``: small where W fills in, as bodies have many contacts.

    ``jacobian`` J (nc * dim, ndof) CSR: relative velocities of the contacts from those of the
    bodies; ``inverse_mass`` M^-1 (ndof, ndof) sparse, symmetric, block diagonal [1/kg, 1/(kg m^2)];
    a body that can not move has no columns in J.  ``body_size``: freedoms of a body, 3 in 2D and
    6 in 3D.
    """

    jacobian: sp.csr_array
    inverse_mass: sp.csr_array
    body_size: int

    @cached_property
    def mass_blocks(self) -> Floats:
        """M by its blocks, (bodies, size, size) [kg, kg m^2]."""
        blocks = find_diagonal_blocks(*split_csr(self.inverse_mass), self.body_size)
        return np.asarray(np.linalg.inv(blocks), dtype=float)

    @cached_property
    def spread(self) -> sp.csr_array:
        """``M^-1 J^T`` (ndof, nc * dim): what forces do to the bodies."""
        return sp.csr_array(self.inverse_mass @ self.jacobian.T)

    @cached_property
    def matrix(self) -> sp.csr_array:
        """W, (nc * dim, nc * dim)."""
        return sp.csr_array(self.jacobian @ self.spread)

    @cached_property
    def diagonal(self) -> Floats:
        """The diagonal of W, without W."""
        found: Floats = find_row_forms(
            *split_csr(self.jacobian), *split_csr(self.inverse_mass), self.jacobian.shape[1]
        )
        return found

    def select_contacts(self, taking: Ints) -> BodySpace:
        """The same bodies and these contacts alone, by their numbers."""
        dim = 2 if self.body_size == 3 else 3
        rows = (dim * taking[:, None] + np.arange(dim)).ravel()
        return BodySpace(sp.csr_array(self.jacobian[rows]), self.inverse_mass, self.body_size)

    def product(self, force: Floats) -> Floats:
        """``W r``."""
        given = np.ascontiguousarray(force, dtype=float)
        made: Floats = multiply_factors(
            *split_csr(self.jacobian), *split_csr(self.inverse_mass), given
        )
        return made


@dataclass(frozen=True)
class FrictionProblem:
    """``u = W r + q`` with K* containing ``u + mu |u_T| n``, orthogonal to r in K.

    ``matrix`` W (nc * dim, nc * dim) CSR, or None where ``bodies`` has its factors; it need be
    neither regular nor quite symmetric.  ``offset`` q (nc * dim,); ``friction`` mu (nc,).
    Made by `make_problem`, which checks all of it.
    """

    matrix: sp.csr_array | None
    offset: Floats
    friction: Floats
    dim: int
    bodies: BodySpace | None = None

    @property
    def contacts(self) -> int:
        """Number of contacts nc."""
        return len(self.friction)

    @cached_property
    def delassus(self) -> sp.csr_array:
        """W itself, made from its factors if need be."""
        if self.matrix is not None:
            return self.matrix
        assert self.bodies is not None
        return self.bodies.matrix

    @cached_property
    def delassus_blocks(self) -> sp.bsr_array:
        """W in blocks, a row of (dim, dim) ones a contact."""
        return sp.bsr_array(self.delassus, blocksize=(self.dim, self.dim))

    @cached_property
    def body_jacobians(self) -> tuple[Ints, Ints, Floats]:
        """J of the bodies in blocks: ``first``, ``body``, ``block``
        (`rigid_lcp.sparse.body_matrix`)."""
        assert self.bodies is not None
        made: tuple[Ints, Ints, Floats] = split_jacobian(
            *split_csr(self.bodies.jacobian), self.dim, self.bodies.body_size
        )
        return made

    @cached_property
    def diagonal(self) -> Floats:
        """The diagonal of W, (nc * dim,)."""
        return self.bodies.diagonal if self.bodies is not None else self.delassus.diagonal()

    @cached_property
    def rho(self) -> float:
        """``1 / mean(diag W)``: force per velocity that makes the two comparable."""
        mean = float(self.diagonal.mean()) if len(self.diagonal) else 1.0
        return 1.0 / mean if mean > 0 else 1.0

    @cached_property
    def contact_rho(self) -> Floats:
        """``1 / max(diag W_cc)`` of every contact: force per velocity of it alone, (nc,)."""
        most = self.diagonal.reshape(-1, self.dim).max(axis=1)
        return 1.0 / np.maximum(most, 1e-9 / self.rho)

    @cached_property
    def error_without_forces(self) -> float:
        """Norm of the natural map at r = 0, in units of r: what forces have to mend."""
        shape = (self.contacts, self.dim)
        velocity = np.ascontiguousarray(self.offset).reshape(shape)
        none = np.zeros_like(velocity)
        scale = norm(velocity) or 1.0
        return scale * norm(find_natural_map(none, velocity / scale, self.friction, self.rho))

    def velocity(self, force: Floats) -> Floats:
        """``u = W r + q``, (nc * dim,)."""
        if self.matrix is None and self.bodies is not None:
            return self.bodies.product(force) + self.offset
        force = np.ascontiguousarray(force, dtype=float)
        made: Floats = multiply_csr(*split_csr(self.delassus), force)
        return made + self.offset

    def residual(self, force: Floats, velocity: Floats | None = None) -> float:
        """Scale-free natural residual of forces r (nc * dim,), see
        `rigid_lcp.friction.problem.cones`.

        ``velocity``: ``W r + q``, where it is known already.
        """
        shape = (self.contacts, self.dim)
        u = self.velocity(force) if velocity is None else velocity
        return find_natural_residual(
            np.ascontiguousarray(force).reshape(shape), np.ascontiguousarray(u).reshape(shape),
            self.friction, self.rho,
        )  # fmt: skip

    def reduces_error(self, force: Floats, residual: float) -> bool:
        """Whether forces of this residual leave little of the error without forces.

        Or of the velocities, each contact by its own rho: where W of one is 1e15 times that of
        another, rho of the mean sees nothing of the latter's.
        """
        left = max(residual, FORCE_ROUND_OFF) * norm(force)
        if left <= SHARE_LEFT * self.error_without_forces:
            return True
        none = self._find_approach(np.zeros_like(force))
        return none > 0.0 and self._find_approach(force) <= SHARE_LEFT * none

    def _find_approach(self, force: Floats) -> float:
        """Norm of the natural maps of all contacts over their own rho, what round-off of the forces
        may hide included."""
        shape = (self.contacts, self.dim)
        own, r = self.contact_rho[:, None], np.ascontiguousarray(force).reshape(shape)
        push = own * self.velocity(force).reshape(shape)
        error = np.abs(find_natural_map(r, push, self.friction, 1.0))
        return norm(np.maximum(error, FORCE_ROUND_OFF * np.abs(r)) / own)


@dataclass(frozen=True)
class FrictionSolution:
    """What a solver found: always its best point, with the residual that says how good it is."""

    r: Floats
    """Forces or impulses, (nc * dim,)."""
    u: Floats
    """Relative accelerations or velocities ``W r + q``, (nc * dim,)."""
    residual: float
    """Scale-free natural residual [-]."""
    status: Status
    method: str
    """The method that found it."""
    work: dict[str, float] = field(default_factory=dict)
    """Counts that do not depend on the machine: sweeps, pivots, factorisations, ..."""
    message: str = ""
    """Empty if solved; else what happened, and what to do."""

    @property
    def solved(self) -> bool:
        """The tolerance was reached."""
        return self.status == "solved"


def judge_forces(
    problem: FrictionProblem, force: Floats, tolerance: float, method: str,
    work: dict[str, float] | None = None, *, status: Status = "not converged", message: str = "",
    velocity: Floats | None = None,
) -> FrictionSolution:  # fmt: skip
    """Judge forces by their residual: ``solved`` at or below ``tolerance``, else ``status``.

    Forces that grow without bound in a problem that has no solution make the residual, which is
    relative to them, as small as one likes: they are not ``solved`` unless they also leave less
    than `SHARE_LEFT` of the error that no forces have (`FrictionProblem.reduces_error`).
    ``velocity``: ``W r + q``, where it is known already.
    """
    velocity = problem.velocity(force) if velocity is None else velocity
    residual = problem.residual(force, velocity)
    solved = residual <= tolerance and problem.reduces_error(force, residual)
    if not solved and not message and residual <= tolerance:
        message = (
            f"{method}: the residual is small, but only beside forces of"
            f" {float(np.abs(force).max()):.1g}; they leave most of what they have to mend"
            "\n  -> ask for a smaller tolerance; if that ends so too, forces grow without bound:"
            " look for contacts that bear on no mass, or use impulses"
        )
    elif not solved and not message:
        message = (
            f"{method} stopped at a residual of {residual:.2g} (asked: {tolerance:.2g})"
            "\n  -> ask for less, start from another point, or try another method"
        )
    return FrictionSolution(
        force, velocity, residual, "solved" if solved else status, method,
        work or {}, "" if solved else message,
    )  # fmt: skip


def make_problem(matrix: Any, offset: ArrayLike, friction: ArrayLike, dim: int) -> FrictionProblem:
    """Check W, q and mu and make a `FrictionProblem` of them; what was given is left as it is.

    ``matrix``: W (nc * dim, nc * dim) as a dense or sparse matrix, or as a `BodySpace`; ``offset``
    q (nc * dim,) or (nc, dim); ``friction`` mu (nc,), or one number for all; ``dim`` 2 or 3.
    Raises `ProblemError`, which names what is wrong and where.
    """
    if not isinstance(dim, int | np.integer) or dim not in (2, 3):
        raise ProblemError(f"dim is {dim!r}", where="dim", remedy="give 2 or 3")
    q = checks.require_by_contact(offset, "q", dim)
    checks.require_range(q, "q", least=0.0)  # bodies may come to rest as slowly as they like
    if len(q) % dim:
        raise ProblemError(
            f"q has {len(q)} numbers, which are not {dim} a contact", where="q",
            remedy="order it contact after contact: n, t" + ", t2" * (dim - 2),
        )  # fmt: skip
    contacts = len(q) // dim
    mu = checks.require_one_a_contact(friction, "mu", MOST_FRICTION, contacts)
    bodies = matrix if isinstance(matrix, BodySpace) else None
    if bodies is not None:
        checks.check_factors(bodies.jacobian, bodies.inverse_mass, bodies.body_size)
    w = None if bodies is not None else checks.require_matrix(matrix)
    if w is not None:
        checks.require_range(w.data, "W")
    shape = (bodies.jacobian.shape[0],) * 2 if bodies is not None else w.shape  # type: ignore[union-attr]
    if shape != (len(q), len(q)):
        raise ProblemError(
            f"W is {shape[0]} x {shape[1]} and q has {len(q)} numbers", where="W",
            remedy="give a square W with a row for every number of q",
        )  # fmt: skip
    return FrictionProblem(w, q, mu, int(dim), bodies)
