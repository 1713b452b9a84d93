"""Rules for the tangential force of a Hertz-Mindlin contact whose normal force changes.

Eq. 6 gives F_t = k_t delta_t with k_t = 8 G* sqrt(R* delta_n), and leaves open what becomes of F_t
when delta_n changes at fixed delta_t.  Each rule here answers that; a path is a series of overlaps
delta_n and tangential displacements delta_t, shape (s,) each, of a contact that does not slide as a
whole.  The paper's rule: "when the normal effort F_n decreases by dF_n, the value of the tangential
force when the normal force was F_n - dF_n is assigned to F_t" (section 2.2, after Roux, and Elata
and Berryman).
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import trapezoid

from adapters.bed.state import FloatArray

LOOPS = {
    "load n, load t, unload n, unload t": np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]),
    "load t, load n, unload t, unload n": np.array([[0, 0], [0, 1], [1, 1], [1, 0], [0, 0]]),
    "load both, unload both": np.array([[0, 0], [1, 1], [0, 0]]),
}
"""Closed paths: corners (n, t), 0 and 1 for the least and greatest overlap and displacement.

The second is the first run backwards.
"""


def force_secant(stiffness: FloatArray, displacement: FloatArray) -> FloatArray:
    """F_t = k_t delta_t [N], shape (s,): eq. 6 as printed, and LIGGGHTS' ``tangential history``.

    ``stiffness`` k_t [N/m] and ``displacement`` delta_t [m] along the path, shape (s,).
    """
    return stiffness * displacement


def force_incremental(stiffness: FloatArray, displacement: FloatArray) -> FloatArray:
    """dF_t = k_t d delta_t [N], shape (s,): a change of the normal force leaves F_t as it is."""
    mean = (stiffness[1:] + stiffness[:-1]) / 2
    steps = mean * np.diff(displacement)
    return stiffness[0] * displacement[0] + np.concatenate([[0.0], np.cumsum(steps)])


def force_rescaled(stiffness: FloatArray, displacement: FloatArray) -> FloatArray:
    """The paper's rule [N], shape (s,): dF_t = k_t d delta_t, and F_t ~ k_t while F_n decreases.

    We read the value "when the normal force was F_n - dF_n" as that of the same elastic
    displacement F_t/k_t, that is F_t k_t(F_n - dF_n)/k_t(F_n).
    """
    force = np.empty_like(displacement)
    force[0] = stiffness[0] * displacement[0]
    for i in range(1, len(force)):
        kept = force[i - 1] * min(1.0, stiffness[i] / stiffness[i - 1])
        mean = (stiffness[i] + stiffness[i - 1]) / 2
        force[i] = kept + mean * (displacement[i] - displacement[i - 1])
    return force


def work(force: FloatArray, displacement: FloatArray) -> float:
    """Work done on the contact along a path, integral of F_t d delta_t [J].

    Around a closed loop of a contact that is the same at its end: energy lost, if negative created.
    """
    return float(trapezoid(force, displacement))
