"""What a bed is made of: the recipe, and the bodies that follow from it.

`qdem_fem.track.bed` prepares the bed; its file is that of one recipe.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from functools import lru_cache

import numpy as np

from qdem_fem.bodies import Body, Rigid
from qdem_fem.contact.search import PeriodicWidth
from qdem_fem.contact.spheres import ContactPlane, SphereContact
from qdem_fem.element import Material
from qdem_fem.files import Floats
from qdem_fem.grains import GrainSet, make_grains
from qdem_fem.track.bodies import TrackBox
from qdem_fem.track.layout import Part, TrackLayout
from qdem_fem.track.sleeper_mesh import SleeperShape
from trackbed.scene_files import Grading

SLEEPER = "sleeper"
"""Name of the body."""


@dataclass(frozen=True)
class BedRecipe:
    """Everything that the prepared bed depends on, SI."""

    box: TrackBox
    below: int  # grains below the sleeper
    beside: int  # grains that fall into the cribs
    seed: int
    sizes: tuple[float, float]  # least and greatest sieve size of the grains' meshes [m]
    shape: SleeperShape
    cells: tuple[int, int, int]
    ballast: Material
    sleeper: Material
    radius: float
    stiffness: tuple[float, float]  # k_n of ballast and sleeper [N/m]
    friction: float
    side_friction: float  # of the walls at the sides; smooth ones are planes of symmetry
    gravity: tuple[float, float, float]
    softness: float
    unbalanced: float
    kinetic: float
    loose: float  # greatest shares of `Rest` that are equilibrium
    patience: float  # simulated time of a stage after which it is given up [s]
    rigid: bool = True  # whether grains are rigid until the last stage
    periodic: bool = False
    """Whether the track repeats along y, as in the paper, in place of walls there."""
    part: Part = "slice"
    shoulder: tuple[float, float] | None = None  # as in `TrackLayout`

    @property
    def layout(self) -> TrackLayout:
        """Where sleeper and ballast lie."""
        return TrackLayout(
            self.part, self.box, self.shape, self.cells, self.radius, self.shoulder
        )  # fmt: skip

    def planes(self) -> tuple[ContactPlane, ...]:
        """Ground and sides."""
        length, width = self.box.length, self.box.width
        ground = ContactPlane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
        sides = [
            ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
            ((length, 0.0, 0.0), (-1.0, 0.0, 0.0)),
            ((0.0, 0.0, 0.0), (0.0, 1.0, 0.0)),
            ((0.0, width, 0.0), (0.0, -1.0, 0.0)),
        ]
        if self.periodic:
            sides = sides[:2]
        return (ground, *(ContactPlane(*side, self.side_friction) for side in sides))

    def contact(self, names: Sequence[str], softness: float = 1.0) -> SphereContact:
        """Spheres of bodies with these names, their springs softer by a factor."""
        ballast, sleeper = self.stiffness
        each = {n: softness * (sleeper if n == SLEEPER else ballast) for n in names}
        width = PeriodicWidth("y", self.box.width) if self.periodic else None
        return SphereContact(self.radius, each, self.friction, self.planes(), periodic=width)

    def format_json(self) -> str:
        """The recipe as a text, equal for equal beds; that of a slice names no part.

        ``patience`` is not in it: it is no part of what has come to rest.
        """
        written = asdict(self)
        del written["patience"]
        if self.part == "slice":
            del written["part"], written["shoulder"]
        return json.dumps(written, sort_keys=True, default=np.ndarray.tolist)


def make_bed_grains(recipe: BedRecipe) -> GrainSet:
    """The grains of a bed."""
    return _make_grains_once(recipe.below + recipe.beside, recipe.seed, recipe.sizes)


@lru_cache(maxsize=1)  # 30 ms a grain, and a run asks twice
def _make_grains_once(count: int, seed: int, sizes: tuple[float, float]) -> GrainSet:
    return make_grains(count, seed, None, Grading(np.array(sizes), np.array([0.0, 1.0])))


def name_bodies(count: int, sleeper: bool) -> list[str]:
    """Names of the bodies: ``grain-0`` and so on, and the sleeper."""
    return [f"grain-{number}" for number in range(count)] + [SLEEPER] * sleeper


def make_bed_bodies(
    recipe: BedRecipe, grains: GrainSet, nodes: Sequence[Floats], *, rigid: Rigid,
    sleeper_rigid: Rigid | None = None,
) -> dict[str, Body]:  # fmt: skip
    """Bodies by name: grains ``rigid`` or not, the sleeper as they are if nothing else is said."""
    sleeper = len(nodes) > recipe.below + recipe.beside
    names = name_bodies(len(nodes) - sleeper, sleeper)
    other = rigid if sleeper_rigid is None else sleeper_rigid
    bodies = {}
    for number, (name, x) in enumerate(zip(names, nodes, strict=True)):
        if name == SLEEPER:
            mesh = replace(recipe.layout.sleeper(0.0), nodes=x)
            bodies[name] = Body(mesh, recipe.sleeper, name=name, rigid=other)
        else:
            mesh = replace(grains.mesh(number), nodes=x)
            bodies[name] = Body(mesh, recipe.ballast, name=name, rigid=rigid)
    return bodies
