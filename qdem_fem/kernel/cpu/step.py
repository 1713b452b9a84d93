"""The compiled time step: forces of the elements (eqs 1-11), then the motion of the nodes.

Elements are worked on in chunks, each with its own window of nodal forces
(`qdem_fem.kernel.cpu.layout`), so that threads never write to the same place; the order of all sums
is fixed by the layout, not by the threads, and a run gives the same bits on any number of them.

A scene pays for what it names: the strain measure is chosen by the type of ``law``, and an
argument that is ``None`` (viscosity, gravity) takes its branch out of the compiled code.
"""

import os
from functools import cache
from typing import Any

import numpy as np
from numba import config, prange
from numba.extending import overload

from qdem_fem.element import MEASURES, stress
from qdem_fem.kernel import digest_sources
from qdem_fem.kernel.cpu import lanes, linear, quadratic
from qdem_fem.kernel.cpu.arrays import QuadraticLayout
from qdem_fem.kernel.cpu.lanes import clear_row, load_row, store_row
from qdem_fem.kernel.cpu.linear import add_chunk_forces, compiled, inlined
from qdem_fem.kernel.cpu.quadratic import add_quadratic_forces

__all__ = [
    "SOURCES",
    "add_chunk_forces",
    "add_element_forces",
    "build_window",
    "choose_window_kernel",
]

SOURCES = stress, lanes, linear, quadratic, *MEASURES.values()
"""What a step is compiled from, beside this file."""

if not {"NUMBA_THREADING_LAYER", "NUMBA_THREADING_LAYER_PRIORITY"} & set(os.environ):
    # numba's first choice, TBB, takes ten times longer to start a loop than OpenMP does
    settings: Any = config
    settings.THREADING_LAYER_PRIORITY = ["omp", "tbb", "workqueue"]


def is_quadratic(layout: Any) -> bool | None:
    """True for quadratic elements, else None: a branch that is not compiled."""
    return True if isinstance(layout, QuadraticLayout) else None


@overload(is_quadratic, strict=False)
def _is_quadratic(layout: Any) -> Any:
    if layout.instance_class is QuadraticLayout:
        return lambda layout: True
    return lambda layout: None


@inlined()
def add_element_forces(quadratic: Any, *chunk: Any) -> tuple[float, float]:
    """`add_chunk_forces` of linear or of quadratic elements."""
    return add_chunk_forces(*chunk) if quadratic is None else add_quadratic_forces(*chunk)


@compiled()
def move_piece(
    start: int, stop: int, shifts: Any, first: int, last: int, forces: Any, inverse_mass: Any,
    displacement: Any, velocity: Any, step: Any, gravity: Any,
) -> None:  # fmt: skip
    """Velocity Verlet for the nodes ``start`` to ``stop``: ``v += dt f/m``, ``u += dt v``.

    ``shifts[first:last]`` are the windows of forces that hold these nodes; they are summed
    (eq. 11) and emptied.
    """
    for window in range(first + 1, last):
        for at in range(4 * start, 4 * stop, 4):
            here, there = at + shifts[first], at + shifts[window]
            store_row(forces, here, load_row(forces, here) + load_row(forces, there))
            clear_row(forces, there)
    for node in range(start, stop):
        at = 4 * node
        here = at + shifts[first]
        change = load_row(forces, here) * (step * inverse_mass[node])
        clear_row(forces, here)
        if gravity is not None:
            change = change + load_row(gravity, 0) * step
        faster = load_row(velocity, at) + change
        store_row(velocity, at, faster)
        store_row(displacement, at, load_row(displacement, at) + faster * step)


@compiled()
def apply_loads(loads: Any, table_row: Any, forces: Any) -> None:
    """Add the loads to the forces."""
    for i in range(loads.force_at.size):
        forces[loads.force_at[i]] += loads.weight[i] * table_row[loads.series[i]]


@compiled()
def compute_loads_power(loads: Any, table_row: Any, velocity: Any) -> float:
    """Power of the loads [W]."""
    power = 0.0
    for i in range(loads.node_at.size):
        power += loads.weight[i] * table_row[loads.series[i]] * velocity[loads.node_at[i]]
    return power


@compiled()
def apply_constraints(held: Any, table_row: Any, state: Any, step: float) -> float:
    """Hold rollers in their planes and components at their values; returns the work done [J]."""
    displacement, velocity = state.displacement, state.velocity
    for i in range(held.roller_at.size):
        at, normal = held.roller_at[i], held.roller_normal[i]
        for field in (displacement, velocity):
            across = 0.0
            for c in range(3):
                across += field[at + c] * normal[c]
            for c in range(3):
                field[at + c] -= across * normal[c]
    work = 0.0
    for i in range(held.node_at.size):
        at = held.node_at[i]
        target = held.weight[i] * table_row[held.series[i]]
        before = displacement[at] - step * velocity[at]
        given = (target - before) / step
        impulse = (given - velocity[at]) / state.inverse_mass[at // 4]
        work += 0.5 * impulse * (given + held.previous[i])
        held.previous[i] = given
        velocity[at] = given
        displacement[at] = target
    return work


@compiled()
def record_probes(probes: Any, done: int, displacement: Any) -> None:
    """Record the probes when the step number asks for it."""
    if done >= probes.first and (done - probes.first) % probes.stride == 0:
        sample = (done - probes.first) // probes.stride
        if sample < probes.record.shape[0]:
            for i in range(probes.node_at.size):
                for c in range(3):
                    probes.record[sample, i, c] = displacement[probes.node_at[i] + c]


def build_window(variant: str) -> Any:
    """The compiled loop over time steps, on ``"threads"`` or on ``"one thread"``.

    Its compiled form is kept on disk.  ``made_from`` is a part of its key there, so that a change
    of the stress or of the lanes, which are other files, is never answered by an old kernel.
    """
    made_from = variant + digest_sources(*SOURCES)

    @compiled(parallel=variant == "threads", cache=True)
    def advance_window(
        law: Any, viscous: Any, layout: Any, state: Any, loads: Any, held: Any, probes: Any,
        table: Any, gravity: Any, work: Any, step: Any, steps: int,
    ) -> tuple[int, float]:  # fmt: skip
        """Compute up to ``steps`` time steps; returns how many, and the count of bad elements.

        ``law``: one of `LAWS`; ``viscous``: True or None; ``table`` (steps + 1, series):
        amplitudes at the times of the steps; ``gravity`` (4,) [m/s^2] or None;
        ``work`` (3,) [J], of the loads, of prescribed motion and taken by viscosity, is added to.
        Stops after a step that met an inverted element or NaN.
        """
        stamp = made_from  # noqa: F841  (makes it a part of the key)
        corners, rows, chunk_block, chunk_shift = layout[0], layout[1], layout[2], layout[3]
        piece_first, piece_stop, chunk_piece = layout[4], layout[5], layout[6]
        piece_window, window_shift = layout[7], layout[8]
        displacement, velocity, forces, inverse_mass = state[0], state[1], state[2], state[3]
        bad, taken = np.zeros(chunk_shift.size), np.zeros(chunk_shift.size)
        shared, kind = chunk_piece[-1], is_quadratic(layout)
        for k in range(steps):
            apply_loads(loads, table[k], forces)
            work[0] += 0.5 * step * compute_loads_power(loads, table[k], velocity)
            for c in prange(chunk_shift.size):
                bad[c], taken[c] = add_element_forces(
                    kind, law, viscous, corners, rows, chunk_block[c], chunk_block[c + 1],
                    displacement, velocity, forces, chunk_shift[c],
                )  # fmt: skip
                # no other chunk needs these nodes; while they are in the cache, they move
                for p in range(chunk_piece[c], chunk_piece[c + 1]):
                    move_piece(
                        piece_first[p], piece_stop[p], window_shift, piece_window[p],
                        piece_window[p + 1], forces, inverse_mass, displacement, velocity, step,
                        gravity,
                    )  # fmt: skip
            for s in prange(piece_first.size - shared):
                move_piece(
                    piece_first[shared + s], piece_stop[shared + s], window_shift,
                    piece_window[shared + s], piece_window[shared + s + 1], forces, inverse_mass,
                    displacement, velocity, step, gravity,
                )  # fmt: skip
            work[1] += apply_constraints(held, table[k + 1], state, step)
            if viscous is not None:
                work[2] += step * taken.sum()
            work[0] += 0.5 * step * compute_loads_power(loads, table[k], velocity)
            record_probes(probes, k + 1, displacement)
            inverted = bad.sum()
            if inverted > 0.0:
                return k + 1, inverted
        return steps, 0.0

    return advance_window


@cache
def choose_window_kernel(threads: int) -> Any:
    """The loop for so many threads; one thread pays for no barrier."""
    return build_window("threads" if threads > 1 else "one thread")
