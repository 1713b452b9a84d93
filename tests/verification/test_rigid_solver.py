"""`solve_friction` on closed forms, on hard small cases, and on real problems where they are given.

A solution is judged by its residual (`rigid_lcp.friction.problem.cones`); forces are compared only
where they are unique.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp import BodySpace, solve_friction
from rigid_lcp.friction.auto import paths as solver_paths
from rigid_lcp.friction.auto import trial as solver_trial
from rigid_lcp.friction.auto.paths import (
    CONVEX,
    SHARP,
    follow_convex_path,
    follow_sharp_path,
    smooth_further,
)
from rigid_lcp.friction.auto.plan import ALL_PATHS, LAST, run_plan
from rigid_lcp.friction.auto.solve import solve_auto
from rigid_lcp.friction.auto.trial import LIMITS, Trial
from rigid_lcp.friction.linear.factorisation import choose_factorisation
from rigid_lcp.friction.problem.definition import FrictionProblem, make_problem
from validation.bench.rigid import packings
from validation.bench.rigid.friction_problems import read_problem
from validation.bench.rigid.packings import build_packing

FOLDER = Path(os.environ.get("TRACKBED_DATA", "")) / "friction_problems"
STORED = (
    sorted(p for p in FOLDER.glob("*.npz") if p.stem[-2:] not in ("_W", "_H"))
    if "TRACKBED_DATA" in os.environ
    else []
)


def block_on_slope(tangent_of_slope: float, mu: float, dim: int) -> tuple[np.ndarray, np.ndarray]:
    """Accelerations of a unit mass on a slope, and its law's answer (a_T, r_T) by hand."""
    cosine = 1.0 / np.hypot(1.0, tangent_of_slope)
    weight, pull = 9.81 * cosine, 9.81 * cosine * tangent_of_slope
    q = np.zeros(dim)
    q[0], q[-1] = -weight, pull
    friction = min(pull, mu * weight)
    return q, np.array([pull - friction, -friction])


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("ratio", [0.0, 0.5, 1 - 1e-9, 1.0, 1 + 1e-9, 2.0, 1e3])
def test_block_on_a_slope(dim, ratio):
    """a_T = g (sin - mu cos) where mu < tan, else 0; r_N = m g cos.  Also exactly at tan = mu."""
    q, (sliding, friction) = block_on_slope(0.4, 0.4 * ratio, dim)
    found = solve_friction(np.eye(dim), q, 0.4 * ratio, dim)
    assert found.solved, found.message
    assert found.r[0] == pytest.approx(-q[0], rel=1e-11)
    assert found.r[-1] == pytest.approx(friction, abs=1e-10)
    assert found.u[-1] == pytest.approx(sliding, abs=1e-10)


def tower(boxes: int, top: float, dim: int) -> tuple[BodySpace, np.ndarray]:
    """Unit boxes on each other, contacts at the corners of each face, under gravity 1."""
    made = packings.build_tower(boxes, dim, top_mass=top, step=1.0 / packings.GRAVITY)
    return made.bodies, made.offset


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize(("boxes", "top"), [(1, 1.0), (10, 1.0), (10, 1e4), (10, 1e-4), (100, 1.0)])
def test_towers_stand_and_each_face_bears_the_weight_above(dim, boxes, top):
    """Redundant corners: single forces are not unique, their sum over a face is."""
    bodies, q = tower(boxes, top, dim)
    found = solve_friction(bodies, q, 0.5, dim)
    assert found.solved, found.message
    faces = found.r.reshape(boxes, -1, dim)[:, :, 0].sum(axis=1)
    above = np.arange(boxes - 1, -1, -1) + top
    np.testing.assert_allclose(faces, above, rtol=1e-9)
    # a tower of n boxes adds up n such errors of the residual's size
    assert np.abs(found.u).max() < 1e-10 * above[0]


@pytest.mark.parametrize("dim", [2, 3])
def test_bodies_and_matrix_give_a_solution_of_the_same_problem(dim):
    bodies, q = tower(20, 3.0, dim)
    by_bodies = solve_friction(bodies, q, 0.3, dim)
    by_matrix = solve_friction(bodies.matrix, q, 0.3, dim)
    assert by_bodies.solved
    assert by_matrix.solved
    again = solve_friction(bodies.matrix, q, 0.3, dim, start=by_bodies.r)
    assert again.method == "start"


@pytest.mark.parametrize("mu", [0.0, 1e-9, 1e3, 1e6])
@pytest.mark.parametrize("dim", [2, 3])
def test_no_friction_hardly_any_and_huge_friction(mu, dim):
    """Round-off of u_T comes into the residual times mu: 1e6 * 1e-16 is what can be asked."""
    g = np.random.default_rng(7)
    j = g.standard_normal((6 * dim, 6 * dim - 3))
    q = j @ g.standard_normal(j.shape[1])
    found = solve_friction(j @ j.T, q, mu, dim, tolerance=max(1e-12, 1e-15 * mu))
    assert found.solved, found.message
    if mu == 0.0:
        np.testing.assert_array_equal(found.r.reshape(-1, dim)[:, 1:], 0.0)


@settings(max_examples=60, derandomize=True)
@given(
    seed=st.integers(0, 10**6),
    dim=st.sampled_from([2, 3]),
    contacts=st.integers(1, 25),
    rank=st.floats(0.2, 1.0),
    skew=st.sampled_from([0.0, 1e-3]),
    mixed=st.booleans(),
)
def test_random_problems_with_a_solution_are_solved(seed, dim, contacts, rank, skew, mixed):
    """W = J J^T of any rank and q = J v: v may be stopped, so there is a solution.

    Then a relative skew part of 1e-3, W stays monotone and, as q stays in its image, solvable.
    """
    g = np.random.default_rng(seed)
    size = contacts * dim
    j = g.standard_normal((size, max(1, round(rank * size))))
    turn = g.standard_normal((j.shape[1],) * 2) * skew / np.sqrt(j.shape[1])
    w = j @ (np.eye(len(turn)) + turn - turn.T) @ j.T
    mu = g.uniform(0.0, 1.2, contacts)
    if mixed:
        mu[g.uniform(size=contacts) < 0.3] = 0.0
    found = solve_friction(w, j @ g.standard_normal(j.shape[1]), mu, dim)
    assert found.solved, found.message


def test_a_warm_start_costs_less_and_a_wrong_one_does_no_harm():
    bodies, q = tower(60, 1.0, 3)
    kick = np.zeros(360)
    kick[-6] = 0.7  # of the top box: more than friction holds, so that not all sticks
    q = q + bodies.jacobian @ kick
    cold = solve_friction(bodies, q, 0.5, 3)
    push = bodies.jacobian @ np.random.default_rng(5).standard_normal(360)
    changed = q + 1e-3 * push
    warm = solve_friction(bodies, changed, 0.5, 3, start=cold.r)
    again = solve_friction(bodies, changed, 0.5, 3)
    assert warm.solved
    assert again.solved
    assert warm.work["factorisations"] < again.work["factorisations"]
    assert "interior-point iterations" not in warm.work
    for factor in (-2.0, 1e6):  # far farther than no forces: as if they had not been given
        wrong = solve_friction(bodies, changed, 0.5, 3, start=factor * cold.r)
        assert wrong.work == again.work
        np.testing.assert_array_equal(wrong.r, again.r)


def test_low_friction_is_reached_along_the_convex_path_bent_to_coulombs():
    """At friction .1 much of a bed slides: the convex answer is wrong by 1e-3 and Newton fails from
    there; the same path with the term |u_T| ends at Coulomb's law, without a sweep."""
    problem = build_packing(60, 2, seed=3, friction=0.1)
    found = solve_auto(problem)
    assert found.solved
    assert found.method == "interior-point + newton"
    assert "sweeps" not in found.work
    assert found.work["interior-point iterations"] > CONVEX.steps


def random_problem(contacts: int, rank: int, friction: float, seed: int) -> FrictionProblem:
    """W = B B^T of low rank, q at random: with q out of its image there may be no solution."""
    g = np.random.default_rng(seed)
    b = g.standard_normal((3 * contacts, rank))
    return make_problem(b @ b.T, g.standard_normal(3 * contacts), friction, 3)


@pytest.mark.parametrize("ratio", [1e12, 1e15, 1e18])
def test_an_exact_answer_is_solved_whatever_bodies_weigh_beside_others(ratio):
    """Two blocks on the ground, W = 1 and ``ratio``: ``r = 1 / W``; the residual, which is relative
    to the greater force, hides at most 1e-16 of that in the lesser, 1e-9 of which is asked here."""
    found = solve_friction(np.diag([1.0, 1.0, ratio, ratio]), [-1.0, 0.0, -1.0, 0.0], 0.5, 2)
    assert found.solved
    np.testing.assert_allclose(found.r, [1.0, 0.0, 1.0 / ratio, 0.0], rtol=1e-9)


@pytest.fixture(scope="module")
def still() -> FrictionProblem:
    """120 spheres at rest, friction .1."""
    return build_packing(120, 3, seed=0, friction=0.1)


@pytest.fixture(scope="module")
def struck(still) -> FrictionProblem:
    """The same, hit: solved neither by the convex path nor by Newton from a hundred sweeps."""
    hit = np.random.default_rng(0).standard_normal(still.bodies.jacobian.shape[1])
    push = still.bodies.jacobian @ hit
    push *= 0.3 * np.linalg.norm(still.offset) / np.linalg.norm(push)
    return replace(still, offset=still.offset + push)


@pytest.fixture
def jammed(monkeypatch) -> None:
    """The sharp path leads nowhere."""
    monkeypatch.setattr(solver_paths, "SHARP", replace(SHARP, steps=1))


def test_the_sharp_path_solves_in_few_steps_what_the_smoothed_one_leaves(monkeypatch):
    """The one ends at Coulomb's law within 40 factorisations, the other has not after 150: what the
    order of the two rests on."""
    problem = build_packing(60, 3, seed=1, friction=0.3)
    path = Trial(problem, None, 1e-12)
    assert not follow_convex_path(path)
    sharp, smoothed = (Trial(problem, None, 1e-12) for _ in range(2))
    smoothed.linear = sharp.linear = choose_factorisation(problem)
    assert follow_sharp_path(sharp)
    assert problem.residual(sharp.best.r) <= 1e-12
    assert sharp.work["factorisations"] <= 40
    smoothed.path_point = path.path_point
    assert not smooth_further(smoothed)
    found = solve_auto(problem)
    assert found.solved
    assert "smoothed path points" not in found.work


@pytest.mark.long
@pytest.mark.usefixtures("jammed")
def test_dear_factorisations_do_not_keep_from_the_smoothed_path(struck, monkeypatch):
    """Beds of thousands of spheres take minutes to settle, so every factorisation is called dear
    here."""
    monkeypatch.setattr(solver_trial, "LIMITS", replace(LIMITS, dear=0.0))
    trial = Trial(struck, None, 1e-12)
    assert run_plan(trial, ALL_PATHS)
    assert struck.residual(trial.best.r) <= 1e-12
    assert trial.work["smoothed path points"] > 5
    assert trial.work.get("sweeps", 0.0) < 2000


@pytest.mark.usefixtures("jammed")
def test_a_start_does_not_keep_from_the_smoothed_path(still, struck):
    """Where sweeps from the forces of the step before have failed, both paths are followed."""
    trial = Trial(struck, solve_auto(still).r, 1e-12)
    assert not trial.best.solved
    run_plan(trial, LAST)
    assert struck.residual(trial.best.r) <= 1e-12
    assert trial.work["smoothed path points"] > 5


@pytest.mark.long
def test_where_a_proof_is_at_hand_no_path_is_tried():
    """20 freedoms for 100 contacts: no force keeps all from approaching, by a linear programme."""
    found = solve_auto(random_problem(100, 20, 0.5, 1))
    assert found.status == "no solution"
    assert "linear programme" in found.message
    assert "interior-point iterations" not in found.work


def test_contacts_in_any_order():
    bodies, q = tower(8, 2.0, 3)
    order = np.random.default_rng(1).permutation(32)
    rows = (order[:, None] * 3 + np.arange(3)).ravel()
    found = solve_friction(bodies.matrix[rows][:, rows], q[rows], 0.5, 3)
    assert found.solved
    faces = np.zeros(8)
    np.add.at(faces, order // 4, found.r[::3])
    np.testing.assert_allclose(faces, np.arange(7, -1, -1) + 2.0, rtol=1e-9)


@pytest.mark.skipif(not STORED, reason="TRACKBED_DATA does not name a folder with problems")
@pytest.mark.parametrize("path", STORED, ids=[p.stem for p in STORED])
def test_real_problems(path):
    """Capsules, spheres, towers, masonry and flows, many with redundant contacts: to 1e-12."""
    if path.stem.startswith("nonunique"):
        data = np.load(path)
        found = solve_friction(data["W"], data["q"], data["mu"], 2)
    else:
        found = solve_auto(read_problem(path))
    assert found.residual <= 1e-12, found.message
