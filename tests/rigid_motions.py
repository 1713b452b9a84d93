"""Motions with a closed form, or with a few equations that SciPy solves: what integrators are for.

Each scene is built by one function and has its answer in the next.
"""

from __future__ import annotations

from math import cos, sin, sqrt

import numpy as np
from scipy.integrate import solve_ivp

from rigid_lcp import Disc, HalfSpace, Polygon, Polyhedron, Scene, Simulation
from rigid_lcp.arrays import Floats
from rigid_lcp.motion.state import Motion
from rigid_lcp.scene.simulation import Method
from rigid_lcp.shapes.rotations import find_quaternion_rate, make_quaternion, rotate
from tests.rigid_solids import make_stone
from validation.bench.rigid.scenes import DENSITY, FLOOR, G, turn_gravity

EXACT = {"rtol": 1e-13, "atol": 1e-13, "method": "DOP853"}
"""How SciPy solves the equations of motion: to round-off, as good as a closed form here."""

# --- a disc that skids down an incline until it rolls ---

DISC_SLOPE, DISC_FRICTION, DISC_SPEED = 0.2, 0.2, 1.0


def skidding_disc(method: Method, step: float, *, radius: float = 0.5) -> Simulation:
    """A disc (body 0) that starts down an incline without spin; it has grip enough to roll."""
    scene = Scene(2, turn_gravity(DISC_SLOPE))
    scene.add(Disc(radius), density=DENSITY, position=(0, radius), velocity=(DISC_SPEED, 0))
    scene.add(FLOOR, friction=DISC_FRICTION)
    return Simulation(scene, method, step=step)


def skidding_disc_answer(seconds: float, *, radius: float = 0.5) -> Floats:
    """Way [m], height [m], angle [rad]: ``g (sin - mu cos)``, from no slip on ``2/3 g sin``.

    The slip ``v + w R`` loses ``g (3 mu cos - sin)`` each second.
    """
    grip, pull = G * DISC_FRICTION * cos(DISC_SLOPE), G * sin(DISC_SLOPE)
    skid = min(seconds, DISC_SPEED / (3 * grip - pull))
    roll, speed = seconds - skid, DISC_SPEED + (pull - grip) * skid
    way = DISC_SPEED * skid + (pull - grip) * skid**2 / 2 + speed * roll + pull * roll**2 / 3
    spin = 2 * grip * skid / radius
    angle = grip * skid**2 / radius + spin * roll + pull * roll**2 / 3 / radius
    return np.array([way, radius, -angle])


# --- a rod that tips over the edge of a table, and slides off ---

ROD_LENGTH, ROD_THICK, ROD_OVER, ROD_TILT, ROD_FRICTION = 1.0, 0.04, 0.15, 0.05, 0.4


def rod_over_edge(method: Method, step: float) -> Simulation:
    """A rod (body 0) at rest on the corner of a table, its middle beyond it, tilted already."""
    along, up = _rod_axes(ROD_TILT)
    scene = Scene(2)
    scene.add(
        Polygon.rectangle(ROD_LENGTH, ROD_THICK), density=DENSITY, angle=-ROD_TILT,
        position=ROD_OVER * along + ROD_THICK / 2 * up, friction=ROD_FRICTION,
    )  # fmt: skip
    scene.add(Polygon.rectangle(2, 1), fixed=True, position=(-1, -0.5))
    return Simulation(scene, method, step=step)


def _rod_axes(tilt: float) -> tuple[Floats, Floats]:
    return np.array([cos(tilt), -sin(tilt)]), np.array([sin(tilt), cos(tilt)])


def rod_over_edge_answer(seconds: float) -> Floats:
    """Centre [m] and angle [rad], by the two equations of motion of the rod on the corner.

    With s the way of the centre beyond the corner, t the tilt, b half the thickness, per mass:
    ``s'' + b t'' - s t'^2 = g sin t + F``,
    ``b s'' + (b^2 + s^2 + I) t'' + 2 s s' t' = g (s cos t + b sin t)``,
    ``N = g cos t - s t'' - 2 s' t' - b t'^2``; it sticks while ``|F| < mu N``, then ``F = -mu N``.
    """
    b = ROD_THICK / 2
    inertia = (ROD_LENGTH**2 + ROD_THICK**2) / 12

    def rates(y: Floats, mu: float | None) -> tuple[Floats, float, float]:
        s, tilt, slip, spin = y
        rest = b * b + s * s + inertia
        drive = G * (s * cos(tilt) + b * sin(tilt)) - 2 * s * slip * spin
        fixed = s * spin**2 + G * sin(tilt)
        press = G * cos(tilt) - 2 * slip * spin - b * spin**2
        if mu is None:
            turn = drive / rest
            return np.array([slip, spin, 0.0, turn]), b * turn - fixed, press - s * turn
        # s'' + (b - mu s) t'' = fixed - mu press, as F = -mu N and N = press - s t''
        a = np.array([[1.0, b - mu * s], [b, rest]])
        slide, turn = np.linalg.solve(a, [fixed - mu * press, drive]).tolist()
        normal = press - s * turn
        return np.array([slip, spin, slide, turn]), -mu * normal, normal

    def grip(_: float, y: Floats) -> float:
        friction, normal = rates(y, None)[1:]
        return ROD_FRICTION * normal - abs(friction)

    grip.terminal = True  # type: ignore[attr-defined]
    rest = [ROD_OVER, ROD_TILT, 0.0, 0.0]
    first = solve_ivp(lambda _, y: rates(y, None)[0], (0, seconds), rest, events=grip, **EXACT)
    begun, state = first.t[-1], first.y[:, -1]
    if begun < seconds:
        state = solve_ivp(
            lambda _, y: rates(y, ROD_FRICTION)[0], (begun, seconds), state, **EXACT
        ).y[:, -1]
    assert rates(state, ROD_FRICTION)[2] > 0, "it has left the corner"
    along, up = _rod_axes(state[1])
    return np.array([*(state[0] * along + b * up), -state[1]])


# --- a box that falls on its corner, slides, bounces and turns ---


def falling_box(method: Method, step: float) -> Simulation:
    """A box (body 0) that hits a floor with a corner; its motion has no closed form."""
    scene = Scene(2)
    scene.add(Polygon.rectangle(1, 0.5), density=1.0, position=(0, 0.6), angle=0.4, velocity=(1, 0))
    scene.add(HalfSpace((0, 1)), friction=0.2, restitution=0.3)
    return Simulation(scene, method, step=step)


# --- a stone in free flight ---

STONE = make_stone(np.random.default_rng(0), 0.05)
STONE_SPIN = np.array([20.0, -35.0, 10.0])
STONE_DENSITY = 1e3


def stone_in_flight(method: Method, step: float) -> Simulation:
    """A stone (body 0) spun by 42 rad/s about no principal axis; nothing acts on it."""
    scene = Scene(3)
    scene.add(
        STONE, density=STONE_DENSITY, position=[0.0, 0.0, 0.0], velocity=[0.3, 0.0, 0.4],
        spin=STONE_SPIN,
    )  # fmt: skip
    return Simulation(scene, method, step=step)


def stone_in_flight_answer(seconds: float) -> Floats:
    """Its quaternion, from Euler's equations ``I w' = -w x I w`` in components of the body."""
    inertia = STONE.mass_properties(STONE_DENSITY)[1]

    def law(_: float, y: Floats) -> Floats:
        spin = y[4:]
        change = np.linalg.solve(inertia, -np.cross(spin, inertia @ spin))
        return np.concatenate([find_quaternion_rate(y[:4], rotate(y[:4], spin)), change])

    start = np.concatenate([[1.0, 0.0, 0.0, 0.0], STONE_SPIN])
    return np.asarray(solve_ivp(law, (0, seconds), start, **EXACT).y[:4, -1])


# --- a prism that slides and turns on an incline ---

CORNERS = np.array([[0.1, 0.0], [-0.05, 0.08], [-0.04, -0.09]])
THICK = 0.04
PRISM = Polyhedron(
    np.vstack([np.column_stack([CORNERS, np.full(3, z)]) for z in (-THICK / 2, THICK / 2)])
)
PRISM_SLOPE, PRISM_FRICTION, KICK, TURN = 0.2, 0.4, np.array([1.0, 0.6]), 2.0


def sliding_prism(method: Method, step: float) -> Simulation:
    """A kicked prism (body 0) that stands on a triangle on an incline, and turns."""
    normal = np.array([np.sin(PRISM_SLOPE), 0.0, np.cos(PRISM_SLOPE)])
    turn = make_quaternion([0.0, PRISM_SLOPE, 0.0])
    scene = Scene(3)
    scene.add(
        PRISM, density=STONE_DENSITY, position=THICK / 2 * normal, angle=turn,
        friction=PRISM_FRICTION, velocity=rotate(turn, [*KICK, 0.0]), spin=TURN * normal,
    )  # fmt: skip
    scene.add(HalfSpace(normal, 0.0))
    return Simulation(scene, method, step=step)


def sliding_prism_place(run: Simulation) -> Floats:
    """Place down the incline and across it [m], angle about its normal [rad]."""
    normal = np.array([np.sin(PRISM_SLOPE), 0.0, np.cos(PRISM_SLOPE)])
    back = make_quaternion([0.0, -PRISM_SLOPE, 0.0])
    place = rotate(back, run.positions[0] - THICK / 2 * normal)
    side = rotate(back, rotate(run.angles[0], [1.0, 0.0, 0.0]))
    return np.array([place[0], place[1], np.arctan2(side[1], side[0])])


def sliding_prism_answer(seconds: float) -> Floats:
    """The same by SciPy, in the plane of the incline.

    Three normal forces follow from the weight and from no moment tipping the prism: with the
    lever (x, y, -h) of a corner and its friction ``-mu N s``, s the direction of its slip,
    ``sum N = m g cos``, ``sum N (y - mu h s_y) = 0``, ``sum N (x - mu h s_x) = 0``.
    """
    mass, inertia = PRISM.mass_properties(STONE_DENSITY)
    corners, height = CORNERS - PRISM.centroid[:2], THICK / 2

    def law(_: float, y: Floats) -> Floats:
        c, s = np.cos(y[2]), np.sin(y[2])
        arm = corners @ np.array([[c, s], [-s, c]])
        velocity = y[3:5] + y[5] * np.column_stack([-arm[:, 1], arm[:, 0]])
        way = velocity / np.linalg.norm(velocity, axis=1)[:, None]
        tipping = arm - PRISM_FRICTION * height * way
        weight = mass * G * np.cos(PRISM_SLOPE)
        force = np.linalg.solve(np.vstack([np.ones(3), tipping.T]), [weight, 0.0, 0.0])
        drag = -PRISM_FRICTION * force[:, None] * way
        moment = float((arm[:, 0] * drag[:, 1] - arm[:, 1] * drag[:, 0]).sum())
        pull = drag.sum(axis=0) / mass + [G * np.sin(PRISM_SLOPE), 0.0]
        return np.array([*y[3:], *pull, moment / inertia[2, 2]])

    start = [0.0, 0.0, 0.0, *KICK, TURN]
    return np.asarray(solve_ivp(law, (0, seconds), start, **EXACT).y[:3, -1])


# --- bodies that collide again and again ---


def grains_in_a_box(seed: int) -> Scene:
    """Five discs and boxes that fly about in a trough; restitution 0.7, friction 0.3."""
    generator = np.random.default_rng(seed)
    scene = Scene(2)
    for k in range(5):
        shape = Disc(0.04) if k % 2 else Polygon.rectangle(0.07, 0.05)
        scene.add(
            shape, density=2700, position=(0.1 + 0.12 * (k % 3), 0.1 + 0.12 * (k // 3)),
            angle=generator.uniform(-1, 1), velocity=generator.uniform(-1, 1, 2), friction=0.3,
            restitution=0.7,
        )  # fmt: skip
    for normal, offset in (((0, 1), 0.0), ((1, 0), 0.0), ((-1, 0), -0.44)):
        scene.add(HalfSpace(normal, offset), restitution=0.7)
    return scene


# --- a disc that goes round another ---

ORBIT_RADII = (0.1, 0.3)  # radii of the disc that goes round and of the fixed one [m]
ORBIT_FRICTION = 0.5


def orbiting_disc(method: Method, step: float, friction: float) -> Simulation:
    """A disc (body 0) pressed on a fixed one (body 1) by a constant force to its middle.

    It goes round at 1 m/s, by pure rolling where there is friction: both are kept for ever.
    """
    small, large = ORBIT_RADII
    way = small + large
    scene = Scene(2, gravity=(0.0, 0.0))
    scene.add(
        Disc(small), density=DENSITY, position=(way, 0), velocity=(0, 1), friction=friction,
        spin=1 / small if friction else 0.0,
    )  # fmt: skip
    scene.add(Disc(large), fixed=True, position=(0, 0))
    press = 10.0 * scene.bodies[0].mass / way  # ten times what the bend asks for

    def towards_the_middle(_: float, motion: Motion) -> Floats:
        loads = np.zeros((2, 3))
        loads[0, :2] = -press * motion.position[0] / np.linalg.norm(motion.position[0])
        return loads

    return Simulation(scene, method, step=step, loads=towards_the_middle)


# --- answers of scenes of `validation.bench.rigid.scenes`, and a rocking block ---


def stack_drop(run: Simulation, seconds: float) -> float:
    """Greatest change of any coordinate of a run that should rest [m, rad]."""
    position, angle = run.positions.copy(), run.angles.copy()
    run.advance(seconds)
    move = np.abs(run.positions - position).max()
    return float(max(move, np.abs(run.angles - angle).max()))


def disc_on_incline_acceleration(slope: float, mu: float) -> float:
    """``2/3 g sin`` where it rolls (``mu >= tan/3``), ``g (sin - mu cos)`` where it slides."""
    return max(2 / 3 * G * sin(slope), G * (sin(slope) - mu * cos(slope)))


def bouncing_time(height: float, restitution: float) -> float:
    """When it has come to rest after infinitely many bounces: ``sqrt(2h/g) (1+e)/(1-e)`` [s]."""
    return sqrt(2 * height / G) * (1 + restitution) / (1 - restitution)


def rocking_block(
    half_width: float, half_height: float, lean: float, *, method: Method = "acceleration",
    step: float = 0.02,
) -> Simulation:  # fmt: skip
    """A block (body 0) let go on its right corner, ``lean`` [rad]; too rough to slide."""
    scene = Scene(2)
    corner = np.array([[cos(lean), sin(lean)], [-sin(lean), cos(lean)]])
    scene.add(
        Polygon.rectangle(2 * half_width, 2 * half_height), density=DENSITY, angle=-lean,
        position=corner @ (-half_width, half_height),
    )  # fmt: skip
    scene.add(FLOOR, friction=5.0)
    return Simulation(scene, method, step=step)


def rocking_block_answer(
    half_width: float, half_height: float, lean: float, impacts: int
) -> tuple[Floats, float]:
    """Times of the first impacts [s], and the share of its kinetic energy that each one leaves.

    Housner, Bull. Seismol. Soc. Am. 53 (1963) 403: the moment about the new corner is kept, so
    ``w+/w- = 1 - 3/2 sin^2 alpha``, without bounce; between impacts the energy of the turn about
    a corner, ``2/3 m R^2 w^2 + m g R cos(alpha - lean)``.
    """
    from scipy.integrate import quad

    alpha, radius = np.arctan2(half_width, half_height), np.hypot(half_width, half_height)
    share = (1 - 1.5 * sin(alpha) ** 2) ** 2
    times, now, parts = [], 0.0, 1
    for _ in range(impacts):
        # u^2 = lean - angle: no singularity at rest
        fall = lambda u, top=lean: 2 * u / sqrt(  # noqa: E731
            1.5 * G / radius * (cos(alpha - top) - cos(alpha - top + u * u))
        )  # fmt: skip
        now += parts * quad(fall, 0, sqrt(lean), epsabs=1e-13, epsrel=1e-12)[0]
        times.append(now)
        lean = alpha - np.arccos(cos(alpha) + share * (cos(alpha - lean) - cos(alpha)))
        parts = 2
    return np.array(times), float(share)
