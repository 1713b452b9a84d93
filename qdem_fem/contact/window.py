"""The compiled loop over time steps with rigid bodies or contact beside the elements' own step.

The step itself is `qdem_fem.kernel.cpu.build_window`'s, of one step, as it is without contact: what
a scene without both runs is not touched.  Contact forces of a displacement are found when that
displacement is, and wait for the next step; so the springs and the fields are of one time.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numba import njit
from numba.core import types
from numba.extending import overload

from qdem_fem.bodies import Absorber, absorbing_step, begin_absorber, end_absorber
from qdem_fem.contact.spheres import GO_ON, Contact, advance_one, advance_threads
from qdem_fem.contact.surface import law as contact_surface_kernel
from qdem_fem.contact.surface import surface_step
from qdem_fem.contact.system import System
from qdem_fem.element import MEASURES, stress
from qdem_fem.kernel import digest_sources, exact
from qdem_fem.kernel.cpu import Constraints, Loads, Probes, lanes
from qdem_fem.kernel.cpu import step as kernel
from qdem_fem.rigid import Rigid, rigid_advance
from qdem_fem.rigid import step as rigid_step

SOURCES = kernel, stress, lanes, rigid_step, absorbing_step, contact_surface_kernel
THREAD_SPHERES = 16_384
"""Fewer spheres than this for each thread lose more at barriers than they gain."""
WINDOW_ONE: Any = kernel.choose_window_kernel(1)
WINDOW_THREADS: Any = kernel.choose_window_kernel(2)


def gravity_from(gravity: Any, k: int) -> Any:
    """Accelerations from step k on; None without gravity."""
    return None if gravity is None else gravity[4 * k :]


@overload(gravity_from, strict=False)
def _gravity_from(gravity: Any, k: int) -> Any:
    if isinstance(gravity, types.NoneType):
        return lambda gravity, k: None
    return lambda gravity, k: gravity[4 * k :]


def choose_places(contact: Any, nothing: Any) -> Any:
    """The vertices that contact may act on, their places in the forces, and the forces on all.

    ``nothing``: an empty array of integers, for no contact.
    """
    if contact is None:
        return nothing, nothing, nothing.reshape(0, 1)
    if isinstance(contact, Contact):
        return contact.pairs.acting, contact.spheres.force_at, contact.force
    return contact.acting, contact.surface.force_at, contact.force


@overload(choose_places, strict=False)
def _places_of(contact: Any, nothing: Any) -> Any:
    if isinstance(contact, types.NoneType):
        return lambda contact, nothing: (nothing, nothing, nothing.reshape(0, 1))
    if contact.instance_class is Contact:
        return lambda contact, nothing: (
            contact.pairs.acting, contact.spheres.force_at, contact.force
        )  # fmt: skip
    return lambda contact, nothing: (contact.acting, contact.surface.force_at, contact.force)


def advance_rigid(
    rigid: Any, forces: Any, state: Any, table: Any, fall: Any, work: Any, step: float
) -> None:
    """One step of the rigid bodies, if there are any."""
    if rigid is not None:
        rigid_advance(
            rigid, forces, state.displacement, state.velocity, table, fall, work, step
        )  # fmt: skip


@overload(advance_rigid, strict=False)
def _rigid_of(
    rigid: Any, forces: Any, state: Any, table: Any, fall: Any, work: Any, step: float
) -> Any:
    if isinstance(rigid, types.NoneType):
        return lambda rigid, forces, state, table, fall, work, step: None
    return lambda rigid, forces, state, table, fall, work, step: rigid_advance(
        rigid, forces, state.displacement, state.velocity, table, fall, work, step
    )


def absorb_before(absorber: Any, forces: Any, state: Any) -> None:
    """What absorbing faces do before the motion, if there are any."""
    if absorber is not None:
        begin_absorber(absorber, forces, state.displacement, state.velocity)


@overload(absorb_before, strict=False)
def _absorb_before(absorber: Any, forces: Any, state: Any) -> Any:
    if isinstance(absorber, types.NoneType):
        return lambda absorber, forces, state: None
    return lambda absorber, forces, state: begin_absorber(
        absorber, forces, state.displacement, state.velocity
    )


def choose_probes(absorber: Any, probes: Any) -> Any:
    """What the step itself records: nothing where dashpots are still to slow it."""
    return probes if absorber is None else probes._replace(first=2)


@overload(choose_probes, strict=False)
def _probes_of(absorber: Any, probes: Any) -> Any:
    if isinstance(absorber, types.NoneType):
        return lambda absorber, probes: probes
    return lambda absorber, probes: Probes(probes.node_at, probes.record, probes.stride, 2)


def absorb_after(
    absorber: Any, state: Any, loads: Any, row: Any, probes: Any, work: Any, step: float
) -> None:
    """What dashpots do behind the motion, if there are any; then loads' work and probes are due."""
    if absorber is not None:
        slow_absorber(absorber, state, loads, row, probes, work, step)


@overload(absorb_after, strict=False)
def _absorb_behind(
    absorber: Any, state: Any, loads: Any, row: Any, probes: Any, work: Any, step: float
) -> Any:
    if isinstance(absorber, types.NoneType):
        return lambda absorber, state, loads, row, probes, work, step: None
    return lambda absorber, state, loads, row, probes, work, step: slow_absorber(
        absorber, state, loads, row, probes, work, step
    )


@exact
def slow_absorber(
    absorber: Any, state: Any, loads: Any, row: Any, probes: Any, work: Any, step: float
) -> None:  # pragma: no cover
    """The dashpots of a step, its loads' work at the slower velocity, and its probes."""
    fast = kernel.loads_power(loads, row, state.velocity)
    end_absorber(absorber, state.inverse_mass, state.displacement, state.velocity, step)
    work[0] += 0.5 * step * (kernel.loads_power(loads, row, state.velocity) - fast)
    kernel.take_probes(probes, 1, state.displacement)


def advance_contact(
    contact: Any, threads: Any, displacement: Any, velocity: Any, step: float
) -> int:
    """One step of contact, by the type of ``contact``; ``threads``: True, or None for one."""
    if contact is None:
        return GO_ON
    if not isinstance(contact, Contact):
        return int(surface_step(contact, displacement, velocity, step))
    advance = advance_one if threads is None else advance_threads
    return int(advance(contact, displacement, velocity, step))


@overload(advance_contact, strict=False)
def _advance_of(contact: Any, threads: Any, displacement: Any, velocity: Any, step: float) -> Any:
    if isinstance(contact, types.NoneType):
        return lambda contact, threads, displacement, velocity, step: GO_ON
    if contact.instance_class is not Contact:
        return lambda contact, threads, displacement, velocity, step: surface_step(
            contact, displacement, velocity, step
        )
    if isinstance(threads, types.NoneType):
        return lambda contact, threads, displacement, velocity, step: advance_one(
            contact, displacement, velocity, step
        )
    return lambda contact, threads, displacement, velocity, step: advance_threads(
        contact, displacement, velocity, step
    )


def build_contact_window(made_from: str) -> Any:
    """The loop; ``made_from`` makes the sources it calls a part of its key on disk."""

    @njit(cache=True, error_model="numpy")
    def contact_window(
        threads: Any, law: Any, viscous: Any, layout: Any, state: Any, loads: Any, held: Any,
        probes: Any, table: Any, gravity: Any, work: Any, step: Any, steps: int, contact: Any,
        rigid: Any, absorber: Any,
    ) -> tuple[int, float, int]:  # fmt: skip  # pragma: no cover
        """As `window` of `qdem_fem.kernel.cpu.step`, with a `Contact`, a `Rigid`, an `Absorber`, or
        None.

        ``threads``: True, or None for one.  Returns steps done, bad elements, and what the last
        step of contact said.  Comes back where that is not `GO_ON`.
        """
        stamp = made_from  # noqa: F841  (makes it a part of the key)
        forces = state.forces
        acting, force_at, pull = choose_places(contact, layout.piece_first[:0])
        for k in range(steps):
            for i in acting:
                for c in range(3):
                    forces[force_at[i] + c] += pull[i, c]
            ahead = Probes(probes.node_at, probes.record, probes.stride, probes.first - k)
            row, fall = table[k : k + 2], gravity_from(gravity, k)
            absorb_before(absorber, forces, state)
            advance_rigid(rigid, forces, state, row, fall, work, step)
            seen = choose_probes(absorber, ahead)
            if threads is None:
                _, bad = WINDOW_ONE(
                    law, viscous, layout, state, loads, held, seen, row, fall, work, step, 1
                )
                absorb_after(absorber, state, loads, row[0], ahead, work, step)
                said = advance_contact(contact, None, state.displacement, state.velocity, step)
            else:
                _, bad = WINDOW_THREADS(
                    law, viscous, layout, state, loads, held, seen, row, fall, work, step, 1
                )
                absorb_after(absorber, state, loads, row[0], ahead, work, step)
                said = advance_contact(contact, True, state.displacement, state.velocity, step)
            if bad > 0.0 or said != GO_ON:
                return k + 1, bad, said
        return steps, 0.0, GO_ON

    return contact_window


contact_window: Any = build_contact_window(
    digest_sources(*SOURCES, *contact_surface_kernel.SOURCES, *MEASURES.values())
)


def choose_threads(run: System, contact: Any) -> int:
    """Threads that share a step: as many as the elements or the spheres are worth."""
    if not isinstance(contact, Contact):
        return run.assembly.threads
    spheres = run.threads or len(contact.position) // THREAD_SPHERES
    return max(run.assembly.threads, min(spheres, numba.get_num_threads()))


def find_vertex_places(contact: Any) -> Any:
    """4 x kernel number of the node of each vertex of a contact's arrays, (c,)."""
    if contact is None:
        return np.zeros(0, np.int64)
    return (contact.spheres if isinstance(contact, Contact) else contact.surface).place


def run_window(
    run: System, contact: Any, steps: int, step: float, loads: Loads,
    held: Constraints, probes: Probes, table: Any, gravity: Any, work: Any,
) -> tuple[int, float, int]:  # fmt: skip
    """Run the loop on a simulation: steps done, bad elements, what the last contact said.

    Arguments as of `qdem_fem.bodies.assembly.Assembly.window`; ``contact``: arrays of its model, or
    None.
    """
    assembly = run.assembly
    rigid: Rigid | None = None
    if run.rigid is not None:
        rigid = run.rigid.kernel_of(probes.node_at, find_vertex_places(contact))
    absorber: Absorber | None = None if run.absorbers is None else run.absorbers.kernel
    before, threads = numba.get_num_threads(), choose_threads(run, contact)
    numba.set_num_threads(threads)
    try:
        done, bad, said = contact_window(
            True if threads > 1 else None, assembly.law, assembly.viscous,
            assembly.packed.layout, assembly.state, loads, held, probes, table,
            assembly.pack_gravity(gravity), work, assembly.dtype.type(step), steps, contact,
            rigid, absorber,
        )  # fmt: skip
    finally:
        numba.set_num_threads(before)
    if absorber is not None:
        run.motion.absorbed += float(absorber.taken[0])
        absorber.taken[0] = 0.0
    return int(done), float(bad), int(said)
