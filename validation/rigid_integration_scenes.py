"""Motions with a closed form, or with a few equations that SciPy solves: what integrators are for.

Each scene is built by one function and has its answer in the next; tests and
`validation.rigid_integration_order` share them.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from rigid_lcp.polyhedra import ballast_stone
from rigid_lcp.rotations import quaternion_of_rotation, quaternion_rate, rotate
from rigid_lcp.scene import Scene
from rigid_lcp.shapes_2d import Disc, HalfSpace, Polygon
from rigid_lcp.shapes_3d import Polyhedron
from rigid_lcp.simulation import Simulation
from rigid_lcp.simulation_input import Method
from validation.rigid_scenes import DENSITY, FLOOR, G, gravity_on

Floats = NDArray[np.float64]
EXACT = {"rtol": 1e-13, "atol": 1e-13, "method": "DOP853"}
"""How SciPy solves the equations of motion: to round-off, as good as a closed form here."""

# --- a disc that skids down an incline until it rolls ---

DISC_SLOPE, DISC_FRICTION, DISC_SPEED = 0.2, 0.2, 1.0


def skidding_disc(method: Method, step: float, *, radius: float = 0.5) -> Simulation:
    """A disc (body 0) that starts down an incline without spin; it has grip enough to roll."""
    scene = Scene(2, gravity_on(DISC_SLOPE))
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


# --- a rocking block, at any time ---


def rocking_block_state(
    half_width: float, half_height: float, lean: float, seconds: float
) -> Floats:
    """Centre [m] and angle [rad] of `validation.rigid_scenes.rocking_block` (Housner 1963).

    About either corner ``4/3 R^2 t'' = -g R sin(alpha - |t|) sign t``; upright it goes on with
    ``1 - 3/2 sin^2 alpha`` of its spin.  The block is let go on its right corner.
    """
    alpha, radius = np.arctan2(half_width, half_height), np.hypot(half_width, half_height)
    side, time, state = 1.0, 0.0, np.array([lean, 0.0])

    def upright(_: float, y: Floats) -> float:
        return float(y[0])

    upright.terminal, upright.direction = True, -1  # type: ignore[attr-defined]
    corner = half_width
    while True:
        found = solve_ivp(
            lambda _, y: [y[1], -0.75 * G / radius * sin(alpha - y[0])], (time, seconds), state,
            events=upright, **EXACT,
        )  # fmt: skip
        time, state = found.t[-1], found.y[:, -1]
        if found.status != 1:
            break
        side, state = -side, np.array([0.0, -(1 - 1.5 * sin(alpha) ** 2) * state[1]])
    tilt = side * state[0]  # to the right
    turn = np.array([[cos(tilt), sin(tilt)], [-sin(tilt), cos(tilt)]])
    foot = np.array([0.0 if side > 0 else -2 * corner, 0.0])
    return np.array([*(foot + turn @ (-side * half_width, half_height)), -tilt])


# --- a box that falls on its corner, slides, bounces and turns ---


def falling_box(method: Method, step: float) -> Simulation:
    """A box (body 0) that hits a floor with a corner; its motion has no closed form."""
    scene = Scene(2)
    scene.add(Polygon.rectangle(1, 0.5), density=1.0, position=(0, 0.6), angle=0.4, velocity=(1, 0))
    scene.add(HalfSpace((0, 1)), friction=0.2, restitution=0.3)
    return Simulation(scene, method, step=step)


# --- a stone in free flight ---

STONE = ballast_stone(np.random.default_rng(0), 0.05)
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
        return np.concatenate([quaternion_rate(y[:4], rotate(y[:4], spin)), change])

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
    turn = quaternion_of_rotation([0.0, PRISM_SLOPE, 0.0])
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
    back = quaternion_of_rotation([0.0, -PRISM_SLOPE, 0.0])
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
