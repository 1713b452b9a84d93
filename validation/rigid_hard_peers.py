"""Painleve's rod and bounces in MuJoCo, ODE and LMGC90.

They are judged by forces, energies and overlaps, which `PeerScene.path` tells; each row of a peer
is that of ours with the peer's numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, nan

import numpy as np

from rigid_lcp.shapes_2d import Polygon
from validation import rigid_scenes as scenes
from validation.rigid_hard_trials import Row
from validation.rigid_scene_peers import (
    PeerScene,
    path_energy,
    peer_run,
    scene_data,
    unless_it_falls,
)

ONE_STEP = 1e-6
"""Step [s] after which a peer's force on the rod is read off its velocity."""


def row_of_peer(row: Row, made: PeerScene, value: float, steps: int) -> Row:
    """The row of ours as the peer fares in it; ``value`` counts where it ran and is a number."""
    sign, bar = row.bar.split()
    measured = not made.why and not np.isnan(value)
    value = float(value) if measured else nan
    met = measured and (value <= float(bar) if sign == "<=" else value >= float(bar))
    return replace(
        row, method=made.engine, value=value, ok=bool(met), cpu_s=made.cpu_s,
        steps=0 if made.why else steps, why=made.why, peer=True,
    )  # fmt: skip


def rod_force_peer(row: Row, mu: float, exact: float, engine: str) -> Row:
    """The force on the rod [N], ``m (v/h + g)`` after one step from rest across the floor."""
    run = scenes.sliding_rod(mu, method="time-stepping", step=ONE_STEP)
    scene = run.world.scene
    made = peer_run(engine, scene_data(scene, impacts=True), run.step, 1)
    made = unless_it_falls(made, scene, run.step)
    if made.why:
        return row_of_peer(row, made, nan, 1)
    force = scene.bodies[0].mass * (made.path[-1, 0, 4] / run.step + scenes.G)
    return row_of_peer(row, made, abs(force / exact - 1), 1)


def rod_stepped_peer(rows: Sequence[Row], mu: float, engine: str) -> list[Row]:
    """Energy gained, and overlap of the rod over half its length, in the steps of ours."""
    run = scenes.sliding_rod(mu, method="time-stepping")
    scene, steps = run.world.scene, rows[0].steps
    made = peer_run(engine, scene_data(scene, impacts=True), run.step, steps, every=1)
    made = unless_it_falls(made, scene, steps * run.step)
    if made.why:
        return [row_of_peer(row, made, nan, steps) for row in rows]
    shape, rod = scene.bodies[0].shape, made.path[:, 0]
    assert isinstance(shape, Polygon)
    angle = scene.bodies[0].angle[0] + rod[:, 2, None]
    height = scene.bodies[0].position[1] + rod[:, 1, None] + (
        np.sin(angle) * shape.vertices[:, 0] + np.cos(angle) * shape.vertices[:, 1]
    )  # fmt: skip
    gained = float((path_energy(scene, made.path) / run.energy - 1).max())
    overlap = max(0.0, float(-height.min())) / run.world.length
    return [
        row_of_peer(row, made, value, steps)
        for row, value in zip(rows, (gained, overlap), strict=True)
    ]


def bounce_peer(row: Row, bounces: int, height: float, period: float, engine: str) -> Row:
    """Energy that a disc has lost or gained a bounce, after as long as ours took for them all."""
    run = scenes.bouncing_disc(height, 1.0, step=period / 7.3)
    scene = run.world.scene
    floor = run.world.mass[0] * scenes.G * run.world.length
    steps = ceil(bounces * period / run.step)
    made = peer_run(engine, scene_data(scene, impacts=True), run.step, steps)
    if made.why:
        return row_of_peer(row, made, nan, steps)
    left = (path_energy(scene, made.path)[-1] - floor) / (run.energy - floor)
    return row_of_peer(row, made, abs(left - 1) / bounces, steps)
