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

What it can and can not do: a settled packing of discs, 227 contacts, solved of 10 random orders of
contacts (pivots, CPU time of one thread, provisional):

=====  =====================  ======================  ==========================================
mu     as in the paper        with reversal           what stops it
=====  =====================  ======================  ==========================================
0      10  (290, 0.01 s)      10  (290, 0.01 s)
0.1    9   (1210, 0.05 s)     10  (1230, 0.05 s)      cycle
0.2    1   (1030, 0.05 s)     9   (1480, 0.07 s)      cycle; driven force back at zero
0.3    0                      4                       cycle; driven force back at zero
0.5    0                      0                       cycle; driven force back at zero
0.8    0                      0                       cycle; driven force back at zero
=====  =====================  ======================  ==========================================

The cycle is one contact that goes from static to sliding and back in steps of length zero: with
sliding columns the matrix of eq. 28 need not have positive principal minors.  That is no round-off.
`rigid_lcp.friction.methods.pivoting` follows a path that can turn, and solves these.

Redundant contacts make eq. 28 singular, ties (b = 0, symmetric piles) make lists cycle: a shift of
A and a perturbation of b, in the range of A, prevent that, and are driven out at the end
(`rigid_lcp.friction.pivots.shift`).  A pivot costs O(k^2) for k unknown forces, the paper's way
O(k^3).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from rigid_lcp.errors import ProblemError
from rigid_lcp.friction.pivots import (
    BREAKING,
    DONE,
    LIST_NAMES,
    NORMAL,
    SHIFT_LEAST,
    SINGULAR,
    SLIDING_DOWN,
    SLIDING_UP,
    TANGENTIAL,
    TURNING,
    Geometry,
    Pivots,
    Reduced,
    drive,
    drive_offset,
    judge_pivots,
    move_contact,
    read_pivots_force,
    remove_shift,
    scatter_column,
    settle_values,
    start_pivots,
)
from rigid_lcp.friction.problem import (
    FrictionProblem,
    FrictionSolution,
    read_order,
    require_number,
    require_whole,
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Event:
    """One change of lists, for pictures of a run."""

    driven: int
    """The contact that was being made consistent."""
    force: Literal["normal", "tangential", "offset"]
    """What was driven: its normal or tangential force, or b."""
    contact: int
    """The contact that changed its list."""
    origin: str
    """The list it left: NC, C_F, C+, C-."""
    target: str
    """The list it entered."""
    step: float
    """Length of the step s that ended in this event [N or N s]; zero in a cycle."""
    travelled: float
    """The driven quantity since its drive began [N or N s; offset: share of 1]."""


def dantzig(
    problem: FrictionProblem,
    start: Floats | None = None,
    tolerance: float = 1e-12,
    *,
    order: ArrayLike | None = None,
    tangential_velocity: ArrayLike | None = None,
    reversal: bool = False,
    perturbation: float = 1e-4,
    shift: float = SHIFT_LEAST,
    max_pivots: int | None = None,
    trace: list[Event] | None = None,
) -> FrictionSolution:
    """Solve a 2D friction problem by the paper's modified Dantzig algorithm (section 6).

    ``start`` is not used: the algorithm begins with no forces.  ``order`` (nc,): the contacts in
    the order they are considered in (default: as numbered).  ``tangential_velocity`` u_T (nc,)
    [m/s]: where it is not zero the contact slides already, friction opposes u_T, and the contact
    can not become static (event 3c); the residual is then that of ``f_T = -sign(u_T) mu f_N``.
    ``reversal``: after an event the driven force may fall as well (Keller's path), which the paper
    does not do.  ``perturbation``: of b, relative to its size, against ties; removed at the end.
    ``shift``: added to the diagonal, relative to its mean, against redundance; removed at the end.
    ``max_pivots``: most changes of lists (default 40 a contact).  ``trace``: a list that takes
    every `Event`.

    Status: ``cycled``: the lists repeat with steps of length zero; ``no solution``: a force grew
    without bound, and a linear programme proves that no forces at all keep the contacts from
    approaching (Painleve: go over to impulses); ``singular``; ``not converged``: the pivots are
    used up, a ray without that proof, or with reversal the driven force came back to zero.
    Raises `ProblemError` in 3D and for an order or velocities that are none, `UsageError` for other
    options that are none.  Takes memory for (2 nc)^2 numbers: not for above some 2,000 contacts.
    """
    tolerance = require_number(tolerance, "tolerance")
    shift = require_number(shift, "shift", zero=True)
    perturbation = require_number(perturbation, "perturbation", zero=True)
    limit = 40 * problem.contacts + 100
    if max_pivots is not None:
        limit = require_whole(max_pivots, "max_pivots")
    sequence = read_order(np.arange(problem.contacts) if order is None else order, problem.contacts)
    if sequence is None:
        raise ProblemError(
            "the order does not name every contact once", where="order",
            remedy=f"give a permutation of 0 ... {problem.contacts - 1}",
        )  # fmt: skip
    state = start_pivots(problem, shift, perturbation, tangential_velocity, trace is not None)
    ended, where = consider_contacts(
        state.geometry, state.reduced, state.b, state.f, state.a, sequence, reversal, limit,
        state.codes, state.trace, state.events,
    )  # fmt: skip
    if ended == DONE and perturbation > 0:
        exact = problem.offset[state.rows]
        ended = drive_offset(state, exact - state.b, 1.0, reversal, limit)
    force = read_pivots_force(problem, state)
    if ended == DONE:
        force = remove_shift(problem, state, tolerance, problem.contacts + 50)
    if trace is not None:
        trace += trace_events(state)
    return judge_pivots(problem, state, force, tolerance, "dantzig", ended, where)


@njit(cache=True)
def consider_contacts(
    geometry: Geometry, reduced: Reduced, b: Floats, f: Floats, a: Floats, order: Ints,
    reversal: bool, limit: int, codes: Ints, trace: Floats, count: Ints,
) -> tuple[int, int]:  # fmt: skip
    """Section 6, steps 1 to 4 for one contact after the other; how it ended, and where."""
    rate, nothing = np.zeros(len(b)), np.zeros(len(b))
    for c in order:
        settle_values(geometry, reduced, b, nothing, f, a)
        n, t, slip = geometry.normal[c], geometry.tangent[c], geometry.slip[c]
        if a[n] >= 0.0:  # step 1
            reduced.kind[c] = BREAKING
            continue
        rate[:] = 0.0
        scatter_column(geometry, n, 1.0, rate)
        if slip != 0:
            scatter_column(geometry, t, slip * geometry.mu[c], rate)
        ended, where = drive(
            geometry, reduced, b, f, a, rate, NORMAL, c, np.inf, reversal, limit - count[0],
            codes, trace, count,
        )  # fmt: skip
        if ended != DONE:
            return ended, where
        if slip != 0 or t < 0:
            to = SLIDING_DOWN if slip < 0 else SLIDING_UP
            if not move_contact(geometry, reduced, c, to):
                return SINGULAR, c
            continue
        if not move_contact(geometry, reduced, c, TURNING):
            return SINGULAR, c
        rate[:] = 0.0
        scatter_column(geometry, t, 1.0 if a[t] < 0.0 else -1.0, rate)
        ended, where = drive(
            geometry, reduced, b, f, a, rate, TANGENTIAL, c, np.inf, reversal, limit - count[0],
            codes, trace, count,
        )  # fmt: skip
        if ended != DONE:
            return ended, where
    settle_values(geometry, reduced, b, nothing, f, a)
    return DONE, -1


def trace_events(state: Pivots) -> list[Event]:
    """The events a drive has written down."""
    names: tuple[Literal["normal"], Literal["tangential"], Literal["offset"]]
    names = ("normal", "tangential", "offset")
    count = min(int(state.events[0]), len(state.trace))
    return [
        Event(
            int(row[0]), names[int(row[1])], int(row[2]), LIST_NAMES[int(row[3])],
            LIST_NAMES[int(row[4])], float(row[5]), float(row[6]),
        )
        for row in state.trace[:count]
    ]  # fmt: skip


METHOD = dantzig
