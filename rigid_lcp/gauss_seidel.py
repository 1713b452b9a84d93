"""Gauss-Seidel with momentum: one contact after another solved exactly, the others held.

    r_c <- the exact force of ``u_c = W_cc r_c + (u_c - W_cc r_c at present)``   for every c

(nonsmooth contact dynamics: Jean, Comput. Methods Appl. Mech. Eng. 177 (1999) 235; Jourdan,
Alart and Jean, ibid. 155 (1998) 31).  Where the factors of W are known, the velocities of the
bodies are kept and a visit costs two small products; else the row of W is multiplied.

Plain sweeps creep: news travel one contact a sweep.  With momentum (Nesterov) a sweep starts from
``y = r + beta (r - r before)``, beta growing towards one; where the step turns against the way
made, ``(y - r) . (r - r before) > 0`` with the weights diag W, it starts again from zero
(O'Donoghue and Candes, Found. Comput. Math. 15 (2015) 715), and too where steps grow.  Nothing
proves that this converges with friction, as nothing proves it of plain sweeps; so the residual is
watched and the best point kept.  Where a bed yields slowly the sweeps drift at some 1e-6 for
thousands: Newton's method (`rigid_lcp.newton`) goes on from there.  Sweeps to a residual of 1e-6
and of 1e-12 (- where 2000 were short):

| problem (contacts)       | plain        | momentum   |
|--------------------------|--------------|------------|
| spheres_500 (1251)       |   -      -   | 734    901 |
| discs_500 (928)          |   -      -   | 229    566 |
| tower3d_200 (800)        |   -      -   | 537     -  |
| KaplasTower (570)        | 541   1881   |  99    324 |
| Capsules-i125 (286)      |   -      -   | 284    407 |
| FCP00237, sliding (376)  | 227    541   |  55    132 |
"""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rigid_lcp.cones import natural_residual
from rigid_lcp.contact_blocks import body_blocks, matrix_blocks
from rigid_lcp.contact_sweeps import sweep_bodies_2d, sweep_bodies_3d, sweep_matrix
from rigid_lcp.errors import UsageError
from rigid_lcp.friction_problem import FrictionProblem, FrictionSolution, friction_solution

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Order = Literal["forward", "symmetric"]

GROWTH = 1.5
"""Momentum starts again when a sweep changes the forces by so many times the least change since
it last did: without this large beds (10,000 contacts) swing on at 1e-4, as nothing turns back."""
CHECK_EVERY = 0.1
"""The residual costs about a sweep: it is taken when the sweeps have grown by this part, and when
the change a sweep makes has fallen as far as the residual should."""


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
    stuck, enough = 0, 0.0
    while best_residual > tolerance and sweeper.done < sweeps:
        check = min(sweeps, sweeper.done + max(1, math.ceil(CHECK_EVERY * sweeper.done)))
        while sweeper.done < check:
            stuck = sweeper.sweep(force)
            if sweeper.change <= enough:
                break
        residual = sweeper.residual(force)
        if not np.isfinite(residual):
            break
        if residual < best_residual:
            best, best_residual = force.copy(), residual
        if momentum and residual > 0:
            enough = sweeper.change * min(0.9, tolerance / residual)
    message = (
        f"{stuck} contacts have no solution while the others are held (Painleve, or no mass)"
        "\n  -> solve at velocity level, or use a method that changes all contacts at once"
    )
    return friction_solution(
        problem, best.ravel(), tolerance, "gauss-seidel",
        {"sweeps": float(sweeper.done), "contact updates": float(sweeper.done) * contacts},
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
        self.done, self.time, self.least, self.change = 0, 1.0, math.inf, math.inf
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
        if self.momentum and whole and self.restarts(force):
            # Begin anew, and rid the velocities of rounding, which momentum would throw forward.
            self.time, self.least = 1.0, math.inf
            if self.bodies is not None:
                self.velocity = self.bodies.body_velocity(force)
        return stuck

    def restarts(self, force: Floats) -> bool:
        """The sweep turned back, or went farther than the shortest since the last restart."""
        product, square = step_made(self.origin, force, self.last, self.weight)
        self.change = math.sqrt(square)
        self.least = min(self.least, self.change)
        return product > 0.0 or self.change > GROWTH * self.least

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
def step_made(origin: Floats, values: Floats, last: Floats, weight: Floats) -> tuple[float, float]:
    """``(y - x) . (x - last)`` and ``|y - x|^2`` of a sweep from y to x, weighted.

    The first is positive if the sweep went against the way made since ``last``.
    """
    product = square = 0.0
    for i in range(values.shape[0]):
        for k in range(values.shape[1]):
            back = origin[i, k] - values[i, k]
            product += weight[i, k] * back * (values[i, k] - last[i, k])
            square += weight[i, k] * back * back
    return product, square


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
