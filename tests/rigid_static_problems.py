"""Small problems of grains at rest with more contact forces than equations of balance."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from rigid_lcp.friction.problem.definition import BodySpace, FrictionProblem, make_problem

GRAVITY = 9.81


def bodies_2d(contacts, centre, mass, inertia, load, friction) -> FrictionProblem:
    """Problem of contacts (a, b, point, normal) in 2D; load (n, 3) forces and torque."""
    jacobian = np.zeros((2 * len(contacts), 3 * len(mass)))
    for c, (a, b, point, normal) in enumerate(contacts):
        n = np.asarray(normal, float) / np.linalg.norm(normal)
        for body, sign in ((a, 1.0), (b, -1.0)):
            if body < 0:
                continue
            arm = np.asarray(point, float) - centre[body]
            for row, d in ((2 * c, n), (2 * c + 1, np.array([-n[1], n[0]]))):
                spin = arm[0] * d[1] - arm[1] * d[0]
                jacobian[row, 3 * body : 3 * body + 3] += sign * np.array([d[0], d[1], spin])
    inverse = np.column_stack([1 / mass, 1 / mass, 1 / inertia]).ravel()
    space = BodySpace(sp.csr_array(jacobian), sp.csr_array(sp.diags_array(inverse)), 3)
    return make_problem(space, jacobian @ (inverse * np.ravel(load)), friction, 2)


def weights(mass, across=0.0):
    return np.column_stack([across * mass, -GRAVITY * mass, 0 * mass])


def beam(position=0.3, friction=0.0) -> FrictionProblem:
    """A beam of 10 kg on supports at x = -1, 0.2, 1 m with its centre of mass at ``position``."""
    mass = np.array([10.0])
    contacts = [(0, -1, (x, 0.0), (0, 1)) for x in (-1.0, 0.2, 1.0)]
    return bodies_2d(contacts, np.array([[position, 0.1]]), mass, 3 * mass, weights(mass), friction)


def tower(n=10, top=1.0, friction=0.5) -> FrictionProblem:
    mass = np.append(np.ones(n - 1), top)
    contacts = [(i, i - 1, (x, i), (0, 1)) for i in range(n) for x in (-0.5, 0.5)]
    centre = np.column_stack([np.zeros(n), np.arange(n) + 0.5])
    return bodies_2d(contacts, centre, mass, mass / 6, weights(mass), friction)


def pyramid(rows, friction, contact_order=None, body_order=None, across=0.0, masses=1):
    """Rows of touching discs of diameter 1 m on a floor, unequal masses."""
    place = {}
    for r in range(rows):
        for i in range(rows - r):
            place[r, i] = len(place)
    centre = np.array([[i + 0.5 * r, 0.5 + r * np.sqrt(3) / 2] for r, i in place])
    mass = np.random.default_rng(masses).uniform(0.5, 2.0, len(place))
    order = np.arange(len(place)) if body_order is None else body_order
    number = np.argsort(order)
    contacts = []
    for (r, i), b in place.items():
        if r == 0:
            contacts.append((number[b], -1, centre[b] - [0, 0.5], (0, 1)))
        for step in ((0, 1), (1, 0), (1, -1)):
            a = place.get((r + step[0], i + step[1]))
            if a is not None:
                middle, between = (centre[a] + centre[b]) / 2, centre[a] - centre[b]
                contacts.append((number[a], number[b], middle, between))
    if contact_order is not None:
        contacts = [contacts[c] for c in contact_order]
    m = mass[order]
    return bodies_2d(contacts, centre[order], m, m / 8, weights(m, across), friction)


def table(load_at=(0.1, 0.2)) -> FrictionProblem:
    """A table of 4 kg in 3D on four legs at (+-1, +-1) m, centre of mass at ``load_at``."""
    rows = []
    for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        arm = np.array([x - load_at[0], y - load_at[1], -0.7])
        rows += [np.concatenate([d, np.cross(arm, d)]) for d in np.eye(3)[[2, 0, 1]]]
    inverse = np.diag([0.25] * 3 + [0.5, 0.7, 0.3])
    inverse[3, 4] = inverse[4, 3] = 0.1
    space = BodySpace(sp.csr_array(np.array(rows)), sp.csr_array(inverse), 6)
    fall = np.array([0, 0, -GRAVITY, 0, 0, 0])
    return make_problem(space, np.array(rows) @ fall, 0.6, 3)


def difference(a, b) -> float:
    return float(np.linalg.norm(a - b) / np.linalg.norm(b))
