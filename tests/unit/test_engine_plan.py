"""The seating of a piston: what it is for the scenes that ship, and for a piston that is light."""

from __future__ import annotations

import numpy as np
import pytest

from adapters.engines.plan import PLAN, plan_seating
from adapters.scene.file import load_scene
from trackbed.scenes import find_scene_file

SHIPPED = ("karrech", "karrech-coarse", "karrech-partial")


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_scenes_are_seated_by_the_peak(name: str) -> None:
    scene = load_scene(find_scene_file(name))
    peak = float(scene.stress_at(np.linspace(0, 1, 1001)).max()) * scene.loaded_area
    assert plan_seating(scene).force == PLAN.seat_share * peak


@pytest.mark.parametrize("mass", [1e-6, 1e-4, 3e-3])
@pytest.mark.parametrize("load", [1.0, 100.0])
def test_drag_of_a_light_piston_is_one_the_step_can_follow(mass: float, load: float) -> None:
    """v' = v (1 - c dt/m) of the drag alone falls from step to step without a change of sign."""
    amplitude = 14150.0 * load
    settings = [f"loading.piston_mass={mass}", f"loading.amplitude={amplitude}"]
    settings.append("material.grain.young=1e10")
    scene = load_scene(
        find_scene_file("karrech-coarse"), [*settings, f"loading.mean={amplitude / 2}"]
    )
    plan = plan_seating(scene)
    factor = 1 - plan.force / plan.speed * scene.time_step / mass
    assert 1 - PLAN.seat_drag_share - 1e-12 <= factor < 1
    assert plan.force <= amplitude * scene.loaded_area * (1 + 1e-12)
