"""Problems made for examining the solver: bit for bit by seed, bodies' weights, and the judge."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.friction.auto.solve import solve_friction
from rigid_lcp.friction.problem.definition import make_problem
from validation.bench.rigid import examination_beds as beds
from validation.bench.rigid.examination import find_family
from validation.bench.rigid.examination_beds import Posed, kick_posed, tilt_posed
from validation.bench.rigid.examination_problems import pose_assembly
from validation.bench.rigid.judge import measure_residual
from validation.bench.rigid.packings import GRAVITY, Bed, build_tower, pose_bed, pose_step
from validation.bench.rigid.walls import build_wall, count_bricks, draw_masses

WITHOUT_BEDS = ("crystals", "towers", "walls", "random assemblies")
"""Families that are made in no time."""
WEIGHT = GRAVITY * beds.STEP  # impulse of the weight of 1 kg in a step [N s]


# --- the judge --------------------------------------------------------------------------------


@given(
    index=st.integers(0, 3), seed=st.integers(0, 10**6), scale=st.sampled_from([1e-6, 1.0, 1e6]),
    by_bodies=st.booleans(),
)  # fmt: skip
@settings(max_examples=40)
def test_both_judges_agree(index: int, seed: int, scale: float, by_bodies: bool) -> None:
    """The solver's residual and the one of plain NumPy: round-off of some hundred terms apart."""
    generator = np.random.default_rng(seed)
    problem = pose_assembly(generator, index).problem
    if not by_bodies:
        problem = make_problem(problem.delassus, problem.offset, problem.friction, problem.dim)
    force = scale * generator.standard_normal(len(problem.offset))
    residual, left = measure_residual(problem, force)
    assert residual == pytest.approx(problem.residual(force), rel=1e-11)
    begun = problem.error_without_forces  # zero where nothing approaches
    assert left * (begun or 1.0) == pytest.approx(
        residual * np.linalg.norm(force) if begun else 1.0, rel=1e-11
    )


def test_judge_of_a_sliding_block() -> None:
    """W = 1, q = (-1, 3), mu = 0.5: r = (1, -0.5) slides on, and is known to the last digit; one
    part in a million less leaves just that, as does no force at all leave everything."""
    problem = make_problem(np.eye(2), np.array([-1.0, 3.0]), 0.5, 2)
    right = np.array([1.0, -0.5])
    assert measure_residual(problem, right) == (0.0, 0.0)
    assert measure_residual(problem, right * (1 - 1e-6))[0] == pytest.approx(1e-6, rel=0.5)
    assert measure_residual(problem, np.zeros(2))[1] == 1.0
    assert np.isnan(measure_residual(problem, np.array([np.nan, 0.0]))[0])


def test_judge_without_forces() -> None:
    """What parts needs none: residual zero; what approaches shows its velocity, over its size."""
    part, meet = (make_problem(np.eye(2), np.array([v, 0.0]), 0.5, 2) for v in (1.0, -2.0))
    assert measure_residual(part, np.zeros(2))[0] == 0.0
    assert measure_residual(meet, np.zeros(2))[0] == 1.0


# --- the problems -----------------------------------------------------------------------------


def same(one: Posed, other: Posed) -> bool:
    """The same numbers, bit by bit."""
    return (
        one.recipe == other.recipe
        and np.array_equal(one.problem.offset, other.problem.offset)
        and np.array_equal(one.problem.friction, other.problem.friction)
        and np.array_equal(one.problem.delassus.toarray(), other.problem.delassus.toarray())
    )


@pytest.mark.parametrize("name", WITHOUT_BEDS)
def test_problems_follow_from_family_seed_and_number(name: str) -> None:
    """Made twice they are the same; another seed or number makes another."""
    family = find_family(name)
    once, again, later, elsewhere = (
        family.pose(seed, index) for seed, index in ((5, 3), (5, 3), (5, 5), (6, 3))
    )
    assert same(once, again)
    assert not same(once, later)
    assert not same(once, elsewhere)


@pytest.mark.long
def test_beds_follow_from_family_seed_and_number(monkeypatch: pytest.MonkeyPatch) -> None:
    """So do small beds, and families do not share theirs."""
    monkeypatch.setattr(beds, "SIZES", (8, 12))
    monkeypatch.delenv("TRACKBED_BEDS", raising=False)
    kick, tilt = find_family("beds kicked"), find_family("beds tilted")
    once = kick.pose(5, 0)
    assert same(once, kick.pose(5, 0))
    assert once.recipe.partition(", kicked")[0] != tilt.pose(5, 0).recipe.partition(", tilted")[0]


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("joined", [False, True])
def test_a_wall_stands_on_its_floor(dim: int, joined: bool) -> None:
    """Floor impulses bear the weight of all bricks, and no contact sees the wall move as a whole
    but those with the floor."""
    generator = np.random.default_rng(1)
    mass = draw_masses(count_bricks(3, 3), "random", 1e4, generator)
    space = build_wall(3, 3, dim, mass, joined=joined)
    problem = pose_step(space, beds.STEP, 0.6, dim)
    found = solve_friction(space, problem.offset, problem.friction, dim)
    assert found.solved
    floor = 3 * 2 * (dim - 1)  # bricks, ends, and in space two depths
    borne = found.r.reshape(-1, dim)[:floor, 0].sum()
    assert borne == pytest.approx(mass.sum() * WEIGHT, rel=1e-10)
    sideways = np.zeros((len(mass), space.body_size))
    sideways[:, :dim] = np.arange(1.0, dim + 1)
    moved = (space.jacobian @ sideways.ravel()).reshape(-1, dim)
    assert moved[:floor, 0] == pytest.approx(float(dim))
    assert np.abs(moved[len(moved) - 1]).max() == 0.0


def test_inertia_of_bricks() -> None:
    """2 x 1 x 1 m and 3 kg: ``m (a^2 + b^2) / 12`` about each axis, y alone in the plane."""
    about = 3.0 * np.array([2.0, 5.0, 5.0]) / 12.0
    for dim, turning in ((2, about[1:2]), (3, about)):
        space = build_wall(1, 1, dim, np.array([3.0]))
        expected = 1.0 / np.array([3.0] * dim + [*turning])
        assert space.inverse_mass.diagonal() == pytest.approx(expected, rel=1e-15)


def test_a_wall_turns_as_a_rigid_body() -> None:
    """Turned about a point, all bricks alike, no joint of theirs opens or slides."""
    space = build_wall(3, 3, 2, np.ones(count_bricks(3, 3)), joined=True)
    middle = np.array([(2 * (i + k % 2 / 2), k + 0.5) for k in range(3) for i in range(3 - k % 2)])
    turn = np.column_stack([-middle[:, 1], middle[:, 0], np.ones(len(middle))])
    moved = space.jacobian @ turn.ravel()
    inside = space.jacobian[:, :].indptr  # floor contacts touch one body, the others two
    rows = np.flatnonzero(np.diff(inside) > 3)
    assert np.abs(moved[rows]).max() <= 1e-14


def test_gravity_turns() -> None:
    """Tilted by less than the angle of friction a cube sticks: its floor bears ``m g h`` turned."""
    posed = Posed(build_tower(1, 2, friction=0.9), "cube")
    generator = np.random.default_rng(3)
    turned = tilt_posed(posed, generator, most=0.5)
    angle = np.radians(float(turned.recipe.split()[-2]))
    found = solve_friction(turned.problem.bodies, turned.problem.offset, turned.problem.friction, 2)
    borne = np.abs(found.r.reshape(-1, 2).sum(axis=0))
    expected = WEIGHT * np.array([np.cos(angle), np.sin(angle)])
    assert borne == pytest.approx(expected, rel=5e-3)  # the recipe has three digits


def test_kicks_stay_in_the_image_of_the_bodies() -> None:
    """What is added to q is made by velocities of bodies, so a solution exists."""
    posed = Posed(build_tower(3, 3), "tower")
    for seed in range(8):
        push = kick_posed(posed, np.random.default_rng(seed)).problem.offset - posed.problem.offset
        jacobian = beds.require_bodies(posed).jacobian.toarray()
        made = jacobian @ np.linalg.lstsq(jacobian, push, rcond=None)[0]
        assert made == pytest.approx(push, abs=1e-12 * np.abs(push).max())
        assert np.abs(push).max() > 0


@pytest.mark.parametrize("dim", [2, 3])
def test_answers_hold_in_extended_precision(dim: int) -> None:
    """A residual of 1e-12 is no round-off of the solver's own judge."""
    for problem in (build_tower(5, dim), find_family("random assemblies").pose(5, dim - 2).problem):
        found = solve_friction(problem.bodies, problem.offset, problem.friction, dim)
        assert found.solved
        assert measure_residual(problem, found.r)[0] <= 2e-12


def test_two_grains_beside_a_wall() -> None:
    """Walls have negative numbers, which are no grains: no radius is read past the end."""
    made = Bed(
        np.array([[0.1, 0, 0.05], [0.25, 0, 0.05]]), np.full(2, 0.05), 0.3, 2, 0.5,
        np.array([[0, -1], [1, -1], [1, -3]]), np.zeros((3, 3)), 1.0,
    )  # fmt: skip
    assert pose_bed(made, 1e-3).contacts == 3
