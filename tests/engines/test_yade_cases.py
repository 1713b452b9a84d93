"""What the YADE scripts must do, case by case, where tests/engines/test_yade.py does not say it."""

from __future__ import annotations

import ast
import sys
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from adapters.bed import contact_law as law
from adapters.engines.yade import YADE
from tests.engines.test_yade import ALPHA, Bed
from tests.yade_piston import piston_forces, scene_partial
from validation.bench.few_grains import load_table_1
from validation.bench.few_grains_yade import run_grains

SCRIPTS = [path for path in files("yade_scripts").iterdir() if path.name.endswith(".py")]


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.name)
def test_scripts_need_nothing_but_python_numpy_and_yade(script: Path) -> None:
    """They run by hand where nothing of this project is installed."""
    allowed = {*sys.stdlib_module_names, "numpy", "yade", "bed", "record"}
    for node in ast.walk(ast.parse(script.read_text(encoding="utf-8"))):
        names = []
        if isinstance(node, ast.Import):
            names = [each.name for each in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = [node.module or ""]
        assert {name.split(".")[0] for name in names} <= allowed


def test_a_load_cycle_is_one_call_of_the_engine() -> None:
    """Every ``O.run`` waits 40 ms: the loop over the cycles holds one, and no other loop does."""
    tree = ast.parse((files("yade_scripts") / "cycles.py").read_text(encoding="utf-8"))
    loops = [node for node in ast.walk(tree) if isinstance(node, ast.For | ast.While)]
    calls = [
        [c for c in ast.walk(loop) if isinstance(c, ast.Call) and ast.unparse(c.func) == "O.run"]
        for loop in loops
    ]
    over_cycles = ["cycles" in ast.unparse(getattr(loop, "iter", loop)) for loop in loops]
    assert [len(found) for found in calls] == [int(yes) for yes in over_cycles]
    assert sum(over_cycles) == 1


@pytest.mark.long
def test_nothing_damps_but_contacts() -> None:
    """A grain that touches nothing keeps velocity and step: no numerical damping, a fixed step."""
    scene = load_table_1(f"material.grain.viscous_alpha={ALPHA}")
    step, speed = 1e-6, 0.3
    track = run_grains(
        scene,
        np.array([[0.02, 0.02, 0.03]]),
        np.array([[0.0, speed, 0.0]]),
        ["fix motion all nve/sphere", "run 300"],
        time_step=step,
    )
    assert np.all(track.velocity[:, 0] == [0.0, speed, 0.0])
    moved = np.diff(track.position[:, 0, 1])
    assert moved == pytest.approx(np.full(300, speed * step), rel=1e-7)


@pytest.mark.long
def test_a_partial_piston_pushes_once() -> None:
    """Anywhere under it by eq. 5, and no more when a grain goes from its plane to its rim and back.

    Grains at an overlap of 1e-7 m on the lines from the axis to the rim's corners, where triangles
    meet; in the middle between two; beyond the rim by two contact radii.  Only the one that is on
    such a line and near the rim is pushed by both triangles.
    """
    scene = scene_partial()
    radius, reach = scene.sample.radii.mean, scene.piston_reach
    height, overlap = 0.05, 1e-7
    near, beyond = reach - 0.1 * radius, reach + 2 * np.sqrt(2 * radius * overlap)

    def at(distance: float, corner: float) -> list[float]:
        angle = 2 * np.pi * corner / YADE.disc_corners
        place = [distance * np.cos(angle), distance * np.sin(angle)]
        return [*place, height - radius + overlap]

    looks = [
        np.array([at(0.5 * reach, 5), at(0.8 * reach, 14), at(near, 10), at(near, 19.5)]),
        np.array([at(near, 5.5), at(0.8 * reach, 14), at(near, 10), at(beyond, 19.5)]),
        np.array([at(0.5 * reach, 5), at(0.8 * reach, 14), at(0.6 * reach, 10), at(near, 19.5)]),
    ]
    force, changed = piston_forces(scene, looks, height)
    flat = float(law.find_normal_force(overlap, scene.stiffness.wall, radius))
    expected = np.array([[1, 1, 2, 1], [1, 1, 2, 0], [1, 1, 1, 1]])
    assert -force[..., 2] / flat == pytest.approx(expected, abs=1e-6)
    assert list(changed) == [0, 1, 1]


@pytest.mark.long
def test_partial_piston_moves_by_its_forces(tmp_path: Path) -> None:
    """M dv/dt = F_contact - F_target for a piston over 0.4 of the section, pushing none beyond.

    The least load is not zero, so that it touches the bed at the cycle ends too.
    """
    bed = Bed(tmp_path, "loading.area_share=0.4", "loading.amplitude=5e3")
    scene = bed.scene
    assert scene.loading is not None
    window = bed.computed(bed.after(), 1, "steps", track_steps=1)
    track = window.piston
    velocity = np.diff(track.height) / scene.time_step
    force = (track.contact_force - track.target_force)[1:-1]
    change = scene.loading.piston_mass * np.diff(velocity) / scene.time_step
    noise = scene.loading.piston_mass * 4e-16 * track.height.max() / scene.time_step**2
    assert change == pytest.approx(force, abs=4 * noise)
    target = scene.stress_at(track.time_step / scene.steps_per_cycle) * scene.loaded_area
    assert track.target_force == pytest.approx(target, abs=1e-9 * target.max())
    pushed = window.wall_force["piston"].any(axis=2)
    distance = np.hypot(window.position[..., 0], window.position[..., 1])
    # On the edge a grain is touched from as far as its overlap lets it.
    assert distance[pushed].max() < scene.piston_reach + 0.2 * window.radius.max()
    assert np.mean(distance > scene.piston_reach + 0.2 * window.radius.max()) > 0.2
