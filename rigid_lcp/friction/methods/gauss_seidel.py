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
thousands: Newton's method (`rigid_lcp.friction.methods.newton`) goes on from there.  Sweeps to a
residual of 1e-6 and of 1e-12 (- where 2000 were short):

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

from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.errors import UsageError
from rigid_lcp.friction.problem import (
    FrictionProblem,
    FrictionSolution,
    judge_forces,
    read_order,
    require_number,
    require_start,
    require_whole,
)
from rigid_lcp.friction.sweeps import (
    BodyBlocks,
    Momentum,
    SweepBlocks,
    lay_out_bodies,
    lay_out_matrix,
    pack_contacts,
    residual_of,
    sweep_once,
    sweep_until_small,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Order = Literal["forward", "symmetric"]


def gauss_seidel(
    problem: FrictionProblem,
    start: Floats | None = None,
    tolerance: float = 1e-6,
    sweeps: int = 1000,
    *,
    momentum: bool = True,
    order: Order | Integers = "forward",
    sweeper: Sweeper | None = None,
    last: bool = False,
    slow: tuple[int, float] = (0, np.inf),
) -> FrictionSolution:
    """Sweep until the residual is at or below ``tolerance``, or ``sweeps`` are done.

    ``start``: forces r (nc * dim,), zero if None.  ``momentum``: see above; without it the sweeps
    are plain, to smooth another method's point.  ``order``: ``forward`` visits the contacts as
    they are numbered, ``symmetric`` there and back in turn, an array of indices as it says.
    ``sweeper``: that of an earlier call for the same problem; the two options before are its own.
    The best point of those looked at is returned, or with ``last`` the one where the sweeps end: a
    self-stress that has to grow does so without a better residual, and sweeps that go on from the
    best point lose the way made.  ``slow``: sweeps after which to give up if more than this
    residual is left, looked at as often as the residual is.

    Raises `ProblemError` for a start that is none, `UsageError` for an order that is no permutation
    and other options that are none.
    """
    tolerance = require_number(tolerance, "tolerance", zero=True)
    sweeps = require_whole(sweeps, "sweeps")
    contacts, dim = problem.contacts, problem.dim
    if sweeper is None:
        visit = contact_order(order, contacts)
        symmetric = isinstance(order, str) and order == "symmetric"
        sweeper = Sweeper(problem, visit, symmetric=symmetric, momentum=momentum)
    force = np.zeros(contacts * dim) if start is None else require_start(start, contacts * dim, dim)
    best, _, stuck = sweeper.sweep_until(force.reshape(contacts, dim), tolerance, sweeps, slow)
    message = (
        f"{stuck} contacts have no solution while the others are held (Painleve, or no mass)"
        "\n  -> solve at velocity level, or use a method that changes all contacts at once"
    )
    return judge_forces(
        problem, force.ravel() if last else best.ravel(), tolerance, "gauss-seidel",
        {"sweeps": sweeper.done, "contact updates": sweeper.done * contacts},
        message=message if stuck else "",
    )  # fmt: skip


class Sweeper:
    """Sweeps over one problem: its blocks, laid out once, and the momentum from sweep to sweep."""

    def __init__(
        self, problem: FrictionProblem, visit: Integers, *, symmetric: bool, momentum: bool
    ) -> None:
        self.visit, self.visit_backward = visit, np.ascontiguousarray(visit[::-1])
        self.symmetric, self.momentum = symmetric, momentum
        self.bodies = lay_out_bodies(problem)
        self.blocks = sweep_blocks(problem, self.bodies)
        self.state = self._at_rest(np.zeros((problem.contacts, problem.dim)))

    @property
    def done(self) -> float:
        """Sweeps since forces came from elsewhere."""
        return float(self.state.tally[0])

    def sweep(self, force: Floats) -> int:
        """Change ``force`` (nc, dim) by one sweep; returns how many contacts have no answer.

        Called with the array it left; forces from elsewhere are for a new sweeper.
        """
        if self.done == 0:
            self.state = self._at_rest(force)
        return sweep_once(
            self.blocks, self.state, force, self.visit, self.visit_backward, self.symmetric,
            self.momentum,
        )  # fmt: skip

    def sweep_until(
        self, force: Floats, tolerance: float, sweeps: int, slow: tuple[int, float] = (0, np.inf)
    ) -> tuple[Floats, float, int]:
        """Sweep from forces (nc, dim) from anywhere: best forces, their residual, and how many
        contacts have no answer."""
        force = np.ascontiguousarray(force)
        self.state = self._at_rest(force)
        best, residual, stuck = sweep_until_small(
            self.blocks, self.state, force, self.visit, self.visit_backward, self.symmetric,
            self.momentum, tolerance, sweeps, *slow,
        )  # fmt: skip
        return best, residual, stuck

    def residual(self, force: Floats) -> float:
        """Scale-free natural residual of forces (nc, dim), by the blocks."""
        return float(residual_of(self.blocks, force))

    def _at_rest(self, force: Floats) -> Momentum:
        velocity = np.zeros((0, 0)) if self.bodies is None else self.bodies.body_velocity(force)
        return Momentum(
            force.copy(), velocity, velocity.copy(), np.array([0.0, 1.0, np.inf, np.inf])
        )


def make_sweeper(problem: FrictionProblem) -> Sweeper:
    """What `gauss_seidel` makes by default, for several calls on one problem."""
    return Sweeper(
        problem, contact_order("forward", problem.contacts), symmetric=False, momentum=True
    )


def sweep_blocks(problem: FrictionProblem, bodies: BodyBlocks | None) -> SweepBlocks:
    """The problem laid out for the kernels, by its bodies or by the rows of W."""
    dim, none = problem.dim, np.zeros(0, dtype=np.int64)
    offset = np.ascontiguousarray(problem.offset.reshape(-1, dim))
    if bodies is not None:
        return SweepBlocks(
            offset, problem.friction, bodies.local,
            pack_contacts(bodies.block, bodies.local, offset, problem.friction),
            bodies.body, bodies.block, none, none, np.zeros((0, dim, dim)), bodies.bodies,
            problem.rho,
        )  # fmt: skip
    rows = lay_out_matrix(problem)
    return SweepBlocks(
        offset, problem.friction, rows.local, np.zeros((0, 0)),
        np.zeros((0, 2), dtype=np.int64),
        np.zeros((0, 2, dim, 3 * dim - 3)), rows.start, rows.column, rows.block, 0, problem.rho,
    )  # fmt: skip


def contact_order(order: Order | Integers, contacts: int) -> Integers:
    """The contacts in the order of a sweep; raises `UsageError` if it is no permutation."""
    if isinstance(order, str):
        if order in ("forward", "symmetric"):
            return np.arange(contacts, dtype=np.int64)
    else:
        given = read_order(order, contacts)
        if given is not None:
            return given
    raise UsageError(
        "the order of the contacts is not one", where="gauss_seidel, order",
        remedy="give 'forward', 'symmetric' or an array with every contact once",
    )  # fmt: skip


METHOD = gauss_seidel
