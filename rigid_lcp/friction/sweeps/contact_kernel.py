"""Sweeps over the contacts, each solved exactly while the others are held, with momentum.

A sweep goes by the velocities of the bodies (`rigid_lcp.friction.sweeps.body_kernel`) or by the
rows of W.  A contact that has no solution keeps its force.  `sweep_until_small` repeats them with
momentum (`rigid_lcp.friction.methods.gauss_seidel` says why) without a return to Python: a sweep
over a hundred contacts costs a few microseconds.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.friction.problem import find_natural_map
from rigid_lcp.friction.sweeps.blocks import add_impulses, find_relative_velocities
from rigid_lcp.friction.sweeps.body_kernel import sweep_bodies_2d, sweep_bodies_3d
from rigid_lcp.friction.sweeps.local_contact import NONE, solve_contact_2d, solve_contact_3d


@dataclass(frozen=True)
class SweepNumbers:
    """When momentum starts again, what is looked at and when, and which contacts are visited."""

    change_growth: float = 1.5
    """Momentum starts again when a sweep changes the forces by so many times the least change [-]
    since it last did: without this large beds (10,000 contacts) swing on at 1e-4, as nothing turns
    back."""
    check_growth: float = 0.1
    """The residual costs about a sweep: it is taken when the sweeps have grown by this part [-],"""
    check_sweeps: float = 5.0
    """and by so many at least [-], and when the change a sweep makes has fallen as far as the
    residual should."""
    many_contacts: int = 2000
    """From so many [-] on only some sweeps go over all, and the others over those that bear: beds
    in motion have two open contacts for one that does."""
    sweeps_a_round: int = 10  # one of so many goes over all [-]
    stalled_sweeps: float = 100.0
    """Where the sweeps since the last look, so many [-] at least and as many as all before,"""
    stalled_share: float = 0.7
    """leave more than this part of the residual [-], the order is turned round: in one order sweeps
    may go round in circles, at a few contacts that slide, which in the other they leave at once."""


SWEEPS = SweepNumbers()
CHANGE_GROWTH, MANY_CONTACTS = SWEEPS.change_growth, SWEEPS.many_contacts
CHECK_GROWTH, CHECK_SWEEPS = SWEEPS.check_growth, SWEEPS.check_sweeps
STALLED_SWEEPS, STALLED_SHARE = SWEEPS.stalled_sweeps, SWEEPS.stalled_share
SWEEPS_A_ROUND = SWEEPS.sweeps_a_round


class SweepBlocks(NamedTuple):
    """A problem as the kernels read it, by its bodies (`rigid_lcp.friction.sweeps.blocks`) or,
    where ``body`` is empty, by the rows of W."""

    offset: Floats
    friction: Floats
    local: Floats
    packed: Floats  # `rigid_lcp.friction.sweeps.pack_contacts` where ``body`` is not empty
    body: Ints
    block: Floats
    start: Ints
    column: Ints
    entry: Floats
    bodies: int
    rho: float


class Momentum(NamedTuple):
    """What goes from sweep to sweep, changed in place."""

    last: Floats  # forces before the last sweep, (nc, dim)
    velocity: Floats
    """``w = B^T r`` of the bodies, (bodies + 1, body_size); the last row stands for no body."""
    last_velocity: Floats
    tally: Floats
    """Sweeps done (a sweep over some counts as their share of all contacts), Nesterov's time t_k,
    least change since the restart, last change."""


@njit(cache=True)
def visit_all(
    blocks: SweepBlocks, force: Floats, last: Floats, velocity: Floats, part: float,
    visit: Ints,
) -> tuple[int, float, float]:  # fmt: skip
    """One sweep from ``y = force + part (force - last)``, ``velocity`` being that of y.

    Returns as `rigid_lcp.friction.sweeps.body_kernel.sweep_bodies_2d`, and leaves what it leaves.
    """
    if len(blocks.body) == 0:
        before = force.copy()
        extrapolate(force, last, part)
        origin = force.copy()
        stuck = sweep_matrix(
            blocks.start, blocks.column, blocks.entry, blocks.local, blocks.offset,
            blocks.friction, force, visit,
        )  # fmt: skip
        product, square = measure_step(origin, force, before, blocks.local)
        return stuck, product, square
    if force.shape[1] == 2:
        return sweep_bodies_2d(
            blocks.body, blocks.packed, blocks.local, force, last, velocity, part, visit
        )
    return sweep_bodies_3d(
        blocks.body, blocks.packed, blocks.local, force, last, velocity, part, visit
    )


@njit(cache=True)
def sweep_once(blocks: SweepBlocks, state: Momentum, force: Floats, visit: Ints) -> int:
    """One sweep from ``y = r + beta (r - r before)``; changes ``force`` and ``state``.

    Called with the forces it left; returns as `visit_all`.
    """
    tally = state.tally
    later = 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * tally[1] ** 2))
    part = (tally[1] - 1.0) / later
    extrapolate(state.velocity, state.last_velocity, part)
    stuck, product, square = visit_all(blocks, force, state.last, state.velocity, part, visit)
    tally[0] += len(visit) / len(force)
    tally[1], tally[3] = later, np.sqrt(square)
    tally[2] = min(tally[2], tally[3])
    if product > 0.0 or tally[3] > CHANGE_GROWTH * tally[2]:
        # Begin again, and rid the velocities of rounding, which momentum would throw forward.
        tally[1], tally[2] = 1.0, np.inf
        state.velocity[:] = 0.0
        add_impulses(blocks.body, blocks.block, force, state.velocity)
    return stuck


@njit(cache=True)
def sweep_until_small(
    blocks: SweepBlocks, state: Momentum, force: Floats, tolerance: float, sweeps: int,
    trial: int, useful: float,
) -> tuple[Floats, int]:  # fmt: skip
    """Sweep until the residual is at or below ``tolerance``, or ``sweeps`` are done in all, or
    ``trial`` of them left more than ``useful``.

    Returns the best forces of those looked at, and the contacts without an answer in the last sweep
    over all.
    """
    best, stuck, enough = force.copy(), 0, 0.0
    best_residual = find_residual(blocks, force)
    mark, marked = best_residual, 0.0
    visit = np.arange(len(force))
    some = len(visit) >= MANY_CONTACTS
    count, carry = 0, visit
    while best_residual > tolerance and state.tally[0] < sweeps:
        done = state.tally[0]
        check = min(float(sweeps), done + max(CHECK_SWEEPS, np.ceil(CHECK_GROWTH * done)))
        while state.tally[0] < check:
            if some and count % SWEEPS_A_ROUND > 0:
                sweep_once(blocks, state, force, carry)
            else:
                stuck = sweep_once(blocks, state, force, visit)
                if some:
                    carry = list_carrying(force, state.last, visit)
            count += 1
            if state.tally[3] <= enough:
                break
        if state.tally[0] >= max(STALLED_SWEEPS, 2.0 * marked):
            if best_residual > STALLED_SHARE * mark:
                visit, count = visit[::-1].copy(), 0
                state.tally[1], state.tally[2] = 1.0, np.inf
            mark, marked = best_residual, state.tally[0]
        residual = find_residual(blocks, force)
        if not np.isfinite(residual):
            break
        if residual < best_residual:
            best[:] = force
            best_residual = residual
        if state.tally[0] >= trial and best_residual > useful:
            break
        if residual > 0.0:
            enough = state.tally[3] * min(0.9, tolerance / residual)
    return best, stuck


@njit(cache=True)
def list_carrying(force: Floats, last: Floats, visit: Ints) -> Ints:
    """Those of the contacts ``visit`` that bear, or did before the last sweep, in their order."""
    found, count = np.empty_like(visit), 0
    for c in visit:
        bears = False
        for k in range(force.shape[1]):
            bears = bears or force[c, k] != 0.0 or last[c, k] != 0.0
        if bears:
            found[count] = c
            count += 1
    return found[:count]


@njit(cache=True)
def find_residual(blocks: SweepBlocks, force: Floats) -> float:
    """`rigid_lcp.friction.problem.find_natural_residual` of forces (nc, dim), by the blocks."""
    if len(blocks.body) > 0:
        motion = np.zeros((blocks.bodies + 1, blocks.block.shape[3]))
        add_impulses(blocks.body, blocks.block, force, motion)
        velocity = find_relative_velocities(blocks.body, blocks.block, motion) + blocks.offset
    else:
        velocity = blocks.offset.copy()
        for c in range(len(force)):
            for entry in range(blocks.start[c], blocks.start[c + 1]):
                other = force[blocks.column[entry]]
                for i in range(force.shape[1]):
                    for j in range(force.shape[1]):
                        velocity[c, i] += blocks.entry[entry, i, j] * other[j]
    error = find_norm(find_natural_map(force, velocity, blocks.friction, blocks.rho))
    if error == 0.0:
        return 0.0
    scale = find_norm(force)
    if scale == 0.0:
        scale = blocks.rho * find_norm(velocity)
    return error / scale if scale > 0.0 else np.inf


@njit(cache=True)
def find_norm(values: Floats) -> float:
    """Euclidean norm of (n, k) numbers."""
    total = 0.0
    for i in range(values.shape[0]):
        for k in range(values.shape[1]):
            total += values[i, k] ** 2
    return np.sqrt(total)


@njit(cache=True)
def extrapolate(values: Floats, last: Floats, part: float) -> None:
    """``y = x + part (x - last)``: changes ``values`` from x to y, and ``last`` to x; both 2D."""
    for i in range(values.shape[0]):
        for k in range(values.shape[1]):
            value = values[i, k]
            values[i, k] = value + part * (value - last[i, k])
            last[i, k] = value


@njit(cache=True)
def measure_step(start: Floats, values: Floats, last: Floats, local: Floats) -> tuple[float, float]:
    """``(y - x) . (x - last)`` and ``|y - x|^2`` of a sweep from y to x, weighted with |diag W|.

    The first is positive if the sweep went against the way made since ``last``.
    """
    product = square = 0.0
    for i in range(values.shape[0]):
        for k in range(values.shape[1]):
            back = start[i, k] - values[i, k]
            weight = abs(local[i, k, k])
            product += weight * back * (values[i, k] - last[i, k])
            square += weight * back * back
    return product, square


@njit(cache=True)
def sweep_matrix(
    start: Ints, column: Ints, block: Floats, local: Floats, offset: Floats,
    friction: Floats, force: Floats, visit: Ints,
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
            r_n, r_1, status = solve_contact_2d(local[c], q[0], q[1], friction[c])
            r_2 = 0.0
        else:
            r_n, r_1, r_2, status = solve_contact_3d(
                local[c], q[0], q[1], q[2], friction[c], -force[c, 1], -force[c, 2]
            )
        if status == NONE:
            stuck += 1
            continue
        force[c, 0], force[c, 1] = r_n, r_1
        if dim == 3:
            force[c, 2] = r_2
    return stuck
