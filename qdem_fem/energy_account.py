"""The account of energies of a run: what is stored, taken and put in, and what is missing."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

STORED = ("kinetic", "elastic", "contact", "friction", "viscous", "absorbed", "foundation")
"""Stored in the bodies or taken from them, where a run has it."""


def energy_facts(energy: dict[str, FloatArray]) -> dict[str, float]:
    """Energies at the end [J], and the greatest of external less what all others gained.

    That is also told over the greatest energy that was put in, or went from one form to another,
    or was in motion.  What a scene begins with, overlap or motion, is no work of its loads.
    """
    names = [name for name in STORED if name in energy]
    stored = np.sum([energy[name] - energy[name][0] for name in names], axis=0)
    missing = energy["external"] - stored
    passed = [float(np.abs(energy[name] - energy[name][0]).max()) for name in names]
    passed.append(float(energy["kinetic"].max()))
    greatest = max(float(np.abs(energy["external"]).max()), float(stored.max()), *passed)
    return {
        **{name: float(energy[name][-1]) for name in [*names, "external"]},
        "greatest_imbalance": float(np.abs(missing).max()),
        "relative_imbalance": float(np.abs(missing).max()) / greatest if greatest > 0 else 0.0,
    }
