"""Hostile scenes, runs and run folders: a typed sentence or the right motion, never silence."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

from rigid_lcp import Disc, HalfSpace, Polygon, Scene, Simulation, make_box
from rigid_lcp.errors import (
    NotConverged,
    Overlapping,
    RigidError,
    SceneError,
    ShapeError,
    UsageError,
)

BLOCK = Polygon.rectangle(0.2, 0.1)


def at_rest(method: str = "time-stepping", **given: object) -> Simulation:
    """A block on the ground."""
    scene = Scene()
    scene.add(HalfSpace([0, 1]))
    scene.add(BLOCK, density=2700, position=(0, 0.05), friction=0.5)
    return Simulation(scene, method, **given)  # type: ignore[arg-type]


# --- shapes ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "make",
    [
        lambda: Polygon.rectangle(-1, -1), lambda: Polygon.rectangle(1, 0),
        lambda: Polygon.rectangle("a", 1), lambda: Polygon.regular(5, -1.0),
        lambda: Polygon.regular(2, 1.0), lambda: Polygon.regular(3.5, 1.0), lambda: Disc("a"),
        lambda: Polygon(1j * BLOCK.vertices), lambda: Disc(1e-200),
        lambda: Polygon(1e-160 * BLOCK.vertices), lambda: Polygon(1e160 * BLOCK.vertices),
        lambda: Polygon([*BLOCK.vertices, *BLOCK.vertices]), lambda: Polygon(np.zeros((0, 2))),
        lambda: Polygon([(0, 0), (1j, 0), (0, 1)]), lambda: HalfSpace("ab"), lambda: Disc(np.inf),
        lambda: Disc(0.0), lambda: HalfSpace((0, 0)), lambda: HalfSpace((0, 1), np.nan),
        lambda: HalfSpace([0, 1], "a"), lambda: HalfSpace([0, 1, 0, 0]), lambda: HalfSpace(None),
        lambda: HalfSpace([0, 1], [3.0]), lambda: HalfSpace([0, 0, 1], [1.0, 2.0]),
    ],
)  # fmt: skip
def test_shapes_that_are_none_are_named(make):
    with pytest.raises(ShapeError):
        make()


@pytest.mark.parametrize("length", [1e-200, 1.0, 1e200])
def test_a_normal_of_any_length_is_a_direction(length):
    np.testing.assert_allclose(HalfSpace([3 * length, 4 * length]).normal, [0.6, 0.8], rtol=1e-15)


# --- scenes ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "given",
    [
        {"density": "a"}, {"density": [1, 2]}, {"density": 1e300}, {"density": np.nan},
        {"density": -1}, {"density": 0}, {"density": None}, {"friction": -0.1}, {"spin": np.nan},
        {"friction": "a"}, {"friction": 1e9}, {"friction": np.inf}, {"friction": [0.1, 0.2]},
        {"restitution": "a"}, {"restitution": np.nan}, {"restitution": 1.1},
        {"position": "a"}, {"position": [[1], 2]}, {"position": (0, 0, 0)}, {"angle": "x"},
        {"spin": (1, 2, 3)}, {"velocity": (np.nan, 0)}, {"shape": Disc}, {"shape": None},
        {"fixed": "no"}, {"fixed": None}, {"position": np.array([1j, 0])},
    ],
)  # fmt: skip
def test_bodies_that_are_none_are_named(given):
    scene = Scene()
    what = next(iter(given))
    with pytest.raises(SceneError, match="is no shape" if what == "shape" else f"{what} is"):
        scene.add(**({"shape": BLOCK, "density": 1.0} | given))
    assert scene.bodies == []


def test_the_remedy_of_a_density_names_both_bounds():
    """The message for 1e300 asked for a positive number."""
    with pytest.raises(SceneError, match=r"is 1e\+300\n  -> .*above zero, 1e\+50 at most.*fixed"):
        Scene().add(BLOCK, density=1e300)


@pytest.mark.parametrize(
    "given", [{"dim": 2.0}, {"dim": 4}, {"dim": "2"}, {"gravity": "abc"}, {"gravity": 9}]
)
def test_scenes_that_are_none_are_named(given):
    with pytest.raises(SceneError):
        Scene(**given)
    with pytest.raises(SceneError, match="no body can move"):
        Simulation(Scene())


def test_a_press_that_does_not_give_way_is_named():
    """Impulses can not part what two fixed bodies squeeze, and the user has them already."""
    scene = Scene()
    scene.add(HalfSpace([0, 1]))
    scene.add(BLOCK, density=2700, position=(0, 0.05))
    scene.add(BLOCK, fixed=True, velocity=(0, -1), position=(0, 0.1505))
    with pytest.raises(NotConverged, match="bodies held between others that can not give way"):
        Simulation(scene).advance(0.01)


@pytest.mark.parametrize(
    "given", [{"velocity": (0, 1)}, {"position": (0, 1)}, {"angle": 0.5}, {"spin": 1.0}]
)
def test_a_half_space_that_would_not_go_where_it_is_sent_is_refused(given):
    """Its plane is where normal and offset put it: bodies were thrown by a floor that stayed."""
    with pytest.raises(SceneError, match="half-space"):
        Scene().add(HalfSpace([0, 1]), **given)


@pytest.mark.long
def test_a_belt_carries_a_block_along():
    """A half-space that moves along its face: ``v = mu g t`` until the block has its speed."""
    scene = Scene()
    scene.add(HalfSpace([0, 1]), velocity=(1.0, 0.0))
    scene.add(BLOCK, density=2700, position=(0, 0.05), friction=0.5)
    run = Simulation(scene)
    run.advance(0.1)
    assert run.velocities[1, 0] == pytest.approx(0.5 * 9.81 * 0.1, rel=1e-12)
    run.advance(0.2)
    assert run.velocities[1, 0] == pytest.approx(1.0, rel=1e-12)


def test_what_a_caller_gave_is_his_to_change():
    """One array for all positions, changed in between, put all bodies in one place."""
    place, gravity = np.zeros(2), np.array([0.0, -1.0])
    scene = Scene(gravity=gravity)
    for k in range(3):
        place[0] = k
        scene.add(BLOCK, density=1.0, position=place, velocity=place, spin=place[:1])
    gravity[1] = place[0] = 77.0
    run = Simulation(scene)
    np.testing.assert_array_equal(run.positions[:, 0], [0, 1, 2])
    np.testing.assert_array_equal(run.velocities[:, 0], [0, 1, 2])
    np.testing.assert_array_equal(run.world.scene.gravity, [0, -1])


# --- runs -----------------------------------------------------------------------------------------

METHODS = pytest.mark.parametrize("method", ["time-stepping", "acceleration"])


@METHODS
@pytest.mark.parametrize("seconds", [-1.0, np.nan, np.inf, "1", None])
def test_a_time_that_is_none_changes_nothing(method, seconds):
    run = at_rest(method)
    with pytest.raises(UsageError, match="seconds"):
        run.advance(seconds)
    assert (run.time, run.steps) == (0.0, 0)


@METHODS
def test_no_time_is_no_step(method):
    run = at_rest(method)
    run.advance(0)
    assert (run.time, run.steps) == (0.0, 0)
    run.advance(1e-5)  # shorter than a step
    assert (run.time, run.steps) == (1e-5, 1)


@pytest.mark.parametrize(
    "given",
    [
        *({"tolerance": bad} for bad in (-1, 0, np.nan, "a")), {"wear": 1e-9}, {"wear": "x"},
        {"breakage": 1.0},
    ],
)  # fmt: skip
def test_residuals_wear_and_breakage_that_are_none_are_named(given):
    with pytest.raises(SceneError, match=next(iter(given))):
        at_rest(**given)


def test_a_run_of_no_scene_or_method_is_refused():
    with pytest.raises(SceneError, match="give a rigid_lcp"):
        Simulation(None)
    with pytest.raises(UsageError, match="method is 'euler'"):
        at_rest("euler")


@pytest.mark.parametrize("step", [0, -1e-3, np.nan, np.inf, "1", 1e-300])
def test_a_step_that_is_none_is_named(step):
    with pytest.raises(UsageError, match="step is"):
        at_rest(step=step)


@METHODS
@pytest.mark.parametrize(
    "answer",
    [np.zeros(3), np.zeros((1, 3)), np.zeros((2, 2)), np.full((2, 3), np.nan), 0.0, "a",
     np.full((2, 3), 1j), np.ma.masked_equal(np.eye(2, 3), 1.0)],
)  # fmt: skip
def test_loads_that_are_none_are_named(method, answer):
    """NaN made positions of NaN without a word, other shapes an IndexError, complex ones a part."""
    run = at_rest(method, loads=lambda time, motion: answer)
    with pytest.raises(SceneError, match="loads at"):
        run.advance(0.01)
    assert run.time == 0.0
    assert np.isfinite(run.positions).all()
    with pytest.raises(UsageError, match="no function"):
        at_rest(method, loads=answer)


def test_loads_for_too_few_bodies_after_a_break_are_named():
    run = at_rest(loads=lambda time, motion: np.zeros((2, 3)))
    run.fragment(1, ((0, 0.05), (0, 1)))
    with pytest.raises(SceneError, match=r"shape \(2, 3\)"):
        run.advance(0.01)


@pytest.mark.parametrize("body", [-1, 7, True, "block", 1.0, None])
def test_a_body_that_is_none_is_not_broken(body):
    """-1 broke the last body."""
    run = at_rest()
    with pytest.raises(SceneError, match=r"the body is .*\n  -> give a whole number, 0 to 1"):
        run.fragment(body, ((0, 0.05), (0, 1)))
    assert len(run.positions) == 2


@pytest.mark.parametrize(
    "line",
    [None, 3, ((0, 0.05),), ((10, 0), (0, 1)), ((0, 0.05), (0, 0)), ((np.nan, 0), (0, 1)),
     ((0, 0, 0), (0, 1, 0))],
)  # fmt: skip
def test_a_line_that_breaks_nothing_changes_nothing(line):
    run = at_rest()
    before = run.energy
    with pytest.raises(RigidError):
        run.fragment(1, line)
    assert (len(run.positions), run.energy) == (2, before)


@pytest.mark.parametrize(
    "line",
    ["ab", (("a", 0), (0, 1)), ((0, 0.05, 0), (0, 1)), ((0, 0.05), None), ((0, [1]), (0, 1)),
     ((0, 0.05), (1j, 0)), (0, 0)],
)  # fmt: skip
def test_a_line_or_plane_of_another_kind_is_named(line):
    """In space each of these was an error of numpy, in the plane the second."""
    runs = [at_rest()]
    scene = Scene(3)
    scene.add(make_box(0.1, 0.1, 0.1), density=2700)
    runs.append(Simulation(scene))
    for run, body in zip(runs, (1, 0), strict=True):
        with pytest.raises(SceneError, match="fragment"):
            run.fragment(body, line)


@pytest.mark.parametrize("length", [1e-200, 1.0, 1e200])
def test_a_direction_of_any_length_is_a_line(length):
    """With 1e200 both parts were the whole."""
    run = at_rest()
    part = run.fragment(1, ((0, 0.05), (0, length)))
    masses = [body.mass for body in run.world.scene.bodies[1:]]
    np.testing.assert_allclose(masses, 2 * [BLOCK.area * 2700 / 2], rtol=1e-14)
    assert part == 2
    run.advance(0.01)


def test_bodies_that_overlap_at_the_start_are_named():
    scene = Scene()
    scene.add(HalfSpace([0, 1]))
    scene.add(BLOCK, density=2700, position=(0, 0.01), name="sleeper")
    with pytest.raises(Overlapping, match=r"^sleeper and body 0 at the start: they overlap"):
        Simulation(scene)


def test_a_scene_that_changes_later_does_not_change_its_runs():
    scene = Scene()
    scene.add(HalfSpace([0, 1]))
    scene.add(BLOCK, density=2700, position=(0, 0.05))
    first, second = Simulation(scene), Simulation(scene)
    scene.add(BLOCK, density=2700, position=(0, 5.0))
    scene.gravity[1] = 100.0
    first.fragment(1, ((0, 0.05), (0, 1)))
    first.advance(0.02)
    second.advance(0.02)
    assert (len(first.positions), len(second.positions)) == (3, 2)
    assert np.abs(second.velocities).max() < 1e-12


@pytest.mark.long
@METHODS
@pytest.mark.parametrize("clone", [copy.deepcopy, lambda run: pickle.loads(pickle.dumps(run))])
def test_a_run_copied_or_pickled_goes_on_the_same(method, clone):
    run = at_rest(method)
    run.advance(0.01)
    other = clone(run)
    run.fragment(1, ((0.01, 0.05), (0.1, 1)))
    other.fragment(1, ((0.01, 0.05), (0.1, 1)))
    run.advance(0.01)
    other.advance(0.01)
    np.testing.assert_array_equal(other.positions, run.positions)
    np.testing.assert_array_equal(other.motion.rates, run.motion.rates)
