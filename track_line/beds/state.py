"""What is known of the beds of a line before the first axle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from track_line.arrays import Floats


@dataclass(frozen=True)
class Beds:
    """b lines of n beds, each of half a sleeper."""

    place: Floats
    """Along the line, shape (n,) [m]."""
    stiffness: Floats
    """k_b, shape (b, n) [N/m]."""
    score: Floats
    """Standard normal, shape (b, n): how much more than the mean each bed settles."""
    scale: Floats
    """Of zones, shape (n,): by which every settlement is multiplied [-]."""
    level: Floats
    """How deep each lies below the level of tamping, shape (b, n) [m]."""

    def find_factors(self, score: Floats, variation: float) -> Floats:
        """Settlement over that of the mean bed, (b, n) [-]: lognormal of mean 1 by zone, with a
        coefficient of ``variation``."""
        return spread_around_one(score, variation) * self.scale


def spread_around_one(score: Floats, variation: float) -> Floats:
    """Lognormal numbers of mean 1 and coefficient of ``variation`` of standard normal ones [-]."""
    width = np.sqrt(np.log1p(variation**2))
    return np.asarray(np.exp(width * score - width**2 / 2))
