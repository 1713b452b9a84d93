"""One contact alone, by the product's kernel."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigid_lcp.friction.sweeps.local_contact import solve_contacts_apart

STATUSES = ("open", "stick", "slide", "no solution")


def solve_contact(
    block: ArrayLike, offset: ArrayLike, friction: float
) -> tuple[NDArray[np.float64], str]:
    """Force r (dim,) of one contact with ``u = W r + q``, and what the contact does."""
    w, q = np.array(block, dtype=float), np.array(offset, dtype=float)
    force, status = solve_contacts_apart(w[None], q[None], np.array([friction], dtype=float))
    return force[0], STATUSES[status[0]]
