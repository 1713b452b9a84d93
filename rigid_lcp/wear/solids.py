"""Wear of polyhedra in a run: which edges and corners rub, and the scene they are worn in.

The volume worn at a contact is shared alike by the edges and corners that make it: all of it goes
to the corner on a face, half to each of two crossing edges.  `rigid_lcp.wear.corners` says how
much, and `rigid_lcp.wear.polyhedra` how it is cut off.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.contact import FEATURE_BITS, MOST_EDGES, Contacts
from rigid_lcp.errors import ShapeError
from rigid_lcp.motion import Motion
from rigid_lcp.shapes import Polyhedron, rotate, rotate_back
from rigid_lcp.wear.fragmentation import scene_at
from rigid_lcp.wear.polyhedra import WornPolyhedron, place_plane, rub_edges, unworn, wear_polyhedron

if TYPE_CHECKING:
    from rigid_lcp.motion import Body, Scene

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass
class SolidWear:
    """What the edges and corners of all polyhedra of a scene have lost."""

    grains: list[WornPolyhedron | None]
    """None for a body that does not wear."""
    volume: float = 0.0
    """All that has been worn, cut off or not [m^3]."""
    work: float = 0.0
    """All work of friction, at features that wear and elsewhere [J]."""
    mass: float = 0.0
    """Mass cut off [kg]."""
    energy: float = 0.0
    """Kinetic and potential energy that went with it [J]."""

    @property
    def pending(self) -> Floats:
        """Volume worn on every plane and not yet cut off [m^3]."""
        return np.concatenate([np.zeros(0), *(g.pending for g in self.grains if g is not None)])


def start_solid_wear(scene: Scene) -> SolidWear:
    """The polyhedra of a scene as they are, nothing lost."""
    return SolidWear([_unworn(body) for body in scene.bodies])


def wear_solids_after_break(state: SolidWear, scene: Scene, body: int) -> SolidWear:
    """The state of a scene in which ``body`` was broken and its second part added at the end."""
    grains = list(state.grains)
    grains[body] = _unworn(scene.bodies[body])
    return replace(state, grains=[*grains, _unworn(scene.bodies[-1])])


def _unworn(body: Body) -> WornPolyhedron | None:
    return unworn(body.shape) if body.movable and isinstance(body.shape, Polyhedron) else None


def find_features(state: SolidWear, contacts: Contacts, row: int) -> Iterator[tuple[int, Ints]]:
    """Bodies and corners (one: a corner, two: an edge) of what wears at the contact ``row``."""
    a, b = int(contacts.body_a[row]), int(contacts.body_b[row])
    key = int(contacts.key[row])
    first, second = (key >> FEATURE_BITS) % (1 << FEATURE_BITS), key % (1 << FEATURE_BITS)
    grain_a, grain_b = state.grains[a], state.grains[b]
    if grain_a is not None:
        edge = first >= MOST_EDGES
        yield a, grain_a.shape.edges[first - MOST_EDGES, :2] if edge else np.array([first])
    if grain_b is None:
        return
    edges, faces = grain_b.shape.edges[:, :2], len(grain_b.shape.faces)
    if contacts.radius_a[row] > 0:  # a sphere: faces, then edges, then corners of b
        on_sphere = key % (1 << 2 * FEATURE_BITS) - faces
        if 0 <= on_sphere < len(edges):
            yield b, edges[on_sphere]
        elif on_sphere >= len(edges):
            yield b, np.array([on_sphere - len(edges)])
    elif second >= MOST_EDGES:
        yield b, edges[second - MOST_EDGES]
    elif contacts.radius_b[row] == 0:  # corner on corner: named after the faces
        yield b, np.array([second - faces])


def rub_solids(state: SolidWear, contacts: Contacts, volume: Floats) -> None:
    """Add what each contact wears, (nc,) [m^3], to the features that make it."""
    for row in np.flatnonzero(volume > 0):
        features = list(find_features(state, contacts, int(row)))
        for body, corners in features:
            grain = state.grains[body]
            if grain is not None:
                share = float(volume[row]) / len(features)
                state.grains[body] = rub_edges(grain, corners, share)
                state.volume += share


def volume_lost(state: SolidWear, contacts: Contacts) -> Floats:
    """All that the features of each contact have lost, the most worn one, (nc,) [m^3]."""
    lost = np.zeros(len(contacts))
    for row in range(len(contacts)):
        for body, corners in find_features(state, contacts, row):
            grain = state.grains[body]
            plane = None if grain is None else place_plane(grain, corners)
            if grain is not None and plane is not None:
                lost[row] = max(lost[row], grain.lost[plane] + grain.pending[plane])
    return lost


def replace_worn_solids(
    scene: Scene, motion: Motion, state: SolidWear
) -> tuple[Scene, SolidWear] | None:
    """The scene at ``motion`` with the pending wear cut off; None where there is none to cut.

    Grains keep the motion of the whole: velocity ``v + w x d`` where the centre of mass is now.
    Raises `ShapeError` as `wear_polyhedron` does.
    """
    worn = scene_at(scene, motion)
    made = replace(state, grains=list(state.grains))
    for k, grain in enumerate(state.grains):
        try:
            cut = None if grain is None else wear_polyhedron(grain)
        except ShapeError as error:
            raise error.at(f"wear of {scene.called(k)}") from error
        if cut is None:
            continue
        made.grains[k], shift = cut
        before = worn.bodies[k]
        worn.bodies[k] = after = _body_worn(before, cut[0].shape, shift)
        made.mass += before.mass - after.mass
        made.energy += energy_of(before, scene.gravity) - energy_of(after, scene.gravity)
    if all(new is old for new, old in zip(made.grains, state.grains, strict=True)):
        return None
    return worn, made


def _body_worn(body: Body, shape: Polyhedron, shift: Floats) -> Body:
    mass, inertia = shape.mass_properties(body.mass / body.shape.volume)
    arm = rotate(body.angle, shift)
    return replace(
        body, shape=shape, mass=mass, inertia=inertia, position=body.position + arm,
        velocity=body.velocity + np.cross(body.spin, arm),
    )  # fmt: skip


def energy_of(body: Body, gravity: Floats) -> float:
    """Kinetic and potential energy of a body [J]."""
    flat = len(body.position) == 2
    spin = body.spin if flat else rotate_back(body.angle, body.spin)
    kinetic = 0.5 * body.mass * body.velocity @ body.velocity
    kinetic += 0.5 * spin @ (body.inertia * np.eye(1) if flat else body.inertia) @ spin
    return float(kinetic - body.mass * np.asarray(gravity) @ body.position)
