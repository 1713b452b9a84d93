"""The families of the examination, named before any run: what bars hold for, and what is beyond.

The bars of `solve_friction` were set on stored problems: piles, stacks, walls, packings, mechanisms
of other people's simulations, up to some 1,300 contacts, with a W and friction that a simulation
has.  SAME is what a user of such simulations meets next: other beds, other loads, other masses,
other frictions, W as another program prints it, the step before as a start, or a bad start.
BEYOND is what no simulation of these families poses: friction of 0 beside 1000, three times the
friction under which a bed came about, every contact twice, and contacts in random directions
between random bodies, which need not have a solution at all.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from validation.bench.rigid import examination_beds as beds
from validation.bench.rigid import examination_problems as problems
from validation.bench.rigid.examination_beds import Generator, Posed

SAME, BEYOND = "the same families", "beyond them"


@dataclass(frozen=True)
class Family:
    """Problems of one kind, each made by its number and a seed."""

    name: str
    belongs: str
    """`SAME` or `BEYOND`."""
    count: int
    """How many are posed by default."""
    make: Callable[[Generator, int], Posed]
    soluble: bool = True
    """Every problem is known to have a solution."""
    needs: str = ""
    """Variable that names a folder without which there is none."""

    def pose(self, seed: int, index: int) -> Posed:
        """Problem ``index`` of a seed, the same whenever and wherever it is made."""
        return self.make(np.random.default_rng([seed, index, *self.name.encode()]), index)


DATA, SICONOS = "TRACKBED_DATA", "TRACKBED_SICONOS"
FAMILIES = (
    Family("stored, changed", SAME, 63, problems.pose_stored, False, DATA),
    Family("test suite, changed", SAME, 66, problems.pose_suite, False, SICONOS),
    Family("beds at rest", SAME, 60, beds.pose_resting),
    Family("beds kicked", SAME, 50, beds.pose_kicked),
    Family("beds tilted", SAME, 40, beds.pose_tilted),
    Family("crystals", SAME, 24, beds.pose_crystal),
    Family("towers", SAME, 24, problems.pose_tower),
    Family("walls", SAME, 36, problems.pose_wall),
    Family("warm starts", SAME, 30, problems.pose_warm_start, False),
    Family("wrong starts", SAME, 28, problems.pose_wrong_start, False),
    Family("W with noise", SAME, 36, problems.pose_noisy, False),
    Family("large packings", SAME, 24, beds.pose_large),
    Family("friction 0 and 1000", BEYOND, 20, problems.pose_mixed_friction, False),
    Family("friction x 3", BEYOND, 20, problems.pose_triple_friction, False),
    Family("contacts twice", BEYOND, 12, problems.pose_double_contacts),
    Family("random assemblies", BEYOND, 20, problems.pose_assembly, False),
)


def find_family(name: str) -> Family:
    """A family by its name.  Raises KeyError."""
    return {family.name: family for family in FAMILIES}[name]
