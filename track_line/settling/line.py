"""A line with its axles: everything that does not change while it settles."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from track_line.arrays import Floats
from track_line.beam import GRAVITY, Rail, Support, Track, assemble_rail, make_support
from track_line.beds import Beds, Scatter, Zone, draw_beds
from track_line.laws import Law
from track_line.settling.level import LEVEL
from trackbed.scene_files import NonNegative, Positive, Table


class Axle(Table):
    """A kind of axle."""

    load: Positive  # of the axle, both wheels [N]
    share: Positive = 1.0  # of all axles [-]
    unsprung_mass: NonNegative = 0.0  # of a wheel and its half of the axle [kg]

    @property
    def wheel(self) -> float:
        """Load of a wheel [N]."""
        return self.load / 2


@dataclass(frozen=True)
class Line:
    """b realisations of a line of n sleepers; its margins are in it."""

    track: Track
    rail: Rail
    support: Support
    beds: Beds
    law: Law
    axles: tuple[Axle, ...]  # their shares add up to one
    speed: float  # of all axles, towards greater places [m/s]

    @property
    def shares(self) -> Floats:
        """Of each kind of axle, shape (kinds,) [-]."""
        return np.array([one.share for one in self.axles])

    def find_tonnage(self, cycle: Floats) -> Floats:
        """Millions of gross tonnes (MGT) after so many axles."""
        return cycle * sum(one.share * one.load for one in self.axles) / GRAVITY / 1e9

    @property
    def inside(self) -> slice:
        """Sleepers of the length that was asked for, without the margins."""
        margin = round(LEVEL.margin / self.track.spacing)
        return slice(margin, len(self.beds.place) - margin)


def extend_zone(zone: Zone, length: float) -> Zone:
    """A zone that goes on through the margin where it reaches an end of the line."""
    begin = -np.inf if zone.begin <= 0 else zone.begin
    return zone.model_copy(
        update={"begin": begin, "end": np.inf if zone.end >= length else zone.end}
    )


def make_line(
    length: float, track: Track, law: Law, axles: Sequence[Axle], scatter: Scatter, *,
    zones: Sequence[Zone] = (), lines: int = 1, seed: int = 1, speed: float = 0.0,
) -> Line:  # fmt: skip
    """A line of ``length`` [m] from 0 on, and a margin at each end with beds of the same kind.

    Shares of axles are scaled to add up to one.
    """
    inside = round(length / track.spacing) + 1
    margin = round(LEVEL.margin / track.spacing)
    place = np.arange(-margin, inside + margin) * np.float64(track.spacing)
    wide = [extend_zone(one, length) for one in zones]
    beds = draw_beds(place, track.bed, scatter, wide, lines, seed)
    whole = sum(one.share for one in axles)
    kinds = (one.model_copy(update={"share": one.share / whole}) for one in axles)
    rail, support = assemble_rail(place, track), make_support(track, beds.stiffness)
    return Line(track, rail, support, beds, law, tuple(kinds), speed)
