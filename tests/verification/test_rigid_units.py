"""No method of friction problems knows units: the same steps, to the same forces in other units.

Units of length, time and mass are powers of two apart, so that no number is rounded.  Forces are f
times and velocities v times as great, so W of ``u = W r + q`` is ``v / f`` times what it was.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from rigid_lcp.friction.attempts import (
    extrapolate_points,
    follow_smoothed,
    refine_forces,
    solve_frictionless,
    solve_proximal,
    solve_sticking,
)
from rigid_lcp.friction.auto.solve import solve_auto
from rigid_lcp.friction.methods import (
    solve_dantzig,
    solve_gauss_seidel,
    solve_interior_point,
    solve_newton,
    solve_pivoting,
)
from rigid_lcp.friction.problem import BodySpace, FrictionProblem, make_problem
from tests.rigid_networks import network, stack_on_slope, tower
from validation.bench.rigid.packings import build_packing
from validation.bench.rigid.packings import build_tower as space_tower


def in_units(problem: FrictionProblem, force: float, velocity: float) -> FrictionProblem:
    """Forces and velocities of one unit are so many of another."""
    w, bodies = problem.matrix, problem.bodies
    if bodies is not None:
        mass = bodies.inverse_mass * (velocity / force)
        bodies = BodySpace(bodies.jacobian, mass, bodies.body_size)
    elif w is not None:
        w = w * (velocity / force)
    made: FrictionProblem = make_problem(
        bodies or w, problem.offset * velocity, problem.friction, problem.dim
    )
    return made


def bed() -> FrictionProblem:
    """Settled spheres, some of which slide."""
    return build_packing(40, 3, seed=3, friction=0.1)


METHODS = {
    "auto": (solve_auto, lambda: build_packing(60, 2, seed=3, friction=0.1)),
    "gauss-seidel": (solve_gauss_seidel, lambda: space_tower(4, 3, top_mass=10.0)),
    "gauss-seidel by rows": (solve_gauss_seidel, lambda: network(40, 0.5)),
    "interior point": (partial(solve_interior_point, iterations=12), bed),
    "newton": (partial(solve_newton, iterations=3), bed),
    "pivoting": (partial(solve_pivoting, sweeps=0), lambda: network(40, 0.5)),
    "dantzig": (solve_dantzig, lambda: network(40, 0.1)),
    "frictionless": (solve_frictionless, lambda: network(60, 0.0)),
    "smoothed path": (follow_smoothed, bed),
    "proximal points": (partial(solve_proximal, factorisations=15), bed),
    "extrapolated points": (partial(extrapolate_points, factorisations=15), bed),
    "sticking": (lambda problem, _, tolerance: solve_sticking(problem, tolerance),
                 lambda: tower(10, 0.5)),
    "refinement": (lambda problem, _, tolerance: refine_forces(
        problem, solve_sticking(problem, 1e-12).r, 0.0),
                   lambda: stack_on_slope([1.0, 1e6, 1.0], step=1.0)),
}  # fmt: skip
"""A method, and a problem that it has something to do on."""


@pytest.mark.long
@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize(("force", "velocity"), [(2.0**20, 1.0), (2.0**-10, 2.0**10)])
def test_units_do_not_matter(name: str, force: float, velocity: float) -> None:
    method, make = METHODS[name]
    problem = make()
    start = None
    if name in ("newton", "proximal points", "extrapolated points"):
        start = solve_gauss_seidel(problem, tolerance=1e-10, sweeps=30).r
    here = method(problem, start, 1e-12)
    other = in_units(problem, force, velocity)
    there = method(other, None if start is None else start * force, 1e-12)
    assert there.work == here.work
    assert replace(there, r=here.r, u=here.u).residual == pytest.approx(here.residual, rel=1e-6)
    size = float(np.abs(here.r).max())
    assert size > 0.0
    np.testing.assert_allclose(there.r / force, here.r, rtol=1e-9, atol=1e-9 * size)
