"""A line with its traffic: everything that does not change while it settles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from track_line.arrays import Floats
from track_line.beam import GRAVITY, Rail, Support, Track, assemble_rail, make_support
from track_line.beds import Beds, Scatter, Zone, draw_beds
from track_line.laws import Law
from track_line.settling.level import LEVEL


@dataclass(frozen=True)
class Axle:
    """A kind of axle."""

    load: float
    """Of the axle, both wheels [N]."""
    share: float = 1.0
    """Of all axles [-]."""

    @property
    def wheel(self) -> float:
        """Load of a wheel [N]."""
        return self.load / 2


@dataclass(frozen=True)
class Traffic:
    """The kinds of axles that roll by; their shares add up to one."""

    axles: tuple[Axle, ...]

    @property
    def tonnes(self) -> float:
        """Of the mean axle [1000 kg]."""
        return sum(one.share * one.load for one in self.axles) / GRAVITY / 1e3

    def find_tonnage(self, cycle: Floats) -> Floats:
        """Millions of gross tonnes (MGT) after so many axles."""
        return np.asarray(cycle * self.tonnes / 1e6)


@dataclass(frozen=True)
class Line:
    """b realisations of a line of n sleepers; its margins are in it."""

    track: Track
    rail: Rail
    support: Support
    beds: Beds
    scatter: Scatter
    law: Law
    traffic: Traffic
    seed: int

    @property
    def inside(self) -> slice:
        """Sleepers of the length that was asked for, without the margins."""
        margin = round(LEVEL.margin / self.track.spacing)
        return slice(margin, len(self.beds.place) - margin)


def make_line(
    length: float, track: Track, stiffness: float, law: Law, traffic: Traffic, scatter: Scatter,
    *, zones: tuple[Zone, ...] = (), lines: int = 1, seed: int = 1,
) -> Line:  # fmt: skip
    """A line of ``length`` [m] from 0 on, and a margin at each end with beds of the same kind.

    ``stiffness``: mean of the beds under half a sleeper [N/m].
    """
    inside = round(length / track.spacing) + 1
    margin = round(LEVEL.margin / track.spacing)
    place = np.arange(-margin, inside + margin) * np.float64(track.spacing)
    beds = draw_beds(place, stiffness, scatter, zones, lines, seed)
    rail, support = assemble_rail(place, track), make_support(track, beds.stiffness)
    return Line(track, rail, support, beds, scatter, law, traffic, seed)
