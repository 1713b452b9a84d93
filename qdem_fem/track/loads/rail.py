"""A rail as an infinite beam on a Winkler foundation, and what of a wheel load a seat takes."""

from dataclasses import dataclass, fields
from math import isfinite
from typing import Any

import numpy as np

from qdem_fem.files import ConditionError, Floats

QUIET = 12.0
"""Distance from the sleeper, over the elastic length, within which an axle counts: e^-12."""


@dataclass(frozen=True)
class Track:
    """A rail on its foundation, one of two; a 50N rail, the paper's 0.6 m a sleeper."""

    rail_stiffness: float = 206e9 * 1.96e-5  # E I of one rail [N m^2]
    modulus: float = 30e6
    """Track modulus u: force a metre of one rail over its deflection [N/m^2]; assumed."""
    spacing: float = 0.6  # from sleeper to sleeper [m]

    def __post_init__(self) -> None:
        refuse_unless_positive(self, "track")

    @property
    def elastic_length(self) -> float:
        """L = (4 E I/u)^(1/4) [m]."""
        return float((4 * self.rail_stiffness / self.modulus) ** 0.25)


def refuse_unless_positive(thing: Any, where: str) -> None:
    """Raise `ConditionError` unless every field of a dataclass is a number above zero."""
    for field in fields(thing):
        value = getattr(thing, field.name)
        if not (isfinite(value) and value > 0):
            raise ConditionError(
                f"{field.name} = {value}", where=where, remedy="give numbers above zero, in SI"
            )


def find_seat_share(distance: Floats, track: Track) -> Floats:
    """Share of a wheel load that a rail seat takes from a wheel at ``distance`` x from it [m].

    The foundation carries p = P/(2 L) e^-s (cos s + sin s) a metre, s = |x|/L; over the spacing a

        share = (Q((x + a/2)/L) - Q((x - a/2)/L))/2,   Q(s) = sign(s) (1 - e^-|s| cos s).

    The shares of all sleepers add up to 1 at any moment; beyond 3 pi/4 L a share is negative.
    """
    x, half = np.asarray(distance, float), track.spacing / 2

    def sum_load(s: Floats) -> Floats:
        size = np.abs(s)
        return np.asarray(np.sign(s) * (1 - np.exp(-size) * np.cos(size)))

    length = track.elastic_length
    return (sum_load((x + half) / length) - sum_load((x - half) / length)) / 2
