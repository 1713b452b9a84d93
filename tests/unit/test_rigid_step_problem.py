"""A step's A, b, W, q by name and as a file; friction of pairs of bodies."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from rigid_lcp import Disc, HalfSpace, Polygon, Scene, Simulation, read_problem
from rigid_lcp.errors import ProblemError, SceneError
from rigid_lcp.scene.file import build_scene, load_scene
from tests.unit.test_rigid_scene_file import SMALL, written

G, TILT, MASS, RADIUS, H = 9.81, 0.3, 2.0, 0.1, 1e-3
BOX = Polygon.rectangle(0.2, 2 * RADIUS)


def slope(*shapes, gap: float = 0.0) -> Scene:
    """Bodies of 2 kg, each of its own surface, on a floor tilted down along x."""
    scene = Scene(2, (G * np.sin(TILT), -G * np.cos(TILT)))
    scene.add(HalfSpace((0.0, 1.0)), friction=0.5, surface="floor")
    for k, shape in enumerate(shapes):
        density, place = MASS / shape.mass_properties(1.0)[0], (k, RADIUS + gap)
        scene.add(shape, density=density, position=place, friction=0.5, surface=f"steel {k}")
    return scene


def test_a_disc_on_a_slope_has_the_a_and_b_of_the_paper() -> None:
    """With t = -x: A = diag(1/m, 1/m + R^2/I), I = m R^2 / 2; it rolls at ``a = 2/3 g sin``."""
    run = Simulation(slope(Disc(RADIUS)))
    problem = run.problem(H)
    np.testing.assert_allclose(problem.A.toarray(), np.diag([1.0, 3.0]) / MASS, atol=1e-15)
    np.testing.assert_allclose(problem.b, [-G * np.cos(TILT), -G * np.sin(TILT)], rtol=1e-12)
    np.testing.assert_allclose(problem.q, H * problem.b, rtol=1e-12)
    apart = Simulation(slope(Disc(RADIUS), gap=1e-6)).problem(H)  # half a step is left
    np.testing.assert_allclose(apart.q - problem.q, [2e-6 / H, 0.0], rtol=1e-9, atol=1e-12)
    force = MASS * G * np.array([np.cos(TILT), np.sin(TILT) / 3])
    np.testing.assert_allclose(problem.accelerate(force), 0.0, atol=1e-14)
    run.advance(H)
    made = H * np.array([*run.contacts.normal_force, *run.contacts.tangential_force])
    np.testing.assert_allclose(made, H * force, rtol=1e-12)
    assert problem.residual(made) <= 1e-12


def test_a_saved_step_is_read_to_the_last_bit(tmp_path: Path) -> None:
    path = tmp_path / "step.npz"
    problem = Simulation(slope(BOX, BOX)).problem()
    assert problem.save(path) == [path, tmp_path / "step_W.npz"]
    read = read_problem(path)
    assert (read.delassus != problem.W).nnz == 0
    with np.load(path) as arrays:
        assert np.array_equal([read.offset, arrays["b"]], [problem.q, problem.b])
    (tmp_path / "step_H.npz").touch()
    for name in ("step.npz", "other.mat"):
        with pytest.raises(ProblemError, match=r"to another problem|no name of an"):
            problem.save(tmp_path / name)


def test_a_pair_slides_by_its_own_friction_and_broken_bodies_keep_it() -> None:
    """A box slides down at ``g (sin - mu cos)``; one beside it, of no pair, stays (tan = 0.309)."""
    scene = slope(BOX, BOX)
    scene.set_pair("steel 1", "floor", friction=0.2)
    run = Simulation(scene)
    run.fragment(2, ((1.0, RADIUS), (0.0, 1.0)))
    run.advance(0.1)
    down = 0.1 * G * (np.sin(TILT) - 0.2 * np.cos(TILT))
    np.testing.assert_allclose(run.velocities[1:, 0], [0.0, down, down], atol=1e-9)
    scene.set_pair("steel 1", "flor", restitution=0.5)
    with pytest.raises(SceneError, match="no body has the surface 'flor'; did you mean floor"):
        Simulation(scene)


def test_pairs_of_a_scene_file(tmp_path: Path) -> None:
    """The last one that names two bodies holds, whatever their order."""
    pair = SMALL + "\n[[pair]]\nbetween = {}\nfriction = 0.9\n"
    text = pair.format('["ground", "block"]') + pair[len(SMALL) :].format('["block", "ground.0"]')
    scene = build_scene(load_scene(written(tmp_path, text[:-4] + "0.2")))
    assert Simulation(scene).problem().friction.tolist() == [0.2, 0.2]
    wrong = {'["block", "grond"]': "there is no grond; did you mean ground"}
    wrong |= dict.fromkeys(('["ground", "ground.0"]', '["block", "block"]'), "never touch")
    for between, words in wrong.items():
        with pytest.raises(SceneError, match=words):
            load_scene(written(tmp_path, pair.format(between)))
