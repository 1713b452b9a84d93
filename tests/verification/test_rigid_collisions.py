"""Collisions (section 7): closed forms, energy, momentum, corners, friction."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import example, given, settings
from hypothesis import strategies as st

from rigid_lcp import BodySpace, collide
from rigid_lcp.collision.impulses import Law
from rigid_lcp.errors import ProblemError, UsageError
from tests.rigid_collision_sets import (
    cradle,
    cradle_answer,
    kinetic_energy,
    one_body,
    random_collision,
)
from tests.rigid_networks import network_bodies


@pytest.mark.parametrize("mu", [0.0, 0.3])
@pytest.mark.parametrize(("balls", "moving"), [(2, 1), (3, 1), (5, 1), (5, 2)])
def test_cradle(balls: int, moving: int, mu: float) -> None:
    """The paper's law: all collide at once.  k balls into n: v' = v - 2 (n-k)/n, or + 2 k/n."""
    bodies = cradle(balls)
    velocity = np.zeros(3 * balls)
    velocity[: 3 * moving : 3] = 1.0
    found = collide(bodies, velocity, 1.0, mu)
    assert found.solved
    assert found.velocity[::3] == pytest.approx(cradle_answer(balls, moving), abs=1e-12)
    assert abs(found.energy_change) <= 1e-13


@pytest.mark.parametrize("mu", [0.0, 0.3])
@pytest.mark.parametrize("light", [1e-5, 1e-6, 1e-8])
def test_a_light_ball_between_heavy_ones_takes_no_energy(light: float, mu: float) -> None:
    """1, m, 1 in a row, e = 1: the first stops, both others leave with 1, but for O(m).

    Their gaps close with ``1 + 1/m`` times what the light ball's impulses differ by, so round-off
    is 1e-16 / m of the velocities.
    """
    bodies = cradle(3)
    mass = sp.diags_array(np.repeat([1.0, 1.0 / light, 1.0], 3), format="csr")
    bodies = replace(bodies, inverse_mass=mass)
    found = collide(bodies, [1.0, *[0.0] * 8], 1.0, mu)
    assert found.solved
    assert found.restitution_scale == 1.0
    assert found.message == ""
    lost = -light / (2 + light)  # of the first ball: v0, then v0 + 1 twice, momentum 1
    np.testing.assert_allclose(found.velocity[::3], [lost, 1 + lost, 1 + lost], atol=4e-15 / light)
    assert abs(found.energy_change) <= 4e-15 / light


def test_random_collisions_never_make_energy() -> None:
    """Arms, normals, masses, eps and mu of every contact at random: both laws, a few of each."""
    generator = np.random.default_rng(3)
    for law in ("moreau", "newton", "moreau", "newton"):
        bodies, velocity, eps, mu = random_collision(generator)
        found = collide(bodies, velocity, eps, mu, law=law)  # type: ignore[arg-type]
        before, after = kinetic_energy(bodies, velocity), kinetic_energy(bodies, found.velocity)
        assert found.solved, found.message
        assert after <= before * (1 + 1e-12)


@given(st.floats(0.0, 1.0) | st.just(1.0), st.integers(0, 10**6))
@example(0.25, 816)  # two on which the method without friction stops just above the tolerance
@example(0.25, 147)
@settings(max_examples=8)
def test_energy_is_as_derived(eps: float, seed: int) -> None:
    """One eps, one round: ``E' - E = -(1 - eps)/2 dp . |v|``; and no contact approaches."""
    bodies, velocity = network_bodies(30, seed)
    normal = (bodies.jacobian @ velocity)[::2]
    found = collide(bodies, velocity, eps, max_rounds=200)
    before, after = kinetic_energy(bodies, velocity), kinetic_energy(bodies, found.velocity)
    assert found.solved, found.message
    assert after - before == pytest.approx(found.energy_change, abs=1e-12 * before)
    assert found.energy_change <= 1e-13 * before
    if found.rounds == 1:
        lost = -0.5 * (1 - eps) * found.impulse[::2] @ np.abs(normal)
        assert found.energy_change == pytest.approx(lost, abs=1e-12 * before)
    left = (bodies.jacobian @ found.velocity)[::2]
    assert left.min() >= -1e-11 * np.abs(normal).max()


def test_momentum_is_conserved() -> None:
    """Free bodies: impulses come in pairs, so linear and angular momentum stay."""
    bodies = cradle(4)
    velocity = np.random.default_rng(0).normal(size=12)
    velocity[::3] = [2.0, 1.0, 0.0, -1.0]
    found = collide(bodies, velocity, 0.5, 0.4)
    moment = lambda v: (  # noqa: E731  (spin about the line, radius 1/2, inertia 1/10)
        v[::3].sum(), v[1::3].sum(), 0.1 * v[2::3].sum() + np.arange(4) @ v[1::3],
    )  # fmt: skip
    assert found.solved
    assert moment(found.velocity) == pytest.approx(moment(velocity), abs=1e-12)


@pytest.mark.parametrize("eps", [0.0, 0.5, 1.0])
def test_a_ball_into_a_corner(eps: float) -> None:
    """Two walls at right angles: each component turns, ``v' = -eps v``."""
    body = one_body([([1.0, 0.0], [-0.5, 0.0]), ([0.0, 1.0], [0.0, -0.5])], 0.1)
    found = collide(body, [-2.0, -3.0, 0.0], eps)
    assert found.velocity == pytest.approx([2.0 * eps, 3.0 * eps, 0.0], abs=1e-12)


@pytest.mark.parametrize("eps", [0.0, 0.5, 1.0])
def test_a_corner_hits_the_floor(eps: float) -> None:
    """A square that lands on a corner at arm x: ``p = (1 + eps) v / (1/m + x^2/I)``."""
    x, inertia, v = 0.3, 1.0 / 6.0, 2.0
    body = one_body([([0.0, 1.0], [x, -0.5])], inertia)
    found = collide(body, [0.0, -v, 0.0], eps)
    impulse = (1 + eps) * v / (1 + x * x / inertia)
    assert found.impulse == pytest.approx([impulse, 0.0])
    assert found.velocity == pytest.approx([0.0, impulse - v, x * impulse / inertia])
    assert found.energy_change == pytest.approx(-0.5 * (1 - eps) * impulse * v, abs=1e-13)


def test_a_box_lands_flat() -> None:
    """Two corners at once: it bounces without turning, each corner with half the impulse."""
    body = one_body([([0.0, 1.0], [-0.5, -0.5]), ([0.0, 1.0], [0.5, -0.5])], 1.0 / 6.0)
    found = collide(body, [0.0, -1.0, 0.0], 0.5)
    assert found.velocity == pytest.approx([0.0, 0.5, 0.0], abs=1e-12)
    assert found.impulse[::2] == pytest.approx([0.75, 0.75])


@pytest.mark.parametrize("law", ["newton", "moreau"])
def test_a_sliding_ball(law: Law) -> None:
    """Fast and oblique: it slides through the collision, so ``p_T = mu p_N`` whatever the law."""
    ball = one_body([([0.0, 1.0], [0.0, -0.5])], 0.1)
    found = collide(ball, [-10.0, -1.0, 0.0], 0.5, 0.2, law=law)
    assert found.impulse[0] == pytest.approx(1.5)
    assert abs(found.impulse[1]) == pytest.approx(0.2 * 1.5)
    assert found.velocity[:2] == pytest.approx([-10.0 + 0.3, 0.5])
    assert found.energy_change < 0


def test_energy_that_would_grow_is_prevented_and_said() -> None:
    """A rod that hits with its tip: Newton's law with friction can make energy (Kane's paradox), so
    restitution is scaled down; Moreau's law never does for one eps."""
    sine, cosine = np.sin(0.6), np.cos(0.6)
    rod = one_body([([0.0, 1.0], [-0.5 * cosine, -0.5 * sine])], 1.0 / 12.0)
    g = np.random.default_rng(0)
    scaled = 0
    for _ in range(60):
        velocity = g.normal(size=3)
        newton = collide(rod, velocity, 0.9, 1.0, law="newton")
        moreau = collide(rod, velocity, 0.9, 1.0, law="moreau")
        size = kinetic_energy(rod, velocity)
        assert newton.energy_change <= 1e-11 * size
        assert moreau.energy_change <= 1e-11 * size
        assert moreau.restitution_scale == 1.0
        if newton.restitution_scale < 1.0:
            scaled += 1
            assert "scaled" in newton.message
    assert scaled > 0


def wedged_rod() -> BodySpace:
    """A rod from (-1, 1) to (1, -1) between walls at x = -1 and x = 1, M = 1.

    A spin makes both ends approach.  Bouncing, they slide along the walls; friction then turns the
    rod by ``2 mu p`` against the ``2 p`` of the walls: for mu > 1 no impulses let it bounce.
    """
    rows = [[1.0, 0.0, -1.0], [0.0, 1.0, -1.0], [-1.0, 0.0, -1.0], [0.0, -1.0, -1.0]]
    return BodySpace(sp.csr_array(np.array(rows)), sp.csr_array(sp.eye_array(3)), 3)


@pytest.mark.long
def test_impulses_that_do_not_exist_take_restitution_back() -> None:
    """Newton's law, mu = 2: restitution is taken back until there are impulses, and the rod stops.
    Moreau's law has them, u' = -eps u.  Below mu = 1 all is well: spin -eps."""
    spin = [0.0, 0.0, 1.0]
    safe = collide(wedged_rod(), spin, 0.5, 2.0, law="newton")
    assert safe.solved
    assert safe.velocity == pytest.approx([0.0, 0.0, 0.0], abs=1e-15)
    assert safe.restitution_scale == 0.0
    assert safe.energy_change == pytest.approx(-0.5)
    assert "no impulses were found" in safe.message
    for law, mu in (("moreau", 2.0), ("newton", 0.9)):
        found = collide(wedged_rod(), spin, 0.5, mu, law=law)  # type: ignore[arg-type]
        assert found.solved
        assert found.restitution_scale == 1.0
        assert found.velocity == pytest.approx([0.0, 0.0, -0.5], abs=1e-14)


def test_what_approaches_within_the_tolerance_ends_the_rounds() -> None:
    """A contact at rest beside others that slide at 1 m/s: 1e-10 m/s of approach is nothing to a
    tolerance of 1e-3, so a round finds no impulses, and no further round would."""
    rest = one_body([([0.0, 1.0], [0.0, -0.5])], 0.1)
    found = collide(rest, [1.0, -1e-10, 0.0], 0.0, 0.5, tolerance=1e-3)
    assert found.solved, found.message
    assert found.rounds == 1
    assert (found.impulse == 0.0).all()


def test_nothing_collides() -> None:
    """Contacts that part, or rest, need no impulse; no contacts at all."""
    bodies = cradle(3)
    for first in (-1.0, 0.0):
        found = collide(bodies, [first, 0, 0, 0, 0, 0, 0, 0, 0], 0.5)
        assert found.rounds == 0
        assert (found.impulse == 0).all()
    empty = BodySpace(sp.csr_array((0, 3)), sp.csr_array(sp.eye_array(3)), 3)
    assert collide(empty, [1.0, 0.0, 0.0], 0.5).solved


@pytest.mark.parametrize(("speed", "left"), [(0.9, 0.0), (1.1, 0.55)])
def test_slow_approaches_do_not_bounce(speed: float, left: float) -> None:
    """Zeno's cut-off: at ``rest_speed`` or slower a ball stops, above it leaves with ``eps v``."""
    ball = one_body([([0.0, 1.0], [0.0, -0.5])], 0.1)
    found = collide(ball, [0.0, -speed, 0.0], 0.5, rest_speed=1.0)
    assert found.velocity == pytest.approx([0.0, left, 0.0], abs=1e-15)


def test_what_stands_still_does_not_collide() -> None:
    """An approach not faster than ``still`` is none: nothing changes."""
    ball = one_body([([0.0, 1.0], [0.0, -0.5])], 0.1)
    found = collide(ball, [1e-9, -1e-9, 0.0], 0.5, 0.3, still=1e-9)
    assert found.rounds == 0
    assert (found.velocity == [1e-9, -1e-9, 0.0]).all()


@pytest.mark.parametrize("eps", [0.0, 0.5, 1.0])
def test_a_wall_that_is_driven(eps: float) -> None:
    """A wall comes with speed w towards a ball at rest: it leaves with ``(1 + eps) w``.

    In the wall's frame energy does not grow, whatever the wall does to it in ours.
    """
    ball = one_body([([0.0, 1.0], [0.0, -0.5])], 0.1)
    found = collide(ball, [0.0, 0.0, 0.0], eps, 0.3, drive=[-2.0, 0.0])
    assert found.velocity == pytest.approx([0.0, 2.0 * (1 + eps), 0.0])
    assert found.energy_change <= 0
    away = collide(ball, [0.0, -1.0, 0.0], eps, 0.3, drive=[3.0, 0.0])
    assert away.rounds == 0


def test_rows_that_are_no_contacts() -> None:
    """Three rows, where a contact in the plane has two."""
    rows = sp.eye_array(3).tocsr()
    with pytest.raises(ProblemError, match="3 rows"):
        collide(BodySpace(rows, rows, 3), [-1.0, 0.0, 0.0], 0.5)


def test_rounds_that_do_not_end_are_cut() -> None:
    """After the rounds allowed the rest has no restitution: nothing approaches, and that is all."""
    bodies, velocity = network_bodies(80, 3)
    found = collide(bodies, velocity, 1.0, max_rounds=1)
    assert "after 1 rounds the rest was taken without restitution" in found.message
    assert "rounds" not in collide(bodies, velocity, 1.0, max_rounds=500).message
    normal = (bodies.jacobian @ found.velocity)[::2]
    assert found.solved
    assert normal.min() >= -1e-11 * np.abs(bodies.jacobian @ velocity).max()


@pytest.mark.parametrize(
    ("eps", "mu", "velocity", "where"),
    [
        (1.1, 0.0, [0.0] * 9, "restitution"),
        (-0.1, 0.0, [0.0] * 9, "restitution"),
        (np.nan, 0.0, [0.0] * 9, "restitution"),
        (0.5, -1.0, [0.0] * 9, "friction"),
        ([0.5] * 3, 0.0, [0.0] * 9, "restitution"),
        (0.5, 0.0, [0.0] * 8, "velocity"),
        (0.5, 0.0, [np.inf] * 9, "velocity"),
    ],
)
def test_malformed_input(eps, mu, velocity, where):
    """What is wrong is named."""
    with pytest.raises(ProblemError, match=where):
        collide(cradle(3), velocity, eps, mu)


@pytest.mark.parametrize(
    "wrong",
    [
        {"tolerance": None}, {"max_rounds": "a"}, {"max_rounds": np.inf},
        {"law": "x"}, {"still": np.nan}, {"rest_speed": -1.0},
        {"tolerance": 0.0}, {"tolerance": np.nan}, {"max_rounds": -1}, {"max_rounds": 0.5},
    ],
    ids=str,
)  # fmt: skip
def test_choices_that_there_are_not(wrong: dict[str, Any]) -> None:
    """Named, with what there is; nothing is run as something else."""
    with pytest.raises(UsageError, match=next(iter(wrong))):
        collide(cradle(3), [0.0] * 9, 0.5, **wrong)


@pytest.mark.parametrize("drive", [[1.0], [np.nan] * 4, "abcd"])
def test_a_drive_that_is_none(drive: Any) -> None:
    """One number does not stand for all, text for none."""
    with pytest.raises(ProblemError, match="drive"):
        collide(cradle(3), [0.0] * 9, 0.5, drive=drive)


def test_a_matrix_is_no_bodies() -> None:
    """W alone does not say how velocities of bodies change."""
    with pytest.raises(ProblemError, match="BodySpace"):
        collide(np.eye(4), [0.0] * 4, 0.5)  # type: ignore[arg-type]
