"""The critical step: dense eigenvalues, stable or not, slivers, jumps, mass scaling."""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.optimize import brentq

import qdem_fem as q
from qdem_fem.bodies.mass_scaling import find_element_step, find_mass_scaling_factor
from qdem_fem.contact.critical_step import find_lagged_viscous_step
from qdem_fem.element.strain_measures import Strain
from qdem_fem.files.errors import StepWarning, Unstable
from qdem_fem.mesh.generation import make_box_mesh
from validation.bench.qdem.judge import build_from_lame, build_stiffness, lump_mass
from validation.bench.qdem.meshes import make_delaunay, make_slivers

SLIVER_STEP = {0.3: 0.83, 0.1: 0.51, 0.03: 0.28, 0.01: 0.16}
"""Critical step of `make_slivers` over that of the undisturbed mesh, by altitude."""

LAW = pytest.mark.parametrize("law", get_args(Strain))
YOUNG, POISSON, DENSITY = 1e6, 0.3, 1000.0
BELOW, ABOVE = 2e-3, 1e-7
"""Relative bounds on the value: at most 0.2 % below the true one, never above but by round-off
(the Lanczos value is a Rayleigh quotient, below omega^2; its residual is added)."""


def body(seed: int = 1, count: int = 60, **material: Any) -> q.Body:
    nodes, elements = make_delaunay(count, seed)
    values: dict[str, Any] = {"young": YOUNG, "poisson": POISSON, "density": DENSITY} | material
    return q.Body((nodes, elements), q.Material(**values))


def dense(
    body: q.Body, free: np.ndarray | None = None, master: np.ndarray | None = None
) -> tuple[Any, Any, Any]:
    """Stiffness, viscous matrix and mass by scikit-fem on the free components."""
    m, n = body.material, len(body.nodes)
    follow = np.arange(n) if master is None else master
    join = np.kron(np.eye(n)[follow], np.eye(3))
    mass = np.bincount(follow, lump_mass(body.nodes, body.elements, m.density), n)
    chosen = np.repeat(mass > 0, 3) & (True if free is None else free)
    shear, bulk = m.shear_viscosity, m.bulk_viscosity
    both = (
        build_stiffness(body.nodes, body.elements, m.young, m.poisson),
        build_from_lame(body.nodes, body.elements, bulk - 2 / 3 * shear, shear),
    )
    K, C = ((join.T @ matrix @ join)[np.ix_(chosen, chosen)] for matrix in both)
    return K, C, np.repeat(mass, 3)[chosen]


def critical_dense(K: Any, C: Any, mass: Any) -> float:
    """Largest dt with 4 M - 2 dt C - dt^2 K not negative [s]: stable up to there."""
    scale = np.sqrt(np.outer(mass, mass))

    def lowest(step: float) -> float:
        matrix = (4 * np.diag(mass) - 2 * step * C - step**2 * K) / scale
        return float(eigh(matrix, eigvals_only=True, subset_by_index=(0, 0))[0])

    upper = 2 / np.sqrt(eigh(K / scale, eigvals_only=True)[-1])
    return float(brentq(lowest, 1e-9 * upper, 1.001 * upper, rtol=1e-13, xtol=1e-300))


def within(value: float, expected: float) -> bool:
    return (1 - BELOW) * expected <= value <= (1 + ABOVE) * expected


# --- the value ---------------------------------------------------------------------------------


@pytest.mark.parametrize("precision", ["float64", "float32"])
@pytest.mark.parametrize("seed", range(4))
def test_value_is_the_dense_one(seed: int, precision: Any) -> None:
    """dt = 2/omega, the largest eigenvalue by scikit-fem and LAPACK; free, then held."""
    stone = body(seed)
    run = q.Simulation([stone], precision=precision, threads=1)
    K, C, mass = dense(stone)
    above = ABOVE if precision == "float64" else 1e-5
    found, expected = run.critical_step.value, critical_dense(K, C, mass)
    assert (1 - BELOW) * expected <= found <= (1 + above) * expected
    assert run.step == pytest.approx(0.9 * found)

    bottom, wall = stone.nodes[:, 2] < 0.4, stone.nodes[:, 0] < 0.3
    run.fix(stone, bottom)
    run.roller(stone, wall & ~bottom, [1, 0, 0])
    free = np.ones((len(stone.nodes), 3), dtype=bool)
    free[bottom], free[wall, 0] = False, False
    expected = critical_dense(*dense(stone, free.ravel()))
    found = run.critical_step.value
    assert (1 - BELOW) * expected <= found <= (1 + above) * expected


@pytest.mark.parametrize("size", [1e-3, 1.0, 50.0])
def test_value_of_a_periodic_body(size: float) -> None:
    """Joined nodes count once, whatever the scale of the masses is."""
    mesh = make_box_mesh((2.0, 1.0, 1.0), (4, 2, 2))
    nodes = mesh.nodes.copy()
    inner = (nodes[:, 0] > 0.1) & (nodes[:, 0] < 1.9)
    nodes[inner] += 0.05 * np.random.default_rng(0).normal(size=(inner.sum(), 3))
    bar = q.Body((size * nodes, mesh.elements), q.Material(YOUNG, POISSON, DENSITY))
    run = q.Simulation([bar], threads=1)
    run.periodic(bar, nodes[:, 0] < 1e-9, nodes[:, 0] > 2 - 1e-9)
    expected = critical_dense(*dense(bar, master=run.master))
    assert within(run.critical_step.value, expected)


@pytest.mark.parametrize("viscosity", [10.0, 300.0, 1e3, 1e5])
def test_value_with_viscosity(viscosity: float) -> None:
    """The viscous force uses the velocity half a step behind: dt^2 k + 2 dt c <= 4 in each mode.

    Modes of K and C differ, and so does the one that governs; damping ratios 0.01 to 90.
    """
    stone = body(shear_viscosity=viscosity, bulk_viscosity=viscosity / 2)
    run = q.Simulation([stone], threads=1)
    assert within(run.critical_step.value, critical_dense(*dense(stone)))


def test_one_mode_with_viscosity() -> None:
    """(sqrt(1 + xi^2) - xi) 2/omega; 2/c without a spring, infinite without anything."""
    for xi in (0.0, 0.3, 5.0):
        expected = (np.sqrt(1 + xi**2) - xi) * 2 / 7
        assert find_lagged_viscous_step(49.0, 2 * xi * 7) == pytest.approx(expected, rel=1e-14)
    assert find_lagged_viscous_step(0.0, 8.0) == 0.25
    assert find_lagged_viscous_step(0.0, 0.0) == np.inf


def test_one_element() -> None:
    """Too small for Lanczos; its own eigenvalue is the bound that mass scaling uses, too."""
    nodes = np.array([[0.0, 0, 0], [1, 0.1, 0], [0.2, 1, 0], [0.1, 0.3, 1.1]])
    stone = q.Body((nodes, [[0, 1, 2, 3]]), q.Material(YOUNG, POISSON, DENSITY))
    run = q.Simulation([stone], threads=1)
    expected = critical_dense(*dense(stone))
    assert run.critical_step.value == pytest.approx(expected, rel=1e-6)
    assert find_element_step(stone)[0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", ["young", "density"])
def test_jumps_of_a_thousand(name: str) -> None:
    """A stiff or a light half governs; the other is a thousand times slower in omega^2."""
    nodes, elements = make_delaunay(60, 2)
    right = nodes[elements].mean(axis=1)[:, 0] > 0.5
    value = {"young": YOUNG, "density": DENSITY}[name]
    values = np.where(right, value, value / 1000)
    stone = body(2, **{name: values})
    critical = q.Simulation([stone], threads=1).critical_step
    assert within(critical.value, critical_dense(*dense(stone)))
    assert right[critical.element] == (name == "young")


def test_bodies_of_a_simulation_and_the_one_that_governs() -> None:
    """The step of two bodies is the shorter one, with the name of its body."""
    slow, fast = body(0), body(1, young=100 * YOUNG)
    fast.name = "fast"
    alone = q.Simulation([body(1, young=100 * YOUNG)], threads=1).critical_step
    both = q.Simulation([slow, fast], threads=1).critical_step
    assert both.body == "fast"
    assert both.element == alone.element
    assert both.value == pytest.approx(alone.value, rel=1e-4)


# --- its edge ------------------------------------------------------------------------------------


@pytest.mark.parametrize("viscosity", [0.0, 2e3], ids=["elastic", "viscous"])
@LAW
def test_stable_below_and_stopped_above(law: Strain, viscosity: float) -> None:
    """1 % below, 3000 steps keep the energy put in; 1 % above, the run stops and says why.

    Above, the fastest mode grows by 1.33 a step (elastic) or 1.02 (overdamped), so energy is
    10^10 times larger after some 100 or 1500 steps.  Below, kinetic energy in the leapfrog
    exceeds the true one by at most 1/(1 - (omega dt/2)^2) = 50.
    """
    # short of inversion, so that it is the energy that tells
    speed = 1e-6 * np.random.default_rng(0).normal(size=(60, 3))
    critical = q.Simulation([body(3, shear_viscosity=viscosity)], threads=1).critical_step

    stone = body(3, shear_viscosity=viscosity)
    run = q.Simulation([stone], strain=law, step=0.99 * critical.value, threads=1)
    stone.velocity = speed
    before = run.energy().kinetic
    run.advance(3000 * run.step)
    assert run.energy().kinetic + run.energy().elastic < 50 * before

    stone = body(3, shear_viscosity=viscosity)
    run = q.Simulation([stone], strain=law, step=1.01 * critical.value, threads=1)
    stone.velocity = speed
    with pytest.warns(StepWarning, match="1.01 times"), pytest.raises(Unstable) as raised:
        run.advance(4096 * run.step)
    assert f"element {critical.element} of body" in str(raised.value)
    assert "1.010 times the critical one" in str(raised.value)


def test_exactly_critical() -> None:
    """At omega dt = 2 the mode is u(k) = (-1)^k (a + b k): linear growth, no error.

    One element, whose eigenvalue is exact; bound: |u(k)| <= k dt |v| for a start at rest at u = 0.
    """
    nodes = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    stone = q.Body((nodes, [[0, 1, 2, 3]]), q.Material(YOUNG, POISSON, DENSITY))
    run = q.Simulation([stone], strain="small", safety=1.0, threads=1)
    stone.velocity = 1e-3 * run.critical_step.mode
    run.advance(500 * run.step)
    bound = 500 * run.step * 1e-3
    assert 0.5 * bound < abs(stone.displacement).max() < 1.01 * bound


# --- slivers -------------------------------------------------------------------------------------


def test_slivers_cost_what_they_did_in_the_first_study() -> None:
    """Step over that of the even mesh, by the altitude that is left (8^3 and 4^3 cells agree)."""

    def critical(altitude: float) -> Any:
        nodes, elements = make_slivers(altitude)
        stone = q.Body((nodes, elements), q.Material(45e9, 0.167, 2350.0))
        found = q.Simulation([stone], threads=1).critical_step
        return found, stone.gradients[1]

    even, _ = critical(1.0)
    for altitude, expected in SLIVER_STEP.items():
        found, volumes = critical(altitude)
        assert found.value / even.value == pytest.approx(expected, abs=0.01)
        assert volumes[found.element] < 1.01 * volumes.min()


@pytest.mark.parametrize("place", [0, 40, -1])
def test_a_planted_sliver_is_named(place: int) -> None:
    """A flat element on a face of the surface governs, and the report names it."""
    nodes, elements = make_delaunay(60, 4)
    face = q.Body((nodes, elements), q.Material(YOUNG, POISSON, DENSITY)).surface[7]
    corner = nodes[face]
    normal = np.cross(corner[1] - corner[0], corner[2] - corner[0])
    tip = corner.mean(axis=0) + 1e-3 * normal / np.sqrt(np.linalg.norm(normal))
    number = place % (len(elements) + 1)
    planted = np.insert(elements, number, [*face, len(nodes)], axis=0)
    stone = q.Body((np.vstack([nodes, tip]), planted), q.Material(YOUNG, POISSON, DENSITY))
    assert q.Simulation([stone], threads=1).critical_step.element == number


# --- mass scaling --------------------------------------------------------------------------------


def test_mass_scaling_factor_makes_each_element_as_slow_as_asked() -> None:
    """omega^2 goes with one over the density: dt of the element alone becomes the target."""
    stone = body(5)
    alone = find_element_step(stone)
    target = float(np.quantile(alone, 0.2))
    factor = find_mass_scaling_factor([stone], target)
    assert (factor[alone >= target] == 1).all()
    heavier = body(5, density=DENSITY * factor)
    assert find_element_step(heavier).min() == pytest.approx(target, rel=1e-12)


@pytest.mark.parametrize(
    ("altitude", "share", "gain", "most", "slower"),
    [(0.1, 1.0, 1.8, 0.14, 0.007), (0.01, 0.5, 2.6, 0.32, 0.043), (0.01, 0.25, 1.5, 0.08, 0.004)],
)
def test_mass_scaling_of_a_sliver(
    altitude: float, share: float, gain: float, most: float, slower: float
) -> None:
    """Longer steps for added mass, and what they cost the lowest frequency.

    ``share`` of the step of an even element is asked for.  No assembled mesh is faster than its
    fastest element, so the critical step is at least that.  In a body of 384 elements the added
    mass is up to a third of all; it sits in the middle, where the lowest mode moves little:
    d omega/omega = -phi dM phi/(2 phi M phi), at most half of the added share times the
    square of the mode there.
    """
    nodes, elements = make_slivers(altitude)
    even_nodes, _ = make_slivers(1.0)
    material = q.Material(YOUNG, POISSON, DENSITY)
    target = share * float(find_element_step(q.Body((even_nodes, elements), material)).min())

    stone = q.Body((nodes, elements), material)
    slow = q.Simulation([stone], threads=1).critical_step.value
    run = q.Simulation([q.Body((nodes, elements), material)], mass_scaling=target, threads=1)
    assert run.critical_step.value >= target * (1 - ABOVE)
    assert run.critical_step.value > gain * slow

    K, _, mass = dense(stone)
    scaled = np.repeat(run.assembly.mass, 3)
    added = scaled.sum() / mass.sum() - 1
    assert 0 < added < most
    lowest, changed = (
        np.sqrt(eigh(K / np.sqrt(np.outer(m, m)), eigvals_only=True, subset_by_index=(6, 6))[0])
        for m in (mass, scaled)
    )
    assert 1 - slower < changed / lowest < 1 - 0.001 * added
    assert within(run.critical_step.value, critical_dense(K, 0 * K, scaled))
