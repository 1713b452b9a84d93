"""Contact of spheres: the compiled kernel against a plain twin, its list, its slider, its bound."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import types

from qdem_fem.contact.bounds import bound_contacts, bound_spring_network, shorten_step_by_contact
from qdem_fem.contact.search.pairs import find_near_pairs, find_near_walls, renew_pairs
from qdem_fem.contact.spheres.law import (
    GO_ON,
    LOOK_AGAIN,
    SPHERES_AT_ONCE,
    TOO_DEEP,
    Contact,
    Planes,
    Spheres,
    advance_one,
    advance_threads,
    slide_spring,
)
from qdem_fem.contact.spheres.options import find_pair_stiffness, find_tangential_stiffness
from qdem_fem.files import Floats, Integers

EPS = float(np.finfo(float).eps)
NO_WALLS = np.zeros((2, 0), bool)


def pairs_twin(position: Floats, radius: Floats, body: Integers, skin: float) -> Integers:
    """All pairs i < j of two bodies within their reach, one by one, (p, 2)."""
    apart = np.linalg.norm(position[:, None] - position, axis=2)
    near = apart <= radius[:, None] + radius + skin
    return np.argwhere(np.triu(near & (body[:, None] != body), 1))


def slider_twin(
    s: Floats, n: Floats, way: Floats, stiffness: float, limit: float
) -> tuple[Floats, float]:
    """The slider in vectors: turn, take up, slip; its loss."""
    turned = s - (s @ n) * n
    if s.any():
        turned *= np.linalg.norm(s) / np.linalg.norm(turned)
    trial = turned + way - (way @ n) * n
    pull = stiffness * np.linalg.norm(trial)
    after = trial * min(1.0, limit / pull) if pull > 0 else trial
    return after, 0.5 * stiffness * float((turned + after) @ (trial - after))


class Twin:
    """Contact by the book: a dictionary of springs, every pair looked at in every step."""

    def __init__(self, c: Contact) -> None:
        self.c, self.springs, self.slid = c, dict[Any, Floats](), 0.0

    def step(self, position: Floats, way: Floats) -> Floats:
        """Forces (c, 3) on the spheres."""
        spheres, planes = self.c.spheres, self.c.planes
        force = np.zeros_like(position)
        for i, j in pairs_twin(position, spheres.radius, spheres.body, 1.0):
            apart = position[i] - position[j]
            overlap = spheres.radius[i] + spheres.radius[j] - np.linalg.norm(apart)
            k_n, k_t = (
                find_pair_stiffness(k[i], k[j]) for k in (spheres.normal, spheres.tangential)
            )
            n = apart / np.linalg.norm(apart)
            f = self.law((i, j), n, overlap, way[i] - way[j], k_n, k_t, self.c.friction)
            force[i] += f
            force[j] -= f
        for w, n in enumerate(planes.normal):
            for i, x in enumerate(position):
                overlap = spheres.radius[i] - (x - planes.point[w]) @ n
                k_n, k_t = 2 * spheres.normal[i], 2 * spheres.tangential[i]
                friction = planes.friction[w]
                force[i] += self.law(("wall", w, i), n, overlap, way[i], k_n, k_t, friction)
        return force

    def law(
        self, key: Any, n: Floats, overlap: float, way: Floats, k_n: float, k_t: float, mu: float
    ) -> Floats:
        """Force of one contact; its spring is forgotten where it is open."""
        before = self.springs.pop(key, np.zeros(3))
        push = k_n * max(overlap, 0.0)
        if overlap <= 0 and not before.any():
            return np.zeros(3)
        s, loss = slider_twin(before, n, way, k_t, mu * push)
        self.slid += loss
        if overlap > 0:
            self.springs[key] = s
        return push * n - k_t * s


def cloud(seed: int, count: int, walls: bool, skin: float = 0.2) -> Contact:
    """Spheres of several bodies on a shaken lattice, where each touches about four others."""
    random = np.random.default_rng(seed)
    cells = int(np.ceil(count ** (1 / 3)))
    lattice = np.stack(np.unravel_index(np.arange(count), (cells,) * 3), axis=1)
    reference = 0.95 * lattice + random.uniform(-0.05, 0.05, (count, 3))
    radius = random.uniform(0.4, 0.6, count)
    normal = random.uniform(1.0, 2.0, count)
    body = random.integers(0, 5, count)
    across = random.normal(size=(2 * walls, 3))
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    size = np.zeros((count, 3))
    point = ((reference @ across.T).min(axis=0) - 0.25)[:, None] * across
    near = find_near_walls(reference, radius, point, across, skin)
    return Contact(
        Spheres(
            reference, 4 * np.arange(count), 4 * np.arange(count), body, radius, normal,
            find_tangential_stiffness(normal, 0.2),
        ),
        renew_pairs(None, reference, radius, body, skin, near),
        Planes(
            point, across,
            np.array([0.2, 0.7])[: 2 * walls],
            np.zeros((2 * walls, count, 3)), np.zeros((2 * walls, count, 3)),
        ),
        0.4, skin / 2, reference.copy(), size.copy(), size.copy(), np.zeros(count),
    )  # fmt: skip


def packed(field: Floats) -> Floats:
    """As the kernel has it, four numbers a node."""
    return np.column_stack([field, np.zeros(len(field))]).ravel()


@pytest.mark.parametrize("walls", [False, True])
def test_kernel_is_its_twin(walls: bool) -> None:
    """Forces, springs and losses of 40 steps of wild motion, pairs looked for again and again.

    The twin knows no list: a spring that a renewal lost or mixed up would show.  Tolerance: some
    ten roundings of forces of order one in each of 40 steps.
    """
    c, random = cloud(1, 120, walls), np.random.default_rng(2)
    twin, at = Twin(c), np.zeros((120, 3))
    renewed = slipped = held = 0
    for _ in range(40):
        velocity = random.normal(size=(120, 3))
        step = 0.01
        at += step * velocity
        said = advance_one(c, packed(at), packed(velocity), step)
        if said == LOOK_AGAIN:
            position = c.spheres.reference + at
            radius, body = c.spheres.radius, c.spheres.body
            near = find_near_walls(position, radius, c.planes.point, c.planes.normal, 0.2)
            pairs = renew_pairs(c.pairs, position, radius, body, 0.2, near)
            c = c._replace(pairs=pairs)
            c.start[:] = position
            renewed += 1
            assert advance_one(c, packed(at), packed(velocity), step) == GO_ON
        expected = twin.step(c.spheres.reference + at, step * velocity)
        assert c.force == pytest.approx(expected, abs=40 * 10 * EPS)
        assert c.slid.sum() == pytest.approx(twin.slid, rel=1e-12)
        stretched = np.linalg.norm(c.pairs.spring, axis=1)[c.pairs.touching > 0]
        slipped, held = slipped + (stretched > 0.1).sum(), held + (stretched > 0).sum()
    assert renewed >= 5
    assert held > 1000
    assert slipped > 100
    assert twin.slid > 0.1


@pytest.mark.long
def test_threads_give_the_same_bits() -> None:
    """Several blocks of spheres, one thread or more: forces, springs and losses are equal."""
    count = 2 * SPHERES_AT_ONCE + 17
    one, more = cloud(3, count, True), cloud(3, count, True)
    random = np.random.default_rng(4)
    at = np.zeros((count, 3))
    for _ in range(3):
        velocity = random.normal(size=(count, 3))
        at += 0.003 * velocity
        said = [f(c, packed(at), packed(velocity), 0.003) for f, c in
                ((advance_one, one), (advance_threads, more))]  # fmt: skip
        assert said[0] == said[1]
    for a, b in ((one.force, more.force), (one.slid, more.slid),
                 (one.pairs.spring, more.pairs.spring),
                 (one.planes.spring, more.planes.spring)):  # fmt: skip
        assert np.array_equal(a, b)
    assert one.force.any()


def test_one_thread_and_more_are_two_kernels_on_disk() -> None:
    """numba files what it compiled by source and closure, not by options: equal keys would answer
    two threads by the kernel of one, as they once did."""
    keys = [
        f._cache._index_key((types.int64,), f.targetctx.codegen())
        for f in (advance_one, advance_threads)
    ]
    assert keys[0] != keys[1]
    options = [f.targetoptions.get("parallel") for f in (advance_one, advance_threads)]
    assert [bool(o) for o in options] == [False, True]


def test_action_is_reaction_and_the_branch_takes_the_moment() -> None:
    """Forces of all pairs sum to nothing; their moment is the sum of ``d x F_t`` and no more.

    Without friction there is no moment at all.  Tolerances: a rounding of the greatest force
    (times the arm) for each of the forces that are summed.
    """
    c = cloud(5, 300, False)
    c = c._replace(friction=0.0)
    for friction in (0.0, 0.5):
        c = c._replace(friction=friction)
        velocity = np.random.default_rng(6).normal(size=(300, 3))
        advance_one(c, packed(0.01 * velocity), packed(velocity), 0.01)
        x = c.position
        force, moment = c.force.sum(axis=0), np.cross(x, c.force).sum(axis=0)
        rounding = 300 * EPS * np.abs(c.force).max()
        assert np.abs(force).max() < rounding
        touching = np.flatnonzero(c.pairs.touching)
        row = np.repeat(np.arange(300), np.diff(c.pairs.first))[touching]
        branch = x[row] - x[c.pairs.second[touching]]
        pull = c.pairs.pull[touching]
        expected = np.cross(branch, pull).sum(axis=0)
        assert moment == pytest.approx(expected, abs=10 * np.abs(x).max() * rounding)
        if friction == 0.0:
            assert np.abs(moment).max() < 10 * np.abs(x).max() * rounding
        else:
            assert np.abs(moment).max() > 0.01


def test_what_a_step_says() -> None:
    """A vertex beyond half the skin asks for a list, before any force of the step is computed;

    a centre inside another sphere is too deep.
    """
    c = cloud(7, 2, False)
    c.spheres.body[:] = 0, 1
    c.spheres.radius[:] = 0.5
    c.spheres.reference[:] = [[0, 0, 0], [2.0, 0, 0]]
    c = c._replace(
        pairs=renew_pairs(None, c.spheres.reference, c.spheres.radius, np.arange(2), 9.0, NO_WALLS)
    )
    c.start[:] = c.spheres.reference
    still = np.zeros(8)

    def said(way: float) -> int:
        return int(advance_one(c, packed(np.array([[way, 0, 0], [0, 0, 0]])), still, 1.0))

    assert [said(way) for way in (0.099, 0.101, 1.49, 1.51)] == [GO_ON] + 3 * [LOOK_AGAIN]
    assert not c.force.any()
    c.start[0, 0] = 1.45
    assert [said(way) for way in (1.49, 1.51)] == [GO_ON, TOO_DEEP]
    assert c.force.any()


def test_spheres_that_turn_as_one_strain_their_spring() -> None:
    """What the paper's vertices without a spin imply: ``|s| = |d| theta`` at the scale of a step.

    The chord of 1e-3 differs from its arc by theta^2/24, the old spring's turn by theta^2/2.
    """
    c = cloud(7, 2, False)
    c.spheres.body[:] = 0, 1
    c.spheres.radius[:] = 0.5
    c.spheres.reference[:] = [[-0.48, 0, 0], [0.48, 0, 0]]
    c = c._replace(
        friction=np.inf,
        half_skin=np.inf,
        pairs=renew_pairs(
            None, c.spheres.reference, c.spheres.radius, c.spheres.body, 1.0, NO_WALLS
        ),
    )
    at = c.spheres.reference
    for k in range(10):
        angle = 1e-3 * (k + 1)
        turned = 0.48 * np.array([[-np.cos(angle), -np.sin(angle), 0]])
        now = np.concatenate([turned, -turned])
        way = now - at
        advance_one(c, packed(now - c.spheres.reference), packed(way), 1.0)
        at = now
    assert np.linalg.norm(c.pairs.spring[0]) == pytest.approx(0.96 * 1e-2, rel=1e-4)


# --- the list ------------------------------------------------------------------------------------


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(0, 80), st.sampled_from([1e-3, 1.0, 1e6]))
def test_list_is_complete_and_in_order(seed: int, count: int, scale: float) -> None:
    """Every pair within reach, once, in order; clusters far apart, negative coordinates."""
    random = np.random.default_rng(seed)
    position = random.uniform(-3, 3, (count, 3)) + 1e3 * random.integers(-1, 2, (count, 1))
    radius, body = random.uniform(0.1, 0.8, count), random.integers(0, 3, count)
    skin = float(random.uniform(0, 0.3))
    first, second = find_near_pairs(scale * position, scale * radius, body, scale * skin)
    found = np.column_stack([np.repeat(np.arange(count), np.diff(first)), second])
    expected = pairs_twin(scale * position, scale * radius, body, scale * skin)
    assert found.tolist() == expected.tolist()


@pytest.mark.parametrize("far", [0.0, 1.0, 30.0, 1e9])
def test_pairs_of_bodies_of_many_patches(far: float) -> None:
    """Two bodies whose spheres fill the same room, some on each other, some far away.

    Far as they are, cells of a body are more than can be counted: they are then larger.
    """
    random = np.random.default_rng(7)
    position = random.uniform(-2, 2, (300, 3)) + far * random.integers(-2, 3, (300, 3))
    position[250:] = position[:50]  # at the same places, of the other body
    body = np.concatenate([random.integers(0, 2, 250), np.zeros(50, int)])
    body[250:] = 1 - body[:50]
    radius = random.uniform(0.05, 0.1, 300)
    first, second = find_near_pairs(position, radius, body, 0.02)
    found = np.column_stack([np.repeat(np.arange(300), np.diff(first)), second])
    assert found.tolist() == pairs_twin(position, radius, body, 0.02).tolist()
    assert len(found) >= 50


# --- the slider ----------------------------------------------------------------------------------


@settings(max_examples=100)
@given(st.integers(0, 2**32 - 1))
def test_slider_keeps_length_in_a_turn_and_its_losses_are_the_trapezoids(seed: int) -> None:
    """A turned normal costs nothing; held, all work is stored; slipping, work less store is lost.

    ``loss = 1/2 (F + F') way_t - (E' - E)`` to rounding, and never negative for a limit that
    does not fall.
    """
    random = np.random.default_rng(seed)
    n, s, way = (random.normal(size=3) for _ in range(3))
    n /= np.linalg.norm(n)
    stiffness = random.uniform(0.5, 2)
    length = np.linalg.norm(s)
    turned, loss = slide_spring.py_func(tuple(s), tuple(n), (0.0, 0.0, 0.0), stiffness, 1e9)
    assert np.linalg.norm(turned) == pytest.approx(length, rel=1e-12)
    assert abs(np.dot(turned, n)) < 1e-12 * length
    assert loss == 0.0
    limit = stiffness * length * random.uniform(1, 2)
    after, loss = slide_spring.py_func(turned, tuple(n), tuple(way), stiffness, limit)
    assert stiffness * np.linalg.norm(after) <= limit * (1 + 4 * EPS)
    across = way - (way @ n) * n
    work = 0.5 * stiffness * float(np.add(turned, after) @ across)
    stored = 0.5 * stiffness * float(np.dot(after, after) - length**2)
    assert loss == pytest.approx(work - stored, abs=1e-12 * (1 + abs(work) + abs(stored)))
    assert loss >= 0.0


# --- stiffness and step --------------------------------------------------------------------------


def test_table_1_of_the_paper() -> None:
    """k_t of ballast and sleeper follow from k_n and Poisson's ratio to the digits printed."""
    assert find_tangential_stiffness(1.613, 0.200) == pytest.approx(0.672, abs=5e-4)
    assert find_tangential_stiffness(2.390, 0.167) == pytest.approx(1.024, abs=5e-4)
    assert find_pair_stiffness(1.613, 1.613) == pytest.approx(1.613, rel=EPS)


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(2, 9), st.integers(1, 20), st.booleans())
def test_bound_of_a_network_holds(seed: int, nodes: int, springs: int, walls: bool) -> None:
    """The highest eigenvalue of springs with random directions, ``k_t`` across, walls, masses."""
    random = np.random.default_rng(seed)
    ends = np.array([random.choice(nodes, 2, replace=False) for _ in range(springs)])
    stiffness, inverse = random.uniform(0.1, 5, springs), random.uniform(0.1, 5, nodes)
    wall = walls * random.uniform(0, 3, nodes) * random.integers(0, 2, nodes)
    matrix = np.zeros((nodes, 3, nodes, 3))
    for (i, j), k in zip(ends, stiffness, strict=True):
        n = random.normal(size=3)
        n /= np.linalg.norm(n)
        block = 0.4 * k * np.eye(3) + 0.6 * k * np.outer(n, n)
        for a, b, sign in ((i, i, 1), (j, j, 1), (i, j, -1), (j, i, -1)):
            matrix[a, :, b] += sign * block
    for i in range(nodes):
        matrix[i, :, i] += wall[i] * np.diag([1, 0.4, 0.4])
    root = np.sqrt(np.repeat(inverse, 3))
    highest = np.linalg.eigvalsh(root[:, None] * matrix.reshape(3 * nodes, -1) * root)[-1]
    assert highest <= bound_spring_network(ends, stiffness, wall, inverse) * (1 + 1e-9)


def test_bounds_are_sharp_for_one_pair_and_one_wall() -> None:
    """``omega^2 = k (1/m1 + 1/m2)``, ``k/m``; and of any number of contacts that a vertex has."""
    pair = np.array([[0, 1]])
    inverse = np.array([2.0, 3.0])
    assert bound_spring_network(pair, np.array([7.0]), np.zeros(2), inverse) == 7 * 5
    assert bound_spring_network(pair[:0], np.zeros(0), np.array([7.0, 0]), inverse) == 14
    assert bound_contacts(np.array([7.0, 7.0]), inverse, 1) >= 7 * 5


@pytest.mark.parametrize("viscous", [False, True])
def test_step_with_contact(viscous: bool) -> None:
    """At the step, ``dt^2 K + 2 dt C + dt^2 K_c = 4``; without contact or elements, the known."""
    step = shorten_step_by_contact(0.5, 7.0, viscous=viscous)
    elements = 4 * step / 0.5 if viscous else 4 * (step / 0.5) ** 2
    assert elements + step**2 * 7.0 == pytest.approx(4, rel=1e-12)
    assert shorten_step_by_contact(0.5, 0.0, viscous=viscous) == 0.5
    assert shorten_step_by_contact(np.inf, 4.0, viscous=viscous) == 1.0
