"""Fragmentation: a grain is split along a line, in 3D by a plane, and nothing bursts (section 10).

The parts inherit the rigid motion of the whole.  Every point keeps place and velocity, so mass,
momentum, angular momentum and kinetic energy are those of the whole to round-off, and the parts
touch along the cut at zero gap and zero gap rate: "the system remains always stable".
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from rigid_lcp.arrays import Floats
from rigid_lcp.errors import ShapeError
from rigid_lcp.motion import Body, Motion, Scene, turn_arm
from rigid_lcp.shapes import rotate, rotate_back
from rigid_lcp.wear.cuts import CUTS, Solid, cut_part, find_volume

LEAST_WIDTH = 1e-3
"""Least width of a part across the cut in 2D, as a share of the width of the whole [-]."""


def restart_scene(scene: Scene, motion: Motion) -> Scene:
    """The same bodies, starting from the state ``motion``."""
    return scene.replace_bodies(
        replace(
            each, position=motion.position[k], velocity=motion.velocity[k],
            angle=np.atleast_1d(motion.angle[k]), spin=np.atleast_1d(motion.spin[k]),
        )
        for k, each in enumerate(scene.bodies)
    )  # fmt: skip


def split_body(
    scene: Scene, motion: Motion, body: int, point: ArrayLike, direction: ArrayLike
) -> Scene:
    """The scene at the state ``motion`` with one body broken in two.

    In 2D along the line through ``point`` (2,) [m] with ``direction`` (2,); in 3D by the plane
    through ``point`` (3,) with the normal ``direction`` (3,); world frame.  The first part has the
    number of the whole, the second is added at the end; surface values are those of the whole.
    Raises `ShapeError` for what can not be split: a disc, a fixed body, a sliver.
    """
    made = restart_scene(scene, motion)
    whole, where = made.bodies[body], scene.name_body(body)
    if not whole.movable or not hasattr(whole.shape, "vertices"):
        raise ShapeError(
            "only polygons and polyhedra that move can be split", where=where,
            remedy="give it a density, or make the shape a polygon",
        )  # fmt: skip
    height = measure_height(whole, np.asarray(point), np.asarray(direction), where)
    try:
        parts = [cut_part(whole.shape, side * height) for side in (-1.0, 1.0)]
    except ShapeError as error:
        raise ShapeError(
            "the cut leaves corners too near to one another, or to a face, to be kept apart",
            where=where, remedy="move the plane a little",
        ) from error  # fmt: skip
    made.bodies[body], added = (make_part(whole, *part) for part in parts)
    made.bodies.append(added)
    return made


def measure_height(whole: Body, point: Floats, direction: Floats, where: str) -> Floats:
    """Heights (v,) [m] of a body's corners over the cut; `ShapeError` where it misses the body."""
    normal = direction if len(direction) == 3 else np.array([-direction[1], direction[0]])
    length = float(np.linalg.norm(normal))
    if length == 0.0:
        raise ShapeError(
            "the direction of the cut is zero", where=where,
            remedy="give the direction of the line, in 3D the normal of the plane, of any length",
        )  # fmt: skip
    # about the body's own place: far from the origin its corners would lose digits, and it mass
    normal = rotate_back(whole.angle, normal)
    offset = float(normal @ rotate_back(whole.angle, point - whole.position))
    height = np.asarray((whole.shape.vertices @ normal - offset) / length)
    most, least = float(height.max()), float(height.min())
    thin = CUTS.clearance * whole.shape.reach
    if len(direction) == 2:
        thin = LEAST_WIDTH * (most - least)
    if min(most, -least) <= thin:
        raise ShapeError(
            f"the cut misses the grain or leaves a sliver: its corners lie {least:.3g} to"
            f" {most:.3g} m from it", where=where,
            remedy=f"move it along its normal by {-offset / length:.3g} m to go through the centre"
            " of mass",
        )  # fmt: skip
    return height


def make_part(whole: Body, shape: Solid, way: Floats) -> Body:
    """A part of a body, its centre of mass a ``way`` (dim,) [m] off in the body frame, in the
    motion of the whole: ``v + w x d``."""
    mass, inertia = shape.mass_properties(whole.mass / find_volume(whole.shape))
    arm = rotate(whole.angle, way)
    velocity = whole.velocity + turn_arm(np.squeeze(whole.spin), arm)
    return replace(
        whole, shape=shape, mass=mass, inertia=inertia, position=whole.position + arm,
        velocity=velocity,
    )  # fmt: skip
