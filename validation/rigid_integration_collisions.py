"""Collisions of section 7 apart from any motion: closed forms, and energy in random sets of them.

Bodies are given by J and M^-1 alone; tests share them.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from math import isfinite

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from rigid_lcp.collision_input import Law
from rigid_lcp.collisions import collide
from rigid_lcp.friction_problem import BodySpace
from validation.rigid_hard_trials import Row

Floats = NDArray[np.float64]
ROUND_OFF = 1e-12
LAW = "eqs 33 to 36"


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


def random_collision(
    generator: np.random.Generator,
) -> tuple[BodySpace, Floats, Floats, Floats]:
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


def law_row(case: str, answer: str, measure: str, value: float, bar: float, start: float) -> Row:
    """A row of the law itself; ``start``: processor time when it began [s]."""
    return Row(
        case, answer, LAW, measure, value, f"<= {bar:.0e}", value <= bar, "",
        time.process_time() - start, 1, "" if isfinite(value) else "not solved",
    )  # fmt: skip


def closed_form_rows() -> Iterator[Row]:
    """Cradles, a ball in a corner of two walls of their own eps, a box on its corner and flat."""
    for balls, moving in ((2, 1), (3, 1), (5, 1), (5, 2)):
        start = time.process_time()
        velocity = np.zeros(3 * balls)
        velocity[: 3 * moving : 3] = 1.0
        found = collide(cradle(balls), velocity, 1.0)
        off = float(np.abs(found.velocity[::3] - cradle_answer(balls, moving)).max())
        yield law_row(
            f"cradle of {balls} that touch, {moving} in", "all at once: 1 - 2 (n-k)/n and 2 k/n",
            "velocities off", off, ROUND_OFF, start,
        )  # fmt: skip
    start = time.process_time()
    corner = one_body([([1.0, 0.0], [-0.5, 0.0]), ([0.0, 1.0], [0.0, -0.5])], 0.1)
    found = collide(corner, [-2.0, -3.0, 0.0], [0.3, 0.8])
    off = float(np.abs(found.velocity - [0.6, 2.4, 0.0]).max())
    yield law_row(
        "ball into a corner, walls of e = 0.3 and 0.8", "each wall by its own e: (e1 v1, e2 v2)",
        "velocities off", off, ROUND_OFF, start,
    )  # fmt: skip
    for eps in (0.0, 0.5, 1.0):
        start = time.process_time()
        arm, inertia = 0.3, 1.0 / 6.0
        found = collide(one_body([([0.0, 1.0], [arm, -0.5])], inertia), [0.0, -2.0, 0.0], eps)
        push = 2.0 * (1 + eps) / (1 + arm**2 / inertia)
        off = float(np.abs(found.velocity - [0.0, push - 2.0, arm * push / inertia]).max())
        yield law_row(
            f"box lands on its corner, e = {eps:g}", "impulse (1 + e) v / (1/m + x²/J)",
            "velocities off", off, ROUND_OFF, start,
        )  # fmt: skip


def energy_rows(count: int, seed: int = 1) -> Iterator[Row]:
    """Greatest gain of energy in random collisions, over the energy before; `random_collision`."""
    cases: tuple[tuple[str, Law, bool, bool], ...] = (
        ("friction, e of each contact, law moreau", "moreau", True, True),
        ("friction, e of each contact, law newton", "newton", True, True),
        ("friction, e of each contact, newton, unwatched", "newton", True, False),
        ("no friction, e = 1", "newton", False, True),
    )
    for words, law, rough, safe in cases:
        generator, worst = np.random.default_rng(seed), -np.inf
        scaled, failed, cut = 0, 0, 0
        start = time.process_time()
        for _ in range(count):
            bodies, velocity, eps, mu = random_collision(generator)
            found = collide(
                bodies, velocity, eps if rough else 1.0, mu if rough else 0.0, law=law,
                energy="safe" if safe else "watched",
            )  # fmt: skip
            before = kinetic_energy(bodies, velocity)
            change = kinetic_energy(bodies, found.velocity) / before - 1
            worst = max(worst, change if rough else abs(change))
            scaled += found.restitution_scale < 1.0
            failed += not found.solved
            cut += "without restitution" in found.message
        made = law_row(
            f"{count} random collisions: {words}",
            "energy never grows" if rough else "energy is kept",
            "greatest gain" if rough else "greatest change", worst,
            ROUND_OFF if safe else np.inf, start,
        )  # fmt: skip
        counts = {"e scaled down": scaled, "not solved": failed, "cut after their rounds": cut}
        why = "; ".join(f"{number} {what}" for what, number in counts.items() if number)
        yield replace(made, why=why, steps=count, ok=made.ok and (not failed or not safe))
