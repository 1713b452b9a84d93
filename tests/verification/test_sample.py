"""Sample: radii by their laws, random starts inside every container, volumes, contacts counted."""

from __future__ import annotations

from itertools import product
from math import pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.stats import kstest, truncnorm

from adapters.bed.container import Container
from adapters.bed.overlaps import find_pairs_within
from adapters.bed.radii import PAPER_DENSITY, RadiusDistribution, draw_radii, expect_grains
from adapters.bed.sample import (
    GRAVITY,
    draw_sample_start,
    find_sample_mass,
    measure_bed_height,
    measure_coordination,
    measure_relative_density,
    measure_sample,
    measure_volume_below,
)
from adapters.bed.state import Contacts, FloatArray, State, make_no_contacts
from adapters.errors import NotConverged, SceneError

TABLE_1 = RadiusDistribution("normal", 3.2e-3, 5.651e-4, 2.0)
QUARTER = Container("cylinder", ("x", "y"), radius=0.075)
CONTAINERS = [
    QUARTER,
    Container("cylinder", ("x",), radius=0.05),
    Container("cylinder", ("y",), radius=0.05),
    Container("cylinder", (), radius=0.04),
    Container("box", (), size_x=0.05, size_y=0.08),
    Container("box", ("x", "y"), size_x=0.05, size_y=0.04),
]


def contacts_between(pair: list[tuple[int, int]]) -> Contacts:
    """Contacts of given identifiers; forces play no part in counting."""
    m = len(pair)
    zero = np.zeros((m, 3))
    return Contacts(np.array(pair, np.int64).reshape(m, 2), np.zeros(m), zero, zero, zero)


# ---------------------------------------------------------------------------------------- radii


@pytest.mark.parametrize(
    "law",
    [
        TABLE_1,
        RadiusDistribution("normal", 1.0, 0.3, 0.5),
        RadiusDistribution("uniform", 3.2e-3, 5e-4),
    ],
)
def test_radii_follow_their_law(law: RadiusDistribution) -> None:
    """20,000 radii: bounds, Kolmogorov-Smirnov against the law (p above 1e-4), mean volume.

    The mean volume is within five standard errors of the sample.
    """
    radius = draw_radii(law, 20_000, seed=3)
    assert law.smallest <= radius.min()
    assert radius.max() <= law.greatest
    cut = law.truncation
    reference = (
        truncnorm(-cut, cut, law.mean, law.standard_deviation).cdf
        if law.name == "normal"
        else lambda r: np.clip((r - law.smallest) / (law.greatest - law.smallest), 0, 1)
    )
    assert kstest(radius, reference).pvalue > 1e-4
    volume = 4 / 3 * pi * radius**3
    error = volume.std() / sqrt(len(volume))
    assert abs(volume.mean() - law.volume_mean) < 5 * error


@given(mean=st.floats(1e-3, 1.0), relative=st.floats(0.01, 0.3), truncation=st.floats(0.2, 3.0))
def test_mean_volume_is_the_integral(mean: float, relative: float, truncation: float) -> None:
    """E[4/3 pi r^3] in closed form equals the integral over the cut normal density."""
    law = RadiusDistribution("normal", mean, relative * mean, truncation)
    density = truncnorm(-truncation, truncation, mean, relative * mean).pdf
    integral, _ = quad(lambda r: 4 / 3 * pi * r**3 * density(r), law.smallest, law.greatest)
    assert law.volume_mean == pytest.approx(integral, rel=1e-8)


def test_radii_are_reproducible() -> None:
    """The same seed gives the same radii, another seed others; constant radii are the mean."""
    assert np.array_equal(draw_radii(TABLE_1, 99, 1), draw_radii(TABLE_1, 99, 1))
    assert not np.array_equal(draw_radii(TABLE_1, 99, 1), draw_radii(TABLE_1, 99, 2))
    assert draw_radii(RadiusDistribution("constant", 2e-3), 3, 1).tolist() == [2e-3] * 3


def test_table_1_does_not_give_the_papers_weight() -> None:
    """Table 1 gives 3.96 N for the quarter and 15.8 N for the whole, not the 13.6 N of Fig. 3a.

    Weight = relative density * section * depth * density * g; 1,085 grains weigh 4.25 N.
    """
    quarter = PAPER_DENSITY * QUARTER.area * 0.060 * 2710 * GRAVITY
    assert quarter == pytest.approx(3.957, abs=5e-4)
    assert 4 * quarter == pytest.approx(15.83, abs=5e-3)
    grains = 1085 * TABLE_1.volume_mean * 2710 * GRAVITY
    assert grains == pytest.approx(4.25, abs=5e-3)
    filled = expect_grains(TABLE_1, QUARTER, 0.060) * TABLE_1.volume_mean * 2710 * GRAVITY
    assert filled == pytest.approx(quarter, rel=1e-3)


# ---------------------------------------------------------------------------------------- start


@settings(max_examples=40)
@given(
    container=st.sampled_from(CONTAINERS),
    count=st.integers(1, 300),
    density=st.floats(0.001, 0.1),
    spread=st.floats(0, 0.55),
    seed=st.integers(0, 2**32 - 1),
)
def test_start_is_inside_and_without_overlap(
    container: Container, count: int, density: float, spread: float, seed: int
) -> None:
    """No grain overlaps another or crosses a wall or mirror plane, at the density asked for.

    Walls as the engine gets them, with a lid at the height the start reports.
    """
    law = RadiusDistribution("uniform", 3e-3, spread * 3e-3)
    radius = draw_radii(law, count, seed)
    position, height = draw_sample_start(radius, container, density, seed)
    for i, j in find_pairs_within(position, radius, 0.0):
        raise AssertionError(f"grains {i} and {j} overlap")
    walls = container.walls(piston_height=height)
    for point, normal in zip(walls.plane_point, walls.plane_normal, strict=True):
        assert ((position - point) @ normal >= radius * (1 - 1e-9)).all()
    axis_distance = np.hypot(position[:, 0], position[:, 1])
    assert (axis_distance + radius <= walls.cylinder_radius * (1 + 1e-9)).all()
    filled = measure_relative_density(position, radius, container, height)
    assert filled <= density * (1 + 1e-12)
    if height > 4 * radius.max():
        assert filled == pytest.approx(density, rel=1e-12)
    again, _ = draw_sample_start(radius, container, density, seed)
    assert np.array_equal(position, again)


@pytest.mark.parametrize("container", CONTAINERS, ids=str)
def test_start_is_uniform_in_the_section(container: Container) -> None:
    """Small grains fill the section evenly: their mean place is the section's centroid.

    Within five standard errors of 4,000 grains of 0.1 mm; quarter disc 4R/(3 pi) from each mirror.
    """
    radius = np.full(4000, 1e-4)
    position, _ = draw_sample_start(radius, container, 0.01, seed=5)
    arc = 4 * container.radius / (3 * pi)
    for axis, size in enumerate((container.size_x, container.size_y)):
        mirrored = "xy"[axis] in container.symmetry
        centroid = size / 2 if container.shape == "box" else arc * mirrored
        error = position[:, axis].std() / sqrt(len(position))
        assert abs(position[:, axis].mean() - centroid) < 5 * error + 1e-4


@pytest.mark.parametrize(
    ("container", "fits"),
    [
        (Container("cylinder", radius=0.1), 0.1),
        (Container("cylinder", ("x",), radius=0.1), 0.05),
        (Container("cylinder", ("y",), radius=0.1), 0.05),
        (Container("cylinder", ("x", "y"), radius=0.1), 0.1 / (1 + sqrt(2))),
        (Container("box", size_x=0.1, size_y=0.3), 0.05),
    ],
    ids=str,
)
def test_grains_as_wide_as_the_container(container: Container, fits: float) -> None:
    """Spheres that just fit find their one place across, without an endless search; wider ones
    are refused."""
    position, _ = draw_sample_start(np.full(5, fits), container, 0.05, 1)
    walls = container.walls()
    for point, normal in zip(walls.plane_point, walls.plane_normal, strict=True):
        assert ((position - point) @ normal >= fits * (1 - 1e-6)).all()
    assert (np.hypot(position[:, 0], position[:, 1]) + fits <= walls.cylinder_radius + 1e-7).all()
    with pytest.raises(SceneError, match="does not fit"):
        draw_sample_start(np.full(5, fits * (1 + 1e-9)), container, 0.05, 1)


def test_start_at_the_densest_a_scene_allows() -> None:
    """Relative density 0.15 is reached with radii spread by a factor of ten."""
    law = RadiusDistribution("uniform", 3e-3, 0.47 * 3e-3)
    radius = draw_radii(law, 1000, 2)
    position, height = draw_sample_start(radius, QUARTER, 0.15, 2)
    assert len(find_pairs_within(position, radius, 0.0)) == 0
    assert measure_relative_density(position, radius, QUARTER, height) == pytest.approx(
        0.15, rel=1e-12
    )


def test_start_that_is_too_dense_is_refused() -> None:
    """Random addition can not reach a packed bed, and says so with a remedy."""
    with pytest.raises(NotConverged, match="start looser"):
        draw_sample_start(draw_radii(TABLE_1, 200, 1), QUARTER, 0.5, 1)


# ---------------------------------------------------------------------------------- volumes


@given(height=st.floats(-2, 4), centre=st.floats(-1, 3), radius=st.floats(0.01, 1.5))
def test_cap_is_the_integral_of_discs(height: float, centre: float, radius: float) -> None:
    """Volume below a plane = integral of pi (r^2 - (z - c)^2) up to the plane."""
    top = min(max(height, centre - radius), centre + radius)
    discs, _ = quad(lambda z: pi * (radius**2 - (z - centre) ** 2), centre - radius, top)
    cap = measure_volume_below(np.array([[0, 0, centre]]), np.array([radius]), height)
    assert cap == pytest.approx(discs, rel=1e-9, abs=1e-9 * radius**3)


@pytest.mark.long
@settings(max_examples=25)
@given(seed=st.integers(0, 10_000), low=st.floats(1e-3, 0.6), thickness=st.floats(0.05, 1))
def test_relative_density_is_monte_carlo(seed: int, low: float, thickness: float) -> None:
    """Density of a layer = share of random points inside grains, within five standard errors."""
    container = Container("cylinder", ("x", "y"), radius=0.04)
    radius = draw_radii(TABLE_1, 60, seed)
    position, height = draw_sample_start(radius, container, 0.1, seed)
    bottom, top = low * height, (low + thickness) * height
    generator = np.random.default_rng(seed)
    point = generator.uniform((0, 0, bottom), (0.04, 0.04, top), (40_000, 3))
    point = point[np.hypot(point[:, 0], point[:, 1]) < 0.04]
    inside = np.zeros(len(point), bool)
    for centre, r in zip(position, radius, strict=True):
        inside |= np.sum((point - centre) ** 2, axis=1) < r * r
    filled = [z * measure_relative_density(position, radius, container, z) for z in (top, bottom)]
    exact = (filled[0] - filled[1]) / (top - bottom)
    error = sqrt(max(exact * (1 - exact), 1 / len(point)) / len(point))
    assert abs(inside.mean() - exact) < 5 * error


def cubic_lattice(cells: tuple[int, int, int]) -> FloatArray:
    """Centres of touching unit-diameter spheres in a box of whole cells, shape (n, 3)."""
    return np.array(list(product(*map(range, cells))), float) + 0.5


def test_cubic_lattice() -> None:
    """A simple cubic lattice has relative density pi/6, in every layer and half layer."""
    position, box = cubic_lattice((3, 4, 5)), Container("box", size_x=3, size_y=4)
    radius = np.full(len(position), 0.5)
    for top in (0.5, 1.0, 2.5, 5.0):
        assert measure_relative_density(position, radius, box, top) == pytest.approx(
            pi / 6, rel=1e-14
        )
    assert measure_bed_height(position, radius) == pytest.approx(5.0, rel=1e-14)


# ---------------------------------------------------------------------------------- contacts


def test_coordination_of_a_cubic_lattice() -> None:
    """Touching spheres, 3 x 3 x 3: 2 * 54/27 = 4 with grains, plus 9 on the floor, none rattles."""
    position = cubic_lattice((3, 3, 3))
    pair = find_pairs_within(position, np.full(27, 0.5), 1e-9) + 1
    floor = np.zeros((27, 3))
    floor[position[:, 2] < 1, 2] = 2.5
    found = measure_coordination(
        contacts_between(pair.tolist()), np.arange(1, 28), {"floor": floor, "cylinder": 0 * floor}
    )
    assert found.grains == pytest.approx(4.0)
    assert found.with_walls == pytest.approx(4 + 9 / 27)
    assert found.without_rattlers == pytest.approx(4 + 9 / 27)
    assert found.rattler_share == 0


def test_rattlers_do_not_count_as_carrying() -> None:
    """Grains of one contact or none are rattlers; identifiers may have gaps."""
    identifier = np.array([2, 5, 7, 11, 40])
    contacts = contacts_between([(2, 5), (5, 7), (2, 7), (7, 11)])
    found = measure_coordination(contacts, identifier, {})
    assert found.grains == pytest.approx(8 / 5)
    assert found.with_walls == found.grains
    assert found.without_rattlers == pytest.approx((2 + 2 + 3) / 3)
    assert found.rattler_share == pytest.approx(2 / 5)
    gas = measure_coordination(make_no_contacts(), np.arange(4), {})
    assert (gas.grains, gas.with_walls, gas.without_rattlers, gas.rattler_share) == (0, 0, 0, 1)


def test_figures_of_a_stack() -> None:
    """A column of three spheres: weight, force on the floor, height and density by hand.

    Below 0.9 of the height the column lacks a cap of depth 0.3 diameters d:
    volume pi h^2 (3 r - h)/3 with h = 0.3 d.
    """
    radius, d = np.full(3, 0.01), 0.02
    position = np.array([[0.015, 0.015, 0.01 + d * i] for i in range(3)])
    mass = find_sample_mass(radius, 2710.0)
    weight = float(mass.sum()) * 9.81
    state = State(
        np.arange(1, 4),
        position,
        radius,
        mass,
        np.zeros((3, 3)),
        np.zeros((3, 3)),
        contacts_between([(1, 2), (2, 3)]),
        {"floor": np.array([[0, 0, weight], [0, 0, 0], [0, 0, 0]])},
    )
    box = Container("box", size_x=0.03, size_y=0.03)
    figures = measure_sample(state, box)
    assert figures.weight == pytest.approx(3 * 2710 * 4 / 3 * pi * 0.01**3 * 9.81, rel=1e-14)
    assert figures.apparent_weight == pytest.approx(weight)
    assert figures.height == pytest.approx(3 * d)
    assert figures.coordination.with_walls == pytest.approx(5 / 3)
    cap = 0.3 * d
    volume = 3 * 4 / 3 * pi * 0.01**3 - pi * cap**2 * (3 * 0.01 - cap) / 3
    assert figures.relative_density == pytest.approx(volume / (0.03**2 * 0.9 * 3 * d), rel=1e-12)
