"""Statically indeterminate scenes in the plane: a disc in a groove, a wedge, a beam, pyramids."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from rigid_lcp.arrays import Floats, Ints
from rigid_lcp.friction.problem.definition import BodySpace, FrictionProblem, make_problem

GRAVITY = 9.81
Feature = tuple[int, tuple[float, float], float]
"""Body, place in its frame [m], radius [m]."""
Face = tuple[int, tuple[float, float], tuple[float, float]]
"""Body, a place on the face in its frame [m], its outward normal."""


@dataclass(frozen=True)
class Grains:
    """Bodies at rest that touch without overlap, and all their contacts.

    A contact is a round feature of body a (a place in its frame and a radius, 0 for a corner)
    against a round feature of body b, or against a face of it.  Body n, after all others, is fixed.
    """

    centre: Floats
    """Centres of mass (n, 2) [m]; all angles are zero."""
    mass: Floats
    """(n,) [kg]"""
    inertia: Floats
    """(n,) [kg m^2]"""
    body_a: Ints
    body_b: Ints
    place_a: Floats
    """(nc, 2) [m], from the centre of a."""
    radius_a: Floats
    place_b: Floats
    """(nc, 2) [m], from the centre of b (in the world for the fixed body)."""
    radius_b: Floats
    face: Floats
    """Outward normal of b's face (nc, 2), zero where the feature is round."""
    gravity: Floats
    """(2,) [m/s^2]"""

    @property
    def weight(self) -> float:
        """Weight of all bodies [N]."""
        return float(np.linalg.norm(self.gravity) * self.mass.sum())

    def problem(self, friction: float) -> FrictionProblem:
        """The rigid problem (eqs 25, 26) of the same contacts at zero overlap."""
        count, n = len(self.body_a), len(self.mass)
        centre = np.vstack([self.centre, np.zeros((1, 2))])
        here, there = centre[self.body_a] + self.place_a, centre[self.body_b] + self.place_b
        between = here - there
        distance = np.linalg.norm(between, axis=1)
        round_b = ~self.face.any(axis=1)
        normal = self.face.copy()
        normal[round_b] = between[round_b] / distance[round_b, None]
        point = here - self.radius_a[:, None] * normal
        rows = np.zeros((2 * count, 3 * n))
        for c in range(count):
            for body, sign in ((self.body_a[c], 1.0), (self.body_b[c], -1.0)):
                if body == n:
                    continue
                x, y = point[c] - centre[body]
                (n0, n1), columns = normal[c], slice(3 * body, 3 * body + 3)
                rows[2 * c, columns] += sign * np.array([n0, n1, x * n1 - y * n0])
                rows[2 * c + 1, columns] += sign * np.array([-n1, n0, x * n0 + y * n1])
        inverse = np.column_stack([1 / self.mass, 1 / self.mass, 1 / self.inertia]).ravel()
        space = BodySpace(sp.csr_array(rows), sp.csr_array(sp.diags_array(inverse)), 3)
        fall = np.tile([*self.gravity, 0.0], n)
        return make_problem(space, rows @ fall, friction, 2)


def make_grains(
    centre: Floats, mass: Floats, inertia: Floats,
    contacts: Sequence[tuple[Feature, Feature | Face]], gravity: tuple[float, float],
) -> Grains:  # fmt: skip
    """Arrays of contacts: a round feature against another, or against a face."""
    first, second = [a for a, _ in contacts], [b for _, b in contacts]
    faces = [b[2] if isinstance(b[2], tuple) else (0.0, 0.0) for b in second]
    radii = [0.0 if isinstance(b[2], tuple) else b[2] for b in second]
    return Grains(
        np.asarray(centre, float), np.asarray(mass, float), np.asarray(inertia, float),
        np.array([a[0] for a in first]), np.array([b[0] for b in second]),
        np.array([a[1] for a in first], float), np.array([a[2] for a in first], float),
        np.array([b[1] for b in second], float), np.array(radii, float), np.array(faces, float),
        np.array(gravity, float),
    )  # fmt: skip


def build_groove(tilt: float = 0.35) -> Grains:
    """A disc of 2 kg and 1 m radius between two planes at right angles, gravity ``tilt`` [rad]
    from their bisector: 4 forces, 3 equations."""
    centre = np.array([[1.0, 1.0]])
    walls: list[Face] = [(1, (0.0, 0.0), (1.0, 0.0)), (1, (0.0, 0.0), (0.0, 1.0))]
    angle = -0.75 * np.pi + tilt
    pull = (GRAVITY * float(np.cos(angle)), GRAVITY * float(np.sin(angle)))
    disc: Feature = (0, (0.0, 0.0), 1.0)
    return make_grains(centre, np.array([2.0]), np.array([1.0]), [(disc, w) for w in walls], pull)


def build_wedge(half_angle: float = 0.5, shift: float = 0.1) -> Grains:
    """A triangle, apex down, flush with both walls of a V of ``half_angle`` [rad], its centre of
    mass ``shift`` [m] off the middle: two contacts a face, 8 forces (4 without friction), 3
    equations."""
    sine, cosine = float(np.sin(half_angle)), float(np.cos(half_angle))
    centre = np.array([[shift, 0.9]])
    contacts: list[tuple[Feature, Feature | Face]] = []
    for side in (-1.0, 1.0):
        wall: Face = (1, (0.0, 0.0), (-side * cosine, sine))
        for along in (0.3, 1.3):
            corner = (side * sine * along - shift, cosine * along - 0.9)
            contacts.append(((0, corner, 0.0), wall))
    return make_grains(centre, np.array([3.0]), np.array([0.4]), contacts, (0.0, -GRAVITY))


def build_beam(position: float = 0.3) -> Grains:
    """A beam of 10 kg on three round supports at -1, 0.2 and 1 m, its centre of mass at
    ``position`` [m]: 3 normal forces for 2 equations of balance; stops at both ends carry
    nothing."""
    centre = np.array([[position, 0.1]])
    under = (0, (0.0, -0.1), (0.0, -1.0))
    contacts: list[tuple[Feature, Feature | Face]] = [
        ((1, (x, -0.05), 0.05), under) for x in (-1.0, 0.2, 1.0)
    ]
    for side in (-1.0, 1.0):  # stops at both ends: without friction it would slide off
        end = (0, (side * 1.5 - position, 0.0), (side, 0.0))
        contacts.append(((1, (side * 1.55, 0.1), 0.05), end))
    return make_grains(centre, np.array([10.0]), np.array([30.0]), contacts, (0.0, -GRAVITY))


def build_pyramid(rows: int, walls: bool = False, seed: int = 1) -> Grains:
    """Rows of touching discs of 1 m radius and unequal mass on a floor, and ``walls`` beside the
    lowest row: without friction it would spread."""
    place = {(r, i): k for k, (r, i) in enumerate(
        (r, i) for r in range(rows) for i in range(rows - r))}  # fmt: skip
    centre = np.array([[2.0 * i + r, 1.0 + r * 3**0.5] for r, i in place])
    mass = np.random.default_rng(seed).uniform(0.5, 2.0, len(place))
    fixed = len(place)
    contacts: list[tuple[Feature, Feature | Face]] = []
    for (r, i), b in place.items():
        own: Feature = (b, (0.0, 0.0), 1.0)
        if r == 0:
            contacts.append((own, (fixed, (0.0, 0.0), (0.0, 1.0))))
        if r == 0 and walls and i == 0:
            contacts.append((own, (fixed, (-1.0, 0.0), (1.0, 0.0))))
        if r == 0 and walls and i == rows - 1:
            contacts.append((own, (fixed, (2.0 * rows - 1.0, 0.0), (-1.0, 0.0))))
        for near in ((r, i + 1), (r + 1, i), (r + 1, i - 1)):
            if near in place:
                contacts.append(((place[near], (0.0, 0.0), 1.0), own))
    return make_grains(centre, mass, 0.5 * mass, contacts, (0.0, -GRAVITY))


def renumber(grains: Grains, contact: Ints, body: Ints) -> Grains:
    """The same grains with contacts and bodies in another order."""
    number = np.append(np.argsort(body), len(body))
    return Grains(
        grains.centre[body], grains.mass[body], grains.inertia[body],
        number[grains.body_a][contact], number[grains.body_b][contact], grains.place_a[contact],
        grains.radius_a[contact], grains.place_b[contact], grains.radius_b[contact],
        grains.face[contact], grains.gravity,
    )  # fmt: skip
