"""The examination of the solver: its problems, its judge, how a run is ended, and its record."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigid_lcp.friction_problem import BodySpace, FrictionProblem, friction_problem
from rigid_lcp.problem_files import read_problem
from rigid_lcp.solver import solve_friction
from validation import rigid_examination as examination
from validation import rigid_examination_beds as beds
from validation import rigid_examination_worker as worker
from validation.rigid_examination_beds import Posed, kicked, tilted
from validation.rigid_examination_families import BEYOND, FAMILIES, SAME, Family, family_named
from validation.rigid_examination_judge import residual_extended
from validation.rigid_examination_page import (
    examination_failures,
    examination_table,
    examination_words,
    noise_words,
    seeds_words,
)
from validation.rigid_examination_problems import assembled
from validation.rigid_examination_walls import wall_bodies, wall_count, wall_masses
from validation.rigid_packings import GRAVITY, Bed, bed_problem, step_problem, tower

WITHOUT_BEDS = ("crystals", "towers", "walls", "random assemblies")
"""Families that are made in no time."""
WEIGHT = GRAVITY * beds.STEP
"""Impulse of the weight of 1 kg in a step [N s]."""


# --- the judge --------------------------------------------------------------------------------


@given(
    index=st.integers(0, 3), seed=st.integers(0, 10**6), scale=st.sampled_from([1e-6, 1.0, 1e6]),
    by_bodies=st.booleans(),
)  # fmt: skip
@settings(max_examples=40, deadline=None)
def test_both_judges_agree(index: int, seed: int, scale: float, by_bodies: bool) -> None:
    """The solver's residual and the one of plain NumPy: round-off of some hundred terms apart."""
    generator = np.random.default_rng(seed)
    problem = assembled(generator, index).problem
    if not by_bodies:
        problem = friction_problem(problem.delassus, problem.offset, problem.friction, problem.dim)
    force = scale * generator.standard_normal(len(problem.offset))
    residual, left = residual_extended(problem, force)
    assert residual == pytest.approx(problem.residual(force), rel=1e-11)
    begun = problem.error_without_forces  # zero where nothing approaches
    assert left * (begun or 1.0) == pytest.approx(
        residual * np.linalg.norm(force) if begun else 1.0, rel=1e-11
    )


def test_judge_of_a_sliding_block() -> None:
    """W = 1, q = (-1, 3), mu = 0.5: r = (1, -0.5) slides on, and is known to the last digit; one
    part in a million less leaves just that, as does no force at all leave everything."""
    problem = friction_problem(np.eye(2), np.array([-1.0, 3.0]), 0.5, 2)
    right = np.array([1.0, -0.5])
    assert residual_extended(problem, right) == (0.0, 0.0)
    assert residual_extended(problem, right * (1 - 1e-6))[0] == pytest.approx(1e-6, rel=0.5)
    assert residual_extended(problem, np.zeros(2))[1] == 1.0
    assert np.isnan(residual_extended(problem, np.array([np.nan, 0.0]))[0])


def test_judge_without_forces() -> None:
    """What parts needs none: residual zero; what approaches shows its velocity, over its size."""
    part, meet = (friction_problem(np.eye(2), np.array([v, 0.0]), 0.5, 2) for v in (1.0, -2.0))
    assert residual_extended(part, np.zeros(2))[0] == 0.0
    assert residual_extended(meet, np.zeros(2))[0] == 1.0


# --- the problems -----------------------------------------------------------------------------


def same(one: Posed, other: Posed) -> bool:
    """The same numbers, bit by bit."""
    return (
        one.recipe == other.recipe
        and np.array_equal(one.problem.offset, other.problem.offset)
        and np.array_equal(one.problem.friction, other.problem.friction)
        and np.array_equal(one.problem.delassus.toarray(), other.problem.delassus.toarray())
    )


@pytest.mark.parametrize("name", WITHOUT_BEDS)
def test_problems_follow_from_family_seed_and_number(name: str) -> None:
    """Made twice they are the same; another seed or number makes another."""
    family = family_named(name)
    once, again, later, elsewhere = (
        family.posed(seed, index) for seed, index in ((5, 3), (5, 3), (5, 5), (6, 3))
    )
    assert same(once, again)
    assert not same(once, later)
    assert not same(once, elsewhere)


def test_beds_follow_from_family_seed_and_number(monkeypatch: pytest.MonkeyPatch) -> None:
    """So do small beds, and families do not share theirs."""
    monkeypatch.setattr(beds, "SIZES", (8, 12))
    monkeypatch.delenv("TRACKBED_BEDS", raising=False)
    kick, tilt = family_named("beds kicked"), family_named("beds tilted")
    once = kick.posed(5, 0)
    assert same(once, kick.posed(5, 0))
    assert once.recipe.partition(", kicked")[0] != tilt.posed(5, 0).recipe.partition(", tilted")[0]


def test_families_are_told_apart() -> None:
    """Names are unique; each is of the families of the bars or beyond them."""
    assert len({family.name for family in FAMILIES}) == len(FAMILIES)
    assert {family.belongs for family in FAMILIES} == {SAME, BEYOND}


@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("joined", [False, True])
def test_a_wall_stands_on_its_floor(dim: int, joined: bool) -> None:
    """Floor impulses bear the weight of all bricks, and no contact sees the wall move as a whole
    but those with the floor."""
    generator = np.random.default_rng(1)
    mass = wall_masses(wall_count(3, 3), "random", 1e4, generator)
    space = wall_bodies(3, 3, dim, mass, joined=joined)
    problem = step_problem(space, beds.STEP, 0.6, dim)
    found = solve_friction(space, problem.offset, problem.friction, dim)
    assert found.solved
    floor = 3 * 2 * (dim - 1)  # bricks, ends, and in space two depths
    borne = found.r.reshape(-1, dim)[:floor, 0].sum()
    assert borne == pytest.approx(mass.sum() * WEIGHT, rel=1e-10)
    sideways = np.zeros((len(mass), space.body_size))
    sideways[:, :dim] = np.arange(1.0, dim + 1)
    moved = (space.jacobian @ sideways.ravel()).reshape(-1, dim)
    assert moved[:floor, 0] == pytest.approx(float(dim))
    assert np.abs(moved[len(moved) - 1]).max() == 0.0


def test_inertia_of_bricks() -> None:
    """2 x 1 x 1 m and 3 kg: ``m (a^2 + b^2) / 12`` about each axis, y alone in the plane."""
    about = 3.0 * np.array([2.0, 5.0, 5.0]) / 12.0
    for dim, turning in ((2, about[1:2]), (3, about)):
        space = wall_bodies(1, 1, dim, np.array([3.0]))
        expected = 1.0 / np.array([3.0] * dim + [*turning])
        assert space.inverse_mass.diagonal() == pytest.approx(expected, rel=1e-15)


def test_a_wall_turns_as_a_rigid_body() -> None:
    """Turned about a point, all bricks alike, no joint of theirs opens or slides."""
    space = wall_bodies(3, 3, 2, np.ones(wall_count(3, 3)), joined=True)
    middle = np.array(
        [(2.0 * (i + k % 2 / 2), k + 0.5) for k in range(3) for i in range(3 - k % 2)]
    )
    turn = np.column_stack([-middle[:, 1], middle[:, 0], np.ones(len(middle))])
    moved = space.jacobian @ turn.ravel()
    inside = space.jacobian[:, :].indptr  # floor contacts touch one body, the others two
    rows = np.flatnonzero(np.diff(inside) > 3)
    assert np.abs(moved[rows]).max() <= 1e-14


def test_gravity_turns() -> None:
    """Tilted by less than the angle of friction a cube sticks: its floor bears ``m g h`` turned."""
    posed = Posed(tower(1, 2, friction=0.9), "cube")
    generator = np.random.default_rng(3)
    turned = tilted(posed, generator, most=0.5)
    angle = np.radians(float(turned.recipe.split()[-2]))
    found = solve_friction(turned.problem.bodies, turned.problem.offset, turned.problem.friction, 2)
    borne = np.abs(found.r.reshape(-1, 2).sum(axis=0))
    expected = WEIGHT * np.array([np.cos(angle), np.sin(angle)])
    assert borne == pytest.approx(expected, rel=5e-3)  # the recipe has three digits


def test_kicks_stay_in_the_image_of_the_bodies() -> None:
    """What is added to q is made by velocities of bodies, so a solution exists."""
    posed = Posed(tower(3, 3), "tower")
    for seed in range(8):
        push = kicked(posed, np.random.default_rng(seed)).problem.offset - posed.problem.offset
        jacobian = beds.bodies_of(posed).jacobian.toarray()
        made = jacobian @ np.linalg.lstsq(jacobian, push, rcond=None)[0]
        assert made == pytest.approx(push, abs=1e-12 * np.abs(push).max())
        assert np.abs(push).max() > 0


def test_two_grains_beside_a_wall() -> None:
    """Walls are told by negative numbers, which are no grains: no radius is read past the end."""
    made = Bed(
        np.array([[0.1, 0, 0.05], [0.25, 0, 0.05]]), np.full(2, 0.05), 0.3, 2, 0.5,
        np.array([[0, -1], [1, -1], [1, -3]]), np.zeros((3, 3)), 1.0,
    )  # fmt: skip
    assert bed_problem(made, 1e-3).contacts == 3


@pytest.mark.parametrize("by_bodies", [True, False])
def test_what_failed_is_saved_as_it_was(tmp_path: Path, by_bodies: bool) -> None:
    """It is read again with the same numbers and in the same space."""
    problem: FrictionProblem = tower(3, 3)
    if not by_bodies:
        problem = friction_problem(problem.delassus, problem.offset, problem.friction, 3)
    worker.problem_write(tmp_path / "new" / "tower.npz", problem, np.ones(len(problem.offset)))
    read = read_problem(tmp_path / "new" / "tower.npz")
    assert isinstance(read.bodies, BodySpace) == by_bodies
    assert same(Posed(problem, ""), Posed(read, ""))
    assert (np.load(tmp_path / "new" / "tower.npz")["start"] == 1.0).all()


# --- the process ------------------------------------------------------------------------------

FORKED = pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")


@FORKED
def test_what_takes_too_long_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    """Endless compiled or interpreted work ends by its processor time; what was said is kept, and
    the next problem is solved."""

    def endless(_: Posed) -> dict[str, Any]:
        while True:
            pass

    solve = worker._solve
    monkeypatch.setattr("validation.rigid_dantzig_runs.warm", lambda: None)
    monkeypatch.setattr(worker, "SOLVE_S", 0.1)
    monkeypatch.setattr(worker, "_solve", endless)
    asked = worker.Worker("fork")
    row = examination.examined(asked, family_named("towers"), 5, 1)
    assert (row["status"], row["ok"], row["cpu_s"]) == ("out of time", False, None)
    assert row["contacts"] > 0
    assert not examination.passed(row)
    monkeypatch.setattr(worker, "_solve", solve)
    monkeypatch.setattr(worker, "SOLVE_S", 60.0)
    row = examination.examined(asked, family_named("towers"), 5, 1)
    asked.end()
    assert row["status"] == "solved"
    assert row["ok"]
    assert 0.0 <= row["residual"] <= 1e-12


@FORKED
def test_what_raises_is_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    """And the process goes on."""

    def broken(_: Posed) -> dict[str, Any]:
        raise ValueError("it broke")

    monkeypatch.setattr("validation.rigid_dantzig_runs.warm", lambda: None)
    monkeypatch.setattr(worker, "_solve", broken)
    asked = worker.Worker("fork")
    row = examination.examined(asked, family_named("walls"), 5, 1)
    assert (row["status"], row["ok"]) == ("raised ValueError: it broke", False)
    process = asked._process
    assert asked.ask("save", "no such family", 5, 1)["status"].startswith("raised KeyError")
    assert asked._process is process
    asked.end()


def test_forces_that_grow_are_no_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    """A small residual beside huge forces does not pass: they leave what they have to mend."""
    posed = Posed(tower(1, 2), "tower")
    found, _ = worker._solved(posed)
    monkeypatch.setattr(worker, "_solved", lambda _: (replace(found, r=found.r * 1e15), 9.0))
    monkeypatch.setattr(worker, "residual_extended", lambda *_: (1e-15, 1.0))
    assert not worker._solve(posed)["ok"]


# --- the record -------------------------------------------------------------------------------


class Told:
    """Stands for the process: answers what it is told, and remembers what it was asked."""

    def __init__(self) -> None:
        self.asked: list[tuple[str, str, int]] = []
        self.cost = 0.1

    def ask(self, job: str, family: str, seed: int, index: int, *more: Any) -> dict[str, Any]:
        self.asked.append((job, family, index))
        if job == "solve":
            return {"ok": index != 1, "cpu_s": self.cost * index, "status": "s", "residual": 0.0}
        answers: dict[str, dict[str, Any]] = {
            "rival": {"rival_ok": True, "rival_s": 1.0}, "repeat": {"cpu_s": 0.6, "repeats_s": [0]},
        }  # fmt: skip
        return answers.get(job, {})

    def end(self) -> None:
        """Nothing to end."""


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> Told:
    stands = Told()
    monkeypatch.setattr(examination, "Worker", lambda: stands)
    return stands


POSED = [(family_named("towers"), 5, index) for index in range(3)]


def test_examination_goes_on(tmp_path: Path, told: Told) -> None:
    """What is recorded is not run again; the rival is asked where it was not; failed ones again."""
    path = tmp_path / "record.jsonl"
    examination.examine(path, POSED[:2], {"commit": "a"})
    rows = examination.examine(path, POSED, {"commit": "b"}, rival=True)
    assert [row["commit"] for row in rows] == ["a", "a", "b"]
    assert [each for each in told.asked if each[0] == "solve"] == [
        ("solve", "towers", index) for index in range(3)
    ]
    assert all(row["rival_ok"] for row in rows)
    again = examination.examine(path, POSED, {"commit": "c"}, failed_only=True)
    assert [row["commit"] for row in again] == ["a", "c", "b"]
    told.cost = 1.0  # index 2 takes two seconds: solved, and too slow
    path.unlink()
    examination.examine(path, POSED, {"commit": "d"}, save=tmp_path)
    assert [each for each in told.asked if each[0] == "save"] == [
        ("save", "towers", 1), ("save", "towers", 2)
    ]  # fmt: skip


def test_close_costs_are_measured_again(tmp_path: Path, told: Told) -> None:
    """Those between half a second and two, once, and not under load."""
    path = tmp_path / "record.jsonl"
    told.cost = 0.4
    examination.examine(path, POSED, {})
    examination.examine(path, POSED, {}, close=True, load=-1.0)
    assert not [each for each in told.asked if each[0] == "repeat"]
    for _ in range(2):
        rows = examination.examine(path, POSED, {}, close=True, load=np.inf)
    assert [each for each in told.asked if each[0] == "repeat"] == [("repeat", "towers", 2)]
    assert [row["cpu_s"] for row in rows] == [0.0, 0.4, 0.6]


def test_families_by_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    """All families, or some by words in their names; those whose folder is not named are left."""
    monkeypatch.delenv("TRACKBED_SICONOS", raising=False)
    monkeypatch.delenv("TRACKBED_DATA", raising=False)
    names = {family.name for family, _, _ in examination.tasks(5)}
    assert names == {family.name for family in FAMILIES if not family.needs}
    some = [(family.name, index) for family, _, index in examination.tasks(5, "towers, walls", 2)]
    assert some == [("towers", 0), ("walls", 0), ("towers", 1), ("walls", 1)]


def test_command_says_what_it_lacks(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path, told: Told
) -> None:
    """One thread, the rival's package, the folders of problems; then it runs what is left."""
    words = ["--seed", "5", "--families", "towers", "--count", "2"]
    words += ["--record", str(tmp_path / "record.jsonl")]
    for name in examination.ONE_THREAD:
        monkeypatch.setenv(name, "1")
    monkeypatch.delenv("TRACKBED_SICONOS", raising=False)
    examination.main(words)
    said = capsys.readouterr().out
    assert "left out: test suite, changed, as TRACKBED_SICONOS names no folder" in said
    assert "1 of 2 solved within 1 s" in said
    (line, _) = examination.rows_read(tmp_path / "record.jsonl")
    assert line["command"] == "python -m validation.rigid_examination --seed 5"
    monkeypatch.setattr(examination, "library_missing", lambda _: True)
    with pytest.raises(SystemExit, match="pip install clarabel"):
        examination.main([*words, "--rival"])
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    with pytest.raises(SystemExit, match="costs are of one thread"):
        examination.main(words)


def row(family: Family, index: int, **more: Any) -> dict[str, Any]:
    """A line of the record."""
    return {
        "family": family.name, "belongs": family.belongs, "seed": 5, "index": index, "ok": True,
        "claims": True, "cpu_s": 0.5, "residual": 1e-15, "rival_ok": True, "rival_s": 0.25,
        "commit": "abc", "recipe": "bricks", "contacts": 1200, "status": "solved",
        "load": 2.0, "machine": "m", "left": 1e-14,
    } | more  # fmt: skip


def test_noise_is_told_by_its_proofs() -> None:
    """Solved, proved to give energy, proved to have no solution: three of four."""
    base = {"family": "W with noise", "ok": False, "status": "not converged"}
    rows = [base | {"ok": True}, base | {"gives_energy": True}, base | {"status": "no solution"},
            base | {"family": "towers"}]  # fmt: skip
    assert noise_words(rows) == (
        "Of the 3 of the record 1 are solved; of the others 1 have the proof that W gives energy "
        "and 1 that there is no solution."
    )


def test_page_counts() -> None:
    """Solved, slow, slower than the rival where both solve; what failed or was slow by name."""
    near, far = family_named("towers"), family_named("random assemblies")
    rows = [
        row(near, 0), row(near, 1, cpu_s=1.5, rival_s=3.0), row(near, 3, rival_s=1.0),
        row(near, 2, ok=False, claims=False, residual=1e-5, cpu_s=9.0, status="not converged",
            left=2.5),
        row(far, 0, ok=False, residual=None, cpu_s=None, status="out of time"),
        row(far, 1, ok=False, claims=False, residual=1e-14, cpu_s=4.0, left=3.0, rival_ok=False),
    ]  # fmt: skip
    table = examination_table(rows)
    assert "| towers | 4 | 3 | 1 | 0.5 s | 1.5 s | 1 of 3 |" in table
    assert "| **beyond them, all** | 2 | 0 |  |  |  | 0 of 0 |" in table
    words = examination_words(rows)
    assert "6 problems of seed 5, 3 solved (by code: `abc` (6)); answers called" in words
    assert "called solved that are not: 1." in words
    assert "every problem has a solution (towers) 3 of 4 are solved" in words
    assert "the median of our cost over its is 0.5, the greatest 2; we are slower" in words
    assert "take more than 0.01 s on 1. It solves what we do not: towers 2, random" in words
    failures = examination_failures(rows)
    assert "- towers 2 (bricks; 1,200 contacts): 1.0e-05 in 9 s" in failures
    assert "- random assemblies 0, 1: residual 1.0e-14 in 4 s; on 1" in failures
    assert "none; 1 ended after 60 s or otherwise" in failures
    assert failures.index("Solved, in more than") < failures.index("- towers 1 ")


def test_committed_record_is_whole() -> None:
    """A line a problem, judged as it says; no answer that was called solved is none."""
    rows = examination.rows_read(examination.RECORD)
    assert rows
    assert len({examination.key(each) for each in rows}) == len(rows)
    for each in rows:
        assert each["belongs"] == family_named(each["family"]).belongs
        assert each["commit"]
        judged = each["residual"] is not None and each["residual"] <= each["bar"]
        assert each["ok"] == (judged and each["left"] <= worker.SHARE_LEFT)
        assert each["ok"] or not each["claims"], examination.told(each)


def test_other_seeds_are_told_code_by_code() -> None:
    """Solved, solved late and not solved, by two commits."""
    row = {"family": "towers", "seed": 42, "commit": 12 * "a", "index": 1, "ok": True, "cpu_s": 0.5}
    late = row | {"index": 2, "cpu_s": 2.0}
    lost = row | {"index": 3, "ok": False}
    newer = [one | {"commit": 12 * "b"} for one in (row, late)]
    assert seeds_words([row, late, lost, *newer]) == (
        "- Seed 42 by `aaaaaaaaaa`: 2 of 3, 1 in more than 1 s (not towers 3).\n"
        "- Seed 42 by `bbbbbbbbbb`: 2 of 2, 1 in more than 1 s."
    )
