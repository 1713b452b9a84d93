"""Measures of a ballast bed: settlement laws, fabric, dissipation, means with confidence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

MOBILISED = 0.99
"""Share of the friction limit above which a contact counts as sliding [-]."""


def settlement_law(settlement: Floats, kind: str) -> tuple[float, float, float]:
    """Least squares of settlement against cycles 1..n: two coefficients, root mean square error.

    ``settlement`` (n,) [m].  ``log``: ``a + b ln N`` (a: first cycle; Shenton's and ORE's form),
    ``linear``: ``a + b N``.
    """
    cycles = np.arange(1, len(settlement) + 1, dtype=float)
    column = np.log(cycles) if kind == "log" else cycles
    matrix = np.column_stack([np.ones_like(cycles), column])
    (a, b), *_ = np.linalg.lstsq(matrix, settlement, rcond=None)
    off = settlement - matrix @ np.array([a, b])
    return float(a), float(b), float(np.sqrt(np.mean(off**2)))


def fabric_of(contacts: dict[str, Any], stones: int, friction: float) -> dict[str, float]:
    """Fabric of a state: coordination number, anisotropy, direction, sliding, forces.

    ``contacts`` as in `validation.rigid_ballast_bed.Moment`; ``stones``: bodies that move.
    Contacts of one pair of bodies count once in the coordination number.  The anisotropy is
    ``2 (l1 - l2)`` of the fabric tensor ``<n n>``, its direction that of l1 against the vertical.
    """
    force = np.asarray(contacts["force"], dtype=float)
    carried = force[:, 0] > 1e-6 * force[:, 0].max(initial=0.0)
    force, normal = force[carried], np.asarray(contacts["normal"])[carried]
    if len(force) == 0:
        return {"contacts": 0, "coordination": 0.0}
    pairs = np.unique(np.sort(np.asarray(contacts["bodies"])[carried], axis=1), axis=0)
    share, axis = np.linalg.eigh(np.einsum("ci,cj->ij", normal, normal) / len(normal))
    weighted = np.einsum("c,ci,cj->ij", force[:, 0], normal, normal) / force[:, 0].sum()
    own = np.linalg.eigvalsh(weighted)
    mean = float(force[:, 0].mean())
    sliding = np.abs(force[:, 1]) >= MOBILISED * friction * force[:, 0]
    return {
        "contacts": len(force),
        "coordination": 2.0 * len(pairs) / stones,
        "anisotropy": float(2 * (share[1] - share[0])),
        "direction": float(np.degrees(np.arctan(axis[0, 1] / axis[1, 1]))),
        "force_anisotropy": float(2 * (own[1] - own[0])),
        "sliding": float(sliding.mean()),
        "force_mean": mean,
        "force_largest": float(force[:, 0].max()) / mean,
        "force_below_mean": float((force[:, 0] < mean).mean()),
    }


def dissipated(work: Sequence[float], energy: Sequence[float]) -> Floats:
    """Energy lost in every cycle [J]: work of the load less the gain of the bodies' own energy."""
    return np.asarray(np.diff(work) - np.diff(energy))
