"""Large problems: sweeps over the contacts that bear, warm starts to the last digit, a bound."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp

from rigid_lcp.friction.auto import trial as solver_trial
from rigid_lcp.friction.auto.solve import solve_friction
from rigid_lcp.friction.methods.gauss_seidel import solve_gauss_seidel
from rigid_lcp.friction.problem.definition import BodySpace, FrictionProblem, make_problem
from rigid_lcp.friction.sweeps.contact_kernel import MANY_CONTACTS, list_carrying
from validation.bench.rigid.packings import build_crystal, build_tower

COPIES, BOXES, HELD = 500, 3, 3
"""So many small towers side by side, of which one of ``HELD`` stands and the others fly up."""


def towers_side_by_side() -> FrictionProblem:
    """Towers that do not touch: ``q`` of those that fly is that of the others, turned round."""
    one = build_tower(BOXES, 2)
    assert one.bodies is not None
    signs = np.where(np.arange(COPIES) % HELD == 0, 1.0, -1.0)
    space = BodySpace(
        sp.csr_array(sp.block_diag([one.bodies.jacobian] * COPIES)),
        sp.csr_array(sp.block_diag([one.bodies.inverse_mass] * COPIES)), 3,
    )  # fmt: skip
    return make_problem(space, np.outer(signs, one.offset).ravel(), 0.5, 2)


def test_sweeps_over_what_bears_end_where_sweeps_over_all_do() -> None:
    """Contacts that open are left out of most sweeps and found again: the weight above each joint
    is carried, ``sum r_N = m g h k`` below k boxes, and what flies feels nothing."""
    problem = towers_side_by_side()
    assert problem.contacts >= MANY_CONTACTS
    begin = np.zeros((problem.contacts, 2))
    begin[:, 0] = 1.0  # everything seems to bear at first
    found = solve_gauss_seidel(problem, begin.ravel(), 1e-12, 3000)
    assert found.solved
    force = found.r.reshape(COPIES, BOXES, 2, 2)
    flying = np.arange(COPIES) % HELD != 0
    assert np.abs(force[flying]).max() <= 1e-12 * np.linalg.norm(found.r)
    own = np.linalg.norm(build_tower(1, 2).offset) / np.sqrt(2.0)  # g h of a box of 1 kg
    carried = force[~flying, :, :, 0].sum(axis=2)
    expected = own * np.arange(BOXES, 0, -1)
    # the natural map leaves 1e-12 of all forces, and W of such a tower answers within a factor 100
    assert np.allclose(carried, expected, rtol=0.0, atol=1e-10 * np.linalg.norm(found.r))


def test_contacts_that_bear_are_named_in_the_order_of_the_sweep() -> None:
    force, last = np.zeros((6, 2)), np.zeros((6, 2))
    force[4, 0], force[1, 1], last[2, 0] = 1.0, -1.0, 1.0
    visit = np.array([5, 4, 3, 2, 1, 0], dtype=np.int64)
    assert list_carrying(force, last, visit).tolist() == [4, 2, 1]


def test_a_swept_solution_is_exact() -> None:
    """Sweeps that end at 1e-12 go on to round-off, half their number more at the most; those that
    end a rougher tolerance do not."""
    problem = build_crystal(5)
    assert problem.bodies is not None
    found = solve_friction(problem.bodies, problem.offset, problem.friction, 3)
    assert (found.method, found.residual < 5e-15) == ("gauss-seidel", True)
    assert found.work["sweeps"] < 100
    rough = solve_friction(problem.bodies, problem.offset, problem.friction, 3, tolerance=1e-9)
    assert 1e-12 < rough.residual <= 1e-9


def test_sweeps_that_creep_end_early() -> None:
    """A tower gains nothing by sweeps: fifteen tell, and that all contacts stick is tried."""
    problem = build_tower(100, 3)
    found = solve_friction(problem.bodies, problem.offset, problem.friction, 3)
    assert (found.method, found.work["sweeps"]) == ("sticking", 15)


def test_a_warm_start_ends_at_the_last_digit() -> None:
    """From forces that are wrong by a thousandth, to a residual of 1e-12."""
    problem = build_crystal(6)
    cold = solve_friction(problem.bodies, problem.offset, problem.friction, 3)
    noise = 1.0 + 1e-3 * np.random.default_rng(4).standard_normal(len(cold.r))
    warm = solve_friction(
        problem.bodies, problem.offset, problem.friction, 3, start=cold.r * noise
    )  # fmt: skip
    assert cold.solved
    assert warm.solved
    assert problem.residual(warm.r) <= 1e-12


def test_no_factorisation_is_begun_beyond_the_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    """With nothing to spend Newton's method and the paths are left out, and the answer says what
    residual it has."""
    limits = replace(solver_trial.LIMITS, most_flops=0.0)
    monkeypatch.setattr(solver_trial, "LIMITS", limits)
    problem = build_crystal(6)
    found = solve_friction(
        problem.bodies, problem.offset, problem.friction, 3,
        start=np.ones(len(problem.offset)),
    )  # fmt: skip
    assert not any("newton" in name or "interior" in name for name, n in found.work.items() if n)
    assert found.residual == pytest.approx(problem.residual(found.r))
    assert found.solved == (found.residual <= 1e-12)
