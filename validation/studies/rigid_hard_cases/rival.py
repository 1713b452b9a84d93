"""The same planar scenes in MuJoCo: slabs that slide along x and y and turn in the plane.

MuJoCo has its most exact settings: elliptic cones, ``impratio`` 100, 30 iterations without slip,
contacts as stiff as its step allows (a time constant of two steps).  The plane's y is its z.
"""

from __future__ import annotations

import time
from itertools import combinations
from math import cos, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.motion.world import Body
from rigid_lcp.scene.simulation import Simulation
from rigid_lcp.shapes import Disc
from rigid_lcp.shapes.half_space import HalfSpace

Floats = NDArray[np.float64]
OPTIONS = (
    'cone="elliptic" impratio="100" noslip_iterations="30" noslip_tolerance="0" '
    'solver="Newton" tolerance="0" iterations="100"'
)
SOFTNESS = 'solref="{time} 1" solimp="0.99 0.9999 {width} 0.5 2"'
LEAST_FRICTION = 1e-5
"""MuJoCo's least coefficient."""


def move_in_mujoco(run: Simulation, seconds: float) -> tuple[Floats, int, float]:
    """Displacements (n, 3) [m, m, rad] of all bodies, steps, CPU time of the steps [s]."""
    import mujoco  # a peer: whoever reads the study's record needs none

    bodies = run.world.scene.bodies
    model = mujoco.MjModel.from_xml_string(write_model(run))
    state = mujoco.MjData(model)
    moving = [k for k, body in enumerate(bodies) if body.movable]
    start = np.array([[0.0, 0.0, body.angle[0]] for body in bodies])
    state.qpos[:] = start[moving].ravel()
    state.qvel[:] = np.array([[*bodies[k].velocity, bodies[k].spin[0]] for k in moving]).ravel()
    loads = None if run.loads is None else run.loads(0.0, run.motion)
    if loads is not None:
        state.qfrc_applied[:] = loads[moving].ravel()
    steps = round(seconds / run.step)
    begun = time.process_time()
    for _ in range(steps):
        mujoco.mj_step(model, state)
    spent = time.process_time() - begun
    moved = np.zeros((len(bodies), 3))
    moved[moving] = state.qpos.reshape(-1, 3) - start[moving]
    return moved, steps, spent


def write_model(run: Simulation) -> str:
    """The scene as it starts, in MuJoCo's XML."""
    scene = run.world.scene
    depth = run.world.length
    contact = SOFTNESS.format(time=2 * run.step, width=1e-3 * depth)
    geometries, assets = zip(
        *(write_shape(k, body, depth) for k, body in enumerate(scene.bodies)), strict=True
    )
    world = "".join(map(write_body, range(len(scene.bodies)), scene.bodies, geometries))
    pairs = "".join(
        f'<pair geom1="g{i}" geom2="g{j}" condim="3" {contact} '
        f'friction="{write_numbers(*[find_friction(first, second)] * 2)} 0 0 0"/>'
        for (i, first), (j, second) in combinations(enumerate(scene.bodies), 2)
        if first.movable or second.movable
    )
    x, y = scene.gravity
    return (
        f'<mujoco><compiler angle="radian"/><option timestep="{run.step:.17g}" '
        f'gravity="{write_numbers(x, 0, y)}" {OPTIONS}/><asset>{"".join(assets)}</asset>'
        f"<worldbody>{world}</worldbody><contact>{pairs}</contact></mujoco>"
    )


def write_shape(number: int, body: Body, depth: float) -> tuple[str, str]:
    """The geometry of a body of which only pairs collide, and the mesh that it needs."""
    common = f'<geom name="g{number}" contype="0" conaffinity="0" '
    shape: Any = body.shape
    if isinstance(shape, HalfSpace):
        (nx, ny), offset = shape.normal, shape.offset
        place = write_numbers(offset * nx, 0, offset * ny)
        up = write_numbers(nx, 0, ny)
        return f'{common}type="plane" size="0 0 1" pos="{place}" zaxis="{up}"/>', ""
    if isinstance(shape, Disc):
        return f'{common}type="sphere" size="{shape.radius:.17g}"/>', ""
    outline = shape.vertices
    low, high = outline.min(axis=0), outline.max(axis=0)
    if len(outline) == 4 and np.isin(outline, [low, high]).all():
        half = write_numbers((high - low)[0] / 2, depth / 2, (high - low)[1] / 2)
        return f'{common}type="box" size="{half}"/>', ""
    points = " ".join(write_numbers(x, y, z) for x, z in outline for y in (-depth / 2, depth / 2))
    mesh = f'<mesh name="m{number}" inertia="exact" vertex="{points}"/>'
    return f'{common}type="mesh" mesh="m{number}"/>', mesh


def write_body(number: int, body: Body, geometry: str) -> str:
    """A body with its three freedoms; of its moments of inertia only the middle one matters."""
    x, y = body.position if not isinstance(body.shape, HalfSpace) else (0.0, 0.0)
    place = write_numbers(x, 0, y)
    if not body.movable:
        half = -body.angle[0] / 2
        turned = write_numbers(cos(half), 0, sin(half), 0)
        return f'<body pos="{place}" quat="{turned}">{geometry}</body>'
    return (
        f'<body name="b{number}" pos="{place}"><joint type="slide" axis="1 0 0"/>'
        '<joint type="slide" axis="0 0 1"/><joint type="hinge" axis="0 -1 0"/>'
        f'<inertial pos="0 0 0" mass="{body.mass:.17g}" '
        f'diaginertia="{write_numbers(*[body.inertia] * 3)}"/>{geometry}</body>'
    )


def find_friction(first: Body, second: Body) -> float:
    """The smaller of two bodies' coefficients; None leaves it to the other."""
    given = [body.friction for body in (first, second) if body.friction is not None]
    return max(min(given, default=0.0), LEAST_FRICTION)


def write_numbers(*numbers: float) -> str:
    """Numbers to the last digit, as XML has them."""
    return " ".join(f"{number:.17g}" for number in numbers)
