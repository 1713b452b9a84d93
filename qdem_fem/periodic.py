"""Partners on opposite faces of a periodic body."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from qdem_fem.errors import ConditionError
from qdem_fem.series import is_real

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


def partners(
    nodes: Floats, a: Integers, b: Integers, tolerance: float, name: str
) -> tuple[Integers, Integers]:
    """Pairs ``(a[i], b[j])`` of nodes that differ by the shift between the two faces.

    ``nodes`` (n, 3) [m]; ``tolerance`` over the size of the body [-].  Raises `ConditionError`
    naming a node without a partner.
    """
    from scipy.spatial import cKDTree

    if not (is_real(tolerance) and tolerance >= 0):
        raise ConditionError(f"a tolerance of {tolerance!r}", where="periodic", remedy="take 1e-6")
    if both := np.intersect1d(a, b).tolist():
        raise ConditionError(
            f"node {both[0]} of {name} is named on both faces", where="periodic",
            remedy="name two opposite faces",
        )  # fmt: skip
    if len(a) != len(b):
        raise ConditionError(
            f"{len(a)} nodes on one face of {name} and {len(b)} on the other",
            where="periodic",
            remedy="mesh both faces alike",
        )
    shift = nodes[b].mean(axis=0) - nodes[a].mean(axis=0)
    distance, place = cKDTree(nodes[b]).query(nodes[a] + shift)
    size = np.ptp(nodes, axis=0).max()
    worst = int(np.argmax(distance))
    if distance[worst] > tolerance * size or len(np.unique(place)) != len(place):
        raise ConditionError(
            f"node {a[worst]} of {name} has no partner: the nearest, {b[place[worst]]}, is "
            f"{distance[worst]:.3g} m from where it should be",
            where="periodic",
            remedy="mesh both faces alike, or give a larger tolerance",
        )
    return a, b[place]
