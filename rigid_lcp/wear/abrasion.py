"""Abrasion: edges lose volume by the work of friction, and their contacts change gradually.

Archard (J. Appl. Phys. 24 (1953) 981): volume worn per length of sliding is ``K F_N / H``.  With
``F_T = mu F_N`` it is a volume per work of friction, ``V = k W`` with ``k = K / (mu H)``
(Reye 1860).

Two effects, both small in one step: the corner loses the worn volume (`rigid_lcp.wear.polygons`),
and, as section 8 of the paper proposes, "gradually changing the force law (38), which describes
changing edge properties" (`worn_stiffness`, for `elastic_limit`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigid_lcp.errors import ShapeError

Floats = NDArray[np.float64]


def friction_work(force: ArrayLike, velocity: ArrayLike, duration: float) -> Floats:
    """Work that friction takes from the motion at each contact, (nc,) [J], never below zero.

    ``force`` (nc, dim) [N] on body a, ``velocity`` (nc, dim) [m/s] of a against b, both (n, t..)
    as everywhere; ``duration`` [s].  With impulses [N s] for forces, give a duration of 1.
    """
    f, v = np.asarray(force, dtype=float), np.asarray(velocity, dtype=float)
    return np.maximum(-(f[:, 1:] * v[:, 1:]).sum(axis=1), 0.0) * duration


def worn_volume(work: ArrayLike, wear_coefficient: float) -> Floats:
    """``V = k W`` [m^3] for work (nc,) [J]; ``wear_coefficient`` k [m^3/J] = K / (mu H)."""
    if not (np.isfinite(wear_coefficient) and wear_coefficient >= 0):
        raise ShapeError(
            f"the wear coefficient is {wear_coefficient}", where="abrasion",
            remedy="give zero or more, in m^3/J (1e-15 to 1e-12 for rock)",
        )  # fmt: skip
    return wear_coefficient * np.asarray(work, dtype=float)


def worn_stiffness(
    stiffness: ArrayLike, worn: ArrayLike, volume_scale: float, left: float = 0.1
) -> Floats:
    """Stiffness [N/m] of contacts at edges that have lost ``worn`` (nc,) [m^3].

    ``k = k0 (left + (1 - left) exp(-V / V_0))``: crushed and rounded edges yield more.  The paper
    gives no law; this is the simplest gradual one, with ``volume_scale`` V_0 [m^3] and the share
    ``left`` of the stiffness that stays.  ``stiffness`` (nc,) or (nc, dim).
    """
    if not (volume_scale > 0 and 0 < left <= 1):
        raise ShapeError(
            f"volume_scale is {volume_scale}, left is {left}", where="worn_stiffness",
            remedy="give a volume above zero and a share in (0, 1]",
        )  # fmt: skip
    k = np.asarray(stiffness, dtype=float)
    share = left + (1 - left) * np.exp(-np.asarray(worn, dtype=float) / volume_scale)
    return np.asarray(k * (share[:, None] if k.ndim == 2 else share))
