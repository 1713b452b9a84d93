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
from rigid_lcp.friction.problem.definition import BODY_SIZE, BodySpace, friction_problem
from validation.bench.rigid.examination_beds import (
    FRICTIONS,
    SIZES,
    STEP,
    Generator,
    Posed,
    beds_settled,
    between,
    bodies_of,
    loaded,
    settled,
)
from validation.bench.rigid.friction_problems import (
    NamedProblem,
    changed,
    stored_problems,
    suite_problems,
)
from validation.bench.rigid.packings import step_problem
from validation.bench.rigid.walls import MASSES, wall_bodies, wall_count, wall_masses

MASS_RATIOS = (1.0, 1e4)
NOISE_OF_W = 1e-3
"""Standard deviation of the change of every entry of W, over the entry."""
MIXED_FRICTION = (0.0, 1000.0)


# --- towers and walls -------------------------------------------------------------------------


def masonry(generator: Generator, index: int, columns: int) -> Posed:
    """Bricks of many masses under any load, ``columns`` in a row."""
    dim, joined = 2 + index % 2, bool(generator.random() < 0.5) and columns > 1
    room = SIZES[1] / (2 * dim - 2) ** 2 / (columns * (2 + joined) if columns > 1 else 1)
    rows = round(between(generator, 2, max(3.0, room)))
    kind, ratio = str(generator.choice(MASSES)), between(generator, *MASS_RATIOS)
    mass = wall_masses(wall_count(rows, columns), kind, ratio, generator)
    length = 2.0 if columns > 1 else 1.0
    space = wall_bodies(rows, columns, dim, mass, length=length, joined=joined)
    friction = between(generator, *FRICTIONS)
    words = f"{rows} rows of {columns} in {dim}D, masses {kind}"
    words += f" to {ratio:.2g}" * (kind != "equal") + ", joined" * joined
    posed = Posed(step_problem(space, STEP, friction, dim), f"{words}, friction {friction:.2g}")
    return loaded(posed, generator)


def towers(generator: Generator, index: int) -> Posed:
    """Cubes on each other."""
    return masonry(generator, index, 1)


def walls(generator: Generator, index: int) -> Posed:
    """Bricks in running bond, 2 to 12 in a row."""
    return masonry(generator, index, int(generator.integers(2, 13)))


# --- problems of others -----------------------------------------------------------------------


@cache
def stored() -> tuple[NamedProblem, ...]:
    """The stored problems."""
    return tuple(stored_problems())


@cache
def suite() -> tuple[NamedProblem, ...]:
    """Those of Siconos's test suite that are not stored."""
    return tuple(suite_problems())


def named(each: NamedProblem) -> Posed:
    """A problem as it is."""
    return Posed(each.make(), each.name, bar=each.bar)


def stored_changed(generator: Generator, index: int) -> Posed:
    """The stored problems by turns, `altered`."""
    return altered(named(stored()[index % len(stored())]), generator)


def suite_changed(generator: Generator, index: int) -> Posed:
    """Those of the test suite by turns, changed in the same way."""
    return altered(named(suite()[index % len(suite())]), generator)


def altered(posed: Posed, generator: Generator) -> Posed:
    """Another order, q and friction."""
    made = changed(posed.problem, generator)
    return replace(posed, problem=made, recipe=f"{posed.recipe}, changed")


def any_problem(generator: Generator, index: int) -> Posed:
    """A stored problem changed, or a bed under any load, by turns; a bed where none is stored."""
    if index % 2 and stored():
        return altered(named(stored()[generator.integers(len(stored()))]), generator)
    return loaded(settled(generator, 2 + index // 2 % 2), generator)


# --- W, starts --------------------------------------------------------------------------------


def noisy(generator: Generator, index: int) -> Posed:
    """W as a matrix that is not symmetric.  It may be the W of a problem without solution."""
    posed = any_problem(generator, index)
    w = posed.problem.delassus.copy()
    w.data *= 1.0 + NOISE_OF_W * generator.standard_normal(len(w.data))
    made = friction_problem(w, posed.problem.offset, posed.problem.friction, posed.problem.dim)
    return replace(posed, problem=made, recipe=f"{posed.recipe}, W with noise of {NOISE_OF_W:g}")


def warm(generator: Generator, index: int) -> Posed:
    """From the solution of the problem before a small change of load or friction."""
    posed = any_problem(generator, index)
    problem = posed.problem
    before = solve_friction(
        problem.bodies or problem.delassus, problem.offset, problem.friction, problem.dim
    )
    size = between(generator, 1e-3, 1e-1)
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


def misled(generator: Generator, index: int) -> Posed:
    """From forces that are none: too large, pulling, outside of the cones, or another problem's."""
    posed = any_problem(generator, index)
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


def mixed_friction(generator: Generator, index: int) -> Posed:
    """Friction of 0 and of 1000, contact by contact."""
    posed = any_problem(generator, index)
    friction = generator.choice(MIXED_FRICTION, posed.problem.contacts)
    made = replace(posed.problem, friction=friction)
    return replace(posed, problem=made, recipe=f"{posed.recipe}, friction 0 and 1000")


def thrice_friction(generator: Generator, index: int) -> Posed:
    """Three times the friction under which the problem came about."""
    posed = any_problem(generator, index)
    made = replace(posed.problem, friction=3.0 * posed.problem.friction)
    return replace(posed, problem=made, recipe=f"{posed.recipe}, friction x 3")


def contacts_twice(generator: Generator, index: int) -> Posed:
    """Every contact of a bed or wall a second time: forces are free to be shared at will."""
    make: Callable[[Generator, int], Posed] = walls if index % 2 else beds_settled
    posed = make(generator, index // 2)
    problem, space = posed.problem, bodies_of(posed)
    jacobian = sp.csr_array(sp.vstack([space.jacobian, space.jacobian]))
    made = friction_problem(
        BodySpace(jacobian, space.inverse_mass, space.body_size),
        np.tile(problem.offset, 2), np.tile(problem.friction, 2), problem.dim,
    )  # fmt: skip
    return replace(posed, problem=made, recipe=f"{posed.recipe}, contacts twice")


def assembled(generator: Generator, index: int) -> Posed:
    """Contacts of random directions between random pairs of bodies; every other one with a q that
    no velocities of the bodies make, which need not have a solution."""
    dim = 2 + index % 2
    contacts, size = round(between(generator, 2, 300)), BODY_SIZE[dim]
    bodies = max(1, round(contacts * generator.uniform(0.2, 1.0)))
    blocks = np.zeros((contacts, dim, bodies, size))
    for c in range(contacts):
        for sign, body in zip((1.0, -1.0), generator.integers(bodies, size=2), strict=True):
            blocks[c, :, body] += sign * generator.standard_normal((dim, size))
    jacobian = sp.csr_array(blocks.reshape(contacts * dim, bodies * size))
    inverse = sp.csr_array(
        sp.diags_array(between(generator, 1.0, 1e3) ** generator.random(bodies * size))
    )
    kept = index // 2 % 2 == 0
    offset = jacobian @ generator.standard_normal(bodies * size)
    if not kept:
        offset = generator.standard_normal(contacts * dim)
    friction = generator.uniform(0.0, 1.5, contacts)
    made = friction_problem(BodySpace(jacobian, inverse, size), offset, friction, dim)
    words = f"{contacts} contacts of {bodies} bodies in {dim}D, q {'of J' if kept else 'any'}"
    return Posed(made, words)
