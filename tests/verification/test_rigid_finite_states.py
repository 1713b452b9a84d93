"""No step ends in numbers that are none: the state before it is kept, and the body is named.

A load F on a mass m for a step h gives the speed ``h F / m``; floats end at 1.8e308, and so does
the energy ``m v^2 / 2`` at speeds above some 1e154 m/s.
"""

from __future__ import annotations

import numpy as np
import pytest

from rigid_lcp import Disc, HalfSpace, Polygon, Scene, Simulation, Sphere
from rigid_lcp.errors import NotConverged, SceneError
from rigid_lcp.motion.finite_states import is_finite
from rigid_lcp.motion.world import make_world

METHODS = pytest.mark.parametrize("method", ["time-stepping", "acceleration"])
SPACES = pytest.mark.parametrize("dim", [2, 3])
OVERFLOWS = pytest.mark.filterwarnings("ignore:invalid:RuntimeWarning")
"""numpy's own word on differences of what is not finite; looked at is what the run says then."""


def free_bodies(dim: int, method: str, **given: object) -> Simulation:
    """Two balls far from each other, the second with the name 'b'."""
    scene, shape = Scene(dim=dim, gravity=np.zeros(dim)), Disc(0.1) if dim == 2 else Sphere(0.1)
    scene.add(shape, density=1.0)
    scene.add(shape, density=1.0, position=np.eye(dim)[0], name="b")
    return Simulation(scene, method, **given)  # type: ignore[arg-type]


@OVERFLOWS
@SPACES
@METHODS
@pytest.mark.parametrize(("column", "unit"), [(0, "N on"), (2, "N")])
@pytest.mark.parametrize("load", [1e307, 1e250])
def test_a_load_beyond_numbers_is_named(dim, method, column, unit, load):
    """Positions of inf and an energy of NaN came without a word; at acceleration level bodies
    were said to overlap by 0 m."""

    def loads(time, motion):
        pull = np.zeros_like(motion.rates)
        pull[1, column] = load
        return pull

    run = free_bodies(dim, method, loads=loads)
    with pytest.raises(SceneError, match=r"^b at 0 s: its load is 1e\+") as error:
        run.advance(0.01)
    assert f" {unit} " in error.value.what
    assert "this leads to" in error.value.what  # no finite state, or no forces of a contact ahead
    assert error.value.remedy
    assert (run.time, run.energy) == (0.0, 0.0)
    np.testing.assert_array_equal(run.positions, [np.zeros(dim), np.eye(dim)[0]])


@OVERFLOWS
def test_the_steps_before_are_kept():
    """A load from 4.5 ms on, at the middle of the fifth step: four steps are made."""
    run = free_bodies(
        2, "time-stepping",
        loads=lambda time, motion: np.full((2, 3), 1e307 if time > 4.4e-3 else 0.0),
    )  # fmt: skip
    with pytest.raises(SceneError, match=r" at 0\.004 s: its load"):
        run.advance(0.01)
    assert run.steps == 4
    assert run.time == pytest.approx(4e-3, rel=1e-12)
    assert np.isfinite(run.motion.rates).all()


@METHODS
def test_a_load_that_no_step_is_short_enough_for_is_named(method):
    """``h F / m`` with F / m = 3e32 m/s^2: a number, but farther than a body's size at any step of
    Runge-Kutta, whose error spoke of an overlap of 0 m; a step of time stepping has no such bound.
    """
    run = free_bodies(2, method, loads=lambda time, motion: [[0, 0, 0], [1e31, 0, 0]])
    if method == "time-stepping":
        run.advance(1e-3)
        assert run.velocities[1, 0] == pytest.approx(1e28 / run.world.mass[1], rel=1e-12)
        return
    with pytest.raises(NotConverged, match=r"^b, time 0 s: the shortest step is too long") as error:
        run.advance(1e-3)
    assert "overlap" not in str(error.value)
    assert "time-stepping" in error.value.remedy


@OVERFLOWS
@METHODS
@pytest.mark.parametrize("load", [1e200, 1e308])
def test_a_load_upon_a_contact_names_its_body(method, load):
    """It was a sentence on q."""
    scene = Scene()
    scene.add(HalfSpace((0, 1)))
    scene.add(Polygon.rectangle(0.2, 0.1), density=2e3, position=(0, 0.05), name="sleeper")
    run = Simulation(scene, method, loads=lambda time, motion: [[0, 0, 0], [0, -load, 0]])
    with pytest.raises(
        SceneError, match=r"^sleeper at 0 s: its load is .*40 kg: this leads"
    ) as error:
        run.advance(0.01)
    assert error.value.exit_code == 3
    assert run.time == 0.0


@SPACES
def test_a_mass_too_small_for_forces_is_named(dim):
    scene = Scene(dim=dim)
    scene.add(HalfSpace(np.eye(dim)[-1]))
    shape = Disc(0.1) if dim == 2 else Sphere(0.1)
    scene.add(shape, density=1e-105, position=0.1 * np.eye(dim)[-1], name="feather")
    with pytest.raises(SceneError, match=r"^feather at 0 s: its mass is .* kg.*inverse_mass"):
        Simulation(scene).advance(0.01)


@pytest.mark.parametrize("what", ["position", "velocity", "spin", "angle"])
@pytest.mark.parametrize("dim", [2, 3])
def test_states_beyond_bounds_are_not_added(dim, what):
    sizes = {"spin": 1 if dim == 2 else 3, "angle": 1 if dim == 2 else 4}
    shape = Disc(0.1) if dim == 2 else Sphere(0.1)
    for size in (1e51, 1e200, 1e300):
        with pytest.raises(SceneError, match=rf"{what} is .*\n  -> .*1e\+50 at most"):
            Scene(dim=dim).add(shape, density=1.0, **{what: np.full(sizes.get(what, dim), size)})
    with pytest.raises(SceneError, match=r"gravity is .*\n  -> .*1e\+50 at most"):
        Scene(dim=dim, gravity=np.full(dim, 1e200))


@OVERFLOWS
def test_an_energy_beyond_numbers_at_the_start_is_named():
    """``I w^2 / 2``: 1e50 kg/m^2 times R^4 of 1e160 m^4 times 1e100 rad^2/s^2."""
    scene = Scene()
    scene.add(Disc(1e40), density=1e50, spin=1e50, name="wheel")
    with pytest.raises(SceneError, match=r"^wheel at 0 s: its spin is 1e\+50 rad/s"):
        Simulation(scene)


@OVERFLOWS
@SPACES
@pytest.mark.parametrize("what", ["position", "angle", "velocity", "spin"])
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_every_number_of_a_state_is_looked_at(dim, what, bad):
    """Of fixed bodies too, which have no energy."""
    scene, shape = Scene(dim=dim), Disc(0.1) if dim == 2 else Sphere(0.1)
    for fixed in (False, True):
        scene.add(shape, density=None if fixed else 1.0, fixed=fixed)
    for body in (0, 1):
        world, motion = make_world(scene)
        assert is_finite(world, motion)
        getattr(motion, what)[body] = bad
        assert not is_finite(world, motion)


@pytest.mark.parametrize("speed", [1e40, 1e48])
def test_great_but_finite_energies_are_finite(speed):
    """``m v^2 / 2`` is 1.6e230 J or 1.6e246 J; the bound, with I = 1.6e250 for m, is no number."""
    scene = Scene(gravity=(0, 0))
    scene.add(Disc(1e50), density=1e50, velocity=(speed, 0))
    world, motion = make_world(scene)
    assert is_finite(world, motion)
