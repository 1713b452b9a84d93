"""Forces at a moment of a run that do not depend on the solver: section 8 on the contacts as is.

A time step has any of the impulses that fit.  What hangs on single forces (force chains, grains
that break) wants those that elastic contacts would choose: the friction problem of eqs 25 and 26
at the present state, solved by `rigid_lcp.unique.elastic_limit`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from rigid_lcp.contact import ContactForces
from rigid_lcp.errors import NotConverged
from rigid_lcp.friction.problem import friction_problem
from rigid_lcp.motion import (
    Motion,
    World,
    body_space,
    contact_forces,
    find_contact_offset,
    replace_rates,
)
from rigid_lcp.unique.elastic_limit import elastic_limit
from rigid_lcp.wear import Wear, WearState, contact_stiffness_worn

CLOSED = 1e-6
"""Contacts are closed up to this share of the smallest body's size: time steps leave gaps of their
accuracy."""


def unique_forces(
    world: World, motion: Motion, loads: ArrayLike | None = None, wear: Wear | None = None,
    worn: WearState | None = None,
) -> ContactForces:  # fmt: skip
    """Forces of elastic contacts at the state ``motion``, the same for any order and solver.

    ``loads`` (n, 3) or (n, 6) [N, N m].  All contacts are equally stiff, but with ``wear`` and
    ``worn`` worn ones less (`rigid_lcp.wear.contact_stiffness_worn`).  For grains at rest or in
    slow motion: impacts are not in it.  Raises `NotConverged` where the limit is not found (many
    sliding contacts).
    """
    contacts = world.contacts(motion, 0.5 * CLOSED * world.length)
    none = np.zeros((len(contacts), motion.dim))
    if len(contacts) == 0:
        return contact_forces(contacts, none, None, 1.0)
    space = body_space(contacts, motion.position, world.columns, world.inverse_mass(motion))
    free = replace_rates(motion, world.accelerations(motion, loads))
    problem = friction_problem(
        space, find_contact_offset(contacts, motion, free), contacts.friction, motion.dim
    )
    k = np.ones(len(contacts))
    if wear is not None and worn is not None:
        k = contact_stiffness_worn(worn, wear, contacts)
    found = elastic_limit(problem, k, tolerance=1e-10)
    if not found.solved:
        raise NotConverged(
            f"the forces of elastic contacts were not found (residual {found.residual:.2g})",
            where="unique_forces", remedy=found.message,
        )  # fmt: skip
    return contact_forces(contacts, found.r.reshape(none.shape), None, 1.0)
