"""Gauss-Seidel with momentum: one contact after another solved exactly, the others held.

    r_c <- the exact force of ``u_c = W_cc r_c + (u_c - W_cc r_c at present)``   for every c

(nonsmooth contact dynamics: Jean, Comput. Methods Appl. Mech. Eng. 177 (1999) 235; Jourdan,
Alart and Jean, ibid. 155 (1998) 31).  Where the factors of W are known, the velocities of the
bodies are kept and a visit costs two small products; else the row of W is multiplied.

Plain sweeps creep: news travel one contact a sweep.  With momentum (Nesterov) a sweep starts from
``y = r + beta (r - r before)``, beta growing towards one; where the step turns against the way
made, ``(y - r) . (r - r before) > 0`` with the weights diag W, it starts again from zero
(O'Donoghue and Candes, Found. Comput. Math. 15 (2015) 715).  Nothing proves that this converges
with friction, as nothing proves it of plain sweeps; so the residual is watched and the best point
kept.  Sweeps to a residual of 1e-6 and 1e-12, plain and with momentum (- where 1000 were short):

| problem (contacts)       | plain      | momentum   |
|--------------------------|------------|------------|
| spheres_500 (1251)       |   -    -   | 363   552  |
| discs_500 (928)          |   -    -   | 207   491  |
| tower3d_200 (800)        |   -    -   | 533    -   |
| KaplasTower (570)        | 493    -   | 105   312  |
| Capsules-i125 (286)      |   -    -   | 212   376  |
| FCP00237, sliding (376)  | 209   530  |  55   124  |
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rigid_lcp.cones import natural_residual
from rigid_lcp.contact_blocks import body_blocks, matrix_blocks
from rigid_lcp.errors import UsageError
from rigid_lcp.friction_problem import FrictionProblem, FrictionSolution, friction_solution
from rigid_lcp.local_contact import NONE, contact_2d, contact_3d

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Order = Literal["forward", "symmetric"]

CHECK_EVERY = 0.1
"""The residual costs about a sweep: it is taken when the sweeps have grown by this part."""


def gauss_seidel(
    problem: FrictionProblem,
    start: Floats | None = None,
    tolerance: float = 1e-6,
    sweeps: int = 1000,
    *,
    momentum: bool = True,
    order: Order | Integers = "forward",
) -> FrictionSolution:
    """Sweep until the residual is at or below ``tolerance``, or ``sweeps`` are done.

    ``start``: forces r (nc * dim,), zero if None.  ``momentum``: see above; without it the sweeps
    are plain, to smooth another method's point.  ``order``: ``forward`` visits the contacts as
    they are numbered, ``symmetric`` there and back in turn, an array of indices as it says.
    The best point of those looked at is returned.  Raises `UsageError` for an order that is no
    permutation.
    """
    contacts, dim = problem.contacts, problem.dim
    visit = contact_order(order, contacts)
    force = np.zeros((contacts, dim)) if start is None else np.array(start, dtype=float)
    force = np.ascontiguousarray(force.reshape(contacts, dim))
    symmetric = isinstance(order, str) and order == "symmetric"
    sweeper = Sweeper(problem, visit, symmetric=symmetric, momentum=momentum)
    best, best_residual = force.copy(), sweeper.residual(force)
    done = stuck = 0
    while best_residual > tolerance and done < sweeps:
        batch = min(sweeps - done, max(1, math.ceil(CHECK_EVERY * done)))
        for _ in range(batch):
            stuck = sweeper.sweep(force)
        done += batch
        residual = sweeper.residual(force)
        if not np.isfinite(residual):
            break
        if residual < best_residual:
            best, best_residual = force.copy(), residual
    message = (
        f"{stuck} contacts have no solution while the others are held (Painleve, or no mass)"
        "\n  -> solve at velocity level, or use a method that changes all contacts at once"
    )
    return friction_solution(
        problem, best.ravel(), tolerance, "gauss-seidel",
        {"sweeps": float(done), "contact updates": float(done) * contacts},
        message=message if stuck else "",
    )  # fmt: skip


class Sweeper:
    """Sweeps over one problem: its blocks, laid out once, and the momentum from sweep to sweep."""

    def __init__(
        self, problem: FrictionProblem, visit: Integers, *, symmetric: bool, momentum: bool
    ) -> None:
        self.problem, self.visit = problem, visit
        self.visit_backward = np.ascontiguousarray(visit[::-1])
        self.symmetric, self.momentum = symmetric, momentum
        self.offset = np.ascontiguousarray(problem.offset.reshape(-1, problem.dim))
        self.bodies = body_blocks(problem)
        self.rows = matrix_blocks(problem) if self.bodies is None else None
        blocks = self.bodies or self.rows
        assert blocks is not None
        self.weight = np.ascontiguousarray(np.einsum("cii->ci", blocks.local))
        self.done, self.time = 0, 1.0
        self.last = self.origin = np.zeros(0)
        self.velocity = self.last_velocity = np.zeros((0, 0))

    def sweep(self, force: Floats) -> int:
        """Change ``force`` (nc, dim) by one sweep; returns how many contacts have no answer.

        Called with the array it left; forces from elsewhere are for a new sweeper.
        """
        if self.done == 0:
            self.last = force.copy()
            if self.bodies is not None:
                self.velocity = self.bodies.body_velocity(force)
                self.last_velocity = self.velocity.copy()
        if self.momentum and not (self.symmetric and self.done % 2):
            later = 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * self.time**2))
            part = (self.time - 1.0) / later
            extrapolate(force, self.last, part)
            extrapolate(self.velocity, self.last_velocity, part)
            self.time, self.origin = later, force.copy()
        stuck = self.visit_all(force, backward=self.symmetric and self.done % 2 == 1)
        self.done += 1
        whole = not self.symmetric or self.done % 2 == 0
        if self.momentum and whole and turned_back(self.origin, force, self.last, self.weight):
            self.time = 1.0
            if self.bodies is not None:
                # Rid of the rounding of many changes; with momentum that would be thrown forward.
                self.velocity = self.bodies.body_velocity(force)
        return stuck

    def visit_all(self, force: Floats, *, backward: bool) -> int:
        """One plain sweep."""
        visit = self.visit_backward if backward else self.visit
        friction = self.problem.friction
        if self.rows is not None:
            rows = self.rows
            return sweep_matrix(
                rows.start, rows.column, rows.block, rows.local, self.offset, friction, force, visit
            )
        assert self.bodies is not None
        blocks = self.bodies
        kernel = sweep_bodies_2d if force.shape[1] == 2 else sweep_bodies_3d
        return kernel(
            blocks.body, blocks.block, blocks.local, self.offset, friction, force, self.velocity,
            visit,
        )  # fmt: skip

    def residual(self, force: Floats) -> float:
        """Scale-free natural residual of forces (nc, dim), by the blocks where there are any."""
        if self.bodies is None:
            return self.problem.residual(force.ravel())
        body = self.bodies.body_velocity(force)
        velocity = self.bodies.contact_velocity(body) + self.offset
        return natural_residual(force, velocity, self.problem.friction, self.problem.rho)


@njit(cache=True)
def extrapolate(values: Floats, last: Floats, part: float) -> None:
    """``y = x + part (x - last)``: changes ``values`` from x to y, and ``last`` to x; both 2D."""
    for i in range(values.shape[0]):
        for k in range(values.shape[1]):
            value = values[i, k]
            values[i, k] = value + part * (value - last[i, k])
            last[i, k] = value


@njit(cache=True)
def turned_back(origin: Floats, values: Floats, last: Floats, weight: Floats) -> bool:
    """``(y - x) . (x - last) > 0``: the sweep from y to x went against the way made since last."""
    product = 0.0
    for i in range(values.shape[0]):
        for k in range(values.shape[1]):
            back = origin[i, k] - values[i, k]
            product += weight[i, k] * back * (values[i, k] - last[i, k])
    return product > 0.0


def contact_order(order: Order | Integers, contacts: int) -> Integers:
    """The contacts in the order of a sweep; raises `UsageError` if it is no permutation."""
    if isinstance(order, str):
        if order in ("forward", "symmetric"):
            return np.arange(contacts, dtype=np.int64)
    else:
        given = np.asarray(order, dtype=np.int64)
        if given.shape == (contacts,) and (np.sort(given) == np.arange(contacts)).all():
            return given
    raise UsageError(
        "the order of the contacts is not one", where="gauss_seidel, order",
        remedy="give 'forward', 'symmetric' or an array with every contact once",
    )  # fmt: skip


@njit(cache=True)
def sweep_bodies_2d(
    body: Integers, block: Floats, local: Floats, offset: Floats, friction: Floats,
    force: Floats, velocity: Floats, visit: Integers,
) -> int:  # fmt: skip
    """A sweep in the plane, in body space; changes ``force`` and the bodies' ``velocity``.

    ``body`` (nc, 2) holds rows of ``velocity``.  Returns how many contacts found no force and
    kept theirs.
    """
    stuck = 0
    for c in visit:
        a, b = body[c, 0], body[c, 1]
        r_n, r_t = force[c, 0], force[c, 1]
        q_n = offset[c, 0] - local[c, 0, 0] * r_n - local[c, 0, 1] * r_t
        q_t = offset[c, 1] - local[c, 1, 0] * r_n - local[c, 1, 1] * r_t
        for k in range(3):
            v_a, v_b = velocity[a, k], velocity[b, k]
            q_n += block[c, 0, 0, k] * v_a + block[c, 1, 0, k] * v_b
            q_t += block[c, 0, 1, k] * v_a + block[c, 1, 1, k] * v_b
        new_n, new_t, status = contact_2d(local[c], q_n, q_t, friction[c])
        if status == NONE:
            stuck += 1
            continue
        force[c, 0], force[c, 1] = new_n, new_t
        d_n, d_t = new_n - r_n, new_t - r_t
        if d_n != 0.0 or d_t != 0.0:
            for k in range(3):
                velocity[a, k] += block[c, 0, 0, k] * d_n + block[c, 0, 1, k] * d_t
            for k in range(3):
                velocity[b, k] += block[c, 1, 0, k] * d_n + block[c, 1, 1, k] * d_t
    return stuck


@njit(cache=True)
def sweep_bodies_3d(
    body: Integers, block: Floats, local: Floats, offset: Floats, friction: Floats,
    force: Floats, velocity: Floats, visit: Integers,
) -> int:  # fmt: skip
    """`sweep_bodies_2d` in space."""
    stuck = 0
    for c in visit:
        a, b, w = body[c, 0], body[c, 1], local[c]
        r_n, r_1, r_2 = force[c, 0], force[c, 1], force[c, 2]
        q_n = offset[c, 0] - w[0, 0] * r_n - w[0, 1] * r_1 - w[0, 2] * r_2
        q_1 = offset[c, 1] - w[1, 0] * r_n - w[1, 1] * r_1 - w[1, 2] * r_2
        q_2 = offset[c, 2] - w[2, 0] * r_n - w[2, 1] * r_1 - w[2, 2] * r_2
        for k in range(6):
            v_a, v_b = velocity[a, k], velocity[b, k]
            q_n += block[c, 0, 0, k] * v_a + block[c, 1, 0, k] * v_b
            q_1 += block[c, 0, 1, k] * v_a + block[c, 1, 1, k] * v_b
            q_2 += block[c, 0, 2, k] * v_a + block[c, 1, 2, k] * v_b
        new_n, new_1, new_2, status = contact_3d(w, q_n, q_1, q_2, friction[c], -r_1, -r_2)
        if status == NONE:
            stuck += 1
            continue
        force[c, 0], force[c, 1], force[c, 2] = new_n, new_1, new_2
        d_n, d_1, d_2 = new_n - r_n, new_1 - r_1, new_2 - r_2
        if d_n != 0.0 or d_1 != 0.0 or d_2 != 0.0:
            for k in range(6):
                velocity[a, k] += (
                    block[c, 0, 0, k] * d_n + block[c, 0, 1, k] * d_1 + block[c, 0, 2, k] * d_2
                )
            for k in range(6):
                velocity[b, k] += (
                    block[c, 1, 0, k] * d_n + block[c, 1, 1, k] * d_1 + block[c, 1, 2, k] * d_2
                )
    return stuck


@njit(cache=True)
def sweep_matrix(
    start: Integers, column: Integers, block: Floats, local: Floats, offset: Floats,
    friction: Floats, force: Floats, visit: Integers,
) -> int:  # fmt: skip
    """A sweep with the rows of W, in blocks; changes ``force``; returns as `sweep_bodies_2d`."""
    stuck, dim = 0, force.shape[1]
    q = np.zeros(3)
    for c in visit:
        for i in range(dim):
            q[i] = offset[c, i]
        for entry in range(start[c], start[c + 1]):
            other = column[entry]
            if other != c:
                for i in range(dim):
                    for j in range(dim):
                        q[i] += block[entry, i, j] * force[other, j]
        if dim == 2:
            r_n, r_1, status = contact_2d(local[c], q[0], q[1], friction[c])
            r_2 = 0.0
        else:
            r_n, r_1, r_2, status = contact_3d(
                local[c], q[0], q[1], q[2], friction[c], -force[c, 1], -force[c, 2]
            )
        if status == NONE:
            stuck += 1
            continue
        force[c, 0], force[c, 1] = r_n, r_1
        if dim == 3:
            force[c, 2] = r_2
    return stuck
