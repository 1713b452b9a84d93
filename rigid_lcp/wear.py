"""Wear in a run: the work of friction takes the corners off polygons (Archard, Reye; section 8).

The work at a contact, ``-f_T . s`` over the slip s, belongs to the corner that makes the contact
(the vertex of body a, or the corner of b that a disc touches); a corner loses ``V = k W``
(`rigid_lcp.abrasion`).  What is lost is kept for every corner and cut off now and then: each
corner of the polygon as it was first is replaced by a chamfer of all that it has lost, so shapes
only shrink, chamfers grow parallel to themselves, and nothing can overlap.  Where a chamfer meets
its neighbour or takes half of an edge, the worn shape becomes the one to wear from.

What stays goes on as part of the rigid motion of the whole; what is worn off takes its momentum
and energy away.  Faces, discs, half-spaces and fixed bodies keep their shape.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.abrasion import friction_work, worn_stiffness, worn_volume
from rigid_lcp.contacts import ContactForces, Contacts, contact_frames
from rigid_lcp.detection_2d import FACE_BITS
from rigid_lcp.equations import relative_velocity
from rigid_lcp.errors import SceneError, ShapeError
from rigid_lcp.fragmentation import polygon_moments, scene_at
from rigid_lcp.motion import Motion
from rigid_lcp.shapes_2d import Polygon

if TYPE_CHECKING:
    from rigid_lcp.scene import Body, Scene

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAST_CUT = 1e-6
"""Chamfers shorter than this share of a grain's reach wait: detection has ties of 1e-9 of it."""


@dataclass(frozen=True)
class Wear:
    """How grains wear in a run."""

    coefficient: float
    """k of ``V = k W`` [m^3/J], in 2D [m^2 per J/m], the same number (Reye 1860, Archard 1953)."""
    every: int = 20
    """Steps between cuts."""
    volume_scale: float | None = None
    """V_0 of `rigid_lcp.abrasion.worn_stiffness` [m^3, m^2 in 2D]; None: stiffness does not change.
    """
    stiffness_left: float = 0.1
    """Share of the stiffness that stays at a worn corner [-]."""

    def __post_init__(self) -> None:
        worn_volume(np.zeros(1), self.coefficient)
        if self.every < 1:
            raise ShapeError(
                f"every is {self.every}", where="wear", remedy="give 1 or more steps between cuts"
            )
        worn_stiffness(1.0, 0.0, self.volume_scale or 1.0, self.stiffness_left)


@dataclass(frozen=True)
class WornPolygon:
    """A polygon and the sharp one that it is worn from; all in the frame of the latter's shape."""

    sharp: Floats
    """Corners before chamfers (k, 2) [m]."""
    lost: Floats
    """Area cut off each sharp corner (k,) [m^2]."""
    vertices: Floats
    """Corners now (n, 2) [m]."""
    owner: Ints
    """The sharp corner that each corner now belongs to (n,)."""
    total: Floats
    """All area that has been worn at each corner now, on whatever sharp polygon, (n,) [m^2]."""


@dataclass
class WearState:
    """What the corners of all grains of a scene have lost."""

    grains: list[WornPolygon | None]
    """None for a body that does not wear."""
    first: Ints
    """Where the corners of each body start among all, (n + 1,)."""
    pending: Floats
    """Area worn at every corner and not yet cut off, (m,) [m^2]."""
    volume: float = 0.0
    """All that has been worn, cut off or not [m^2]."""
    work: float = 0.0
    """All work of friction, at corners that wear and elsewhere [J]."""


def wear_start(scene: Scene) -> WearState:
    """The polygons of a scene as they are, nothing lost.  Raises `SceneError` in 3D."""
    if scene.dim != 2:
        raise SceneError(
            "only polygons wear in a run", where="wear",
            remedy="leave wear out in 3D; rigid_lcp.abrasion has the laws",
        )  # fmt: skip
    grains = [_unworn(body) for body in scene.bodies]
    return _state_of(grains, [_nothing(grain) for grain in grains])


def wear_after_break(state: WearState, scene: Scene, body: int) -> WearState:
    """The state of a scene in which ``body`` was broken and its second part added at the end.

    The parts are wear's new beginning; what the whole had not yet lost is dropped.
    """
    grains = list(state.grains)
    pending = _parts(state)
    grains[body], added = _unworn(scene.bodies[body]), _unworn(scene.bodies[-1])
    pending[body] = _nothing(grains[body])
    return _state_of([*grains, added], [*pending, _nothing(added)], state)


def _unworn(body: Body) -> WornPolygon | None:
    if not (body.movable and isinstance(body.shape, Polygon)):
        return None
    corners = body.shape.vertices
    nothing = np.zeros(len(corners))
    return WornPolygon(corners, nothing, corners, np.arange(len(corners)), nothing)


def _nothing(grain: WornPolygon | None) -> Floats:
    return np.zeros(0 if grain is None else len(grain.vertices))


def _parts(state: WearState) -> list[Floats]:
    """Pending wear body by body."""
    return np.split(state.pending, state.first[1:-1])


def _state_of(
    grains: list[WornPolygon | None], pending: list[Floats], before: WearState | None = None
) -> WearState:
    first = np.concatenate([[0], np.cumsum([len(part) for part in pending])]).astype(np.int64)
    made = WearState(grains, first, np.concatenate(pending))
    if before is not None:
        made.volume, made.work = before.volume, before.work
    return made


def corner_of_contacts(state: WearState, contacts: Contacts) -> Ints:
    """The corner that makes each contact, -1 where none that wears does, (nc,)."""
    face = contacts.key & ((1 << FACE_BITS) - 1)
    vertex = (contacts.key >> FACE_BITS) & ((1 << FACE_BITS) - 1)
    of_b = (contacts.radius_a > 0) & (contacts.radius_b == 0)  # a disc at a corner of b
    body = np.where(of_b, contacts.body_b, contacts.body_a)
    number = np.where(of_b, face, vertex)
    count = state.first[body + 1] - state.first[body]
    makes = (number < count) & ((contacts.radius_a == 0) | of_b)
    return np.where(makes, state.first[body] + number, -1)


def slip_work(contacts: ContactForces, before: Motion, after: Motion, h: float) -> Floats:
    """Work of friction at each contact in a step of ``h`` [s], (nc,) [J].

    With the mean of the velocities before and after: what the step's impulses take from the
    kinetic energy, and the slip of a step that is half drift with one, half with the other.
    """
    mean = Motion(
        0.5 * (before.position + after.position), before.angle,
        0.5 * (before.velocity + after.velocity), 0.5 * (before.spin + after.spin),
    )  # fmt: skip
    slip = relative_velocity(contacts, mean)
    force = np.einsum("cij,cj->ci", contact_frames(contacts.normal), contacts.force)
    return friction_work(force, slip, h)


def wear_step(
    state: WearState, wear: Wear, contacts: ContactForces, before: Motion, after: Motion, h: float
) -> None:
    """Add the wear of a step of ``h`` [s] between the states ``before`` and ``after``."""
    if len(contacts) == 0:
        return
    work = slip_work(contacts, before, after, h)
    corner = corner_of_contacts(state, contacts)
    made = corner >= 0
    volume = worn_volume(work[made], wear.coefficient)
    np.add.at(state.pending, corner[made], volume)
    state.volume += float(volume.sum())
    state.work += float(work.sum())


def contact_stiffness_worn(
    state: WearState, wear: Wear, contacts: Contacts, stiffness: float = 1.0
) -> Floats:
    """Stiffness of contacts at their worn corners, (nc,) [N/m], for `rigid_lcp.elastic_limit`.

    Contacts that no corner makes keep ``stiffness``, and so do all without ``volume_scale``.
    """
    corner = corner_of_contacts(state, contacts)
    k = np.full(len(contacts), float(stiffness))
    if wear.volume_scale is None or not (corner >= 0).any():
        return k
    worn = np.concatenate([grain.total for grain in state.grains if grain is not None])
    lost = np.where(corner >= 0, (worn + state.pending)[corner], 0.0)
    return worn_stiffness(k, lost, wear.volume_scale, wear.stiffness_left)


def chamfered(sharp: Floats, lost: Floats) -> tuple[Floats, Ints] | None:
    """A polygon (n, 2) with ``lost`` (n,) [m^2] cut off its corners, and each corner's owner.

    Each chamfer cuts the same length off both edges.  None where chamfers would meet on an edge,
    or take more than half of one.
    """
    back = np.roll(sharp, 1, axis=0) - sharp
    ahead = np.roll(sharp, -1, axis=0) - sharp
    length_back, length = np.linalg.norm(back, axis=1), np.linalg.norm(ahead, axis=1)
    back, ahead = back / length_back[:, None], ahead / length[:, None]
    cut = np.sqrt(2 * lost / np.abs(back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0]))
    if (cut > 0.49 * np.minimum(length, length_back)).any():
        return None
    ends = np.stack([sharp + cut[:, None] * back, sharp + cut[:, None] * ahead], axis=1)
    kept = np.column_stack([np.ones(len(sharp), bool), lost > 0]).ravel()
    owner = np.repeat(np.arange(len(sharp)), 2)
    return ends.reshape(-1, 2)[kept], owner[kept]


def polygon_worn(grain: WornPolygon, pending: Floats) -> WornPolygon | None:
    """The polygon with the ``pending`` wear (n,) [m^2] of its corners cut off too.

    None where all of it is too little to be cut yet.  Raises `ShapeError` where it is more than
    half of the grain.
    """
    size = float(np.linalg.norm(np.ptp(grain.sharp, axis=0)))
    least = (LEAST_CUT * size) ** 2
    if pending.max() < least:
        return None
    sharp, owner = grain.sharp, grain.owner
    lost = grain.lost + np.bincount(owner, pending, len(sharp))
    made = chamfered(sharp, lost)
    if made is None:  # wear on from the shape as it is now
        sharp, owner, lost = grain.vertices, np.arange(len(pending)), pending
        made = chamfered(sharp, lost)
    total = np.zeros(len(sharp))
    np.maximum.at(total, owner, grain.total)
    total += np.bincount(owner, pending, len(sharp))
    if made is None:  # corners with short edges go as a whole
        sharp, owner = corners_taken(sharp, pending)
        lost, total = np.zeros(len(sharp)), total[owner]
        made = sharp, np.arange(len(sharp))
    return WornPolygon(sharp, lost, made[0], made[1], total[made[1]])


def corners_taken(vertices: Floats, areas: Floats) -> tuple[Floats, Ints]:
    """A polygon (n, 2) that loses ``areas`` (n,) [m^2] at its corners by straight cuts of any size.

    Each cut is across the bisector of its corner, and takes neighbouring corners too where it must.
    The corners that remain, and for each the nearest of the old ones.  Raises `ShapeError` where
    that leaves no more than half of the polygon.
    """
    from scipy.optimize import brentq

    if areas.sum() > 0.5 * polygon_moments(vertices)[0]:
        raise ShapeError(
            f"{areas.sum():.3g} m^2 wore off a grain of {polygon_moments(vertices)[0]:.3g} m^2 "
            "between two cuts", where="wear",
            remedy="cut more often (every), or take a smaller coefficient",
        )  # fmt: skip
    left = vertices
    for k in np.argsort(-areas, kind="stable"):
        if areas[k] == 0:
            break
        corner = int(np.argmin(np.linalg.norm(left - vertices[k], axis=1)))
        sides = left[[corner - 1, (corner + 1) % len(left)]] - left[corner]
        across = -(sides / np.linalg.norm(sides, axis=1)[:, None]).sum(axis=0)
        across /= np.linalg.norm(across)
        depth = (left[corner] - left) @ across
        whole = polygon_moments(left)[0]

        def excess(
            t: float, left: Floats = left, across: Floats = across, corner: int = corner,
            wanted: float = whole - float(areas[k]),
        ) -> float:  # fmt: skip
            return polygon_moments(_clipped(left, (left - left[corner]) @ across + t))[0] - wanted

        t = float(brentq(excess, 0.0, 0.999 * float(depth.max()), xtol=1e-300, rtol=1e-15))
        left = _clipped(left, t - depth)
    edge = np.linalg.norm(np.roll(left, -1, axis=0) - left, axis=1)
    left = left[edge > LEAST_CUT * edge.max()]
    apart = np.linalg.norm(left[:, None] - vertices[None], axis=2)
    return left, np.argmin(apart, axis=1)


def _clipped(vertices: Floats, height: Floats) -> Floats:
    """The part of a convex polygon where ``height`` (n,), linear in place, is not positive."""
    kept = []
    for k in range(len(vertices)):
        following = (k + 1) % len(vertices)
        here, there = height[k], height[following]
        if here <= 0:
            kept.append(vertices[k])
        if here * there < 0:
            share = here / (here - there)
            kept.append((1 - share) * vertices[k] + share * vertices[following])
    return np.array(kept)


def scene_worn(scene: Scene, motion: Motion, state: WearState) -> tuple[Scene, WearState] | None:
    """The scene at ``motion`` with all pending wear cut off; None where there is none to cut.

    Grains keep the motion of the whole: velocity ``v + w x d`` where the centre of mass is now.
    Raises `ShapeError` as `polygon_worn` does.
    """
    from rigid_lcp.scene import Scene

    grains, bodies = list(state.grains), scene_at(scene, motion).bodies
    pending = _parts(state)
    changed = False
    for k in np.flatnonzero([part.any() for part in pending]):
        grain = state.grains[k]
        made = None if grain is None else polygon_worn(grain, pending[k])
        if grain is None or made is None:
            continue
        bodies[k] = _body_worn(bodies[k], grain, made)
        grains[k], pending[k], changed = made, np.zeros(len(made.vertices)), True
    if not changed:
        return None
    worn = Scene(scene.dim, scene.gravity)
    worn.bodies = bodies
    return worn, _state_of(grains, pending, state)


def _body_worn(body: Body, before: WornPolygon, after: WornPolygon) -> Body:
    shape = Polygon(after.vertices)
    mass, inertia = shape.mass_properties(body.mass / body.shape.area)
    angle, spin = float(body.angle[0]), float(body.spin[0])
    shift = shape.centroid - Polygon(before.vertices).centroid
    arm = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ shift
    return replace(
        body, shape=shape, mass=mass, inertia=inertia, position=body.position + arm,
        velocity=body.velocity + spin * np.array([-arm[1], arm[0]]),
    )  # fmt: skip
