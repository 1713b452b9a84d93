"""The record of the friction solvers and what the page says of it: rows, costs, outcomes."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import pytest
from numba import njit

from rigid_lcp.friction_problem import friction_problem
from rigid_lcp.solver import solve_friction
from validation import rigid_peers as peers
from validation import rigid_report as report
from validation import rigid_runs as runs
from validation import rigid_scale_runs as scale_runs
from validation.cases import rigid as case
from validation.cases.rigid import jam_or_part, nonunique_checks, scale_checks
from validation.rigid_packings import tower
from validation.rigid_problems import NamedProblem, changed
from validation.rigid_timing import OutOfTime, repeated

# --- runs and record --------------------------------------------------------------------------


def test_out_of_time_is_a_row() -> None:
    """A run that takes too long is stopped by its processor time, and told."""

    def endless(*_: float) -> peers.PeerRun:
        while True:
            pass

    before = time.process_time()
    found = repeated(endless, 1e-8, 0.05)
    assert time.process_time() - before < 2.0
    assert (found.force, found.why) == (None, "out of time")


@pytest.mark.long
def test_kernels_that_are_compiled_in_a_run_cost_it_nothing() -> None:
    """A checkout's first run: compiling takes longer than the limit, which does not count it, and
    the run is made again."""

    @njit
    def summed(values: np.ndarray) -> float:
        total = 0.0
        for one in np.sort(values):
            total += one
        return total

    def solve(tolerance: float, _: float) -> peers.PeerRun:
        before = time.process_time()
        summed(np.arange(3.0))
        cost = time.process_time() - before
        return peers.PeerRun({"tolerance": tolerance}, np.zeros(2), cost, (), 0.0, "", True, "")

    before = time.process_time()
    found = repeated(solve, 1e-8, 0.01)
    assert time.process_time() - before > 0.1  # compiled within a limit of 0.02 s
    assert found.why == ""
    assert found.cost_s is not None
    assert found.cost_s < 0.01


def test_a_peer_that_raises_is_a_row() -> None:
    """Any exception is a result."""

    def broken(*_: float) -> peers.PeerRun:
        raise RuntimeError("it broke")

    assert repeated(broken, 1e-8, 1.0).why == "RuntimeError: it broke"


def test_the_limit_wrapped_in_another_error_is_out_of_time() -> None:
    """Compiled code in which the limit strikes raises an error of its own, caused by it."""

    def compiled(*_: float) -> peers.PeerRun:
        try:
            raise OutOfTime
        except OutOfTime as struck:
            raise SystemError("returned a result with an exception set") from struck

    assert repeated(compiled, 1e-8, 1.0).why == "out of time"


def test_forces_that_are_not_finite() -> None:
    """No error, and the row says why."""
    problem = tower(1, 2)
    named = NamedProblem("tower", "towers 2D", lambda: problem)
    run = peers.PeerRun({"tolerance": 1e-8}, np.full(4, np.nan), 0.1, claims=True)
    row = runs.row_of(named, problem, "broken", run, 1.0)
    assert (row["error"], row["ok"], row["why"]) == (None, False, "its forces are not finite")


def test_race_resumes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is recorded is not run again, unless it is asked for; rows are JSON."""
    named = NamedProblem("tower2d_2", "towers 2D", lambda: tower(2, 2))
    monkeypatch.setattr(runs, "all_problems", lambda quick: [named])
    monkeypatch.setattr(runs, "warm", lambda: None)
    path = tmp_path / "record.jsonl"
    solve_friction(tower(2, 2).bodies, np.ones(8), 0.5, 2, method="newton")  # compiled
    arguments: dict[str, Any] = {"only_methods": "rigid_lcp newton", "budget_s": 1.0}
    rows = runs.race(path, True, **arguments)
    assert [row["setting"]["tolerance"] for row in rows] == list(runs.TOLERANCES)
    assert all(row["ok"] and len(row["repeats_s"]) == 5 for row in rows)
    assert [json.loads(line) for line in path.read_text().splitlines()] == rows
    again = {"rigid_lcp newton": lambda _: pytest.fail("it was run again")}
    monkeypatch.setattr(runs, "methods", lambda *_: again)
    assert runs.race(path, True, **arguments) == rows
    assert runs.race(path, True, fresh=True, **arguments) == rows  # the same commit made them
    assert runs.race(path, True, only_problems="packings") == rows


def test_fresh_is_by_commit(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """``fresh`` makes again what another commit made, Dantzig's and large packings' rows too."""
    monkeypatch.setattr(runs, "all_problems", lambda quick: [])
    monkeypatch.setattr(runs, "warm", lambda: None)
    commits = iter("aabb")
    monkeypatch.setattr(runs, "provenance", lambda _: {"commit": next(commits)})
    made: list[str] = []

    def further(_: bool) -> list[Any]:
        def rows() -> list[dict[str, Any]]:
            made.append("x")
            return [{"case": "rigid-scale", "problem": "x", "method": "m"}]

        return [("scale x", lambda row: row["problem"] == "x", rows)]

    monkeypatch.setattr(runs, "further", further)
    path = tmp_path / "record.jsonl"
    for fresh, count in ((False, 1), (True, 1), (True, 2), (False, 2)):
        found = runs.race(path, True, fresh=fresh)
        assert len(made) == count
        assert len(found) == 1
    assert found[0]["commit"] == "b"


@pytest.mark.parametrize(
    ("family", "method", "boxes", "made"),
    [
        ("other packings 3D", "Siconos 3D_NSGS", 125, True),
        ("other packings 3D", "Siconos 3D_NSGS", 124, False),
        ("other packings 3D", "Clarabel", 125, False),
        ("other packings 3D", "rigid_lcp", 124, True),
        ("unseen", "Siconos 3D_NSGS", 125, False),
        ("stored", "Siconos 3D_NSGS", 124, True),
    ],
)
def test_which_runs_are_made(family: str, method: str, boxes: int, made: bool) -> None:
    """Siconos races on packings that no setting was chosen by from 500 contacts, 4 a box."""
    problem = tower(boxes, 3)
    named = NamedProblem("spheres", family, lambda: problem)
    assert runs.raced(named, problem, method) is made


@pytest.mark.parametrize(("reached", "more"), [(3e-7, (3e-7,)), (2e-13, ()), (1e-3, ())])
@pytest.mark.long
def test_ours_is_asked_for_what_siconos_reached(reached: float, more: tuple[float, ...]) -> None:
    """Between the tolerances of all, so that costs are those of one residual; ours alone."""
    problem = tower(125, 3)
    rows = [{"method": "Siconos 3D_NSGS", "error": reached}, {"method": "Clarabel", "error": 4e-6}]
    made = runs.methods(problem, True, lambda: rows)
    asked = [run.setting["tolerance"] for run in made["rigid_lcp"](60.0)]
    assert asked == sorted({*runs.LADDER, *more}, reverse=True)
    asked = [run.setting["tolerance"] for run in made["rigid_lcp newton"](1.0)]
    assert asked == sorted(runs.LADDER, reverse=True)


def test_changed_problems_are_of_the_family() -> None:
    """Order, friction and q change by a seed; W keeps its eigenvalues, q its space."""
    problem = tower(3, 2)
    once, again = (changed(problem, np.random.default_rng(5)) for _ in range(2))
    assert (once.offset == again.offset).all()
    assert (once.friction != problem.friction).all()
    eigenvalues = [np.linalg.eigvalsh(each.delassus.toarray()) for each in (problem, once)]
    assert eigenvalues[0] == pytest.approx(eigenvalues[1], abs=1e-12)
    assert once.bodies is not None
    outside = np.linalg.lstsq(once.bodies.jacobian.toarray(), once.offset, rcond=None)[0]
    assert once.bodies.jacobian @ outside == pytest.approx(once.offset, abs=1e-14)
    plain = changed(
        friction_problem(problem.delassus, problem.offset, problem.friction, 2),
        np.random.default_rng(5),
    )
    assert (plain.friction == once.friction).all()


# --- the report -------------------------------------------------------------------------------


def row(method: str, problem: str, error: float | None, cost: float, **more: Any) -> dict[str, Any]:
    """A line of a record."""
    return {
        "case": "rigid-solvers", "family": "stored", "problem": problem, "method": method,
        "setting": {"tolerance": 1e-12}, "error": error, "cost_s": cost, "bar": 1e-12,
        "contacts": 600, "claims": False, "ok": error is not None and error <= 1e-12, "why": "x",
    } | more  # fmt: skip


def test_cost_at_equal_residual() -> None:
    """The cheapest run that is as good; infinite if none is."""
    rows = [row("a", "p", 1e-4, 0.1), row("a", "p", 1e-8, 1.0), row("a", "p", None, 0.01)]
    assert report.cost_to(rows, 1e-3) == 0.1
    assert report.cost_to(rows, 1e-6) == 1.0
    assert report.cost_to(rows, 1e-9) == np.inf
    assert report.least_error(rows) == 1e-8


def test_costs_beside_rivals() -> None:
    """At each residual our cost and the least of Siconos; ratios where the rival gets there."""
    rows = [
        row("rigid_lcp", "p", 1e-13, 0.1), row("rigid_lcp", "p", 1e-5, 0.05),
        row("Siconos A", "p", 1e-5, 0.4), row("Siconos B", "p", 1e-7, 0.8),
        row(report.HYBRID, "p", 1e-14, 0.2), row(report.HYBRID, "q", 1e-3, 0.2),
        row("rigid_lcp", "q", 1e-13, 0.1),
    ]  # fmt: skip
    each = report.problems(rows)["p"]
    assert report.ladder(each, (1e-4, 1e-6)) == [(1e-4, 0.05, 0.4), (1e-6, 0.1, 0.8)]
    assert report.ladder(each, (1e-9,)) == [(1e-9, 0.1, np.inf)]
    assert report.cost_ratios(rows, report.HYBRID) == pytest.approx({"p": 0.5})


def test_lead_on_siconos() -> None:
    """At the least residual that any of its solvers reached, its cheapest run over ours."""
    rows = [
        row("Siconos a", "discs", 1e-5, 2.0), row("Siconos b", "discs", 1e-6, 4.0),
        row("rigid_lcp", "discs", 1e-4, 0.01), row("rigid_lcp", "discs", 1e-13, 0.1),
    ]  # fmt: skip
    assert report.siconos_lead(rows) == (1e-6, pytest.approx(40.0))


@pytest.mark.parametrize(
    ("error", "more", "words"),
    [
        (1e-13, {}, "reached"),
        (1e-9, {}, "stopped short"),
        (1e-2, {"claims": True}, "wrong, though it says solved"),
        (1e-2, {}, "stopped short"),
        (None, {"why": "out of time"}, "out of time"),
        (None, {"why": "died of SIGABRT: x"}, "died"),
        (None, {"why": "SystemError: x"}, "raised an error"),
    ],
)
def test_outcomes(error: float | None, more: dict[str, Any], words: str) -> None:
    """What became of a method on a problem."""
    assert report.outcome([row("a", "p", error, 1.0, **more)]) == words


def test_profile() -> None:
    """Method a is fastest on p and fails on q, b takes four times as long on p."""
    rows = [row("a", "p", 1e-13, 0.1), row("b", "p", 1e-13, 0.4), row("a", "q", 1e-3, 0.1),
            row("b", "q", 1e-13, 0.5)]  # fmt: skip
    factors = [1, 3.9, 4.1, 100]
    assert report.profile(rows, "a", ("a", "b"), factors) == pytest.approx([0.5, 0.5, 0.5, 0.5])
    assert report.profile(rows, "b", ("a", "b"), factors) == pytest.approx([0.5, 0.5, 1.0, 1.0])


def test_silent_failures() -> None:
    """A run of ours that claims what it has not, or does not say why, is found."""
    rows = [
        row("rigid_lcp", "p", 1e-3, 0.1), row("rigid_lcp", "q", 1e-3, 0.1, claims=True),
        row("rigid_lcp newton", "p", 1e-3, 0.1, why=""), row("other", "p", 1e-3, 0.1, why=""),
    ]  # fmt: skip
    assert [each["problem"] for each in report.silent_failures(rows)] == ["q", "p"]


def test_two_solutions_of_one_contact() -> None:
    """Residuals of both are round-off and their velocities (1, -2) and (0, 0) differ by 2."""
    problem, forces = jam_or_part()
    assert np.linalg.eigvalsh(problem.delassus.toarray()).min() > 0
    assert [problem.residual(force) <= 1e-15 for force in forces] == [True, True]
    assert problem.velocity(forces[1]) == pytest.approx([0.0, 0.0], abs=1e-15)
    assert all(check.holds for check in nonunique_checks())
    less = friction_problem(problem.delassus, problem.offset, 1.37, 2)  # below 1.375: slides
    assert less.residual(forces[1]) > 1e-4


# --- large packings ---------------------------------------------------------------------------


def test_scale_row(monkeypatch: pytest.MonkeyPatch) -> None:
    """A small bed: warm-started from the step before, which is nearer than no forces."""
    monkeypatch.delenv("TRACKBED_BEDS", raising=False)
    small = scale_runs.Scale("small, warm", 12, 2, True, 1e-8, 1.0, settle=20)
    made = scale_runs.scale_row(small)
    assert made["ok"]
    assert made["error"] <= 1e-8
    assert made["start_error"] < 1.0
    (check,) = scale_checks([made])
    assert check.holds == (made["cost_s"] <= 1.0)


def test_what_the_record_holds_is_not_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """`trackbed validate rigid` pours no bed to see that it has its rows already."""

    def refuse() -> NoReturn:
        raise AssertionError("made")

    named = [NamedProblem(name, "family", refuse) for name in ("here", "lacking")]
    monkeypatch.setattr(case, "all_problems", lambda quick: named)
    rows = [{"case": "rigid-solvers", "problem": "here", "method": report.OURS}]
    assert case.problems_lacking(rows) == ["lacking"]


@pytest.mark.parametrize("form", ["--out {}", "--out={}"])
def test_rows_name_the_record_and_not_its_place(form, tmp_path, monkeypatch) -> None:
    """A path of the machine that made a row means nothing to who makes it again."""
    kept: list[str] = []
    monkeypatch.setattr(runs, "race", lambda *_, command, **__: kept.extend(command))
    for name in peers.ONE_THREAD:
        monkeypatch.setenv(name, "1")
    runs.main(["--quick", *form.format(tmp_path / "some.jsonl").split()])
    assert " ".join(kept).endswith("--quick " + form.format("some.jsonl"))
    assert all(" /" not in row["command"] for row in runs.rows_read(runs.RECORD))
