"""Abrasion in a run: friction takes corners and edges off grains (section 8).

Archard (J. Appl. Phys. 24 (1953) 981): volume worn per length of sliding is ``K F_N / H``.  With
``F_T = mu F_N`` it is a volume per work of friction, ``V = k W`` with ``k = K / (mu H)``
(Reye 1860).  The work ``-f_T . s`` over the slip s at a contact is shared alike by the corners and
edges that make it: all of it goes to a corner on a face, half to each of two crossing edges.  What
they lose is kept, and cut off now and then (`rigid_lcp.wear.cuts`).

What stays goes on as part of the rigid motion of the whole; what is worn off takes its momentum
and energy away.  Faces, discs, spheres, half-spaces and fixed bodies keep their shape.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from sys import float_info

import numpy as np

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.contact import FEATURE_BITS, MOST_EDGES, ContactForces, Contacts, build_frames
from rigid_lcp.errors import ShapeError
from rigid_lcp.motion import (
    Body,
    Motion,
    Scene,
    find_relative_velocity,
    require_number_in,
    require_whole_in,
)
from rigid_lcp.shapes import Polygon, Polyhedron, rotate_back
from rigid_lcp.wear.cuts import WornShape, make_unworn, rub_corners, wear_shape
from rigid_lcp.wear.fragmentation import make_part, restart_scene


@dataclass(frozen=True)
class Wear:
    """How grains wear in a run."""

    coefficient: float
    """k of ``V = k W`` [m^3/J], in 2D [m^2 per J/m], the same number (Reye 1860, Archard 1953)."""
    every: int = 20
    """Steps between cuts."""

    def __post_init__(self) -> None:
        require_number_in(
            self.coefficient, 0.0, float_info.max, "the wear coefficient", "wear",
            "give zero or more, in m^3/J (1e-15 to 1e-12 for rock)",
        )  # fmt: skip
        require_whole_in(self.every, 1, "every", "wear", "give 1 or more steps between cuts")


@dataclass
class WearState:
    """What the corners and edges of all grains of a scene have lost; volumes are areas in 2D."""

    grains: list[WornShape | None]  # None for a body that does not wear
    volume: float = 0.0  # all that has been worn, cut off or not [m^3]
    work: float = 0.0  # all work of friction, at features that wear and elsewhere [J]
    mass: float = 0.0  # mass cut off [kg]
    energy: float = 0.0  # kinetic and potential energy that went with it [J]

    @property
    def pending(self) -> Floats:
        """Volume worn on every plane and not yet cut off [m^3]."""
        return np.concatenate([np.zeros(0), *(g.pending for g in self.grains if g is not None)])


def start_wear(scene: Scene) -> WearState:
    """The grains of a scene as they are, nothing lost."""
    return WearState([_make_unworn(body) for body in scene.bodies])


def split_wear(state: WearState, scene: Scene, body: int) -> WearState:
    """The state of a scene in which ``body`` was broken and its second part added at the end.

    The parts are wear's new beginning; what the whole had not yet lost is dropped.
    """
    grains = list(state.grains)
    grains[body] = _make_unworn(scene.bodies[body])
    return replace(state, grains=[*grains, _make_unworn(scene.bodies[-1])])


def _make_unworn(body: Body) -> WornShape | None:
    wears = body.movable and isinstance(body.shape, Polygon | Polyhedron)
    return make_unworn(body.shape) if wears else None


def find_features(state: WearState, contacts: Contacts, row: int) -> Iterator[tuple[int, Ints]]:
    """Bodies and corners (one: a corner, two: an edge) of what wears at the contact ``row``."""
    a, b = int(contacts.body_a[row]), int(contacts.body_b[row])
    key = int(contacts.key[row])
    first, second = (key >> FEATURE_BITS) % (1 << FEATURE_BITS), key % (1 << FEATURE_BITS)
    grain_a, grain_b = state.grains[a], state.grains[b]
    at_corner = contacts.radius_b[row] == 0
    if contacts.dim == 2:
        if grain_a is not None:
            yield a, np.array([first])
        elif grain_b is not None and at_corner:  # a disc at a corner of b
            yield b, np.array([second])
        return
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
    elif at_corner:  # corner on corner: named after the faces
        yield b, np.array([second - faces])


def find_slip_work(contacts: ContactForces, before: Motion, after: Motion, h: float) -> Floats:
    """Work of friction at each contact in a step of ``h`` [s], (nc,) [J], never below zero.

    With the mean of the velocities before and after: what the step's impulses take from the
    kinetic energy, and the slip of a step that is half drift with one, half with the other.
    """
    mean = Motion(
        0.5 * (before.position + after.position), before.angle,
        0.5 * (before.velocity + after.velocity), 0.5 * (before.spin + after.spin),
    )  # fmt: skip
    slip = find_relative_velocity(contacts, mean)
    force = np.einsum("cij,cj->ci", build_frames(contacts.normal), contacts.force)
    return np.maximum(-(force[:, 1:] * slip[:, 1:]).sum(axis=1), 0.0) * h


def step_wear(
    state: WearState, wear: Wear, contacts: ContactForces, before: Motion, after: Motion, h: float
) -> None:
    """Add the wear of a step of ``h`` [s] between the states ``before`` and ``after``."""
    if len(contacts) == 0:
        return
    work = find_slip_work(contacts, before, after, h)
    state.work += float(work.sum())
    rub_grains(state, contacts, wear.coefficient * work)


def rub_grains(state: WearState, contacts: Contacts, volume: Floats) -> None:
    """Add what each contact wears, (nc,) [m^3], to the features that make it."""
    for row in np.flatnonzero(volume > 0):
        features = list(find_features(state, contacts, int(row)))
        for body, corners in features:
            grain = state.grains[body]
            if grain is not None:
                share = float(volume[row]) / len(features)
                state.grains[body] = rub_corners(grain, corners, share)
                state.volume += share


def swap_worn(scene: Scene, motion: Motion, state: WearState) -> tuple[Scene, WearState] | None:
    """The scene at ``motion`` with the pending wear cut off; None where there is none to cut.

    Grains keep the motion of the whole: velocity ``v + w x d`` where the centre of mass is now.
    Raises `ShapeError` as `wear_shape` does.
    """
    worn = restart_scene(scene, motion)
    made = replace(state, grains=list(state.grains))
    for k, grain in enumerate(state.grains):
        try:
            cut = None if grain is None else wear_shape(grain)
        except ShapeError as error:
            raise error.relocate(f"wear of {scene.name_body(k)}") from error
        if cut is None:
            continue
        made.grains[k], way = cut
        before = worn.bodies[k]
        worn.bodies[k] = after = make_part(before, cut[0].shape, way)
        made.mass += before.mass - after.mass
        made.energy += find_energy(before, scene.gravity) - find_energy(after, scene.gravity)
    if all(new is old for new, old in zip(made.grains, state.grains, strict=True)):
        return None
    return worn, made


def find_energy(body: Body, gravity: Floats) -> float:
    """Kinetic and potential energy of a body [J]."""
    spin = rotate_back(body.angle, body.spin) if len(body.spin) == 3 else body.spin
    inertia = np.reshape(body.inertia, (len(spin), len(spin)))
    kinetic = 0.5 * body.mass * body.velocity @ body.velocity + 0.5 * spin @ inertia @ spin
    return float(kinetic - body.mass * np.asarray(gravity) @ body.position)
