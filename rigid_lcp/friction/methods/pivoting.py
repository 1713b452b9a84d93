"""A pivoting method that does not cycle: a path of exact solutions from an easy problem to ours.

Lemke's idea (Cottle, Pang and Stone, The Linear Complementarity Problem, 1992, 4.4) on the lists
of the paper's section 6 in place of the three or four unknowns a contact of Stewart and Trinkle
(Int. J. Numer. Methods Eng. 39 (1996) 2673): Coulomb's law in 2D with a covering vector d,

    u = W r + q + lambda d,    lambda from large (or 1) down to 0.

The solutions r(lambda) form a path of straight pieces; at each corner one contact changes its list
(events 3a to 3d).  Unlike the driven force of `rigid_lcp.friction.methods.dantzig`, lambda may grow
again: after a corner the path goes on in the sense in which the contact that moved stays
consistent.  A path never meets itself, so nothing cycles.

From no forces, d = n: for large lambda all contacts part.  Along a ray that ends the path,
``dr . du = -mu dr_N |du_T| <= 0`` and ``dr . du = dr . W dr + dlambda dr . d``.  With W positive
definite (it is shifted a little, and the shift removed) and d inside K*, ``dr . d > 0``, so there
is no such ray: the path ends in a solution for every coefficient of friction.

From forces near a solution (of the last step, of Gauss-Seidel, of Newton): the lists are read off
them, and d is what is missing to make them a solution of the problem at lambda = 1.  A few corners
are left.  There d need not be inside K*, so a ray or a detour can end the path.

2D friction, or 3D without friction.  In 3D friction sliding has a circle of directions, which a
pivoting method can only replace by a polygon (an error of ``1 - cos(pi / k)`` for k edges).
"""

from dataclasses import dataclass

import numpy as np

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.methods.gauss_seidel import solve_gauss_seidel
from rigid_lcp.friction.pivots import (
    DONE,
    SHIFT,
    follow_from_forces,
    follow_from_nothing,
    judge_pivots,
    read_pivots,
    remove_shift,
    start_pivots,
)
from rigid_lcp.friction.problem import (
    FrictionProblem,
    FrictionSolution,
    judge_forces,
    require_number,
    require_whole,
)


@dataclass(frozen=True)
class PivotingNumbers:
    """Paths, their starts and shifts."""

    sweeps: int = 300  # of Gauss-Seidel for a start,
    more_sweeps: int = 2000  # and to better one from which a path took too many pivots,
    swept: float = 1e-10  # to this residual [-]
    shift: float = 1e-2  # of the diagonal, over its mean [-], at first;
    near: float = 10.0  # so many times the residual of a start [-], if that is less;
    wider: float = 10.0  # and so many times as much on the last path from a start [-]
    pivots: int = 60  # a contact, of all paths together


PIVOTING = PivotingNumbers()


def solve_pivoting(
    problem: FrictionProblem, start: Floats | None = None, tolerance: float = 1e-12, *,
    sweeps: int = PIVOTING.sweeps, tangential_velocity: Floats | None = None,
) -> FrictionSolution:  # fmt: skip
    """Solve a 2D friction problem, or a frictionless one, exactly by following a path of pivots.

    ``start`` r (nc * dim,): forces near the solution; the nearer, the fewer pivots.  Without it
    ``sweeps`` of Gauss-Seidel make one; ``sweeps=0`` begins with no forces, as Lemke does.  A path
    that takes too many pivots is given up: Gauss-Seidel betters its start, or Lemke's is taken.
    ``tangential_velocity`` u_T (nc,) [m/s]: where not zero the contact slides already and friction
    opposes u_T; only then can there be no solution (Painleve); begins with no forces.

    ``work``: ``pivots``, changes of lists; ``paths``, how many were begun; ``sweeps``.
    Status ``no solution`` is proved by a linear programme.  Raises `ProblemError` in 3D with
    friction and for velocities that are none, `UsageError` for other options that are none.
    Takes memory for (2 nc)^2 numbers and O(k^2) work a pivot for k unknown forces: not for above
    some 2,000 contacts.
    """
    tolerance, sweeps = require_number(tolerance, "tolerance"), require_whole(sweeps, "sweeps")
    most, shift = PIVOTING.pivots * problem.contacts + 100, PIVOTING.shift
    few, spent, swept = problem.contacts + 50, 0, 0
    attempts: list[tuple[float, bool, int]] = [(shift, False, 4 * few), (shift, False, most)]
    if (start is not None or sweeps > 0) and tangential_velocity is None:
        warm_ones = [(shift, True, few), (shift, True, few), (PIVOTING.wider * shift, True, few)]
        attempts = warm_ones + attempts
    near = start
    for paths, (amount, warm, limit) in enumerate(attempts, 1):
        state = start_pivots(problem, amount, 0.0, tangential_velocity)
        if warm:
            if near is None or paths > 1:
                count = sweeps if near is None else PIVOTING.more_sweeps
                swept += count
                near = solve_gauss_seidel(problem, near, PIVOTING.swept, count).r
            if problem.residual(near) <= tolerance:
                work = {"pivots": float(spent), "paths": paths - 1.0, "sweeps": float(swept)}
                return judge_forces(problem, np.array(near), tolerance, "pivoting", work)
            if paths == 1:
                amount = min(max(PIVOTING.near * problem.residual(near), SHIFT.least), shift)
                state = start_pivots(problem, amount, 0.0, None)
            ended = follow_from_forces(problem, state, near, min(limit, most - spent))
        else:
            ended = follow_from_nothing(problem, state, min(limit, most - spent))
        force = read_pivots(problem, state)
        if ended == DONE:
            force = remove_shift(problem, state, tolerance, max(few, limit // 4))
        spent += int(state.events[0])
        state.events[0] = spent
        solution = judge_pivots(problem, state, force, tolerance, "pivoting", ended, -1)
        solution.work.update(paths=float(paths), sweeps=float(swept))
        if solution.status in ("solved", "no solution") or spent >= most:
            break
    return solution


METHOD = solve_pivoting
