"""The validators of a window: each figure against a closed form, each fault named."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from adapters.bed.contact_law import OVERLAP_BOUND, find_overlap_under_force
from adapters.bed.sample import GRAVITY
from adapters.bed.state import make_no_contacts
from adapters.errors import EngineFailed, NotCredible
from adapters.files.window import PistonTrack, Window
from adapters.procedure.checks import (
    BOUNDS,
    WindowFigures,
    advise_other_piston,
    check_bounds,
    check_complete,
    check_rise,
    check_state,
    check_window,
    measure,
)
from adapters.scene.bearing import estimate_swing
from adapters.scene.tables import Scene

RADIUS = 3e-3
MASS = 2e-4
SAMPLES = 100
SCENE = Scene.model_validate(
    {
        "sample": {
            "container": "cylinder",
            "radius": 0.03,
            "count": 3,
            "grain_radius": {"distribution": "constant", "mean": RADIUS},
        },
        "material": {
            "grain": {
                "young": 1e9, "poisson": 0.25, "density": 2710.0, "restitution": 0.5, "friction": 0,
            },
            "wall": {"young": 1e10, "poisson": 0.3, "friction": 0},
        },
        "loading": {"amplitude": 1000.0, "mean": 500.0, "frequency": 50.0, "piston_mass": 0.01},
        "engine": {"name": "fake", "rayleigh_share": 0.2},
    }
)  # fmt: skip
STEPS = SCENE.steps_per_cycle
BED = np.array([[0.0, 0.0, RADIUS], [0.01, 0.0, RADIUS], [0.02, 0.0, RADIUS]])


def window(cycles: int = 4, **change: Any) -> Window:
    """A window of three grains that stand still on the floor, the piston's force as asked for."""
    n = cycles + 1
    step = STEPS * np.arange(n)
    track = np.arange(1, cycles * SAMPLES + 1)
    force = 1.0 - np.cos(2 * np.pi * track / SAMPLES)
    whole = Window(
        first_cycle=7,
        time_step=step,
        identifier=np.arange(1, 4),
        radius=np.full(3, RADIUS),
        mass=np.full(3, MASS),
        position=np.repeat(BED[None], n, axis=0),
        velocity=np.zeros((n, 3, 3)),
        spin=np.zeros((n, 3, 3)),
        wall_force={"floor": np.zeros((n, 3, 3))},
        contacts=(make_no_contacts(),) * n,
        piston=PistonTrack(
            time_step=track * (STEPS // SAMPLES),
            target_force=force,
            contact_force=force.copy(),
            height=np.full(len(track), 0.01),
            kinetic_translational=np.zeros(len(track)),
            kinetic_rotational=np.zeros(len(track)),
        ),
        piston_start=0.01,
    )
    return replace(whole, **change)


def tracked(cycles: int = 4, **change: Any) -> Window:
    """The same with another record of the piston."""
    plain = window(cycles)
    return replace(plain, piston=replace(plain.piston, **change))


def test_a_whole_window_passes() -> None:
    """Nothing moves, nothing overlaps: every figure is zero and the record says so."""
    assert STEPS % SAMPLES == 0
    assert check_window(SCENE, window(), 4) == {
        "overlap_share": pytest.approx(0, abs=1e-15),
        "energy_share": 0.0,
        "move_share": 0.0,
        "force_error": 0.0,
        "own_frequency": pytest.approx(np.nan, nan_ok=True),
    }


@given(st.floats(1e-6, 1.9))
def test_overlap_of_a_pair(share: float) -> None:
    """Two grains at distance 2 r - delta: the share is delta / r."""
    position = window().position.copy()
    position[2, 1, 0] = 2 * RADIUS - share * RADIUS
    figures = measure(SCENE, window(position=position))
    assert figures.overlap_share == pytest.approx(share, rel=1e-9)


@pytest.mark.parametrize(
    ("axis", "place"), [(2, 0.6 * RADIUS), (0, 0.03 - 0.6 * RADIUS), (1, -0.03 + 0.6 * RADIUS)]
)
def test_overlap_with_a_wall(axis: int, place: float) -> None:
    """A grain 0.4 r inside the floor or the cylinder shows 0.4; outside, as deep as it is far."""
    position = window().position.copy()
    position[-1, 1, 0] = 1.0
    with pytest.raises(NotCredible, match="greatest overlap"):
        check_window(SCENE, window(position=position), 4)
    position = window().position.copy()
    position[3, 0] = [0, 0, 2.5 * RADIUS]
    position[3, 0, axis] = place
    figures = measure(SCENE, window(position=position))
    assert figures.overlap_share == pytest.approx(0.4, rel=1e-9)


def test_the_state_before_the_window_is_not_judged() -> None:
    """After a jump the first state is ours, not the engine's."""
    position, velocity = window().position.copy(), window().velocity.copy()
    position[0, 1, 0] = RADIUS
    velocity[0] = 100.0
    figures = measure(SCENE, window(position=position, velocity=velocity))
    assert figures.overlap_share == pytest.approx(0, abs=1e-15)
    assert figures.energy_share == 0


def test_kinetic_energy() -> None:
    """m v^2 / 2 + (2/5) m r^2 w^2 / 2 of one grain, over 3 m g r."""
    velocity, spin = window().velocity.copy(), window().spin.copy()
    velocity[2, 0] = [3.0, 0, 4.0]
    spin[2, 0] = [0, 20.0, 0]
    figures = measure(SCENE, window(velocity=velocity, spin=spin))
    energy = 0.5 * MASS * 25 + 0.5 * 0.4 * MASS * RADIUS**2 * 400
    assert figures.energy_share == pytest.approx(energy / (3 * MASS * GRAVITY * RADIUS), rel=1e-12)


def test_mean_move() -> None:
    """One of three grains moves by 0.6 r in one cycle: the mean is 0.2 r."""
    position = window().position.copy()
    position[2:, 0, 2] += 0.6 * RADIUS
    figures = measure(SCENE, window(position=position))
    assert figures.move_share == pytest.approx(0.2, rel=1e-12)


@pytest.mark.parametrize("cycle", range(4))
def test_force_error(cycle: int) -> None:
    """A constant error in one cycle is its own rms, over the peak 2 N; three cycles are free, and
    with none behind them the figure is nan, which is no fault."""
    short = measure(SCENE, window(3))
    assert np.isnan(short.force_error)
    check_bounds(SCENE, short)
    plain = window().piston
    force = plain.contact_force.copy()
    force[cycle * SAMPLES : (cycle + 1) * SAMPLES] += 0.3
    figures = measure(SCENE, tracked(contact_force=force))
    expected = 0.15 if cycle >= BOUNDS.force_start_cycles else 0.0
    assert figures.force_error == pytest.approx(expected, rel=1e-12)


def test_elastic_deflection_is_what_the_piston_comes_back_by() -> None:
    """Each cycle begins 30 um above its end and dips 100 um below its start: 70 um come back.

    What stays is settlement, and no part of the deflection.
    """
    phase = np.arange(1, SAMPLES + 1) / SAMPLES
    dip = np.interp(phase, [0.0, 0.5, 1.0], [0.0, -100e-6, -30e-6])
    height = np.concatenate([0.01 + c * -30e-6 + dip for c in range(4)])
    found = tracked(height=height).piston.elastic_deflection(STEPS)
    np.testing.assert_allclose(found, 70e-6, atol=1e-12)


def test_a_spring_under_the_piston_has_its_own_stiffness() -> None:
    """Height -F/k: from its trough to its peak the load swings by F, the height by F/k; without a
    deflection the stiffness is nan."""
    phase = np.arange(1, 4 * SAMPLES + 1) / SAMPLES
    force = 1 - np.cos(2 * np.pi * phase)
    piston = tracked(target_force=force, height=0.01 - force / 4e4).piston
    np.testing.assert_allclose(piston.stiffness(STEPS), 4e4, rtol=1e-9)
    assert np.isnan(tracked(height=np.full(4 * SAMPLES, 0.01)).piston.stiffness(STEPS)).all()


@pytest.mark.parametrize(
    ("name", "bound", "words"),
    [
        ("overlap_share", OVERLAP_BOUND, "overlap over the smallest radius"),
        ("energy_share", 1.0, "kinetic energy"),
        ("move_share", 1.0, "mean move in one cycle"),
        ("force_error", BOUNDS.force_error, "piston's rms force error"),
    ],
)
@pytest.mark.parametrize("excess", [1 + 1e-9, 10.0, np.inf])
def test_bounds(name: str, bound: float, words: str, excess: float) -> None:
    """At a bound a window passes, above it the figure and the time step are named."""
    still = WindowFigures(0.0, 0.0, 0.0, 0.0, 9.0)
    check_bounds(SCENE, replace(still, **{name: bound}))
    with pytest.raises(NotCredible, match=words) as caught:
        check_bounds(SCENE, replace(still, **{name: bound * excess}))
    assert caught.value.exit_code == 6
    assert "of the Rayleigh time" in caught.value.remedy
    # 10 g over 4/3 pi (3 mm)^3 at 2710 kg/m^3
    assert ("as heavy as 33 mean grains" in caught.value.remedy) == (name == "force_error")


@pytest.mark.parametrize(("times", "word"), [(3.9, "lighter"), (4.1, "heavier")])
def test_a_piston_that_swings_is_to_be_lighter(times: float, word: str) -> None:
    """On a spring k = m (2 pi f times)^2, f of the load, the piston's own frequency is ``times``
    the load's, and below four the remedy for a force that it misses is less mass."""
    assert SCENE.loading is not None
    stiffness = SCENE.loading.piston_mass * (2 * np.pi * times / SCENE.loading.period) ** 2
    plain = window().piston
    figures = measure(SCENE, tracked(height=0.01 - plain.target_force / stiffness))
    assert figures.own_frequency == pytest.approx(times, rel=1e-9)
    with pytest.raises(NotCredible) as caught:
        check_bounds(SCENE, replace(figures, force_error=0.3))
    assert f"a {word} one (loading.piston_mass)" in caught.value.remedy


def test_a_piston_that_the_bed_hardly_moves_is_to_be_lighter() -> None:
    """k = 3/2 sigma A/(n delta): so heavy that it swings 3.9 times as fast, whatever it shows."""
    assert SCENE.loading is not None
    mass = SCENE.loading.piston_mass * (estimate_swing(SCENE) / 3.9) ** 2
    own = SCENE.loading.model_copy(update={"piston_mass": mass})
    heavy = SCENE.model_copy(update={"loading": own})
    assert estimate_swing(heavy) == pytest.approx(3.9)
    radius, modulus = np.array(RADIUS), SCENE.stiffness.grain
    force = 1000.0 * (2 * RADIUS) ** 2  # on a grain; 1 Pa more closes delta by d delta/d sigma
    bend = np.diff(find_overlap_under_force(force * np.array([1, 1 + 1e-6]), modulus, radius / 2))
    stiffness = 1000.0 * 1e-6 * SCENE.loaded_area / bend[0]  # of less than a layer: n = 1
    times = np.sqrt(stiffness / mass) / (2 * np.pi) * SCENE.loading.period
    assert times == pytest.approx(3.9, rel=1e-5)
    for shown in (np.nan, 9.0):
        assert "3.9 times as fast as the load, does not follow its load: a lighter" in (
            advise_other_piston(heavy, shown)
        )


def test_missing_cycles() -> None:
    """A window of four cycles is not one of three, nor of five; cycle ends lie a cycle apart."""
    step = window().time_step.copy()
    step[-1] += 1
    for one, cycles in ((window(4), 3), (window(4), 5), (window(time_step=step), 4)):
        with pytest.raises(EngineFailed, match=f"4 of {cycles} cycle ends"):
            check_complete(SCENE, one, cycles)


def test_lost_grains_are_named() -> None:
    """A grain that is missing from the start on is named by its identifier."""
    kept = {name: getattr(window(), name)[:, [0, 2]] for name in ("position", "velocity", "spin")}
    one = window(identifier=np.array([1, 3]), **kept)
    with pytest.raises(NotCredible, match="1 grains are lost: 2"):
        check_complete(SCENE, one, 4)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_not_finite(value: float) -> None:
    """The first cycle, or step of the piston's record, with a number that is not finite is named,
    although nan stands for "not judged" in figures."""
    for name in ("position", "velocity", "spin"):
        array = getattr(window(), name).copy()
        array[2:, 1, 2] = value
        with pytest.raises(NotCredible, match=f"{name} is not finite from cycle 9 on"):
            check_complete(SCENE, window(**{name: array}), 4)
    step = window().piston.time_step[150]
    for name in ("target_force", "contact_force", "height"):
        array = getattr(window().piston, name).copy()
        array[150:] = value
        with pytest.raises(NotCredible, match=rf"not finite from step {step} on"):
            check_complete(SCENE, tracked(**{name: array}), 4)


@pytest.mark.parametrize("left", [399, 250, 0])
def test_short_piston_record(left: int) -> None:
    """A record that does not reach the last cycle's end is named with both steps."""
    track = {name: values[:left] for name, values in vars(window().piston).items()}
    with pytest.raises(EngineFailed, match=f"record ends at step .* the window at {4 * STEPS}"):
        check_complete(SCENE, tracked(**track), 4)


@pytest.mark.parametrize("fault", ["lost", "overlap", "nan"])
def test_settled_bed(fault: str) -> None:
    """A bed without all its grains, pressed into one another, or nan is refused."""
    state = window().state(0)
    check_state(SCENE, state)
    position = state.position.copy()
    if fault == "lost":
        state = replace(
            state,
            **{
                name: getattr(state, name)[:2]
                for name in ("identifier", "position", "radius", "mass", "velocity", "spin")
            },
        )
    else:
        position[1, 0] = 1.9 * RADIUS if fault == "overlap" else np.nan
        state = state.move_to(position)
    with pytest.raises(NotCredible) as caught:
        check_state(SCENE, state)
    assert caught.value.where == "preparation"


def test_a_rise_is_judged_by_what_the_window_moved() -> None:
    """The greater of the window's own travel and a thousandth of the mean radius may be risen; one
    grain that is thrown up is no bed that rises."""
    radius = SCENE.sample.radii.mean
    grain = np.linspace(0.01, 0.05, 9)
    moving = grain - np.array([0.0, 2e-3, 1e-3])[:, None] * radius
    still = np.tile(grain, (3, 1))
    thrown = np.where(np.arange(9) == 8, radius, 0.0)
    check_rise(SCENE, moving, np.full(9, 1.9e-3 * radius))
    check_rise(SCENE, still, np.full(9, 0.9e-3 * radius))
    check_rise(SCENE, moving, np.full(9, -radius))
    check_rise(SCENE, still, thrown)
    for heights, rise in ((moving, 2.1e-3 * radius), (still, 1.1e-3 * radius)):
        with pytest.raises(NotCredible, match="lifts the bed"):
            check_rise(SCENE, heights, thrown + rise)
