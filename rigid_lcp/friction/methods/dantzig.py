"""The paper's modified Dantzig algorithm (section 6): exact forces in 2D, contact after contact.

The contacts are considered one by one.  All before are consistent (eq. 27), each on its list:

=====  ===================  =======================================
NC     breaking             ``f_N = f_T = 0``, ``a_N >= 0``
C_F    permanent static     ``a_N = a_T = 0``, ``|f_T| <= mu f_N``
C+     permanent sliding    ``a_N = 0``, ``f_T = mu f_N``, ``a_T <= 0``
C-     permanent sliding    ``a_N = 0``, ``f_T = -mu f_N``, ``a_T >= 0``
=====  ===================  =======================================

A new contact that breaks (step 1) needs nothing.  Else its normal force is driven up until
``a_N = 0`` (step 2, 3), then its tangential force until it sticks or slides, while the forces of
the permanent contacts follow by eqs 30, 31 and contacts change lists (events 3a to 3d).

It solves a settled packing of 227 discs in all of 10 random orders of contacts without friction, in
9 at mu = 0.1, in none from 0.3 on: one contact goes from static to sliding and back in steps of
length zero, as with sliding columns the matrix of eq. 28 need not have positive principal minors.
`rigid_lcp.friction.methods.pivoting` follows a path that can turn, and solves these.

Redundant contacts make eq. 28 singular, ties (b = 0, symmetric piles) make lists cycle: a shift of
A and a perturbation of b, in the range of A, prevent that, and are driven out at the end
(`rigid_lcp.friction.pivots.shift`).  A pivot costs O(k^2) for k unknown forces, the paper's way
O(k^3).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.pivots import (
    DONE,
    SHIFT,
    consider_contacts,
    drive_offset,
    judge_pivots,
    read_pivots,
    remove_shift,
    start_pivots,
)
from rigid_lcp.friction.problem import FrictionProblem, FrictionSolution, require_number


@dataclass(frozen=True)
class DantzigNumbers:
    """Against ties, and the end."""

    perturbation: float = 1e-4  # of b, over its size [-], against ties; removed at the end
    pivots: int = 40  # changes of lists a contact at most [-]


DANTZIG = DantzigNumbers()


def solve_dantzig(
    problem: FrictionProblem,
    start: Floats | None = None,
    tolerance: float = 1e-12,
    *,
    tangential_velocity: ArrayLike | None = None,
) -> FrictionSolution:
    """Solve a 2D friction problem by the paper's modified Dantzig algorithm (section 6).

    ``start`` is not used: the algorithm begins with no forces, and considers the contacts as they
    are numbered.  ``tangential_velocity`` u_T (nc,) [m/s]: where it is not zero the contact slides
    already, friction opposes u_T, and the contact can not become static (event 3c); the residual is
    then that of ``f_T = -sign(u_T) mu f_N``.

    Status: ``cycled``: the lists repeat with steps of length zero; ``no solution``: a force grew
    without bound, and a linear programme proves that no forces at all keep the contacts from
    approaching (Painleve: go over to impulses); ``singular``; ``not converged``: the pivots are
    used up, or a ray without that proof.
    Raises `ProblemError` in 3D and for velocities that are none, `UsageError` for a tolerance that
    is none.  Takes memory for (2 nc)^2 numbers: not for above some 2,000 contacts.
    """
    tolerance = require_number(tolerance, "tolerance")
    limit = DANTZIG.pivots * problem.contacts + 100
    state = start_pivots(problem, SHIFT.least, DANTZIG.perturbation, tangential_velocity)
    ended, where = consider_contacts(
        state.geometry, state.reduced, state.b, state.f, state.a, np.arange(problem.contacts),
        limit, state.codes, state.events,
    )  # fmt: skip
    if ended == DONE:
        exact = problem.offset[state.rows]
        ended = drive_offset(state, exact - state.b, False, limit)
    force = read_pivots(problem, state)
    if ended == DONE:
        force = remove_shift(problem, state, tolerance, problem.contacts + 50)
    return judge_pivots(problem, state, force, tolerance, "dantzig", ended, where)


METHOD = solve_dantzig
