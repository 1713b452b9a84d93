"""Acceleration level: exact motions, fourth order, collisions, step control, no solution."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from rigid_lcp import Disc, HalfSpace, Polygon, Scene, Simulation, make_box
from rigid_lcp.arrays import Floats
from rigid_lcp.errors import NoSolution, NotConverged
from rigid_lcp.motion import runge_kutta
from rigid_lcp.motion.lasting_contacts import find_first_fall
from rigid_lcp.motion.state import Motion
from rigid_lcp.scene.simulation import Method
from tests.rigid_motions import bouncing_time, falling_box, grains_in_a_box
from validation.bench.rigid.scenes import G, drop_disc, limit_rod, slide_rod, stack, tilt_block

BY_HALVING = replace(runge_kutta.RUNGE_KUTTA, located_ends=0)
NEEDLE = Polygon([(-1, 0), (0, -0.01), (1, 0), (0, 0.01)])


def needle(
    mu: float, step: float, method: str, *, angle: float = 1.0, speed: float = 0.0
) -> Simulation:
    """A needle with its tip on the floor, about to fall to the left (body 0), centre at the top."""
    scene = Scene(2)
    scene.add(
        NEEDLE, density=1.0, position=(np.cos(angle), np.sin(angle)), angle=angle,
        velocity=(speed, 0),
    )  # fmt: skip
    scene.add(HalfSpace((0, 1)), friction=mu)
    return Simulation(scene, method, step=step)  # type: ignore[arg-type]


def falling(mu: float, seconds: float) -> float:
    """Angle of the needle, by SciPy: about a fixed tip, or with its centre on a vertical line."""
    mass, inertia = NEEDLE.mass_properties(1.0)

    def sticking(time: float, y: Floats) -> list[float]:
        return [y[1], -mass * G * np.cos(y[0]) / (mass + inertia)]

    def frictionless(time: float, y: Floats) -> list[float]:
        c, s = np.cos(y[0]), np.sin(y[0])
        return [y[1], -c * (G - s * y[1] ** 2) * mass / (inertia + mass * c * c)]

    law = sticking if mu else frictionless
    answer = solve_ivp(law, (0, seconds), [1.0, 0.0], rtol=1e-12, atol=1e-13, method="DOP853")
    return float(answer.y[0, -1])


@pytest.mark.parametrize("mu", [0.0, 5.0])
@pytest.mark.long
def test_fourth_order(mu: float) -> None:
    """A needle falls about its tip (sticking) or with its tip free to slide, against SciPy."""
    seconds = 0.24
    expected = falling(mu, seconds)
    errors = []
    for step in (0.08, 0.04, 0.02):
        run = needle(mu, step, "acceleration")
        run.advance(seconds)
        errors.append(abs(run.angles[0] - expected))
        assert run.overlap < 1e-12
    order = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (order > 3.6).all()
    assert errors[-1] < 1e-7


@pytest.mark.long
@pytest.mark.parametrize("mu", [0.0, 5.0])
def test_both_methods_have_one_limit(mu: float) -> None:
    """Time stepping goes to the same answer as Runge-Kutta: second order while nothing changes."""
    expected = falling(mu, 0.32)
    errors = []
    for step in (8e-3, 4e-3, 2e-3):
        run = needle(mu, step, "time-stepping")
        run.advance(0.32)
        errors.append(abs(run.angles[0] - expected))
    assert (np.log2(np.array(errors[:-1]) / errors[1:]) > 1.7).all()


def test_both_methods_have_one_limit_with_impacts() -> None:
    """A box hits the floor with a corner, slides and turns: first order of time stepping."""

    def end(method: Method, step: float) -> Floats:
        run = falling_box(method, step)
        run.advance(0.3)
        return np.array([*run.positions[0], run.angles[0]])

    exact = end("acceleration", 0.01)
    assert np.abs(end("acceleration", 0.005) - exact).max() < 1e-6
    errors = [np.abs(end("time-stepping", step) - exact).max() for step in (8e-3, 2e-3, 5e-4)]
    assert errors[2] < 2e-3
    assert errors[2] < 0.15 * errors[0]  # 1/16 at first order; where a step begins is chance


@pytest.mark.parametrize("dim", [2, 3])
def test_a_block_that_slides_past_an_edge_lands_on_nothing(dim: int) -> None:
    """Where its rear corner leaves the block below, that block's corner bears on from then on.

    Constant deceleration mu g, no collision, no step taken back.
    """
    scene = Scene(dim)
    blocks = {
        2: (Polygon.rectangle(1.0, 0.2), Polygon.rectangle(0.4, 0.1)),
        3: (make_box(1.0, 0.5, 0.2), make_box(0.4, 0.3, 0.1)),
    }
    below, above = blocks[dim]
    along, up = np.eye(dim)[0], np.eye(dim)[-1]
    scene.add(below, fixed=True, position=0.1 * up, friction=0.2)
    scene.add(above, density=1000, position=0.25 * along + 0.25 * up, velocity=along, friction=0.2)
    run = Simulation(scene, "acceleration", step=0.01)
    run.advance(0.2)  # 0.16 m; its front leaves the block below after 51 ms
    wanted = (0.25 + 0.2 - 0.1 * G * 0.2**2) * along + 0.25 * up
    np.testing.assert_allclose(run.positions[1], wanted, atol=1e-14)
    assert (run.pace.collisions, run.pace.accepted) == (0, 20)


@pytest.mark.long
def test_blocks_that_are_pushed_slide_past_an_edge() -> None:
    """The same on a block that pushes another: the collision that was seen at the edge once parted
    these two, and they met again every 0.3 us for ever."""
    scene = Scene(2)
    scene.add(HalfSpace((0, 1)), friction=0.3)
    for width, height, density, place, mu in (
        (0.4, 0.3, 1000, (0, 0.15), 0.3), (0.3, 0.2, 1500, (0.35, 0.1), 0.25),
        (0.2, 0.1, 800, (-0.05, 0.35), 0.2),
    ):  # fmt: skip
        scene.add(Polygon.rectangle(width, height), density=density, position=place, friction=mu)

    def push(time: float, motion: Motion) -> Floats:
        return np.array([[0, 0, 0], [900 + 700 * np.sin(9 * time), 0, 0], [0, 0, 0], [0, 0, 0]])

    run = Simulation(scene, "acceleration", step=0.01, loads=push)
    run.advance(0.4)
    assert (run.pace.collisions, run.pace.accepted) == (0, 40)
    # the lower two grip each other, which shifts weight between grounds of friction 0.25 and 0.3
    gained = np.array([120.0, 90.0, 16.0]) @ run.velocities[1:, 0]
    pushed, weight = 360 + 700 / 9 * (1 - np.cos(3.6)), 226 * G * 0.4
    assert pushed - 0.3 * weight < gained < pushed - 0.25 * weight


def test_sliding_stops_where_it_should() -> None:
    """``v^2 / (2 mu g)``, met to the speed that counts as rest: the step is cut at the event."""
    run = tilt_block(0.0, 0.5, method="acceleration", step=0.01)
    run.motion.velocity[0, 0] = 1.0
    run.advance(0.3)
    assert run.positions[0, 0] == pytest.approx(1 / G, abs=1e-9)
    assert run.pace.shortened >= 1
    assert (run.contacts.status == "stick").all()


@pytest.mark.long
def test_bounces_keep_the_energy() -> None:
    """Restitution 1: 1e-13 a bounce; time between bounces as on paper."""
    run = drop_disc(0.01, 1.0, method="acceleration", step=0.01)
    energy, bounces = run.energy, 400
    run.advance(2 * bounces * np.sqrt(2 * 0.01 / G))
    assert run.pace.collisions == bounces  # the first after sqrt(2h/g) = 45 ms, then every 90 ms
    assert abs(run.energy / energy - 1) < 1e-13 * run.pace.collisions


def test_zeno_is_cut_off() -> None:
    """Bounces are met one by one until they are too slow to be worth it; then rest."""
    run = drop_disc(0.1, 0.5, method="acceleration", step=0.01)
    seconds = bouncing_time(0.1, 0.5)
    run.advance(0.99 * seconds)
    assert run.positions[0, 1] > 0.1
    run.advance(0.02 * seconds)
    assert run.positions[0, 1] == pytest.approx(0.1, abs=1e-9)
    assert np.abs(run.velocities).max() < 1e-9
    # v = e^k sqrt(2 g h) falls to 1e-4 sqrt(g R) after 14 bounces
    assert run.pace.collisions == pytest.approx(14, abs=1)


@pytest.mark.long
def test_step_is_halved_and_doubled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Section 9: overlaps halve the step; three clean steps double it, up to the longest one."""
    run = drop_disc(0.1, 0.5, method="acceleration", step=0.01)
    monkeypatch.setattr(runge_kutta, "RUNGE_KUTTA", BY_HALVING)
    run.advance(0.15)
    assert run.pace.halved > 5
    assert run.pace.step < 0.01
    run.advance(0.45)
    assert run.pace.step == 0.01


@pytest.mark.parametrize("seed", [0, 1])
def test_where_a_gap_closes_is_located(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same motion as by halving alone, as many collisions, at an eighth of the steps or less.

    Both end a step at gaps below 1e-9 of a body, at speeds of 1 m/s: times of impact, and so
    places, differ by that, and by what some impacts after one another make of it.
    """
    runs = [Simulation(grains_in_a_box(seed), "acceleration", step=5e-3) for _ in range(2)]
    for run in runs:  # the second by halving alone
        run.advance(0.12)
        monkeypatch.setattr(runge_kutta, "RUNGE_KUTTA", BY_HALVING)
        assert run.overlap <= 1e-11 * run.world.length
    paces = [run.pace for run in runs]
    assert paces[0].collisions == paces[1].collisions > 2
    np.testing.assert_allclose(runs[0].positions, runs[1].positions, atol=1e-8)
    np.testing.assert_allclose(runs[0].angles, runs[1].angles, atol=1e-7)
    steps = [pace.accepted + pace.halved for pace in paces]
    quiet = 0.12 / 5e-3
    assert steps[0] - quiet < 0.125 * (steps[1] - quiet)


@pytest.mark.long
def test_steps_with_rough_forces_are_counted() -> None:
    """A tolerance below round-off is met by no step, the default one by all."""
    for tolerance, above in ((1e-12, 0), (1e-30, 3)):
        run = Simulation(stack(4).world.scene, "acceleration", step=1e-3, tolerance=tolerance)
        run.advance(3e-3)
        assert run.pace.accepted == 3
        assert run.pace.steps_above == above


def test_nothing_jumps_over_another() -> None:
    """A fast disc hits a thin plate although one longest step would carry it through."""
    scene = Scene(2, (0, 0))
    scene.add(Disc(0.05), density=1.0, position=(0, 1), velocity=(0, -100), restitution=1.0)
    scene.add(Polygon.rectangle(1, 0.01), fixed=True)
    run = Simulation(scene, "acceleration", step=0.1)
    run.advance(0.1)
    assert run.velocities[0, 1] == pytest.approx(100)


@pytest.mark.parametrize("below", [1e-6, 1e-2])
def test_just_below_painleves_limit_the_tip_stops_at_once(below: float) -> None:
    """Forces of 1/below times the weight stop the tip in far less than a step, whatever its length.

    In the limit an impulse p along n and mu p against the slip: with W of a slender rod of mass 1,
    ``p = v / (mu W_tt - |W_nt|) = 0.3 v`` at tan(lean) = 2, mu = 4/3.  Friction that went on in its
    direction beyond rest threw the rod off with up to 4e8 times its energy; and a step that went
    on where the rod would have turned met states without forces, which it does not come to.
    """
    limit = limit_rod(slide_rod(1.0, method="acceleration"))
    runs = [slide_rod((1 - below) * limit, method="acceleration", step=h) for h in (1e-2, 1e-3)]
    for run in runs:
        energy = run.energy
        run.advance(1e-2)
        assert run.energy < energy
        # g t of the fall, and the turn of the rod by w t = 0.02
        np.testing.assert_allclose(run.velocities[0], [-0.6, 0.3], atol=0.03)
    np.testing.assert_allclose(runs[0].velocities, runs[1].velocities, atol=1e-6)


def test_painleve() -> None:
    """Below its limit the sliding rod has forces; above it none, and impulses go on."""
    limit = limit_rod(slide_rod(1.0, method="acceleration"))
    assert limit == pytest.approx(4 / 3, rel=1e-6)  # a uniform thin rod at tan t = 2
    below = slide_rod(0.99 * limit, method="acceleration")
    below.advance(1e-7)
    mass, inertia = below.world.mass[0], below.world.inertia[0]
    x, y = (below.contacts.point - below.positions)[0]
    compliance = 1 / mass + x * x / inertia - 0.99 * limit * x * y / inertia
    assert below.contacts.normal_force[0] == pytest.approx(G / compliance, rel=1e-3)
    above = slide_rod(1.01 * limit, method="acceleration")
    with pytest.raises(NoSolution, match="Painleve") as error:
        above.advance(1e-3)
    assert "time-stepping" in error.value.remedy
    impulses = slide_rod(1.01 * limit, method="time-stepping")
    energy = impulses.energy
    impulses.advance(0.05)
    assert impulses.worst_residual < 1e-9
    assert impulses.energy < energy
    assert impulses.overlap < 1e-9


def test_residual_is_judged(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forces that were not found stop the run, with their residual."""
    import rigid_lcp.motion.acceleration_forces as integrator

    right = integrator.solve_problem

    def wrong(*args: object, **keys: object) -> object:
        from dataclasses import replace

        found = right(*args, **keys)  # type: ignore[arg-type]
        return replace(found, residual=1e-3, status="not converged", message="stopped")

    monkeypatch.setattr(integrator, "solve_problem", wrong)
    monkeypatch.setattr(integrator, "try_lasting_forces", lambda *_: None)
    run = tilt_block(0.1, 0.5, method="acceleration")
    with pytest.raises(NotConverged, match="residual"):
        run.advance(0.01)


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ((1.0, -2.0, -1.0, -2.0), 0.5),  # a straight line
        ((0.75, 0.0, -0.25, -2.0), 0.75**0.5),  # 0.75 - x^2
        ((-1e-12, 1.0, -1.0, -3.0), 0.5),  # x (1 - 2 x): just left, flies up, comes back
        ((-0.1, -1.0, -1.1, -1.0), None),  # overlaps all the time
    ],
)
def test_first_fall(values: tuple[float, ...], expected: float | None) -> None:
    """Roots of cubics that are known."""
    assert find_first_fall(*values) == pytest.approx(expected, abs=1e-10)
