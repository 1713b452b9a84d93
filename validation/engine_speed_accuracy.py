"""Errors of Chung and Ooi's tests against the step: how many steps a contact needs on each engine.

`trackbed validate engines` judges the same tests at one documented step; here the step varies.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from adapters.contact_law import hertz_collision
from adapters.scene import Scene
from validation.chung_ooi import TANGENTIAL, TEST_3
from validation.chung_ooi_checks import ORDER_PHASES, sliding_impulse_error, sticking_error
from validation.chung_ooi_impacts import motion_of, rebound_of

STEPS = (10, 20, 50, 100, 200, 500, 1000)
"""Steps in the contact time of the fastest impact."""

SPEEDS = (0.01, 1.0)
"""Speeds of approach [m/s] between which the grains of a loaded bed meet."""

ERRORS = {
    "rebound, e = 1": "test 3, undamped",
    "rebound, e = 0.2": "test 3, damped",
    "friction, own rule": "tests 4 to 8",
    "sliding limit": "tests 4 to 8",
}
"""Kinds of error, and the tests they come from."""


def rebound_error(engine: str, restitution: float, steps: int) -> float:
    """Test 3: root mean square, over impacts that begin at 16 parts of a step, relative."""
    setting = replace(TEST_3, restitution=restitution, impacts=ORDER_PHASES * TEST_3.impacts)
    found = rebound_of(setting, motion_of(setting, engine, steps=steps)).restitution
    return float(np.sqrt(np.mean((found / restitution - 1) ** 2)))


def friction_errors(engine: str, steps: int) -> tuple[float, float]:
    """Tests 4 to 8, first material of each: greatest relative errors of the friction impulse.

    The first of all impacts against the engine's own tangential rule; the second of those that
    slide all the time against mu (1 + e) of rigid bodies, which the time in which the spring is
    first stretched keeps apart from any engine.  Under the law for which that limit is meant
    (`validation.chung_ooi_runs.law_text`).
    """
    own, limit = [], []
    for setting in TANGENTIAL[::2]:
        rebound = rebound_of(setting, motion_of(setting, engine, "sliding", steps=steps))
        own.append(sticking_error(setting, rebound, engine))
        limit.append(abs(sliding_impulse_error(setting, rebound)))
    return max(own), max(limit)


def errors_at(engine: str, steps: int) -> dict[str, float]:
    """The errors of `ERRORS` at ``steps`` in a contact."""
    values = (
        rebound_error(engine, 1.0, steps),
        rebound_error(engine, 0.2, steps),
        *friction_errors(engine, steps),
    )
    return dict(zip(ERRORS, values, strict=True))


def steps_of_scene(scene: Scene) -> tuple[float, float]:
    """Steps in a contact of two mean grains of a scene, of the fastest and slowest of `SPEEDS`."""
    radius = scene.sample.grain_radius.mean
    mass = 4 / 3 * np.pi * radius**3 * scene.material.grain.density
    few, many = (
        hertz_collision(v, scene.stiffness.grain, radius / 2, mass / 2).contact_time
        for v in reversed(SPEEDS)
    )
    return few / scene.time_step, many / scene.time_step
