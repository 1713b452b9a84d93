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
thousands: Newton's method (`rigid_lcp.friction.methods.newton`) goes on from there.
"""

import numpy as np

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.problem import (
    FrictionProblem,
    FrictionSolution,
    judge_forces,
    require_number,
    require_start,
    require_whole,
)
from rigid_lcp.friction.sweeps import (
    Momentum,
    SweepBlocks,
    add_impulses,
    lay_out_bodies,
    lay_out_matrix,
    pack_contacts,
    sweep_until_small,
)


def solve_gauss_seidel(
    problem: FrictionProblem, start: Floats | None = None, tolerance: float = 1e-6,
    sweeps: int = 1000, *, blocks: SweepBlocks | None = None, last: bool = False,
    slow: tuple[int, float] = (0, np.inf),
) -> FrictionSolution:  # fmt: skip
    """Sweep until the residual is at or below ``tolerance``, or ``sweeps`` are done.

    ``start``: forces r (nc * dim,), zero if None.  ``blocks``: the same problem laid out earlier.
    The best point of those looked at is returned, or with ``last`` the one where the sweeps end: a
    self-stress that has to grow does so without a better residual, and sweeps that go on from the
    best point lose the way made.
    ``slow``: sweeps after which to give up if more than this residual is left, looked at as often
    as the residual is.

    Raises `ProblemError` for a start that is none, `UsageError` for other options that are none.
    """
    tolerance = require_number(tolerance, "tolerance", zero=True)
    sweeps = require_whole(sweeps, "sweeps")
    contacts, dim = problem.contacts, problem.dim
    blocks = blocks or lay_out_sweeps(problem)
    force = np.zeros(contacts * dim) if start is None else require_start(start, contacts * dim, dim)
    rows = force.reshape(contacts, dim)
    state = begin_sweeps(blocks, rows)
    best, stuck = sweep_until_small(blocks, state, rows, tolerance, sweeps, *slow)
    done = float(state.tally[0])
    message = (
        f"{stuck} contacts have no solution while the others are held (Painleve, or no mass)"
        "\n  -> solve at velocity level, or use a method that changes all contacts at once"
    )
    return judge_forces(
        problem, force if last else best.ravel(), tolerance, "gauss-seidel",
        {"sweeps": done, "contact updates": done * contacts}, message=message if stuck else "",
    )  # fmt: skip


def lay_out_sweeps(problem: FrictionProblem) -> SweepBlocks:
    """One problem laid out for sweeps, by its bodies or by the rows of W."""
    dim, size = problem.dim, 3 * problem.dim - 3
    offset = np.ascontiguousarray(problem.offset.reshape(-1, dim))
    laid_out = lay_out_bodies(problem)
    if laid_out is not None and problem.bodies is not None:
        (body, block, local), none = laid_out, np.zeros(0, dtype=np.int64)
        return SweepBlocks(
            offset, problem.friction, local, pack_contacts(block, local, offset, problem.friction),
            body, block, none, none, np.zeros((0, dim, dim)),
            problem.bodies.jacobian.shape[1] // size, problem.rho,
        )  # fmt: skip
    local, start, column, entry = lay_out_matrix(problem)
    return SweepBlocks(
        offset, problem.friction, local, np.zeros((0, 0)), np.zeros((0, 2), dtype=np.int64),
        np.zeros((0, 2, dim, size)), start, column, entry, 0, problem.rho,
    )  # fmt: skip


def begin_sweeps(blocks: SweepBlocks, force: Floats) -> Momentum:
    """No sweep done yet, from forces (nc, dim)."""
    velocity = np.zeros((blocks.bodies + 1, blocks.block.shape[3]))
    add_impulses(blocks.body, blocks.block, force, velocity)
    return Momentum(force.copy(), velocity, velocity.copy(), np.array([0.0, 1.0, np.inf, np.inf]))


METHOD = solve_gauss_seidel
