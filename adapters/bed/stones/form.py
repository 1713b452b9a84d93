"""The form of a stone, and stones of one form as a bed has them: spheres, contacts, energies."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from adapters.bed import FloatArray, Neighbours, State, Walls, find_pairs
from adapters.bed.stones.solid import Solid, integrate_union


@dataclass(frozen=True)
class Form:
    """m spheres that keep their places, about the centre of mass along the principal axes.

    Lengths are in radii of the sphere of the stone's volume: the same form has stones of any size.
    """

    name: str
    place: FloatArray  # centres [-], shape (m, 3)
    radius: FloatArray  # radii [-], shape (m,)
    inertia: FloatArray  # principal moments over mass and squared radius [-], shape (3,)

    @property
    def reach(self) -> float:
        """Radius of a sphere about the centre of mass that holds all of the stone [-]."""
        return float((np.linalg.norm(self.place, axis=1) + self.radius).max())

    @property
    def least(self) -> float:
        """Radius of the smallest sphere [-], by which the time step is judged."""
        return float(self.radius.min())

    @property
    def usual(self) -> float:
        """Median radius of the spheres [-], by which overlaps are judged."""
        return float(np.median(self.radius))


SPHERE = Form("sphere", np.zeros((1, 3)), np.ones(1), np.full(3, 0.4))
"""The form of grains that are spheres: these alone need no orientation."""


def make_form(name: str, place: FloatArray, radius: FloatArray, solid: Solid | None = None) -> Form:
    """The form of spheres with centres (m, 3) and radii (m,) in any unit of length.

    Mass and inertia are those of ``solid``, in the same place and unit, or of the spheres' union.
    """
    solid = solid or integrate_union(place, radius)
    moments, axes = np.linalg.eigh(solid.inertia)
    axes[:, 0] *= np.linalg.det(axes)  # right-handed
    size, own = solid.radius, (place - solid.centre) @ axes
    return Form(name, own / size, radius / size, moments / (solid.volume * size**2))


def turn_by(orientation: FloatArray) -> Rotation:
    """Rotations of quaternions with the real part first, shape (n, 4)."""
    return Rotation.from_quat(np.roll(orientation, -1, axis=-1))


def find_rotation(start: FloatArray, end: FloatArray) -> FloatArray:
    """Rotation vectors from one orientation to another, shape (n, 4) each, as (n, 3) [rad]."""
    return np.asarray((turn_by(end) * turn_by(start).inv()).as_rotvec())


def turn_stones(state: State, vector: FloatArray) -> State:
    """Stones turned about their centres by rotation vectors (n, 3) [rad]."""
    assert state.orientation is not None
    turned = Rotation.from_rotvec(vector) * turn_by(state.orientation)
    return replace(state, orientation=np.roll(turned.as_quat(), 1, axis=1))


def spread_spheres(form: Form, state: State) -> tuple[FloatArray, FloatArray]:
    """Centres (n m, 3) and radii (n m,) [m] of the spheres of n grains, m behind one another."""
    if state.orientation is None:
        return state.position, state.radius
    matrix = turn_by(state.orientation).as_matrix()
    turned = state.radius[:, None, None] * (form.place @ matrix.transpose(0, 2, 1))
    centre = (state.position[:, None] + turned).reshape(-1, 3)
    return centre, np.outer(state.radius, form.radius).ravel()


def find_touching(form: Form, state: State, walls: Walls) -> Neighbours:
    """Contacts of spheres of different grains, and of spheres with walls: `spread_spheres`."""
    rows, count = find_pairs(*spread_spheres(form, state), walls), len(form.radius)
    other = (rows.second < 0) | (rows.first // count != rows.second // count)
    return Neighbours(*(column[other] for column in vars(rows).values()))


def find_kinetic_energies(form: Form, state: State) -> tuple[float, float]:
    """Translational and rotational kinetic energy of a bed [J]."""
    spin = state.spin
    if state.orientation is not None:
        spin = turn_by(state.orientation).inv().apply(spin)
    translational = 0.5 * float(state.mass @ (state.velocity**2).sum(axis=1))
    return translational, 0.5 * float(state.mass * state.radius**2 @ (spin**2 @ form.inertia))
