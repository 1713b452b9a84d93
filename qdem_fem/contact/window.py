"""The compiled loop over time steps with rigid bodies or contact beside the elements' own step.

The step itself is `qdem_fem.kernel.cpu.step.build_window`'s, of one step, as it is without contact:
what a scene without both runs is not touched.  Contact forces of a displacement are found when that
displacement is, and wait for the next step; so the springs and the fields are of one time.
"""

from typing import Any

import numba
import numpy as np
from numba import njit
from numba.core import types
from numba.extending import overload

from qdem_fem import kernel as compiling
from qdem_fem.bodies import Given
from qdem_fem.contact.spheres import GO_ON, Contact, advance_one, advance_threads
from qdem_fem.contact.surface import advance_surfaces
from qdem_fem.contact.surface import law as contact_surface_kernel
from qdem_fem.contact.system import System
from qdem_fem.kernel import digest_sources
from qdem_fem.kernel.cpu import Probes
from qdem_fem.kernel.cpu import step as kernel
from qdem_fem.rigid import advance_rigid
from qdem_fem.rigid import step as rigid_step

SOURCES = compiling, kernel, *kernel.SOURCES, rigid_step, contact_surface_kernel
THREAD_SPHERES = 16_384
"""Fewer spheres than this for each thread lose more at barriers than they gain."""
WINDOW_ONE: Any = kernel.choose_window_kernel(1)
WINDOW_THREADS: Any = kernel.choose_window_kernel(2)


def advance_contact(
    contact: Any, threads: Any, displacement: Any, velocity: Any, step: float
) -> int:
    """One step of contact, by the type of ``contact``; ``threads``: True, or None for one."""
    if contact is None:
        return GO_ON
    if not isinstance(contact, Contact):
        return int(advance_surfaces(contact, displacement, velocity, step))
    advance = advance_one if threads is None else advance_threads
    return int(advance(contact, displacement, velocity, step))


@overload(advance_contact, strict=False)
def _choose_advance(
    contact: Any, threads: Any, displacement: Any, velocity: Any, step: float
) -> Any:
    if isinstance(contact, types.NoneType):
        return lambda contact, threads, displacement, velocity, step: GO_ON
    if contact.instance_class is not Contact:
        return lambda contact, threads, displacement, velocity, step: advance_surfaces(
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
    def advance_contact_window(
        threads: Any, law: Any, viscous: Any, layout: Any, state: Any, loads: Any, held: Any,
        probes: Any, table: Any, gravity: Any, work: Any, step: Any, steps: int, contact: Any,
        acting: Any, force_at: Any, pull: Any, rigid: Any,
    ) -> tuple[int, float, int]:  # fmt: skip  # pragma: no cover
        """As `window` of `qdem_fem.kernel.cpu.step`, with a `Contact` and a `Rigid`, or None.

        ``threads``: True, or None for one; ``acting`` (a,), ``force_at`` (c,), ``pull`` (c, 3): as
        of `list_forces`.  Returns steps done, bad elements, and what the last
        step of contact said.  Comes back where that is not `GO_ON`.
        """
        stamp = made_from  # noqa: F841  (makes it a part of the key)
        forces, one = state.forces, np.int64(1)  # a literal would compile another window
        for k in range(steps):
            for i in acting:
                for c in range(3):
                    forces[force_at[i] + c] += pull[i, c]
            ahead = Probes(probes.node_at, probes.record, probes.stride, probes.first - k)
            row = table[k : k + 2]
            if rigid is not None:
                advance_rigid(
                    rigid, forces, state.displacement, state.velocity, row, gravity, work, step
                )
            if threads is None:
                _, bad = WINDOW_ONE(
                    law, viscous, layout, state, loads, held, ahead, row, gravity, work, step, one
                )
                said = advance_contact(contact, None, state.displacement, state.velocity, step)
            else:
                _, bad = WINDOW_THREADS(
                    law, viscous, layout, state, loads, held, ahead, row, gravity, work, step, one
                )
                said = advance_contact(contact, True, state.displacement, state.velocity, step)
            if bad > 0.0 or said != GO_ON:
                return k + 1, bad, said
        return steps, 0.0, GO_ON

    return advance_contact_window


contact_window: Any = build_contact_window(
    digest_sources(*SOURCES, *contact_surface_kernel.SOURCES)
)


def choose_threads(run: System, contact: Any) -> int:
    """Threads that share a step: as many as the elements or the spheres are worth."""
    if not isinstance(contact, Contact):
        return run.assembly.threads
    spheres = run.threads or len(contact.position) // THREAD_SPHERES
    return max(run.assembly.threads, min(spheres, numba.get_num_threads()))


def list_forces(contact: Any) -> tuple[Any, Any, Any, Any]:
    """Of a contact's vertices: 4 x kernel number of the node of each, those that it may act on,
    their places in the windows of forces, and the forces [N]."""
    if contact is None:
        none = np.zeros(0, np.int64)
        return none, none, none, np.zeros((0, 3))
    if isinstance(contact, Contact):
        spheres = contact.spheres
        return spheres.place, contact.pairs.acting, spheres.force_at, contact.force
    return contact.surface.place, contact.acting, contact.surface.force_at, contact.force


def run_window(
    run: System, contact: Any, steps: int, step: float, given: Given, work: Any
) -> tuple[int, float, int]:
    """Run the loop on a simulation: steps done, bad elements, what the last contact said.

    Arguments as of `qdem_fem.bodies.Assembly.advance_window`; ``contact``: arrays of its model, or
    None.
    """
    assembly = run.assembly
    place, *forces = list_forces(contact)
    rigid = None if run.rigid is None else run.rigid.make_kernel(given.probes.node_at, place)
    before, threads = numba.get_num_threads(), choose_threads(run, contact)
    numba.set_num_threads(threads)
    try:
        done, bad, said = contact_window(
            True if threads > 1 else None, assembly.law, assembly.viscous,
            assembly.packed.layout, assembly.state, given.loads, given.held, given.probes,
            given.table, assembly.pack_gravity(given.gravity), work, assembly.dtype.type(step),
            steps, contact, *forces, rigid,
        )  # fmt: skip
    finally:
        numba.set_num_threads(before)
    return int(done), float(bad), int(said)
