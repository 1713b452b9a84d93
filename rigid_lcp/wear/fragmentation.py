"""Fragmentation in 2D: a polygon is split along a line, and nothing bursts (section 10).

"After a fragmentation (which is algorithmically done by constructing two or more new polygons
from the previous particle simply by introducing another edge into the old particle and splitting
along this line) the system remains always stable."  The parts inherit the rigid motion of the
whole: every point keeps place and velocity, so mass, momentum, angular momentum and kinetic
energy are those of the whole to round-off, and the parts touch along the cut at zero gap and zero
gap rate, in two contacts.  Polyhedra are broken by `rigid_lcp.shapes.fragments`;
`split_body` does either to a body of a scene in motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigid_lcp.errors import ShapeError
from rigid_lcp.shapes import Polygon, real_numbers

if TYPE_CHECKING:
    from rigid_lcp.motion import Body, Motion, Scene

Floats = NDArray[np.float64]
SLIVER = 1e-3
"""Least width of a part across the cut, as a share of the width of the whole [-]."""


@dataclass(frozen=True)
class Fragment:
    """A part of a body, at the moment of the break."""

    vertices: Floats
    """Corners (n, 2) [m], anticlockwise, in the frame the whole was given in."""
    mass: float
    """[kg]"""
    inertia: float
    """About its own centre of mass [kg m^2]."""
    position: Floats
    """Centre of mass (2,) [m]."""
    velocity: Floats
    """Velocity of the centre of mass (2,) [m/s]."""
    spin: float
    """[rad/s]"""


def polygon_moments(vertices: Floats) -> tuple[float, Floats, float]:
    """Area [m^2], centroid (2,) [m] and second moment about it [m^4] of a polygon (n, 2).

    Taken about a vertex first: exact for polygons far from the origin.
    """
    origin = vertices[0]
    here = vertices - origin
    there = np.roll(here, -1, axis=0)
    twice = here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0]
    area = float(twice.sum() / 2)
    first = ((here + there) * twice[:, None]).sum(axis=0) / 6
    second = float((twice * ((here**2).sum(1) + (here * there).sum(1) + (there**2).sum(1))).sum())
    return area, origin + first / area, second / 12 - float(first @ first) / area


def split_polygon(
    vertices: ArrayLike, point: ArrayLike, direction: ArrayLike
) -> tuple[Floats, Floats]:
    """The two parts of a convex polygon left and right of a line.

    ``vertices`` (n, 2) [m] anticlockwise; the line through ``point`` (2,) [m] along ``direction``
    (2,).  Both parts are anticlockwise and share the two ends of the cut to the last digit.  A
    vertex nearer to the line than round-off is taken as on it.  Raises `ShapeError` for a line
    that misses the polygon or leaves a sliver narrower than `SLIVER` of its width.
    """
    corners = _numbers(vertices, "vertices")
    along, origin = _numbers(direction, "direction"), _numbers(point, "point")
    length = float(np.linalg.norm(along))
    planar = corners.ndim == 2 and corners.shape[1] == 2 and len(corners) >= 3
    if not planar or origin.shape != (2,) or along.shape != (2,):
        raise ShapeError(
            f"vertices have shape {corners.shape}, point {origin.shape}, direction {along.shape}",
            where="split",
            remedy="give corners (n, 2), three at least, a point and a direction (2,)",
        )  # fmt: skip
    if length == 0:
        raise ShapeError(
            "the direction of the line is zero", where="split",
            remedy="give the direction in which it runs, of any length",
        )  # fmt: skip
    normal = np.array([-along[1], along[0]]) / length
    height = (corners - origin) @ normal
    width = float(height.max() - height.min())
    least = min(float(height.max()), -float(height.min()))
    if least < SLIVER * width:
        raise ShapeError(
            "the line misses the polygon" if least <= 0 else
            f"the line leaves a sliver {least:.3g} m wide of a polygon {width:.3g} m wide",
            where="split", remedy="move the line towards the centroid",
        )  # fmt: skip
    height[np.abs(height) < 1e-12 * width] = 0.0

    left: list[Floats] = []
    right: list[Floats] = []
    for k in range(len(corners)):
        here, there = height[k], height[(k + 1) % len(corners)]
        if here >= 0:
            left.append(corners[k])
        if here <= 0:
            right.append(corners[k])
        if here * there < 0:
            share = here / (here - there)
            crossing = (1 - share) * corners[k] + share * corners[(k + 1) % len(corners)]
            left.append(crossing)
            right.append(crossing)
    return np.array(left), np.array(right)


def break_polygon(
    whole: Floats, point: Floats, direction: ArrayLike, density: float, velocity: Floats,
    spin: float,
) -> tuple[Fragment, Fragment]:  # fmt: skip
    """The parts of a moving polygon that breaks along a line, with their motion.

    ``whole`` (n, 2) [m], anticlockwise; ``point``, ``direction``: see `split_polygon`; ``density``
    [kg/m^2]; ``velocity`` (2,) [m/s] of the centre of mass of the whole; ``spin`` [rad/s].
    """
    _, centre, _ = polygon_moments(whole)
    made = []
    for part in split_polygon(whole, point, direction):
        area, position, second = polygon_moments(part)
        arm = position - centre
        moved = velocity + spin * np.array([-arm[1], arm[0]])
        made.append(Fragment(part, density * area, density * second, position, moved, spin))
    return made[0], made[1]


def scene_at(scene: Scene, motion: Motion) -> Scene:
    """The same bodies, starting from the state ``motion``."""
    from rigid_lcp.motion import Scene

    made = Scene(scene.dim, scene.gravity)
    made.bodies = [
        replace(
            each, position=motion.position[k], velocity=motion.velocity[k],
            angle=np.atleast_1d(motion.angle[k]), spin=np.atleast_1d(motion.spin[k]),
        )
        for k, each in enumerate(scene.bodies)
    ]  # fmt: skip
    return made


def split_body(
    scene: Scene, motion: Motion, body: int, point: ArrayLike, direction: ArrayLike
) -> Scene:
    """The scene at the state ``motion`` with one body broken in two.

    In 2D along the line through ``point`` (2,) [m] with ``direction`` (2,); in 3D by the plane
    through ``point`` (3,) with the normal ``direction`` (3,); world frame.  The first part has the
    number of the whole, the second is added at the end; surface values are those of the whole.
    Raises `ShapeError` for what can not be split: a disc, a fixed body, a sliver.
    """
    made = scene_at(scene, motion)
    where = scene.called(body)
    if not scene.bodies[body].movable or not hasattr(scene.bodies[body].shape, "vertices"):
        raise ShapeError(
            "only polygons and polyhedra that move can be split", where=where,
            remedy="give it a density, or make the shape a polygon",
        )  # fmt: skip
    parts = _split_2d if scene.dim == 2 else _split_3d
    try:
        made.bodies[body], added = parts(made.bodies[body], point, direction)
    except ShapeError as error:
        raise error.at(f"{where}, {error.where}") from error
    made.bodies.append(added)
    return made


def _split_2d(body: Body, point: ArrayLike, direction: ArrayLike) -> tuple[Body, Body]:
    angle = float(body.angle[0])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    # about the body's own place: far from the origin its corners would lose digits, and it mass
    parts = break_polygon(
        body.shape.vertices @ turn.T, _numbers(point, "point") - body.position, direction,
        body.mass / body.shape.area, body.velocity, float(body.spin[0]),
    )  # fmt: skip
    made = [
        replace(
            body, shape=Polygon(each.vertices), mass=each.mass, inertia=each.inertia,
            position=body.position + each.position, angle=np.zeros(1), velocity=each.velocity,
        )
        for each in parts
    ]  # fmt: skip
    return made[0], made[1]


def _split_3d(body: Body, point: ArrayLike, normal: ArrayLike) -> tuple[Body, Body]:
    from rigid_lcp.shapes import Polyhedron, fragments

    parts = fragments(
        body.shape, body.position, body.angle, body.velocity, body.spin, normal, point
    )
    density = body.mass / body.shape.mass_properties(1.0)[0]
    made = []
    for each in parts:
        shape = Polyhedron.of_corners(each.shape.vertices)  # as a run that goes on makes it again
        try:
            _ = shape.edges  # contacts want them
        except ShapeError as error:
            raise ShapeError(
                "the plane leaves corners too near to one another, or to a face, to be kept apart",
                where="cut", remedy="move the plane a little",
            ) from error  # fmt: skip
        mass, inertia = shape.mass_properties(density)
        made.append(replace(
            body, shape=shape, mass=mass, inertia=inertia, position=each.position,
            velocity=each.velocity,
        ))  # fmt: skip
    return made[0], made[1]


def _numbers(values: ArrayLike, what: str) -> Floats:
    remedy = "give metres"
    try:
        array = real_numbers(values)
    except (TypeError, ValueError) as error:
        raise ShapeError(f"{what} is {values!r}", where="split", remedy=remedy) from error
    if not np.isfinite(array).all():
        raise ShapeError(f"{what} holds numbers that are not finite", where="split", remedy=remedy)
    return array
