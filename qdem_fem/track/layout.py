"""Where sleeper and ballast of a track lie: a slice, half a sleeper with a shoulder, or all of it.

Axes as in `qdem_fem.track.bodies`.  A half is the left half of a whole: the free end of the sleeper
and the shoulder of ballast at low x, the plane of symmetry at the middle of the track at high x.
There, as at the ends of a slice, meshes stop a radius before the plane, which their spheres touch.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from qdem_fem.files import Floats
from qdem_fem.mesh import TetMesh
from qdem_fem.track.bodies import GAP, Room, TrackBox, make_loose_lattice, make_sleeper_slice
from qdem_fem.track.sleeper_mesh import SleeperShape, make_half_sleeper, make_sleeper_mesh

Part = Literal["slice", "half", "whole"]
SLICE_POINTS = {"B1": 0.2, "B2": 0.5, "B3": 0.8}
"""Where along a slice grains are watched, over its length: towards the sleeper's end, below the
rail, towards the sleeper's centre."""


@dataclass(frozen=True)
class TrackLayout:
    """Measures of a part of a track [m]."""

    part: Part
    box: TrackBox
    shape: SleeperShape
    cells: tuple[int, int, int]  # of the part of the sleeper, along, across and up
    radius: float  # of the spheres of contact
    shoulder: tuple[float, float] | None
    """How far the flat top of the ballast and how far its foot reach beyond the sleeper's free end;
    None: to the wall."""

    @property
    def span(self) -> tuple[float, float]:
        """x from which to which the sleeper stands [m]; infinite where no end of it is free."""
        if self.part == "slice":
            return -inf, inf
        if self.part == "half":
            return self.box.length - self.radius - GAP - self.shape.length / 2, inf
        middle = self.box.length / 2
        return middle - self.shape.length / 2, middle + self.shape.length / 2

    def sleeper(self, bottom: float) -> TetMesh:
        """The sleeper across the middle of the box, its bottom at a height [m].

        Node sets ``S1`` (end), ``S2`` (by the rail), ``S3`` (centre), those of rail seats, which
        begin with ``seat``, and ``ends``, planes of symmetry, where there are any.
        """
        if self.part == "slice":
            return make_sleeper_slice(self.shape, self.box, bottom, self.radius, self.cells)
        make = make_half_sleeper if self.part == "half" else make_sleeper_mesh
        mesh = make(self.shape, *self.cells)
        shift = np.array([self.span[0], self.box.width / 2, bottom])
        return replace(mesh, nodes=mesh.nodes + shift)

    def measure_beyond(self, x: Floats) -> Floats:
        """How far x (k,) [m] lies beyond the free end of the sleeper, zero along it [m]."""
        start, end = self.span
        return np.maximum(np.maximum(start - x, x - end), 0.0)

    def is_under(self, places: Floats) -> NDArray[np.bool_]:
        """Whether spheres at (k, 3) [m] are where the sleeper goes down, (k,)."""
        aside = np.abs(self.measure_across(places)) <= self._reach
        return np.asarray(aside & (self.measure_beyond(places[:, 0]) <= 2 * self.radius))

    def measure_across(self, places: Floats) -> Floats:
        """How far places (k, 3) [m] lie from the plane of the sleeper's middle, along y; where the
        track repeats a grain may have left the box, and counts where its image is, (k,) [m]."""
        away = places[:, 1] - self.box.width / 2
        return np.asarray(away - self.box.width * np.round(away / self.box.width))

    def place_grains_below(self, grains: Sequence[Floats], seed: int) -> list[Floats]:
        """Loose grains on the ground, nodes of each [m]: as high as the flat top reaches, and from
        there lower by degrees to the foot."""
        if self.shoulder is None:
            return make_loose_lattice(grains, [self._room(inf)], 0.0, self.radius, seed)
        flat, foot = self.shoulder

        def find_share(x: Floats) -> Floats:
            return np.minimum(1.0, (foot - self.measure_beyond(x)) / (foot - flat))

        return make_loose_lattice(grains, [self._room(foot)], 0.0, self.radius, seed, find_share)

    def place_beside(self, grains: Sequence[Floats], bottom: float, seed: int) -> list[Floats]:
        """Loose grains from a height [m] on, beside the sleeper and beyond its ends; nodes.

        Raises `MeshError` where there is no room."""
        flat = inf if self.shoulder is None else self.shoulder[0]
        left, right, _, width = room = self._room(flat)
        start, end = max(self.span[0] - self.radius, left), min(self.span[1] + self.radius, right)
        middle, reach, radius = width / 2, self._reach, self.radius
        rooms = [
            (start, end, 0.0, middle - reach + radius), (start, end, middle + reach - radius, width)
        ]  # fmt: skip
        rooms += [(left, start, *room[2:]), (end, right, *room[2:])]
        where = "track, beside the sleeper"
        return make_loose_lattice(grains, rooms, bottom, self.radius, seed, where=where)

    @property
    def _reach(self) -> float:
        """From the middle of the sleeper to spheres that just touch its sides' [m]."""
        return self.shape.width / 2 + 2 * self.radius

    def _room(self, reach: float) -> Room:
        """As far as ``reach`` [m] beyond the free ends of the sleeper, and from wall to wall."""
        start, end = self.span
        return max(start - reach, 0.0), min(end + reach, self.box.length), 0.0, self.box.width

    def list_watched(self) -> dict[str, float]:
        """x of the grains that are watched [m]: B1 below S1, the end, B2 below the rail seat, B3
        below S3, the centre; of a slice at `SLICE_POINTS`."""
        if self.part == "slice":
            return {name: share * self.box.length for name, share in SLICE_POINTS.items()}
        half, apart = self.shape.length / 2, self.shape.seat_distance / 2
        return {
            name: self.span[0] + x for name, x in (("B1", 0.0), ("B2", half - apart), ("B3", half))
        }
