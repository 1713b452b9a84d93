"""The shift of the diagonal that makes reduced equations (28) regular, and how it is taken out.

Redundant contacts make the reduced equations singular, and nearly redundant ones make the way to a
solution long.  So ``A + shift`` is solved, and the shift taken out by proximal steps

    a = (A + shift) f - shift f_before + b,

each of which drives the change of b that it makes, all contacts kept consistent.  A fixed point
knows no shift (Rockafellar, SIAM J. Control Optim. 14 (1976) 877, for monotone problems; with
friction it is judged by its residual).  The shift falls as long as that takes few pivots.
"""

from dataclasses import dataclass

import numpy as np

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.friction.pivots.drive import DONE, settle_values
from rigid_lcp.friction.pivots.state import Pivots, drive_offset, measure_residual, read_pivots
from rigid_lcp.friction.pivots.updates import BREAKING, STATIC, multiply_geometry, refresh_reduced
from rigid_lcp.friction.problem import FrictionProblem


@dataclass(frozen=True)
class ShiftNumbers:
    """How the shift falls, and what ends that."""

    least: float = 1e-6
    """Over the mean of the diagonal [-]: below it round-off in the inverse would make events up."""
    steps: int = 60  # most proximal steps that take the shift out,
    patience: int = 12
    """and most without a better residual: self-stress moves on for a while before it settles."""
    fall: float = 0.1  # factor of the shift at a proximal step [-],
    steep_fall: float = 0.01  # and after one of few pivots [-]:
    few_pivots: int = 10  # so many at most
    least_pace: float = 0.1
    """Exponent of that factor [-], halved after a step of too many pivots, below which it ends."""


SHIFT = ShiftNumbers()


def change_shift(state: Pivots, shift: float) -> bool:
    """Another shift [that of A]; b takes the difference up, f and a and the lists stay."""
    geometry, by = state.geometry, shift - state.shift[0]
    geometry.row_value[state.diagonal[0]] += by
    geometry.column_value[state.diagonal[1]] += by
    state.shift[0] = shift
    product = np.zeros_like(state.b)
    multiply_geometry(geometry, state.f, product)
    state.b[:] = state.a - product
    return bool(refresh_reduced(geometry, state.reduced))


def remove_shift(problem: FrictionProblem, state: Pivots, tolerance: float, few: int) -> Floats:
    """Proximal steps; the shift falls tenfold each, a hundredfold after one of few pivots.

    A step of more than ``few`` pivots is done again with the shift of before, which then falls
    more slowly.
    """
    exact, best = problem.offset[state.rows], read_pivots(problem, state)
    least, idle, pace = measure_residual(problem, state, best), 0, 1.0
    taken, floor = 0, SHIFT.least * state.unit
    for _ in range(SHIFT.steps if state.shift[0] > 0.0 else 0):
        if idle == SHIFT.patience:
            break
        before = state.reduced.kind.copy(), state.f.copy(), state.a.copy()
        shift, spent = float(state.shift[0]), int(state.events[0])
        fall = SHIFT.fall if taken > SHIFT.few_pivots else SHIFT.steep_fall
        smaller = min(shift, max(fall**pace * shift, floor))
        if least <= tolerance:
            smaller = shift  # what comes now is cheap, and free where no list changes
        if smaller < shift:
            change_shift(state, smaller)
        change = exact - smaller * state.f - state.b
        ended = drive_offset(state, change, True, spent + few)
        taken = int(state.events[0]) - spent
        if ended != DONE:
            set_lists(state, before[0])
            state.f[:], state.a[:] = before[1:]
            change_shift(state, shift)
            if smaller == shift or pace < SHIFT.least_pace:
                break
            pace *= 0.5
            continue
        force = read_pivots(problem, state)
        residual = measure_residual(problem, state, force)
        idle = 0 if residual < least else idle + 1
        if least <= tolerance and (taken or not residual < 0.5 * least):
            break
        if residual < least:
            best, least = force, residual
    return find_lists_force(problem, state, best, least)


def find_lists_force(
    problem: FrictionProblem, state: Pivots, force: Floats, residual: float
) -> Floats:
    """Forces of the lists reached with no shift at all, where they are better than ``force``.

    A shift larger than a pivot of eq. 28 comes out slowly, and hides the sign of that pivot.
    """
    if not change_shift(state, 0.0):
        return force
    nothing = np.zeros_like(state.b)
    state.b[:] = problem.offset[state.rows]
    state.f[:] = 0.0
    for _ in range(2):
        settle_values(state.geometry, state.reduced, state.b, nothing, state.f, state.a)
    found = read_pivots(problem, state)
    with np.errstate(over="ignore", invalid="ignore"):  # where eq. 28 is singular but to round-off
        return found if measure_residual(problem, state, found) < residual else force


def set_lists(state: Pivots, kinds: Ints) -> None:
    """Put every contact on a list; the inverse has then to be computed again."""
    geometry, reduced = state.geometry, state.reduced
    reduced.kind[:] = kinds
    reduced.place[:] = -1
    inside = np.zeros(len(state.rows), dtype=bool)
    inside[geometry.normal[kinds != BREAKING]] = True
    inside[geometry.tangent[kinds == STATIC]] = True
    members = np.flatnonzero(inside)
    reduced.members[: len(members)] = members
    reduced.place[members] = np.arange(len(members))
    reduced.size[0] = len(members)
