"""Scenes of rigid grains in the plane whose answers are known in closed form.

Each function builds a scene, and each ``..._answer`` states what must come out; tests run them
for a moment, the validation case for as long as it likes.
"""

from __future__ import annotations

from math import cos, pi, sin, tan

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.motion.state import Motion
from rigid_lcp.motion.world import Scene
from rigid_lcp.scene.simulation import Method, Simulation
from rigid_lcp.shapes import Disc
from rigid_lcp.shapes.half_space import HalfSpace
from rigid_lcp.shapes.polygon import Polygon

Floats = NDArray[np.float64]
G = 9.81
DENSITY = 2700.0
FLOOR = HalfSpace((0, 1))


def turn_gravity(slope: float) -> Floats:
    """Gravity in the frame of a plane inclined by ``slope`` [rad], x downhill [m/s^2]."""
    return G * np.array([sin(slope), -cos(slope)])


def tilt_block(
    slope: float, mu: float, *, size: float = 1.0, method: Method = "time-stepping",
    step: float = 1e-3,
) -> Simulation:  # fmt: skip
    """A square block at rest on an incline; it is body 0 and stays iff ``mu >= tan(slope)``."""
    scene = Scene(2, turn_gravity(slope))
    scene.add(Polygon.rectangle(size, size), density=DENSITY, position=(0, size / 2))
    scene.add(FLOOR, friction=mu)
    return Simulation(scene, method, step=step)


def find_slide_distance(slope: float, mu: float, seconds: float) -> float:
    """How far it slides [m]: ``g (sin - mu cos) t^2 / 2``, or not at all."""
    return max(0.0, G * (sin(slope) - mu * cos(slope))) * seconds**2 / 2


def stack(
    boxes: int, top: float = 1.0, *, mu: float = 0.5, step: float = 1e-3, size: float = 1.0
) -> Simulation:
    """``boxes`` unit boxes upon each other, the highest ``top`` times denser; box k is body k."""
    scene = Scene(2)
    for k in range(boxes):
        density = DENSITY * (top if k == boxes - 1 else 1.0)
        scene.add(
            Polygon.rectangle(size, size), density=density, position=(0, (k + 0.5) * size),
            friction=mu,
        )  # fmt: skip
    scene.add(FLOOR)
    return Simulation(scene, step=step)


def lean_cards(phi: float, mu: float, *, height: float = 1.0, step: float = 1e-3) -> Simulation:
    """Two cards that lean against each other, ``phi`` [rad] from the vertical; bodies 0 and 1.

    Parallelograms with a short vertical edge at the top, where they meet without friction (by
    symmetry none is needed), and their feet on a floor with ``mu``.
    """
    foot, edge = height * tan(phi), 0.02 * height
    left = [(-foot, 0.0), (0.0, height - edge), (0.0, height), (-foot, edge)]
    scene = Scene(2)
    scene.add(Polygon(left), density=DENSITY)
    scene.add(Polygon([(-x, y) for x, y in left[::-1]]), density=DENSITY)
    scene.add(FLOOR, friction=mu)
    return Simulation(scene, step=step)


def find_card_friction(phi: float) -> float:
    """Friction below which the cards slide apart: moments about a foot, ``tan(phi) / 2``."""
    return tan(phi) / 2


def build_wedge(half_angle: float, mu: float, force: float, *, step: float = 1e-3) -> Simulation:
    """A symmetric wedge (body 0) squeezed by two plates under opposite forces, without gravity.

    The plates stand on a floor without friction; the wedge, wide end up, can only go up.
    """
    slope = tan(half_angle)
    bottom, top, low, high = 0.5, 0.5 + slope, 1.0, 2.0
    scene = Scene(2, (0, 0))
    scene.add(
        Polygon([(-bottom, low), (bottom, low), (top, high), (-top, high)]), density=DENSITY,
        friction=mu,
    )  # fmt: skip
    near, far = bottom - slope, bottom + 2 * slope
    plate = [(near, 0.0), (4.0, 0.0), (4.0, 3.0), (far, 3.0)]
    right = scene.add(Polygon(plate), density=DENSITY)
    left = scene.add(Polygon([(-x, y) for x, y in plate[::-1]]), density=DENSITY)
    scene.add(FLOOR, friction=0.0)

    def squeeze(time: float, motion: Motion) -> Floats:
        """Opposite forces at the height of the wedge's middle."""
        loads = np.zeros((4, 3))
        for body, push in ((right, -force), (left, force)):
            loads[body] = push, 0.0, -push * (1.5 - motion.position[body, 1])
        return loads

    return Simulation(scene, step=step, loads=squeeze)


def find_wedge_acceleration(run: Simulation, half_angle: float, mu: float, force: float) -> float:
    """Upward acceleration of the wedge [m/s^2]; zero, it jams, iff ``mu >= tan(half_angle)``.

    ``2 N (sin a - mu cos a) = m_w y''`` and ``F - N (cos a + mu sin a) = m_p y'' tan a``.
    """
    s, c = sin(half_angle), cos(half_angle)
    wedge_mass, plate_mass = run.world.mass[:2]
    drive = 2 * (s - mu * c) / wedge_mass
    if drive <= 0:
        return 0.0
    normal = force / (c + mu * s + plate_mass * (s / c) * drive)
    return float(drive * normal)


def tilt_disc(
    slope: float, mu: float, *, radius: float = 0.5, method: Method = "time-stepping",
    step: float = 1e-3,
) -> Simulation:  # fmt: skip
    """A disc at rest on an incline (body 0)."""
    scene = Scene(2, turn_gravity(slope))
    scene.add(Disc(radius), density=DENSITY, position=(0, radius))
    scene.add(FLOOR, friction=mu)
    return Simulation(scene, method, step=step)


def drop_disc(
    height: float, restitution: float, *, radius: float = 0.1, method: Method = "time-stepping",
    step: float = 1e-3,
) -> Simulation:  # fmt: skip
    """A disc (body 0) dropped from ``height`` above a floor."""
    scene = Scene(2)
    scene.add(Disc(radius), density=DENSITY, position=(0, height + radius))
    scene.add(FLOOR, restitution=restitution)
    return Simulation(scene, method, step=step)


def slide_rod(
    mu: float, *, method: Method, speed: float = 1.0, half_length: float = 0.5,
    lean: float = np.arctan(2.0), step: float = 1e-3,
) -> Simulation:  # fmt: skip
    """Painleve's rod (body 0): its lower tip slides on a floor, ``lean`` from the horizontal.

    It slides away from the side the rod leans to, so that friction turns the tip into the floor.
    """
    shape = Polygon.rectangle(2 * half_length, 2e-6 * half_length)
    turn = np.array([[cos(lean), -sin(lean)], [sin(lean), cos(lean)]])
    height = -(shape.vertices @ turn.T)[:, 1].min()
    scene = Scene(2)
    scene.add(shape, density=DENSITY, position=(0, height), angle=lean, velocity=(-speed, 0))
    scene.add(FLOOR, friction=mu)
    return Simulation(scene, method, step=step)


def limit_rod(run: Simulation) -> float:
    """Friction at which ``1/m + x^2/J - mu |x y|/J`` is zero: above, no finite force exists."""
    contact = run.world.contacts(run.motion, 1e-9 * run.world.length)
    x, y = (contact.point - run.positions[0])[0]
    mass, inertia = run.world.mass[0], run.world.inertia[0]
    return float((1 / mass + x * x / inertia) / (abs(x * y) / inertia))


def stack_unequal(ratio: float, *, step: float = 1e-3) -> Simulation:
    """Light on heavy on light boxes, the middle one ``ratio`` times denser."""
    scene = Scene(2)
    for k, density in enumerate((DENSITY, ratio * DENSITY, DENSITY)):
        scene.add(Polygon.rectangle(1, 1), density=density, position=(0, k + 0.5), friction=0.5)
    scene.add(FLOOR)
    return Simulation(scene, step=step)


def build_arch(stones: int, thickness: float, *, mu: float = 2.0, step: float = 1e-3) -> Simulation:
    """A semicircular arch of equal stones with joints along radii, mean radius 1 m.

    ``thickness``: over the mean radius.  The two lowest stones stand on the floor.  It stands iff
    the thickness is above 0.1075 (Milankovitch; Heyman, Int. J. Solids Struct. 2 (1966) 249).
    """
    inner, outer = 1 - thickness / 2, 1 + thickness / 2
    angle = pi * np.arange(stones + 1) / stones
    points = np.column_stack([np.cos(angle), np.sin(angle)])
    points[0], points[-1] = (1, 0), (-1, 0)
    scene = Scene(2)
    for k in range(stones):
        a, b = points[k], points[k + 1]
        stone = Polygon([inner * a, outer * a, outer * b, inner * b])
        scene.add(stone, density=DENSITY, friction=mu)
    scene.add(FLOOR)
    return Simulation(scene, step=step)


def fill_trough(grains: int, *, seed: int = 0, step: float = 1e-3, mu: float = 0.5) -> Simulation:
    """Irregular polygons on a loose lattice in a trough, to be poured: all bodies but the walls."""
    generator = np.random.default_rng(seed)
    columns = max(4, int(np.sqrt(grains)))
    scene = Scene(2)
    for k in range(grains):
        corners = int(generator.integers(4, 8))
        angle = 2 * pi * (np.arange(corners) + generator.uniform(-0.3, 0.3, corners)) / corners
        radius = 0.02 * generator.uniform(0.7, 1.0)
        place = (0.045 * (k % columns + 0.5), 0.03 + 0.045 * (k // columns))
        scene.add(
            Polygon(radius * np.column_stack([np.cos(angle), np.sin(angle)])), density=DENSITY,
            position=place, friction=mu,
        )  # fmt: skip
    width = 0.045 * columns
    for normal, offset in (((0, 1), 0.0), ((1, 0), 0.0), ((-1, 0), -width)):
        scene.add(HalfSpace(normal, offset))
    return Simulation(scene, step=step)
