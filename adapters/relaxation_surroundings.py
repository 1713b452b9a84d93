"""What grains may touch while they are moved: the other grains, and walls that stand still."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from adapters.contact_law import HertzStiffness, normal_force
from adapters.container import Walls
from adapters.overlaps import Neighbours, neighbours, rows_at
from adapters.relaxation_kernel import BoolArray
from adapters.state import FloatArray, IntArray


@dataclass(frozen=True)
class Surroundings:
    """What does not change while the centres of ``n`` grains move."""

    radius: FloatArray
    """Radii [m], (n,)."""
    walls: Walls
    behind: BoolArray
    """Which grains lie behind each plane that ends, (n, p): `adapters.overlaps.behind_discs`."""
    stiffness: HertzStiffness

    def rows(self, position: FloatArray, first: IntArray, second: IntArray) -> Neighbours:
        """The given rows at ``position`` [m], (n, 3)."""
        return rows_at(position, self.radius, first, second, self.walls, self.behind)

    def search(self, position: FloatArray, gap: float) -> Neighbours:
        """All rows nearer than ``gap`` [m] at ``position`` [m], (n, 3)."""
        return neighbours(position, self.radius, self.walls, gap, self.behind)

    def taken(self, order: IntArray) -> Surroundings:
        """The same with the grains in another order."""
        return Surroundings(self.radius[order], self.walls, self.behind[order], self.stiffness)

    def row_stiffness(self, rows: Neighbours) -> FloatArray:
        """lambda = 4/3 E* sqrt(R*) of each row [N/m^1.5]."""
        modulus_of_wall = np.array(
            [
                self.stiffness.mirror if mirror else self.stiffness.wall
                for mirror in self.walls.plane_frictionless
            ]
            + [self.stiffness.wall]
        )
        pair = rows.second >= 0
        other = np.where(pair, self.radius[np.where(pair, rows.second, 0)], np.inf)
        modulus = np.where(
            pair, self.stiffness.grain, modulus_of_wall[np.where(pair, 0, -1 - rows.second)]
        )
        radius = 1 / (1 / self.radius[rows.first] + 1 / other)
        return np.asarray(normal_force(1.0, 1.0, radius) * modulus)
