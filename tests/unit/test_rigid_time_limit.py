"""A time limit of `solve_friction`: what comes back, and that no work is begun behind it."""

from __future__ import annotations

from functools import cache, partial
from itertools import count, islice

import numpy as np
import pytest

from rigid_lcp import solve_friction
from rigid_lcp.errors import UsageError
from rigid_lcp.friction.auto import solve as solver
from rigid_lcp.friction.auto import trial
from rigid_lcp.friction.linear import time_limit
from rigid_lcp.friction.linear.factorisation import BodyFactorisation
from rigid_lcp.friction.problem import FrictionSolution
from validation.bench.rigid.packings import build_packing

TICK = 1e-3  # by which a watch goes on whenever it is looked at [s]
SPHERES = cache(partial(build_packing, 120, 3, seed=0, friction=0.1))
"""At rest.  All of the plan, for a residual below round-off, takes 6,500 looks."""


@pytest.fixture
def begun(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """When factorisations and sweeps, a tick for five, were begun [s] by a watch of its own."""
    watch, times = (TICK * each for each in count(1)), list[float]()
    look = watch.__next__

    def note(work):
        def do(*given, **options):
            times.append(look())
            found = work(*given, **options)
            list(islice(watch, int(getattr(found, "work", {}).get("sweeps", 0.0)) // 5))
            return found

        return do

    for module in (solver, time_limit, trial):
        monkeypatch.setattr(module, "perf_counter", look)
    monkeypatch.setattr(trial, "solve_gauss_seidel", note(trial.solve_gauss_seidel))
    monkeypatch.setattr(BodyFactorisation, "factor", note(BodyFactorisation.factor))
    return times


def solve(friction: float = 0.1, **options) -> FrictionSolution:
    return solve_friction(SPHERES().bodies, SPHERES().offset, friction, 3, **options)


def test_a_limit_that_is_not_reached_changes_no_bit() -> None:
    free = solve()
    assert free.solved
    assert (free.r == solve(max_time=1e3).r).all()


@pytest.mark.parametrize("friction", [0.0, 0.1])
@pytest.mark.parametrize("seconds", [0.01, 0.05, 0.2, 0.6])
def test_the_best_point_comes_back_and_no_work_is_begun_behind_the_end(begun, friction, seconds):
    found = solve(friction, tolerance=1e-18, max_time=seconds)
    assert (found.status, found.message[:14]) == ("out of time", "the time is up")
    assert found.residual < (1.0 if seconds < 0.2 else 1e-6)
    assert max(begun, default=0.0) <= seconds + 3 * TICK  # from the look that allows it
    assert time_limit.perf_counter() <= seconds + 60 * TICK  # each stage, island looks once more


@pytest.mark.parametrize(("method", "seconds"), [("newton", 1.0), ("auto", 0.0), ("auto", "soon")])
def test_methods_without_a_limit_and_times_that_are_none_are_refused(method, seconds) -> None:
    with pytest.raises(UsageError, match="max_time"):
        solve(method=method, max_time=seconds)


def test_friction_that_is_an_angle_is_named_where_the_caller_stands() -> None:
    with pytest.warns(UserWarning, match="mu: a friction of 30 is above 2; as an angle") as said:
        solve_friction(np.eye(2), [-1.0, 0.5], 30.0, 2)
    assert said[0].filename == __file__
