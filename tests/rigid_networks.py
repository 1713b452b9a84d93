"""Small friction problems for tests: contact networks of grains, towers, and stored real ones."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.spatial import Delaunay

from rigid_lcp.arrays import Floats
from rigid_lcp.friction.problem.definition import BodySpace, FrictionProblem, make_problem
from tests.rigid_collision_sets import contact_rows
from validation.bench.rigid import packings
from validation.bench.rigid.friction_problems import read_problem

GRAVITY, STEP = 9.81, 1e-3


def network_bodies(grains: int, seed: int) -> tuple[BodySpace, Floats]:
    """Grains at random places that touch their neighbours at points between them, on fixed ones.

    Returns J and M^-1, and velocities after a time step of free fall and some shaking.  So many
    neighbours are kept as contacts that the network is hyperstatic.
    """
    g = np.random.default_rng(seed)
    side = int(np.ceil(np.sqrt(grains)))
    grid = np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1).reshape(-1, 2)[:grains]
    place = grid + g.uniform(-0.3, 0.3, (grains, 2))
    place[:, 0] += 0.5 * (np.arange(grains) // side % 2)
    triangles = Delaunay(place).simplices
    pairs = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [0, 2]]])
    pairs = np.unique(np.sort(pairs, axis=1), axis=0)
    pairs = pairs[np.linalg.norm(place[pairs[:, 0]] - place[pairs[:, 1]], axis=1) < 1.8]
    pairs = pairs[g.random(len(pairs)) < 0.62]
    fixed = np.arange(grains) < side
    pairs = pairs[~(fixed[pairs].all(axis=1))]
    jacobian = np.zeros((2 * len(pairs), 3 * grains))
    for c, (a, b) in enumerate(pairs):
        normal = (place[a] - place[b]) / np.linalg.norm(place[a] - place[b])
        point = 0.5 * (place[a] + place[b])
        for body, sign in ((a, 1.0), (b, -1.0)):
            if not fixed[body]:
                rows = contact_rows(normal, point - place[body])
                jacobian[2 * c : 2 * c + 2, 3 * body : 3 * body + 3] = sign * rows
    mass = g.uniform(1.0, 4.0, grains)
    inverse = np.repeat(1.0 / mass, 3)
    inverse[2::3] *= 8.0  # discs of radius 1/2
    velocity = 5e-4 * g.normal(size=3 * grains)
    velocity[1::3] -= GRAVITY * STEP
    bodies = BodySpace(sp.csr_array(jacobian), sp.csr_array(sp.diags_array(inverse)), 3)
    return bodies, velocity


def network(grains: int, mu: float, seed: int = 0) -> FrictionProblem:
    """The friction problem of `network_bodies`, with W as a matrix."""
    bodies, velocity = network_bodies(grains, seed)
    return make_problem(bodies.matrix, bodies.jacobian @ velocity, mu, 2)


def random_bodies(pairs, bodies, dim, generator, full=False) -> BodySpace:
    """Contacts in random directions between such pairs of bodies (-1: the ground), whose masses are
    random: one a body, or ``full`` matrices."""
    size = 3 * dim - 3
    jacobian = np.zeros((len(pairs) * dim, bodies * size))
    for c, pair in enumerate(pairs):
        for body in pair:
            if body >= 0:
                block = generator.normal(size=(dim, size))
                jacobian[c * dim : (c + 1) * dim, body * size : (body + 1) * size] = block
    inverse = sp.diags_array(np.repeat(1.0 / generator.uniform(1.0, 3.0, bodies), size))
    if full:
        roots = generator.normal(size=(bodies, size, size))
        inverse = sp.block_diag([root @ root.T + np.eye(size) for root in roots])
    return BodySpace(sp.csr_array(jacobian), sp.csr_array(inverse), size)


def random_pairs(contacts, bodies, generator):
    """Two of so many bodies and the ground, which is -1, for each contact."""
    return [generator.choice(bodies + 1, 2, replace=False) - 1 for _ in range(contacts)]


def tower(boxes: int, mu: float, top: float = 1.0) -> FrictionProblem:
    """A tower under gravity for a step, at rest before, by W alone."""
    made = packings.build_tower(boxes, 2, top_mass=top, friction=mu, step=STEP)
    return make_problem(made.delassus, made.offset, mu, 2)


def stack_on_slope(masses, slope=0.0, friction=0.5, dim=2, step=STEP) -> FrictionProblem:
    """Boxes of such masses [kg] upon each other that fall along a floor of such a slope [rad]."""
    bodies = packings.build_tower(len(masses), dim, friction=friction).bodies
    assert bodies is not None
    size = bodies.body_size
    inverse = bodies.inverse_mass.diagonal() / np.repeat(masses, size)
    space = BodySpace(bodies.jacobian, sp.csr_array(sp.diags_array(inverse)), size)
    fall = np.zeros(space.jacobian.shape[1])
    fall[dim - 1 :: size] = -GRAVITY * step * np.cos(slope)
    fall[::size] = GRAVITY * step * np.sin(slope)
    return make_problem(space, space.jacobian @ fall, friction, dim)


def stored(name: str, mu: float | None = None) -> FrictionProblem:
    """A real problem from the folder ``TRACKBED_DATA`` names; skips where it is not set."""
    home = os.environ.get("TRACKBED_DATA", "")
    path = Path(home) / "friction_problems" / f"{name}.npz"
    if not home or not path.exists():
        pytest.skip("TRACKBED_DATA does not name a folder with friction_problems/" + name)
    made = read_problem(path)
    return made if mu is None else replace(made, friction=np.full(made.contacts, mu))
