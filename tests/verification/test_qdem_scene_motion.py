"""Bodies that a scene sets in motion: ``velocity`` and ``spin`` of ``[[body]]``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from qdem_fem.files.errors import SceneError
from qdem_fem.scene.build import make_simulation
from qdem_fem.scene.checks import load_scene

SIDES = np.array([0.02, 0.03, 0.05])
ORIGIN = np.array([0.1, -0.2, 0.05])
DENSITY = 2700.0

SCENE = f"""
[[body]]
name = "brick"
VELOCITY
SPIN
mesh.box = {{ size = {SIDES.tolist()}, cells = [2, 2, 2], origin = {ORIGIN.tolist()} }}
material = {{ young = 1e9, poisson = 0.2, density = {DENSITY} }}
[simulation]
duration = 1e-3
step = 2e-6
"""


def loaded(folder: Path, velocity: Any = None, spin: Any = None, *overrides: str) -> Any:
    """The simulation of the scene with its brick so moved, and the brick."""
    text = SCENE
    for key, value in (("velocity", velocity), ("spin", spin)):
        text = text.replace(
            key.upper(), "" if value is None else f"{key} = {[float(v) for v in value]}"
        )
    path = folder / "scene.toml"
    path.write_text(text)
    run, bodies = make_simulation(load_scene(path, overrides))
    return run, bodies["brick"]


three = st.tuples(*[st.floats(-50, 50)] * 3)


@settings(max_examples=25)
@given(three, three)
def test_energy_and_momentum_of_a_rigid_brick(tmp_path_factory, velocity: Any, spin: Any) -> None:
    """``m v^2/2 + sum I_i omega_i^2/2``, ``I_i = m (a^2 + b^2)/12``: about its centre."""
    folder = tmp_path_factory.mktemp("scene")
    run, _ = loaded(folder, velocity, spin, "body.0.rigid=true")
    mass = DENSITY * SIDES.prod()
    inertia = mass * (np.dot(SIDES, SIDES) - SIDES**2) / 12
    expected = 0.5 * mass * np.dot(velocity, velocity) + 0.5 * np.dot(inertia, np.square(spin))
    assert run.energy().kinetic == pytest.approx(expected, rel=1e-12, abs=1e-300)


def test_a_deformable_brick_flies_with_its_momentum(tmp_path: Path) -> None:
    """Its centre of mass moves by v t to rounding, and it turns the way that the spin says."""
    velocity, spin = np.array([3.0, -2.0, 1.0]), np.array([0.0, 0.0, 100.0])
    run, brick = loaded(tmp_path, velocity, spin)
    mass = run.assembly.mass
    run.advance(1e-3)
    mean = mass @ brick.displacement / mass.sum()
    assert np.allclose(mean, 1e-3 * velocity, rtol=1e-12)
    arm = brick.nodes - (ORIGIN + SIDES / 2)
    turned = (np.cross(arm, brick.displacement - mean) @ [0, 0, 1]).sum()
    assert turned / (arm[:, :2] ** 2).sum() == pytest.approx(np.sin(0.1), rel=1e-2)


def test_nothing_moves_where_the_scene_names_no_motion(tmp_path: Path) -> None:
    """And the record of the scene does not name it either."""
    run, brick = loaded(tmp_path)
    assert run.energy().kinetic == 0.0
    assert not brick.velocity.any()
    parameters = load_scene(tmp_path / "scene.toml").scene.parameters()
    assert not {"velocity", "spin"} & set(parameters["body"][0])
    assert any(
        "cause of motion" in text
        for text in load_scene(tmp_path / "scene.toml").scene.list_left_out()
    )


def test_motion_is_a_cause_of_motion(tmp_path: Path) -> None:
    """The report does not say that nothing moves it."""
    loaded(tmp_path, (1.0, 0.0, 0.0))
    left_out = load_scene(tmp_path / "scene.toml").scene.list_left_out()
    assert not any("cause of motion" in text for text in left_out)


@pytest.mark.parametrize(
    ("key", "overrides", "message"),
    [
        ("velocity", ["simulation.method=static"], r"body\.0\.velocity: a static answer has no"),
        ("spin", ["simulation.method=static"], r"body\.0\.spin: a static answer has no"),
        ("spin", ["simulation.strain=small"], r"body\.0\.spin: a body that turns is strained"),
    ],
)
def test_motion_that_a_scene_can_not_have(
    tmp_path: Path, key: str, overrides: list[str], message: str
) -> None:
    """A sentence with the line and the key."""
    with pytest.raises(SceneError, match=message):
        loaded(tmp_path, None, None, *overrides, f"body.0.{key}=[1, 0, 0]")


def test_a_body_joined_to_its_images_does_not_turn(tmp_path: Path) -> None:
    """Its joined nodes share one velocity, and a spin gives them two."""
    path = tmp_path / "scene.toml"
    sides = '[[periodic]]\nbody = "brick"\nnodes_a.set = "y-min"\nnodes_b.set = "y-max"\n'
    for spin in (False, True):
        text = SCENE.replace("VELOCITY", "velocity = [1, 0, 0]")
        path.write_text(text.replace("SPIN", "spin = [0, 0, 1]" * spin) + sides)
        if not spin:
            assert make_simulation(load_scene(path, []))[0].energy().kinetic > 0
            continue
        with pytest.raises(SceneError, match=r"body\.0\.spin: a body that \[\[periodic\]\] joins"):
            load_scene(path, [])
