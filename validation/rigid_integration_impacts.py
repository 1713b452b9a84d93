"""Collisions in motion: cradles, corners, a gas, bounces without loss, beside the peers.

Judged by velocities and energies that must be kept; each row of a peer is that of ours with the
peer's numbers.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import ceil, nan, sqrt

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.errors import RigidError
from rigid_lcp.scene import Scene
from rigid_lcp.shapes_2d import Disc, HalfSpace, Polygon
from rigid_lcp.simulation import Simulation
from rigid_lcp.simulation_input import Method
from validation.rigid_hard_peers import row_of_peer
from validation.rigid_hard_trials import Row
from validation.rigid_integration_steps import grains_in_a_box
from validation.rigid_scene_peers import path_energy, peer_run, scene_data
from validation.rigid_scenes import DENSITY, FLOOR, G

Floats = NDArray[np.float64]
METHODS: tuple[Method, ...] = ("time-stepping", "acceleration")


def balls_in_a_row(gap: float, restitution: float = 1.0) -> Scene:
    """Five equal discs (bodies 0 to 4), ``gap`` [m] apart; the first two come with 1 m/s."""
    scene = Scene(2, gravity=(0.0, 0.0))
    for k in range(5):
        place, speed = (0.1 + gap) * k - 0.01 * (k < 2), 1.0 * (k < 2)
        scene.add(
            Disc(0.05), density=1000.0, position=(place, 0.0), velocity=(speed, 0.0),
            restitution=restitution,
        )  # fmt: skip
    return scene


def disc_into_corner(across: float, along: float) -> Scene:
    """A disc (body 0) that meets two walls at once, each with its restitution."""
    scene = Scene(2, gravity=(0.0, 0.0))
    scene.add(Disc(0.1), density=DENSITY, position=(0.2, 0.2), velocity=(-2.0, -2.0))
    scene.add(HalfSpace((1, 0)), restitution=across)
    scene.add(HalfSpace((0, 1)), restitution=along)
    return scene


def dense_gas() -> Scene:
    """36 discs in a box without friction or loss, spaced by less than a step's way at 10 ms."""
    scene = Scene(2, gravity=(0.0, 0.0))
    for normal in ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)):
        scene.add(HalfSpace(normal, -0.33), restitution=1.0)
    speeds = np.random.default_rng(5).standard_normal((36, 2))
    for k, speed in enumerate(speeds):
        place = (0.11 * (k % 6) - 0.275, 0.11 * (k // 6) - 0.275)
        scene.add(
            Disc(0.05), density=1000.0, position=place, velocity=tuple(speed), restitution=1.0
        )
    return scene


def block_bouncing_flat() -> Scene:
    """A block (body 0) that falls flat on a floor by 1 cm, without loss."""
    scene = Scene(2)
    scene.add(Polygon.rectangle(0.2, 0.2), density=DENSITY, position=(0, 0.11), restitution=1.0)
    scene.add(FLOOR)
    return scene


@dataclass(frozen=True)
class Impact:
    """A scene with collisions, and what must come out."""

    case: str
    answer: str
    measure: str
    scene: Scene
    step: float
    """[s]; for ``acceleration`` the longest one."""
    seconds: float
    judge: Callable[[Scene, Floats], float]
    """The measure of a path (frames, n, 6), as `PeerScene.path`."""
    bar: float
    every: int = 0
    """Steps between frames; 0: the end only."""
    peers: tuple[str, ...] = ("mujoco", "ode", "lmgc90")


def velocities_off(*wanted: Sequence[float]) -> Callable[[Scene, Floats], float]:
    """Greatest difference of the first bodies' velocities from those [m/s]."""
    return lambda scene, path: float(np.abs(path[-1, : len(wanted), 3:5] - np.array(wanted)).max())


def energy_off(scene: Scene, path: Floats) -> float:
    """Change of the energy at the end, over that above rest before."""
    energy, least = path_energy(scene, path)[-1], _least(scene)
    return abs(float((energy - least) / (_first(scene) - least)) - 1)


def energy_gained(scene: Scene, path: Floats) -> float:
    """Greatest energy of any frame over the first one, less one."""
    return float(path_energy(scene, path).max()) / _first(scene) - 1


def _first(scene: Scene) -> float:
    """Energy of the scene as it starts [J]."""
    start = [[0.0, 0.0, 0.0, *body.velocity, body.spin[0]] for body in scene.bodies]
    return float(path_energy(scene, np.array([start]))[0])


def _least(scene: Scene) -> float:
    """Energy at rest on the floor of a scene with one falling body that stands on it [J]."""
    if not scene.gravity.any():
        return 0.0
    body = scene.bodies[0]
    return float(-body.mass * scene.gravity[1] * 0.1)


def impacts(quick: bool) -> list[Impact]:
    """The scenes."""
    period = 2 * sqrt(2 * 0.01 / G)
    bounces = 10 if quick else 100
    return [
        Impact(
            "two of five balls in, 2 mm apart", "two out: 0 0 0 1 1", "velocities off, m/s",
            balls_in_a_row(2e-3), 1e-3, 0.04,
            velocities_off((0, 0), (0, 0), (0, 0), (1, 0), (1, 0)), 1e-9,
        ),
        Impact(
            "two of five balls in, touching", "all at once: -0.2 -0.2 0.8 0.8 0.8 (eqs 33 to 36)",
            "energy off", balls_in_a_row(0.0), 1e-3, 0.04, energy_off, 1e-12,
        ),
        Impact(
            "disc into a corner, e = 1", "both components turn", "velocities off, m/s",
            disc_into_corner(1.0, 1.0), 1e-3, 0.15, velocities_off((2.0, 2.0)), 1e-9,
        ),
        Impact(
            "disc into a corner, walls of e = 0.3 and 0.8", "each wall by its own e",
            "velocities off, m/s", disc_into_corner(0.3, 0.8), 1e-3, 0.15,
            velocities_off((0.6, 1.6)), 1e-9,
        ),
        Impact(
            "gas of 36 discs, e = 1", "energy is kept", "energy off", dense_gas(), 1e-2,
            0.05 if quick else 0.3, energy_off, 1e-10,
        ),
        Impact(
            f"block bouncing flat, e = 1, {bounces} times", "energy is kept", "energy off",
            block_bouncing_flat(), period / 7.3, bounces * period, energy_off, 1e-11,
        ),
        Impact(
            "five grains in a trough, e = 0.7, friction 0.3", "energy never grows",
            "greatest gain over the first", grains_in_a_box(0), 2e-3, 0.1 if quick else 0.5,
            energy_gained, 1e-12, every=1,
        ),
    ]  # fmt: skip


def impact_rows(impact: Impact, peers: bool) -> Iterator[Row]:
    """Ours by both methods, then the peers."""
    ours = [impact_ours(impact, method) for method in METHODS]
    yield from ours
    steps = ceil(impact.seconds / impact.step - 1e-9)
    data = scene_data(impact.scene, impacts=True)
    for engine in impact.peers if peers else ():
        made = peer_run(engine, data, impact.seconds / steps, steps, every=impact.every)
        value = nan if made.why else impact.judge(impact.scene, made.path)
        row = row_of_peer(ours[0], made, value, steps)
        yield replace(row, why=made.why or _speeds(made.path))


def impact_ours(impact: Impact, method: Method) -> Row:
    """A scene by `rigid_lcp`."""
    run, path, why = Simulation(impact.scene, method, step=impact.step), list[Floats](), ""
    start_place = np.column_stack([run.positions, run.angles])
    steps = ceil(impact.seconds / impact.step - 1e-9)
    parts = steps // impact.every if impact.every else 1
    start = time.process_time()
    try:
        for _ in range(parts):
            run.advance(impact.seconds / parts)
            place = np.column_stack([run.positions, run.angles]) - start_place
            path.append(np.column_stack([place, run.velocities, run.spins]))
        value = impact.judge(impact.scene, np.array(path))
        why = _speeds(np.array(path))
    except RigidError as error:
        value, why = nan, f"{type(error).__name__}: {error}"
    return Row(
        impact.case, impact.answer, method, impact.measure, value, f"<= {impact.bar:.0e}",
        value <= impact.bar, "", time.process_time() - start, run.steps, why,
    )  # fmt: skip


def _speeds(path: Floats) -> str:
    """Velocities along x at the end of five balls in a row; else nothing."""
    if path.shape[1] != 5:
        return ""
    return "leave with " + " ".join(f"{v + 0.0:.3g}" for v in np.round(path[-1, :, 3], 6))
