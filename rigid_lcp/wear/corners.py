"""Wear in a run: friction takes corners and edges off grains (Archard, Reye; section 8).

The work at a contact, ``-f_T . s`` over the slip s, belongs to the corner that makes the contact
(the vertex of body a, or the corner of b that a disc touches); a corner loses ``V = k W``
(`rigid_lcp.wear.abrasion`).  What is lost is kept for every corner and cut off now and then: each
corner of the polygon as it was first is replaced by a chamfer of all that it has lost, so shapes
only shrink, chamfers grow parallel to themselves, and nothing can overlap.  Where a chamfer meets
its neighbour or takes half of an edge, the worn shape becomes the one to wear from.

In space edges rub too, and chamfers are plane cuts (`rigid_lcp.wear.solids`).

What stays goes on as part of the rigid motion of the whole; what is worn off takes its momentum
and energy away.  Faces, discs, spheres, half-spaces and fixed bodies keep their shape.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from sys import float_info
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.contact import FACE_BITS, ContactForces, Contacts, contact_frames
from rigid_lcp.errors import ShapeError
from rigid_lcp.motion import Motion, relative_velocity, require_number_in, require_whole_in
from rigid_lcp.shapes import Polygon
from rigid_lcp.wear.abrasion import friction_work, worn_stiffness, worn_volume
from rigid_lcp.wear.fragmentation import scene_at
from rigid_lcp.wear.polygons import WornPolygon, wear_polygon
from rigid_lcp.wear.solids import (
    SolidWear,
    energy_of,
    replace_worn_solids,
    rub_solids,
    start_solid_wear,
    volume_lost,
    wear_solids_after_break,
)

if TYPE_CHECKING:
    from rigid_lcp.motion import Body, Scene

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Wear:
    """How grains wear in a run."""

    coefficient: float
    """k of ``V = k W`` [m^3/J], in 2D [m^2 per J/m], the same number (Reye 1860, Archard 1953)."""
    every: int = 20
    """Steps between cuts."""
    volume_scale: float | None = None
    """V_0 of `abrasion.worn_stiffness` [m^3, m^2 in 2D]; None: stiffness does not change.
    """
    stiffness_left: float = 0.1
    """Share of the stiffness that stays at a worn corner [-]."""

    def __post_init__(self) -> None:
        require_number_in(
            self.coefficient, 0.0, float_info.max, "the wear coefficient", "wear",
            "give zero or more, in m^3/J (1e-15 to 1e-12 for rock)",
        )  # fmt: skip
        require_whole_in(self.every, 1, "every", "wear", "give 1 or more steps between cuts")
        worn_stiffness(1.0, 0.0, self.volume_scale or 1.0, self.stiffness_left)


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
    mass: float = 0.0
    """Mass cut off [kg]."""
    energy: float = 0.0
    """Kinetic and potential energy that went with it [J]."""


def start_wear(scene: Scene) -> WearState | SolidWear:
    """The polygons, or polyhedra, of a scene as they are, nothing lost."""
    if scene.dim == 3:
        return start_solid_wear(scene)
    grains = [_unworn(body) for body in scene.bodies]
    return _state_of(grains, [_nothing(grain) for grain in grains])


def wear_on_after_break(
    state: WearState | SolidWear, scene: Scene, body: int
) -> WearState | SolidWear:
    """The state of a scene in which ``body`` was broken and its second part added at the end.

    The parts are wear's new beginning; what the whole had not yet lost is dropped.
    """
    if isinstance(state, SolidWear):
        return wear_solids_after_break(state, scene, body)
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
        made.mass, made.energy = before.mass, before.energy
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


def find_slip_work(contacts: ContactForces, before: Motion, after: Motion, h: float) -> Floats:
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


def step_wear(
    state: WearState | SolidWear, wear: Wear, contacts: ContactForces, before: Motion,
    after: Motion, h: float,
) -> None:  # fmt: skip
    """Add the wear of a step of ``h`` [s] between the states ``before`` and ``after``."""
    if len(contacts) == 0:
        return
    work = find_slip_work(contacts, before, after, h)
    if isinstance(state, SolidWear):
        state.work += float(work.sum())
        rub_solids(state, contacts, worn_volume(work, wear.coefficient))
        return
    corner = corner_of_contacts(state, contacts)
    made = corner >= 0
    volume = worn_volume(work[made], wear.coefficient)
    np.add.at(state.pending, corner[made], volume)
    state.volume += float(volume.sum())
    state.work += float(work.sum())


def contact_stiffness_worn(
    state: WearState | SolidWear, wear: Wear, contacts: Contacts, stiffness: float = 1.0
) -> Floats:
    """Stiffness of contacts at their worn corners, (nc,) [N/m], for
    `rigid_lcp.unique.elastic_limit`.

    Contacts that no corner makes keep ``stiffness``, and so do all without ``volume_scale``.
    """
    if isinstance(state, SolidWear):
        whole = np.full(len(contacts), float(stiffness))
        if wear.volume_scale is None:
            return whole
        lost = volume_lost(state, contacts)
        return worn_stiffness(whole, lost, wear.volume_scale, wear.stiffness_left)
    corner = corner_of_contacts(state, contacts)
    k = np.full(len(contacts), float(stiffness))
    if wear.volume_scale is None or not (corner >= 0).any():
        return k
    worn = np.concatenate([grain.total for grain in state.grains if grain is not None])
    lost = np.where(corner >= 0, (worn + state.pending)[corner], 0.0)
    return worn_stiffness(k, lost, wear.volume_scale, wear.stiffness_left)


def replace_worn(
    scene: Scene, motion: Motion, state: WearState | SolidWear
) -> tuple[Scene, WearState | SolidWear] | None:
    """The scene at ``motion`` with all pending wear cut off; None where there is none to cut.

    Grains keep the motion of the whole: velocity ``v + w x d`` where the centre of mass is now.
    Raises `ShapeError` as `wear_polygon` and `wear_polyhedron` do.
    """
    if isinstance(state, SolidWear):
        return replace_worn_solids(scene, motion, state)
    from rigid_lcp.motion import Scene

    grains, bodies = list(state.grains), scene_at(scene, motion).bodies
    pending = _parts(state)
    mass, energy = state.mass, state.energy
    changed = False
    for k in np.flatnonzero([part.any() for part in pending]):
        grain = state.grains[k]
        try:
            made = None if grain is None else wear_polygon(grain, pending[k])
        except ShapeError as error:
            raise error.at(f"wear of {scene.called(int(k))}") from error
        if grain is None or made is None:
            continue
        grains[k], pending[k] = made
        after, changed = _body_worn(bodies[k], grain, made[0]), True
        mass += bodies[k].mass - after.mass
        energy += energy_of(bodies[k], scene.gravity) - energy_of(after, scene.gravity)
        bodies[k] = after
    if not changed:
        return None
    worn = Scene(scene.dim, scene.gravity)
    worn.bodies = bodies
    result = _state_of(grains, pending, state)
    result.mass, result.energy = mass, energy
    return worn, result


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
