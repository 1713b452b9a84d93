"""The sample: a random start, and the figures of a bed (Karrech et al. 2007, section 2.3, Fig. 3).

The paper's figures do not all agree.  Its Table 1 (relative density 0.5615, R, H, density) gives a
weight of 3.96 N for the quarter cylinder, 15.8 N for the whole, and about 990 grains with its
normal radii.  Our scene's 1,085, which follow from the volume of the mean radius alone, weigh about
4.25 N (17.0 N the whole) and stand 64 mm high.  The 13.6 N of Fig. 3a follow from none of these.
"""

from dataclasses import dataclass
from math import pi

import numpy as np

from adapters.bed.container import Container
from adapters.bed.overlaps import find_pairs_within
from adapters.bed.radii import find_radius_that_fits
from adapters.bed.state import Contacts, FloatArray, IntArray, State
from adapters.errors import NotConverged, NotCredible, SceneError

GRAVITY = 9.81
"""Acceleration of gravity [m/s^2], along -z."""
SURFACE_SHARE = 0.9
"""Part of a bed's height, from the floor, that lies below the uneven free surface."""
START_ROUNDS = 1000
"""Rounds of drawing overlapping grains again before a random start is given up."""


def find_sample_mass(radius: FloatArray, density: float) -> FloatArray:
    """Masses [kg], shape (n,), of grains of ``radius`` [m], shape (n,); density in kg/m^3."""
    return 4 / 3 * pi * density * radius**3


def draw_sample_start(
    radius: FloatArray, container: Container, relative_density: float, seed: int
) -> tuple[FloatArray, float]:
    """Random centres [m], shape (n, 3), that do not overlap, and the height they fill [m].

    Every grain, of ``radius`` [m], shape (n,), lies between the floor, the walls, the mirror planes
    and the height, which follows from ``relative_density`` but is at least two grains.  Random
    sequential addition in rounds: all grains are drawn at once, uniformly; those that overlap a
    settled grain, or a lower index of their own round, are drawn again.
    The same for the same seed.

    Not for dense samples: raises `NotConverged` when no place is found, from about 0.2 on, and
    `SceneError` when a grain is wider than the container.
    """
    if radius.max() > find_radius_that_fits(container):
        raise SceneError(
            f"a grain of radius {radius.max():g} m does not fit into the container, which takes "
            f"radii up to {find_radius_that_fits(container):g} m",
            where="sample.grain_radius",
            remedy="give smaller grains or a wider container",
        )
    generator = np.random.default_rng([seed, 1])
    volume = 4 / 3 * pi * float(np.sum(radius**3))
    height = max(volume / (relative_density * container.area), 4 * float(radius.max()))
    position = draw_places(radius, container, height, generator)
    drawn_in = np.zeros(len(radius), np.int64)
    for round_ in range(1, START_ROUNDS):
        first, second = find_pairs_within(position, radius, 0.0).T
        overlapping = np.unique(np.where(drawn_in[first] > drawn_in[second], first, second))
        if not len(overlapping):
            return position, height
        position[overlapping] = draw_places(radius[overlapping], container, height, generator)
        drawn_in[overlapping] = round_
    raise NotConverged(
        f"{len(overlapping)} grains found no free place at relative density {relative_density:g}",
        where="sample.relative_density_start",
        remedy="start looser, such as 0.05",
    )


def draw_places(
    radius: FloatArray, container: Container, height: float, generator: np.random.Generator
) -> FloatArray:
    """Uniform random centres of grains that lie inside the container, shape (n, 3)."""
    place = np.empty((len(radius), 3))
    place[:, 2] = generator.uniform(radius, height - radius)
    if container.shape == "box":
        place[:, 0] = generator.uniform(radius, container.size_x - radius)
        place[:, 1] = generator.uniform(radius, container.size_y - radius)
        return place
    reach = container.radius - radius
    mirrors = [axis in container.symmetry for axis in "xy"]
    chord = np.sqrt(np.maximum(reach**2 - radius**2, 0))  # reach along a mirror, a radius away
    high = np.column_stack([chord if mirrors[1 - axis] else reach for axis in range(2)])
    low = np.column_stack([radius if mirrors[axis] else -high[:, axis] for axis in range(2)])
    drawn = np.arange(len(radius))
    while len(drawn):
        place[drawn, :2] = generator.uniform(low[drawn], np.maximum(high, low)[drawn])
        outside = np.hypot(place[drawn, 0], place[drawn, 1]) > reach[drawn] * (1 + 1e-12)
        drawn = drawn[outside]
    return place


def measure_volume_below(position: FloatArray, radius: FloatArray, height: float) -> float:
    """Volume of the spheres below the plane z = ``height`` [m^3]: whole spheres and exact caps.

    A cap of depth d of a sphere of radius r has the volume pi d^2 (3 r - d)/3.
    """
    depth = np.clip(height - position[:, 2] + radius, 0, 2 * radius)
    return float(np.sum(pi * depth**2 * (3 * radius - depth) / 3))


def measure_relative_density(
    position: FloatArray, radius: FloatArray, container: Container, height: float
) -> float:
    """Share of the container's volume below ``height`` [m] that grains fill.

    ``position`` [m], shape (n, 3); ``radius`` [m], shape (n,).  Exact for grains within the walls;
    the overlap of two grains counts twice (a part in 1e8 of a bed of stiff grains).
    """
    below, outside = (measure_volume_below(position, radius, z) for z in (height, 0.0))
    return (below - outside) / (container.area * height)


def measure_bed_height(position: FloatArray, radius: FloatArray) -> float:
    """Height of the bed [m]: twice the height of its centre of volume.

    That of a layer of even density; unlike the highest grain it ignores a loose one on top.
    """
    return 2 * float(np.average(position[:, 2], weights=radius**3))


@dataclass(frozen=True)
class CoordinationNumber:
    """Mean number of contacts of a grain, three ways."""

    grains: float  # contacts with other grains; what LIGGGHTS' ``compute contact/atom`` averages
    with_walls: float  # contacts with walls, mirror planes and the piston counted too
    without_rattlers: float
    """The same over grains of two contacts and more, which carry the bed (Thornton 2000)."""
    rattler_share: float  # part of the grains with fewer than two contacts


def measure_coordination(
    contacts: Contacts, identifier: IntArray, wall_force: dict[str, FloatArray]
) -> CoordinationNumber:
    """Coordination number of a bed; a contact with a wall is a force on the grain that is not zero.

    ``identifier`` ascending, shape (n,); ``wall_force`` [N], shape (n, 3) for each wall.
    """
    ends = np.searchsorted(identifier, contacts.pair.ravel())
    with_grains = np.bincount(ends, minlength=len(identifier))
    walls = [np.any(force != 0, axis=1) for force in wall_force.values()]
    touching = with_grains + np.sum(walls, axis=0, dtype=np.int64) if walls else with_grains
    carrying = touching >= 2
    return CoordinationNumber(
        float(with_grains.mean()),
        float(touching.mean()),
        float(touching[carrying].mean()) if carrying.any() else 0.0,
        float(1 - carrying.mean()),
    )


@dataclass(frozen=True)
class SampleFigures:
    """Figures of a bed at one instant, as in Fig. 3 of the paper."""

    weight: float  # weight of all grains [N]
    apparent_weight: float  # force on the floor [N]; the side walls carry the rest by friction
    coordination: CoordinationNumber
    relative_density: float  # below `SURFACE_SHARE` of the bed's height
    height: float  # `measure_bed_height` [m]


def measure_sample(state: State, container: Container) -> SampleFigures:
    """Weight, coordination number and relative density of a bed."""
    height = measure_bed_height(state.position, state.radius)
    floor = state.wall_force.get("floor")
    return SampleFigures(
        weight=float(state.mass.sum()) * GRAVITY,
        apparent_weight=0.0 if floor is None else float(floor[:, 2].sum()),
        coordination=measure_coordination(state.contacts, state.identifier, state.wall_force),
        relative_density=measure_relative_density(
            state.position, state.radius, container, SURFACE_SHARE * height
        ),
        height=height,
    )


def find_top_under(
    position: FloatArray, radius: FloatArray, edges: tuple[float, float, float, float], reach: float
) -> float:
    """Highest place of grains under a piston [m]; ``position`` (n, 3), ``radius`` (n,) [m].

    ``edges`` of a rectangular piston along x, then y, and ``reach`` of a round one [m], infinite
    where there are none.  Raises `NotCredible` where no grain is: a block smaller than the gaps.
    """
    x, y = position[:, 0], position[:, 1]
    left, right, front, back = edges
    beyond = np.hypot(x - np.clip(x, left, right), y - np.clip(y, front, back))
    under = (beyond < radius) & (np.hypot(x, y) - radius < reach)
    if not under.any():
        raise NotCredible(
            "no grain is under the piston", where="loading.footprint",
            remedy="a wider footprint, or more grains",
        )  # fmt: skip
    return float((position[:, 2] + radius)[under].max())
