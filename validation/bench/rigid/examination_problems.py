"""Problems of the examination that are no beds: masonry, other people's, noise, starts.

As in `examination_beds`, a generator and the number in the family decide alone;
what may have no solution says so.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import scipy.sparse as sp

from rigid_lcp.friction.auto.solve import solve_friction
from rigid_lcp.friction.problem.definition import BODY_SIZE, BodySpace, make_problem
from validation.bench.rigid.examination_beds import (
    FRICTIONS,
    SIZES,
    STEP,
    Generator,
    Posed,
    draw_bed,
    draw_between,
    pose_resting,
    require_bodies,
    vary_load,
)
from validation.bench.rigid.friction_problems import NamedProblem, list_stored, list_suite, vary
from validation.bench.rigid.packings import pose_step
from validation.bench.rigid.walls import MASSES, build_wall, count_bricks, draw_masses

MASS_RATIOS = (1.0, 1e4)
NOISE_OF_W = 1e-3
"""Standard deviation of the change of every entry of W, over the entry."""
MIXED_FRICTION = (0.0, 1000.0)


# --- towers and walls -------------------------------------------------------------------------


def pose_masonry(generator: Generator, index: int, columns: int) -> Posed:
    """Bricks of many masses under any load, ``columns`` in a row."""
    dim, joined = 2 + index % 2, bool(generator.random() < 0.5) and columns > 1
    room = SIZES[1] / (2 * dim - 2) ** 2 / (columns * (2 + joined) if columns > 1 else 1)
    rows = round(draw_between(generator, 2, max(3.0, room)))
    kind, ratio = str(generator.choice(MASSES)), draw_between(generator, *MASS_RATIOS)
    mass = draw_masses(count_bricks(rows, columns), kind, ratio, generator)
    length = 2.0 if columns > 1 else 1.0
    space = build_wall(rows, columns, dim, mass, length=length, joined=joined)
    friction = draw_between(generator, *FRICTIONS)
    words = f"{rows} rows of {columns} in {dim}D, masses {kind}"
    words += f" to {ratio:.2g}" * (kind != "equal") + ", joined" * joined
    posed = Posed(pose_step(space, STEP, friction, dim), f"{words}, friction {friction:.2g}")
    return vary_load(posed, generator)


def pose_tower(generator: Generator, index: int) -> Posed:
    """Cubes on each other."""
    return pose_masonry(generator, index, 1)


def pose_wall(generator: Generator, index: int) -> Posed:
    """Bricks in running bond, 2 to 12 in a row."""
    return pose_masonry(generator, index, int(generator.integers(2, 13)))


# --- problems of others -----------------------------------------------------------------------


@cache
def load_stored() -> tuple[NamedProblem, ...]:
    """The stored problems."""
    return tuple(list_stored())


@cache
def load_suite() -> tuple[NamedProblem, ...]:
    """Those of Siconos's test suite that are not stored."""
    return tuple(list_suite())


def pose(each: NamedProblem) -> Posed:
    """A problem as it is."""
    return Posed(each.make(), each.name, bar=each.bar)


def pose_stored(generator: Generator, index: int) -> Posed:
    """The stored problems by turns, `change`."""
    return change(pose(load_stored()[index % len(load_stored())]), generator)


def pose_suite(generator: Generator, index: int) -> Posed:
    """Those of the test suite by turns, changed in the same way."""
    return change(pose(load_suite()[index % len(load_suite())]), generator)


def change(posed: Posed, generator: Generator) -> Posed:
    """Another order, q and friction."""
    made = vary(posed.problem, generator)
    return replace(posed, problem=made, recipe=f"{posed.recipe}, changed")


def pose_any(generator: Generator, index: int) -> Posed:
    """A stored problem changed, or a bed under any load, by turns; a bed where none is stored."""
    if index % 2 and load_stored():
        return change(pose(load_stored()[generator.integers(len(load_stored()))]), generator)
    return vary_load(draw_bed(generator, 2 + index // 2 % 2), generator)


# --- W, starts --------------------------------------------------------------------------------


def pose_noisy(generator: Generator, index: int) -> Posed:
    """W as a matrix that is not symmetric.  It may be the W of a problem without solution."""
    posed = pose_any(generator, index)
    w = posed.problem.delassus.copy()
    w.data *= 1.0 + NOISE_OF_W * generator.standard_normal(len(w.data))
    made = make_problem(w, posed.problem.offset, posed.problem.friction, posed.problem.dim)
    return replace(posed, problem=made, recipe=f"{posed.recipe}, W with noise of {NOISE_OF_W:g}")


def pose_warm_start(generator: Generator, index: int) -> Posed:
    """From the solution of the problem before a small change of load or friction."""
    posed = pose_any(generator, index)
    problem = posed.problem
    before = solve_friction(
        problem.bodies or problem.delassus, problem.offset, problem.friction, problem.dim
    )
    size = draw_between(generator, 1e-3, 1e-1)
    friction, offset = problem.friction, problem.offset
    kind = str(generator.choice(("friction", "load")))
    if kind == "friction":
        friction = friction * (1.0 + size * generator.choice((-1.0, 1.0)))
    elif problem.bodies is None:
        offset = offset * (1.0 + size * generator.standard_normal(len(offset)))
    else:
        push = problem.bodies.jacobian @ generator.standard_normal(problem.bodies.jacobian.shape[1])
        scale = np.linalg.norm(offset) / (np.linalg.norm(push) or 1.0)
        offset = offset + size * scale * push
    words = f"{posed.recipe}, then {kind} by {size:.1g}"
    changed_a_little = replace(problem, friction=friction, offset=offset)
    return replace(posed, problem=changed_a_little, recipe=words, start=before.r)


def pose_wrong_start(generator: Generator, index: int) -> Posed:
    """From forces that are none: too large, pulling, outside of the cones, or another problem's."""
    posed = pose_any(generator, index)
    problem = posed.problem
    scale = problem.rho * (float(np.abs(problem.offset).max()) or 1.0)
    force = np.abs(generator.standard_normal((problem.contacts, problem.dim)))
    kind = ("too large", "pulling", "sideways", "at random")[index % 4]
    factor = {"too large": 1e6, "pulling": -1.0}.get(kind, 1.0)
    if kind == "sideways":
        force[:, 0] = 0.0
    elif kind == "at random":
        force *= generator.choice((-1.0, 1.0), force.shape)
    words = f"{posed.recipe}, begun {kind}"
    return replace(posed, start=(factor * scale * force).ravel(), recipe=words)


# --- beyond -----------------------------------------------------------------------------------


def pose_mixed_friction(generator: Generator, index: int) -> Posed:
    """Friction of 0 and of 1000, contact by contact."""
    posed = pose_any(generator, index)
    friction = generator.choice(MIXED_FRICTION, posed.problem.contacts)
    made = replace(posed.problem, friction=friction)
    return replace(posed, problem=made, recipe=f"{posed.recipe}, friction 0 and 1000")


def pose_triple_friction(generator: Generator, index: int) -> Posed:
    """Three times the friction under which the problem came about."""
    posed = pose_any(generator, index)
    made = replace(posed.problem, friction=3.0 * posed.problem.friction)
    return replace(posed, problem=made, recipe=f"{posed.recipe}, friction x 3")


def pose_double_contacts(generator: Generator, index: int) -> Posed:
    """Every contact of a bed or wall a second time: forces are free to be shared at will."""
    make: Callable[[Generator, int], Posed] = pose_wall if index % 2 else pose_resting
    posed = make(generator, index // 2)
    problem, space = posed.problem, require_bodies(posed)
    jacobian = sp.csr_array(sp.vstack([space.jacobian, space.jacobian]))
    made = make_problem(
        BodySpace(jacobian, space.inverse_mass, space.body_size),
        np.tile(problem.offset, 2), np.tile(problem.friction, 2), problem.dim,
    )  # fmt: skip
    return replace(posed, problem=made, recipe=f"{posed.recipe}, contacts twice")


def pose_assembly(generator: Generator, index: int) -> Posed:
    """Contacts of random directions between random pairs of bodies; every other one with a q that
    no velocities of the bodies make, which need not have a solution."""
    dim = 2 + index % 2
    contacts, size = round(draw_between(generator, 2, 300)), BODY_SIZE[dim]
    bodies = max(1, round(contacts * generator.uniform(0.2, 1.0)))
    blocks = np.zeros((contacts, dim, bodies, size))
    for c in range(contacts):
        for sign, body in zip((1.0, -1.0), generator.integers(bodies, size=2), strict=True):
            blocks[c, :, body] += sign * generator.standard_normal((dim, size))
    jacobian = sp.csr_array(blocks.reshape(contacts * dim, bodies * size))
    inverse = sp.csr_array(
        sp.diags_array(draw_between(generator, 1.0, 1e3) ** generator.random(bodies * size))
    )
    kept = index // 2 % 2 == 0
    offset = jacobian @ generator.standard_normal(bodies * size)
    if not kept:
        offset = generator.standard_normal(contacts * dim)
    friction = generator.uniform(0.0, 1.5, contacts)
    made = make_problem(BodySpace(jacobian, inverse, size), offset, friction, dim)
    words = f"{contacts} contacts of {bodies} bodies in {dim}D, q {'of J' if kept else 'any'}"
    return Posed(made, words)
