"""Generated friction problems: geometry against rigid motions, statics, the kind they are of."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rigid_lcp.friction.auto.solve import solve_auto
from rigid_lcp.friction.methods.gauss_seidel import solve_gauss_seidel
from validation.bench.rigid.packings import (
    DENSITY,
    GRAVITY,
    TOUCH,
    Bed,
    build_crystal,
    build_tower,
    fall_freely,
    find_gaps,
    find_start,
    pose_bed,
    pour_bed,
    update_pairs,
)


@pytest.fixture(scope="module", params=[2, 3])
def made(request: pytest.FixtureRequest) -> Bed:
    return pour_bed(60, request.param, settle=60)


def test_gap_rate_is_the_derivative_of_the_gap(made: Bed) -> None:
    """u_N = J v is dg/dt (eq. 9): central difference of the gaps, error of second order."""
    generator = np.random.default_rng(0)
    axes = [0, 2] if made.dim == 2 else [0, 1, 2]
    problem = pose_bed(made, 1e-3, gaps=True)
    assert problem.bodies is not None
    size = problem.bodies.body_size
    velocity = generator.normal(size=(len(made.radius), size))
    move = np.zeros_like(made.centre)
    move[:, axes] = 1e-6 * velocity[:, : made.dim]
    ahead, behind = (find_gaps(replace(made, centre=made.centre + s * move)) for s in (1, -1))
    rate = problem.bodies.jacobian @ velocity.ravel()
    np.testing.assert_allclose(rate[:: made.dim], (ahead - behind) / 2e-6, atol=1e-7)


def test_a_bed_that_turns_as_one_does_not_slide(made: Bed) -> None:
    """A rigid motion of all grains, v = v_0 + w x r, has no relative velocity between grains."""
    problem = pose_bed(made, 1e-3, gaps=True)
    assert problem.bodies is not None
    between = np.repeat(made.pairs[:, 1] >= 0, made.dim)
    if made.dim == 2:  # phi turns x to z
        place = made.centre[:, [0, 2]]
        velocity = np.column_stack([-place[:, 1], place[:, 0], np.ones(len(place))])
    else:
        spin = np.array([0.3, -0.7, 0.5])
        turn = np.cross(spin, made.centre)
        velocity = np.column_stack([turn, np.tile(spin, (len(turn), 1))])
    relative = (problem.bodies.jacobian @ velocity.ravel())[between]
    gaps = np.repeat(np.abs(find_gaps(made)), made.dim)[between]  # contact points a gap apart
    assert (np.abs(relative) <= gaps + 1e-12).all()


def test_settled_to_an_equilibrium(made: Bed) -> None:
    """Closed gaps, contacts as many as friction needs, the floor bears the weight, few move."""
    apart = find_gaps(made)
    closed = apart < TOUCH * made.radius.mean()
    assert apart.min() > -0.02 * made.radius.mean()
    assert 0.5 * (made.dim + 1) - 0.3 < closed.sum() / len(made.radius) < made.dim + 0.3
    problem = pose_bed(made, 1e-3)
    found = solve_gauss_seidel(problem, tolerance=1e-9, sweeps=5000)
    assert found.solved
    space = problem.bodies
    assert space is not None
    velocity = fall_freely(space, 1e-3, made.dim) + space.inverse_mass @ (
        space.jacobian.T @ found.r
    )
    speed = np.abs(velocity.reshape(-1, space.body_size)[:, : made.dim]).max(axis=1)
    assert np.mean(speed > 0.05 * GRAVITY * 1e-3) < 0.15
    pairs = made.pairs[closed]
    volume = np.pi * made.radius**2 * (1.0 if made.dim == 2 else 4 / 3 * made.radius)
    floor = found.r[:: made.dim][pairs[:, 1] == -1].sum()
    walls = found.r[1 :: made.dim][pairs[:, 1] < -1]  # friction at the walls bears some of it
    weight = DENSITY * volume.sum() * GRAVITY * 1e-3
    assert floor < 1.01 * weight
    if made.dim == 2:
        signs = np.where(pairs[pairs[:, 1] < -1, 1] == -2, 1.0, -1.0)
        assert floor + (signs * walls).sum() == pytest.approx(weight, rel=0.02)


def test_warm_start_has_the_impulses_of_the_step_before(made: Bed) -> None:
    """World impulses in new frames: the norm of each is kept, and the pairs keep theirs."""
    again = update_pairs(made, 1e-4)
    start = find_start(again, 1e-3).reshape(-1, made.dim)
    np.testing.assert_allclose(
        np.linalg.norm(start, axis=1), np.linalg.norm(again.impulse, axis=1) * 1e-3, atol=1e-15
    )
    old = {tuple(pair): impulse for pair, impulse in zip(made.pairs, made.impulse, strict=True)}
    for pair, impulse in zip(again.pairs, again.impulse, strict=True):
        np.testing.assert_array_equal(impulse, old.get(tuple(pair), np.zeros(3)))


def test_reproduced_and_kept_in_a_folder(tmp_path: Path) -> None:
    first = pour_bed(20, 2, settle=10, folder=tmp_path)
    read, again = pour_bed(20, 2, settle=10, folder=tmp_path), pour_bed(20, 2, settle=10)
    for other in (read, again):
        np.testing.assert_array_equal(first.centre, other.centre)
        np.testing.assert_array_equal(first.pairs, other.pairs)
        assert (first.width, first.dim) == (other.width, other.dim)
    assert not np.array_equal(first.radius, pour_bed(20, 2, seed=1, settle=1).radius)


@pytest.mark.parametrize("dim", [2, 3])
def test_towers_are_redundant(dim: int) -> None:
    """2 or 4 contacts a face; every W r has at most the freedoms of the boxes as its rank."""
    problem = build_tower(4, dim, top_mass=1e4)
    contacts = 4 * 2 ** (dim - 1)
    assert problem.contacts == contacts
    matrix = problem.delassus.toarray()
    assert np.linalg.matrix_rank(matrix, tol=1e-12 * np.abs(matrix).max()) <= 4 * (3 * dim - 3)
    np.testing.assert_allclose(problem.offset[: 2 * dim : dim], -GRAVITY * 1e-3)


def test_a_crystal_has_all_its_contacts_and_stands_on_its_floor() -> None:
    """Layers of n^2 and (n-1)^2 spheres in turn: 2 m (m-1) contacts in a layer of m^2, eight for
    each sphere of a small layer above and below, n^2 with the floor, 4 n with the sides in every
    large layer.  The floor bears the weight: its spheres are the first n^2."""
    n = 3
    problem = build_crystal(n)
    large, small = (n + 1) // 2, n // 2
    inside = large * 2 * n * (n - 1) + small * 2 * (n - 1) * (n - 2)
    assert problem.contacts == inside + small * 8 * (n - 1) ** 2 + n * n + large * 4 * n
    found = solve_auto(problem)
    assert found.solved
    space = problem.bodies
    assert space is not None
    impulse = space.jacobian.T @ found.r
    weight = fall_freely(space, 1e-3, 3) / space.inverse_mass.diagonal()
    np.testing.assert_allclose(impulse, -weight, atol=1e-10 * np.abs(weight).max())
