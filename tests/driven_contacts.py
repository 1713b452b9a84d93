"""Contacts that are driven or collide, one at a time, on any engine."""

from __future__ import annotations

from collections.abc import Callable
from math import pi

import numpy as np

from adapters.bed import contact_law
from adapters.bed.contact_law import Collision
from adapters.bed.state import FloatArray
from adapters.scene.tables import Scene
from validation.bench.few_grains import PLACE, RADIUS, Track, TrackRun, run_grains


def find_grain_mass(scene: Scene) -> float:
    """Mass of a grain [kg]."""
    return 4 / 3 * pi * scene.material.grain.density * RADIUS**3


def find_shear_modulus(scene: Scene) -> float:
    """G* of two grains [Pa]."""
    grain = (scene.material.grain.young, scene.material.grain.poisson)
    return contact_law.combine_shear_moduli(*grain, *grain)


def limit_force(scene_part: str) -> str:
    """``scene.in`` with contacts that end where their force turns to tension."""
    style = "pair_style gran model ${contact_model}"
    return scene_part.replace(style, f"{style} limitForce on")


def mirror_tangential(scene_part: str) -> str:
    """``scene.in`` with the grains' own contact law, at friction 0, on the mirror planes."""
    return scene_part.replace("wall/gran model hertz ", "wall/gran model ${contact_model} ")


def collide(
    scene: Scene,
    speed: float,
    *,
    steps: float = 1000,
    mirror: bool = False,
    slide: float = 0.0,
    materials: Callable[[str], str] = str,
    run: TrackRun = run_grains,
) -> tuple[Collision, Track]:
    """Two grains that meet at ``speed`` [m/s], or one and its image in the mirror plane x = 0.

    ``steps`` in the time of an undamped contact; ``slide`` [m/s] is a velocity of both along z.
    """
    mass = find_grain_mass(scene) / 2
    undamped = contact_law.solve_hertz_collision(speed, scene.stiffness.grain, RADIUS / 2, mass)
    time_step = undamped.contact_time / steps
    gap = 2.25 * speed * time_step  # small, and no whole number of steps
    middle = np.array([0.0 if mirror else PLACE[0], *PLACE[1:]])
    apart = np.array([RADIUS + gap / 2, 0.0, 0.0])
    position = np.array([middle + apart, middle - apart])
    velocity = np.array([[-speed / 2, 0.0, slide], [speed / 2, 0.0, slide]])
    grains = 1 if mirror else 2
    track = run(
        scene,
        position[:grains],
        velocity[:grains],
        ["fix motion grains nve/sphere", f"run {round(1.7 * steps)}"],
        time_step=time_step,
        materials=materials,
    )
    x, v = track.position[:, :, 0], track.velocity[:, :, 0]
    overlap = 2 * (RADIUS - x[:, 0]) if mirror else 2 * RADIUS - (x[:, 0] - x[:, 1])
    rebound = 2 * v[-1, 0] if mirror else v[-1, 0] - v[-1, 1]
    touching = np.flatnonzero(overlap > 0)
    ends = [
        track.time[i] - overlap[i] * (track.time[j] - track.time[i]) / (overlap[j] - overlap[i])
        for i, j in ((touching[0], touching[0] - 1), (touching[-1], touching[-1] + 1))
    ]
    return Collision(rebound / speed, float(overlap.max()), ends[1] - ends[0]), track


def drive_contact(
    scene: Scene,
    overlap: FloatArray,
    displacement: FloatArray,
    *,
    speed: float = 1e-3,
    steps: int = 1000,
    run: TrackRun = run_grains,
) -> tuple[Track, FloatArray, FloatArray]:
    """One contact driven along straight legs between the corners of a path; the other grain held.

    ``overlap`` delta_n and ``displacement`` delta_t [m] of the corners, shape (c,); ``speed`` [m/s]
    along each leg, in ``steps`` steps.  Returns the track, delta_n and the distance moved along the
    tangent [m], shape (s,) each.  The normal turns by delta_t/(2 R), which must be small.
    """
    legs = np.column_stack([-np.diff(overlap), np.diff(displacement)])  # along x, along y
    length = np.hypot(*legs.T)
    time_step = float(length.max()) / speed / steps
    motion = []
    for leg in legs / (steps * time_step):
        motion.append(f"fix leg grain_1 move linear {leg[0]:.17g} {leg[1]:.17g} 0.0 units box")
        motion += [f"run {steps}", "unfix leg"]
    start = PLACE + np.array([[2 * RADIUS - overlap[0], displacement[0], 0.0], [0.0, 0.0, 0.0]])
    every = max(steps // 100, 1)
    track = run(scene, start, np.zeros((2, 3)), motion, time_step=time_step, every=every)
    apart = track.position[:, 0] - track.position[:, 1]
    return track, 2 * RADIUS - np.linalg.norm(apart, axis=1), apart[:, 1]


def slide_on_mirror(
    scene: Scene,
    speed: float,
    runs: int,
    materials: Callable[[str], str] = str,
    run: TrackRun = run_grains,
) -> Track:
    """A grain that 1 N presses on the mirror plane x = 0 slides along z at ``speed`` [m/s].

    In ``runs`` commands ``run`` of ten steps each, at the scene's own time step.
    """
    modulus = scene.stiffness.mirror
    overlap = float(contact_law.find_overlap_under_force(1.0, modulus, RADIUS))
    push = ["fix motion grains nve/sphere", "fix push grains addforce -1.0 0.0 0.0"]
    return run(
        scene,
        np.array([[RADIUS - overlap, *PLACE[1:]]]),
        np.array([[0.0, 0.0, speed]]),
        [*push, *["run 10"] * runs],
        time_step=scene.time_step,
        materials=materials,
    )
