"""The one JSON file that the YADE scripts read: what the scene names, in SI units."""

from __future__ import annotations

from typing import Any

import numpy as np

from adapters.contact_law import DAMPING_FACTOR, damping_of_rebound
from adapters.container import Container
from adapters.decks import MIRROR_YOUNG, PISTON_MARGIN, box_bounds, convex_clip, section_bounds
from adapters.engine_plan import frictional
from adapters.sample import GRAVITY
from adapters.scene import GrainRadius, Scene
from adapters.state import FloatArray

VERLET_SHARE = 0.1
"""How far a grain moves before YADE looks for new neighbours, in mean radii."""

DISC_CORNERS = 96
"""Corners of the polygon that stands for a disc-shaped piston."""

RIM_WIDTH = 0.2
"""How far inside a piston's rim grains still meet the rim, in mean radii: further than one moves in
a load cycle, or than a contact is wide."""

NO_WEIGHT = 1.0
"""Density of walls [kg/m^3]: nothing depends on it, and YADE wants one."""


def damping_ratio(scene: Scene) -> float:
    """YADE's ``betan`` = ``betas``, the a of c = 2 a sqrt(m* S) with S the tangent stiffness.

    YADE never lets a contact pull, so one damping can not serve both of a scene's keys:

    * ``viscous_alpha`` names the viscous force: a = sqrt(5/6) alpha, that of the other engines
      (see `adapters.contact_law`).  Grains then rebound faster, e = 0.335 instead of 0.2145 for
      alpha = 0.44, since the end of the collision, where eq. 7 pulls, is missing;
    * ``restitution`` names the rebound: a is that which makes it, without a pull.
    """
    grain = scene.material.grain
    if grain.viscous_alpha is not None:
        return DAMPING_FACTOR * grain.viscous_alpha
    return damping_of_rebound(scene.restitution)


def shared_parameters(scene: Scene, height: float) -> dict[str, Any]:
    """What both scripts need: materials, contact law, walls, box up to ``height`` [m]."""
    material = scene.material
    container = scene.container
    materials = {
        "grain": _material(material.grain.young, material.grain.poisson, material.grain.density),
        "wall": _material(material.wall.young, material.wall.poisson),
    }
    if container.symmetry:
        materials["mirror"] = _material(MIRROR_YOUNG, material.grain.poisson)
    radius = np.array([scene.sample.grain_radius.greatest])
    return {
        "grain_count": scene.grain_count,
        "time_step": scene.time_step,
        "gravity": GRAVITY,
        "verlet_distance": VERLET_SHARE * scene.sample.grain_radius.mean,
        "frictional": frictional(scene),
        "materials": materials,
        "pairs": _pairs(scene),
        "box": np.column_stack(box_bounds(container, radius, height)).tolist(),
        "walls": walls_of(container, height),
    }


def _material(young: float, poisson: float, density: float = NO_WEIGHT) -> dict[str, float]:
    return {"young": young, "poisson": poisson, "density": density}


def _pairs(scene: Scene) -> list[dict[str, float | str]]:
    """Damping and friction of each pair of materials that can meet.

    A pair without friction has no tangential damping either: YADE takes a spring of length zero
    for one that sticks, and would brake what should slide freely.
    """
    damping = damping_ratio(scene)
    friction = {"grain": scene.material.grain.friction, "wall": scene.material.wall.friction}
    if scene.container.symmetry:
        friction["mirror"] = 0.0
    return [
        {
            "first": "grain",
            "second": other,
            "damping_normal": damping,
            "damping_tangential": damping if mu > 0 else 0.0,
            "friction": mu,
        }
        for other, mu in friction.items()
    ]


def walls_of(container: Container, height: float) -> list[dict[str, Any]]:
    """Planes along the axes, and a triangle for each side of a cylinder, up to ``height`` [m]."""
    walls = container.walls()
    sides = iter(container.side_angles())
    result: list[dict[str, Any]] = []
    for name, mirror, point, normal in zip(
        walls.plane_name,
        walls.plane_frictionless,
        walls.plane_point,
        walls.plane_normal,
        strict=True,
    ):
        wall: dict[str, Any] = {"name": name, "material": "mirror" if mirror else "wall"}
        if name.startswith("cylinder"):
            wall["vertices"] = side_triangle(container, next(sides), height).tolist()
        else:
            axis = int(np.argmax(np.abs(normal)))
            sense = int(np.sign(normal[axis]))
            wall |= {"axis": axis, "position": point.tolist(), "sense": sense}
        result.append(wall)
    return result


def side_triangle(container: Container, angle: float, height: float) -> FloatArray:
    """Corners [m], shape (3, 3), of a triangle that covers one side of the polygon.

    One triangle, not two: where two of a plane meet, a grain would touch both and be pushed
    twice.  What of it lies beyond the side lies outside the container, and nothing touches it.
    ``angle`` [rad] of the outward normal, ``height`` [m] up to which the side is covered.
    """
    width = 2 * container.radius * np.tan(np.pi / container.sides)
    margin = width
    corners = np.array([[-width, -margin], [width, -margin], [0.0, 2 * height + 2 * margin]])
    outward = np.array([np.cos(angle), np.sin(angle)])
    along = np.array([-outward[1], outward[0]])
    plane = container.radius * outward + corners[:, :1] * along
    return np.column_stack([plane, corners[:, 1]])


def piston_face(container: Container, reach: float, grain: GrainRadius) -> dict[str, Any]:
    """The piston's face: ``triangles``, horizontal corners [m], shape (t, 3, 2), normal down.

    A whole piston (``reach`` infinite) is one triangle over the section and somewhat more.  A
    partial one, a disc of radius ``reach`` [m], is a plane for grains whose centres are within
    ``plane_reach`` [m] of the axis, and triangles for those further out.  ``grain``: radii.
    """
    margin = PISTON_MARGIN * grain.greatest
    if np.isinf(reach):
        low, high = section_bounds(container)
        corner = np.array(low) - margin
        across = 2 * (np.array(high) + margin - corner)
        face = [corner, corner + np.array([0.0, across[1]]), corner + np.array([across[0], 0.0])]
        return {"triangles": np.array([face]).tolist()}
    angle = -np.linspace(0.0, 2 * np.pi, DISC_CORNERS + 1)[:-1]
    circle = reach * np.column_stack([np.cos(angle), np.sin(angle)])
    floor = [-margin if axis in container.symmetry else -np.inf for axis in "xy"]
    return {
        "triangles": rim_triangles(convex_clip(circle, floor)).tolist(),
        "plane_reach": max(reach - RIM_WIDTH * grain.mean, 0.0),
    }


def rim_triangles(corners: FloatArray) -> FloatArray:
    """Triangles (n, 3, 2) from the origin to the sides of a convex polygon (n, 2) around it.

    YADE pushes a grain on a seam of two triangles from both.  These seams go straight to the
    corners, so that near the rim, where alone grains meet them, there is as little as can be.
    """
    after = np.roll(corners, -1, axis=0)
    return np.stack([np.zeros_like(corners), corners, after], axis=1)
