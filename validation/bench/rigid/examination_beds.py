"""Beds and crystals of the examination under many loads: at rest, kicked, tilted.

Loads are velocities of the bodies before the step, so that q stays in the image of J and a solution
exists.  Their unit is g h, what a step of h adds to a free fall.  Only a generator of random
numbers decides, and the number of the problem in its family, which takes the kinds by turns.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rigid_lcp.friction.problem.definition import BodySpace, FrictionProblem
from validation.bench.rigid.friction_problems import GRAINS
from validation.bench.rigid.packings import (
    GRAVITY,
    RADII,
    TOUCH,
    Bed,
    build_crystal,
    fall_freely,
    pose_bed,
    pour_radii,
    update_pairs,
)

Floats = NDArray[np.float64]
Generator = np.random.Generator

STEP = 1e-3
"""Time step h [s]."""
FRICTIONS = (0.05, 1.5)
SIZES = (4, 1300)
"""Contacts of beds, about; their logarithms are drawn evenly, as those of friction."""
LARGE_SIZES = (500, 5000)
CONTACTS_A_GRAIN = {2: 1.9, 3: 2.8}
KICKS = ("all bodies", "one body", "sideways", "the last tenth down")
KICK_SIZES = (0.1, 100.0)
"""Of a kick's velocity, in units of g h."""


@dataclass(frozen=True)
class Posed:
    """A problem of the examination, how it came about, and where the solver is to start."""

    problem: FrictionProblem
    recipe: str
    start: Floats | None = None
    bar: float = 1e-12
    """The residual to be reached."""


def draw_between(generator: Generator, least: float, most: float) -> float:
    """A number whose logarithm is drawn evenly."""
    return float(np.exp(generator.uniform(np.log(least), np.log(most))))


# --- beds -------------------------------------------------------------------------------------


def draw_radii(generator: Generator, count: int) -> tuple[Floats, str]:
    """Radii (count,) [m], and their kind: even in a range of 1:1.9, nearly equal, or 1:5."""
    kind = str(generator.choice(("uniform", "nearly equal", "1:5")))
    mean = float(np.mean(RADII))
    if kind == "uniform":
        return generator.uniform(*RADII, count), kind
    if kind == "nearly equal":
        return mean * (1.0 + 0.01 * generator.uniform(-1.0, 1.0, count)), kind
    return 0.4 * mean * 5.0 ** generator.random(count), kind


def draw_bed(generator: Generator, dim: int, sizes: tuple[int, int] = SIZES) -> Posed:
    """A bed at rest."""
    grains = max(2, round(draw_between(generator, *sizes) / CONTACTS_A_GRAIN[dim]))
    radius, kind = draw_radii(generator, grains)
    friction = draw_between(generator, *FRICTIONS)
    made = pour_radii(radius, dim, generator, friction=friction)
    words = f"{grains} {GRAINS[dim]}, radii {kind}, friction {friction:.2g}"
    return Posed(pose_bed(made, STEP), words)


def build_hexagonal(rows: int, friction: float) -> FrictionProblem:
    """Equal discs in rows, each in the hollows of the one below, between two walls."""
    radius, place = float(np.mean(RADII)), []
    for k in range(rows):
        x = radius * (1 + k % 2) + 2.0 * radius * np.arange(rows - k % 2)
        place.append(np.column_stack([x, 0 * x, np.full(len(x), radius * (1 + np.sqrt(3.0) * k))]))
    centre = np.concatenate(place)
    made = Bed(
        centre, np.full(len(centre), radius), 2.0 * radius * rows, 2, friction,
        np.zeros((0, 2), int), np.zeros((0, 3)), 1.0,
    )  # fmt: skip
    return pose_bed(update_pairs(made, TOUCH * radius), STEP)


def pose_crystal(generator: Generator, index: int) -> Posed:
    """A crystal of discs or of spheres, at rest, kicked, or tilted."""
    friction = draw_between(generator, *FRICTIONS)
    if index % 2:
        layers = int(generator.integers(2, 7))
        posed = Posed(build_crystal(layers, friction=friction), f"{layers} layers of equal spheres")
    else:
        layers = int(generator.integers(2, 22))
        posed = Posed(build_hexagonal(layers, friction), f"{layers} rows of equal discs")
    posed = replace(posed, recipe=f"{posed.recipe}, friction {friction:.2g}")
    return (posed, kick_posed(posed, generator), tilt_posed(posed, generator))[index // 2 % 3]


# --- loads ------------------------------------------------------------------------------------


def require_bodies(posed: Posed) -> BodySpace:
    """The bodies, which only problems in contact space lack."""
    assert posed.problem.bodies is not None
    return posed.problem.bodies


def kick_posed(posed: Posed, generator: Generator) -> Posed:
    """Velocities of all bodies at random, of one, of all to one side, or of the last ones down."""
    problem, space = posed.problem, require_bodies(posed)
    count = space.jacobian.shape[1] // space.body_size
    kind, size = str(generator.choice(KICKS)), draw_between(generator, *KICK_SIZES)
    velocity = np.zeros((count, space.body_size))
    linear = velocity[:, : problem.dim]
    if kind == "all bodies":
        linear[:] = generator.standard_normal(linear.shape)
    elif kind == "one body":
        linear[generator.integers(count)] = 10.0 * generator.standard_normal(problem.dim)
    elif kind == "sideways":
        linear[:, 0] = 1.0
    else:
        linear[-max(1, count // 10) :, -1] = -1.0
    push = space.jacobian @ (size * GRAVITY * STEP * velocity.ravel())
    words = f"{posed.recipe}, kicked ({kind}, {size:.2g} g h)"
    return replace(posed, problem=replace(problem, offset=problem.offset + push), recipe=words)


def tilt_posed(posed: Posed, generator: Generator, most: float | None = None) -> Posed:
    """Gravity turned: every other time near the angle of friction, else up to 120 degrees."""
    problem, space = posed.problem, require_bodies(posed)
    angle, way = np.radians(generator.uniform(0.0, 120.0)), generator.uniform(0.0, 2.0 * np.pi)
    if most is not None:
        angle = generator.uniform(0.0, most)
    elif generator.random() < 0.5:
        angle = np.arctan(problem.friction.max()) * generator.uniform(0.8, 1.2)
    fall = fall_freely(space, STEP, problem.dim).reshape(-1, space.body_size)
    down = fall[:, problem.dim - 1].copy()
    fall[:, problem.dim - 1] = down * np.cos(angle)
    fall[:, 0] = -down * np.sin(angle) * (np.cos(way) if problem.dim == 3 else 1.0)
    if problem.dim == 3:
        fall[:, 1] = -down * np.sin(angle) * np.sin(way)
    before = space.jacobian @ fall_freely(space, STEP, problem.dim)
    offset = problem.offset + space.jacobian @ fall.ravel() - before
    words = f"{posed.recipe}, tilted by {np.degrees(angle):.3g} degrees"
    return replace(posed, problem=replace(problem, offset=offset), recipe=words)


def vary_load(posed: Posed, generator: Generator) -> Posed:
    """At rest, kicked, or tilted."""
    return (lambda each, _: each, kick_posed, tilt_posed)[generator.integers(3)](posed, generator)


def pose_resting(generator: Generator, index: int) -> Posed:
    """Discs and spheres by turns."""
    return draw_bed(generator, 2 + index % 2)


def pose_kicked(generator: Generator, index: int) -> Posed:
    """The same with velocities."""
    return kick_posed(draw_bed(generator, 2 + index % 2), generator)


def pose_tilted(generator: Generator, index: int) -> Posed:
    """The same with gravity turned."""
    return tilt_posed(draw_bed(generator, 2 + index % 2), generator)


def pose_large(generator: Generator, index: int) -> Posed:
    """The same with more contacts, under any load."""
    return vary_load(draw_bed(generator, 2 + index % 2, LARGE_SIZES), generator)
