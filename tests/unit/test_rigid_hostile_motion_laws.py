"""What physics does not know: frame, mirror, units, numbering, who else is there.

The same scene turned, mirrored, scaled, renumbered, or seen from a train must move the same, to
round-off grown over the steps: polygons that fall, collide with restitution, roll and slide.
"""

from __future__ import annotations

import numpy as np
import pytest

from rigid_lcp import Disc, HalfSpace, Polygon, Scene, Simulation, solve_friction
from rigid_lcp.arrays import Floats

CORNERS = {"time-stepping": (5, 6, 7, 8, 4), "acceleration": (5, 6)}
"""Polygons of the scene; at acceleration level an event takes some 75 steps."""
GROWTH = 1e-9
"""Round-off of 1e-16 after some ten events that each multiply it by the shapes' ten or so [m]."""


def fall(
    method: str, *, turn: float = 0.0, mirror: bool = False, speed: float = 0.0,
    length: float = 1.0, mass: float = 1.0, time: float = 1.0, order: tuple[int, ...] = (),
) -> tuple[Floats, Floats, Floats]:  # fmt: skip
    """Five polygons fall on a fixed slab; positions, angles and spins, put back where they were.

    ``turn`` [rad], ``mirror`` and ``speed`` along the slab [m/s] of the whole; ``length``,
    ``mass`` and ``time``: units; ``order``: in which the polygons are added.
    """
    sign = -1.0 if mirror else 1.0
    frame = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    frame = frame @ np.diag([sign, 1.0])
    density, rate = 2700 * mass / length**2, length / time

    def placed(vertices: Floats) -> Polygon:
        changed = vertices * [sign, 1.0] * length
        return Polygon(changed[::-1] if mirror else changed)

    scene = Scene(gravity=frame @ [0, -9.81] * rate / time)
    drift = frame @ [speed, 0.0] * rate
    slab = Polygon.rectangle(4.0, 0.1)
    scene.add(placed(slab.vertices), fixed=True, position=frame @ [0, -0.05] * length, angle=turn,
              velocity=drift)  # fmt: skip
    corners = CORNERS[method]
    order = order or tuple(range(len(corners)))
    for k in order:
        scene.add(
            placed(Polygon.regular(corners[k], 0.1).vertices), density=density,
            position=frame @ [0.21 * k - 0.4, 0.13 + 0.05 * (k % 2)] * length,
            velocity=frame @ [0.3, -1.0] * rate + drift, angle=sign * 0.1 * k + turn,
            spin=sign * (k - 2.0) / time, friction=0.4, restitution=0.2 * (k % 2),
        )  # fmt: skip
    run = Simulation(scene, method, step=2e-3 * time)  # type: ignore[arg-type]
    duration = 0.05 if method == "acceleration" else 0.2
    run.advance(duration * time)
    back = np.argsort(order) + 1
    places = (run.positions - drift * duration * time) @ frame / length
    angles = sign * (run.angles - turn)
    return places[back], angles[back], (sign * run.spins * time)[back]


METHODS = pytest.mark.parametrize("method", ["time-stepping", "acceleration"])


@pytest.fixture(scope="module")
def as_it_is() -> dict[str, tuple[Floats, Floats, Floats]]:
    return {method: fall(method) for method in ("time-stepping", "acceleration")}


CHANGES = [
    {"turn": 0.7}, {"mirror": True}, {"speed": 1.0}, {"length": 1e6, "mass": 1e12, "time": 1e3},
    {"turn": -2.5}, {"length": 1e-6, "mass": 1e-15, "time": 1e-3}, {"mass": 1e-3},
    {"order": (3, 0, 4, 2, 1)},
]  # fmt: skip


@pytest.mark.parametrize(
    ("method", "change"),
    [("time-stepping", change) for change in CHANGES]
    + [("acceleration", change) for change in CHANGES[:4]],
    ids=str,
)
@pytest.mark.long
def test_the_same_scene_seen_otherwise_moves_the_same(method, change, as_it_is):
    positions, angles, spins = fall(method, **change)
    assert np.ptp(as_it_is[method][2]) > 1.0  # it is a scene that does something
    np.testing.assert_allclose(positions, as_it_is[method][0], atol=GROWTH)
    np.testing.assert_allclose(angles, as_it_is[method][1], atol=10 * GROWTH)
    np.testing.assert_allclose(spins, as_it_is[method][2], atol=1e4 * GROWTH)


@pytest.mark.long
@METHODS
def test_a_run_made_twice_is_the_same_to_the_last_digit(method, as_it_is):
    for once, again in zip(as_it_is[method], fall(method), strict=True):
        np.testing.assert_array_equal(once, again)


@METHODS
def test_free_bodies_keep_their_momentum(method):
    """No gravity, no walls: momentum, angular momentum about the origin; energy never grows."""
    scene = Scene(gravity=(0, 0))
    rng = np.random.default_rng(8)
    for k in range(7):
        shape = Disc(0.1) if k % 3 == 0 else Polygon.regular(4 + k, 0.12)
        place = 0.32 * np.array([k % 3, k // 3], dtype=float)
        scene.add(shape, density=1000.0 * (1 + k), position=place, velocity=-2 * (place - 0.3),
                  spin=float(rng.normal()), friction=0.3, restitution=0.5)  # fmt: skip
    run = Simulation(scene, method)

    def momenta() -> Floats:
        mass, inertia = run.world.mass, run.world.inertia
        push = mass[:, None] * run.velocities
        turn = (run.positions[:, 0] * push[:, 1] - run.positions[:, 1] * push[:, 0]).sum()
        return np.array([*push.sum(axis=0), turn + (inertia * run.spins).sum()])

    before, energy = momenta(), run.energy
    size = (run.world.mass * np.linalg.norm(run.velocities, axis=1)).sum()
    least = energy
    for _ in range(20):
        run.advance(0.01)
        assert run.energy <= least * (1 + 1e-12)
        least = run.energy
    np.testing.assert_allclose(momenta()[:2], before[:2], atol=1e-12 * size)
    # what overlaps is moved apart with its velocity left alone: no farther than it goes in a step
    moved = run.step * 1.0 if method == "time-stepping" else 1e-9
    np.testing.assert_allclose(momenta()[2], before[2], atol=moved * size)
    assert least < 0.9 * energy  # they did collide


@pytest.mark.long
def test_a_symmetric_heap_stays_symmetric():
    """Three discs on the ground, two upon them: their mirror images move as mirror images."""
    scene = Scene()
    scene.add(HalfSpace([0, 1]))
    for x in (-0.2, 0.0, 0.2):
        scene.add(Disc(0.1), density=2000, position=(x, 0.1), friction=0.4)
    for x in (-0.1, 0.1):
        scene.add(Disc(0.1), density=2000, position=(x, 0.1 + 0.1 * 3**0.5 + 1e-3), friction=0.4)
    run = Simulation(scene)
    run.advance(0.3)
    mirrored = [0, 3, 2, 1, 5, 4]
    np.testing.assert_allclose(run.positions[mirrored] * [-1, 1], run.positions, atol=1e-12)
    np.testing.assert_allclose(-run.spins[mirrored], run.spins, atol=1e-9)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_contact_counted_twice_changes_no_motion(dim):
    """Forces of the two share what the one had: ``J^T r`` is the same where motion is unique."""
    jacobian, q = np.random.default_rng(5).normal(size=(dim, 6)), np.array([-1.0, 0.4, -0.2])[:dim]
    single, double = (
        solve_friction(rows @ rows.T, np.tile(q, count), 0.3, dim)
        for count in (1, 2) for rows in [np.tile(jacobian, (count, 1))]
    )  # fmt: skip
    assert single.solved
    assert double.solved
    np.testing.assert_allclose(double.r.reshape(2, dim).sum(axis=0), single.r, atol=1e-10)
    np.testing.assert_allclose(double.u, np.tile(single.u, 2), atol=1e-10)
