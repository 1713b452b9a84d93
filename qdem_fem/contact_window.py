"""The compiled loop over time steps with contact: the step of the elements, then the contact.

The step itself is `qdem_fem.kernel.window_build`'s, of one step, as it is without contact: what a
scene without contact runs is not touched.  Contact forces of a displacement are found when that
displacement is, and wait for the next step; so the springs and the fields are of one time.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from numba import njit
from numba.core import types
from numba.extending import overload

from qdem_fem import kernel
from qdem_fem.contact_kernel import GO_ON, advance_one, advance_threads

SOURCES = ("kernel.py", "stress.py", "lanes.py", "contact_kernel.py")
WINDOW_ONE: Any = kernel.window_kernel(1)
WINDOW_THREADS: Any = kernel.window_kernel(2)


def gravity_from(gravity: Any, k: int) -> Any:
    """Accelerations from step k on; None without gravity."""
    return None if gravity is None else gravity[4 * k :]


@overload(gravity_from, strict=False)
def _gravity_from(gravity: Any, k: int) -> Any:
    if isinstance(gravity, types.NoneType):
        return lambda gravity, k: None
    return lambda gravity, k: gravity[4 * k :]


def contact_window_build(made_from: str) -> Any:
    """The loop; ``made_from`` makes the sources it calls a part of its key on disk."""

    @njit(cache=True, error_model="numpy")
    def contact_window(
        threads: Any, law: Any, viscous: Any, layout: Any, state: Any, loads: Any, held: Any,
        probes: Any, table: Any, gravity: Any, work: Any, step: Any, steps: int, contact: Any,
    ) -> tuple[int, float, int]:  # fmt: skip  # pragma: no cover
        """As `window` of `qdem_fem.kernel`, with a `Contact`; ``threads``: True, or None for one.

        Returns steps done, bad elements, and what the last step of contact said.  Comes back
        where that is not `GO_ON`.
        """
        stamp = made_from  # noqa: F841  (makes it a part of the key)
        forces = state.forces
        force_at, pull = contact.spheres.force_at, contact.force
        for k in range(steps):
            for i in contact.pairs.acting:
                for c in range(3):
                    forces[force_at[i] + c] += pull[i, c]
            ahead = kernel.Probes(probes.node_at, probes.record, probes.stride, probes.first - k)
            row, fall = table[k : k + 2], gravity_from(gravity, k)
            if threads is None:
                _, bad = WINDOW_ONE(
                    law, viscous, layout, state, loads, held, ahead, row, fall, work, step, 1
                )
                said = advance_one(contact, state.displacement, state.velocity, step)
            else:
                _, bad = WINDOW_THREADS(
                    law, viscous, layout, state, loads, held, ahead, row, fall, work, step, 1
                )
                said = advance_threads(contact, state.displacement, state.velocity, step)
            if bad > 0.0 or said != GO_ON:
                return k + 1, bad, said
        return steps, 0.0, GO_ON

    return contact_window


def _sources_digest() -> str:
    digest = hashlib.sha256()
    for name in SOURCES:
        digest.update(Path(__file__).with_name(name).read_bytes())
    return digest.hexdigest()


contact_window: Any = contact_window_build(_sources_digest())
