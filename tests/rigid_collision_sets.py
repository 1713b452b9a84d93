"""Bodies that collide, given by J and M^-1 alone, with their closed forms: tests share them."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from rigid_lcp import BodySpace
from rigid_lcp.arrays import Floats


def contact_rows(normal: Floats, arm: Floats) -> Floats:
    """Rows n, t of J for one body: ``n . (v + w x arm)``, t a quarter turn from n."""
    tangent = np.array([-normal[1], normal[0]])
    return np.array([[d[0], d[1], arm[0] * d[1] - arm[1] * d[0]] for d in (normal, tangent)])


def cradle(balls: int) -> BodySpace:
    """Equal balls of mass 1 in a row that touch; n along the row."""
    jacobian = np.zeros((2 * (balls - 1), 3 * balls))
    for c in range(balls - 1):
        for ball, sign, arm in ((c + 1, 1.0, -0.5), (c, -1.0, 0.5)):
            rows = contact_rows(np.array([1.0, 0.0]), np.array([arm, 0.0]))
            jacobian[2 * c : 2 * c + 2, 3 * ball : 3 * ball + 3] = sign * rows
    inverse = np.ones(3 * balls)
    inverse[2::3] = 10.0
    return BodySpace(sp.csr_array(jacobian), sp.csr_array(sp.diags_array(inverse)), 3)


def cradle_answer(balls: int, moving: int) -> Floats:
    """Velocities after ``moving`` balls came with 1 and all collide at once, without loss.

    Those that came leave alike and so do the others: momentum and energy give ``1 - 2 (n-k)/n`` and
    ``2 k/n``.
    """
    left = 1.0 - 2.0 * (balls - moving) / balls
    return np.array([left] * moving + [2.0 * moving / balls] * (balls - moving))


def one_body(contacts: list[tuple[list[float], list[float]]], inertia: float) -> BodySpace:
    """A body of mass 1 on fixed walls: normals and arms of its contacts."""
    rows = [contact_rows(np.array(n), np.array(arm)) for n, arm in contacts]
    inverse = sp.diags_array([1.0, 1.0, 1.0 / inertia])
    return BodySpace(sp.csr_array(np.vstack(rows)), sp.csr_array(inverse), 3)


def kinetic_energy(bodies: BodySpace, velocity: Floats) -> float:
    """``v M v / 2`` [J] of all bodies; freedoms of infinite mass (M^-1 = 0) have none."""
    inverse = bodies.inverse_mass.toarray()
    moves = np.flatnonzero(inverse.any(axis=1))
    v = velocity[moves]
    return 0.5 * float(v @ np.linalg.solve(inverse[np.ix_(moves, moves)], v))


def random_collision(generator: np.random.Generator) -> tuple[BodySpace, Floats, Floats, Floats]:
    """Some free bodies and a wall with contacts anywhere on them: J and M^-1, v, eps, mu.

    Nothing but Newton's third law holds for the contacts: arms, normals, masses of a factor of
    1e3, eps up to 1 and mu up to 1.5 are drawn, each contact its own.
    """
    bodies = int(generator.integers(1, 7))
    count = int(generator.integers(1, 3 * bodies + 1))
    jacobian = np.zeros((2 * count, 3 * bodies))
    for c in range(count):
        angle = generator.uniform(0, 2 * np.pi)
        normal = np.array([np.cos(angle), np.sin(angle)])
        a, b = generator.integers(0, bodies), generator.integers(-1, bodies)
        for body, sign in ((a, 1.0), (b, -1.0)):
            if body >= 0 and (sign > 0 or body != a):
                rows = contact_rows(normal, generator.uniform(-1, 1, 2))
                jacobian[2 * c : 2 * c + 2, 3 * body : 3 * body + 3] = sign * rows
    inverse = np.repeat(10 ** generator.uniform(-1.5, 1.5, bodies), 3)
    inverse[2::3] *= generator.uniform(2.0, 12.0, bodies)
    space = BodySpace(sp.csr_array(jacobian), sp.csr_array(sp.diags_array(inverse)), 3)
    velocity = generator.normal(size=3 * bodies)
    return space, velocity, generator.uniform(0, 1, count), generator.uniform(0, 1.5, count)
