"""Solvers of rigid contact with friction: real problems, speed against error, beside their peers.

    trackbed validate rigid            judges the record, after the problems that it lacks (all:
                                       hours), and runs the hard cases: some ten minutes
    trackbed validate rigid --quick    small generated problems, no Siconos, and short hard cases

With ``TRACKBED_DATA`` set the stored problems are among them.  What comes out in words and
pictures: ``docs/rigid-solvers.md``.
"""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rigid_lcp.friction_problem import FrictionProblem, friction_problem
from rigid_lcp.problem_files import read_forces, read_problem
from validation import rigid_report as report
from validation.case import Check
from validation.cases import rigid_hard_cases
from validation.rigid_peers import ONE_THREAD
from validation.rigid_problems import NONUNIQUE, all_problems, data_folder
from validation.rigid_report import HYBRID, OSQP, OURS, Row
from validation.rigid_runs import LADDER, LARGE, RECORD, rows_read

SECONDS = 1.0
"""Most that a stored problem may cost [s]."""
LEAD = 10.0
"""Least lead on the best solver of Siconos at its own best residual."""


def run(quick: bool) -> list[Check]:
    """All checks; the quick form makes runs of its own."""
    checks = nonunique_checks()
    if not quick:
        lacking = problems_lacking(rows_read(RECORD))
        if lacking:
            record_apart(RECORD, "--problems", ",".join(lacking))
        return checks + record_checks(rows_read(RECORD)) + rigid_hard_cases.run(quick)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rigid-solvers.jsonl"
        record_apart(path, "--quick", "--budget", "1")
        return checks + record_checks(rows_read(path)) + rigid_hard_cases.run(quick)


def problems_lacking(rows: Sequence[Row]) -> list[str]:
    """Names of the problems on which the record has no run of ours; none of them is made."""
    there = {row.get("problem") for row in report.of(rows, OURS)}
    return [named.name for named in all_problems(quick=False) if named.name not in there]


def record_apart(path: Path, *flags: str) -> None:
    """`rigid_runs` in a process whose libraries have one thread each; what it says goes to
    stderr, a line a run."""
    command = [sys.executable, "-m", "validation.rigid_runs", "--out", str(path), *flags]
    root = str(Path(__file__).resolve().parents[2])
    subprocess.run(
        command, check=True, stdout=sys.stderr, env=os.environ | ONE_THREAD | {"PYTHONPATH": root}
    )


def record_checks(rows: Sequence[Row]) -> list[Check]:
    """The bars on a record."""
    checks = [check for family in report.families(rows) for check in family_checks(rows, family)]
    checks += [*siconos_checks(rows), *hybrid_checks(rows), *frictionless_checks(rows)]
    checks += [*scale_checks(rows), *pivoting_checks(rows)]
    checks += dantzig_checks(rows)
    silent = len(report.silent_failures(rows))
    checks.append(Check("our runs that fail and do not say so", silent, "= 0", silent == 0))
    wrong = len(report.wrong_answers(report.races(rows)))
    return [
        *checks,
        Check("runs that say solved with a wrong answer", wrong, "reported", True),
        Check("runs that killed their process", len(report.deaths(rows)), "reported", True),
    ]


def family_checks(rows: Sequence[Row], family: str) -> list[Check]:
    """Every problem to its bar by the default solver, the stored ones within a second."""
    each = report.problems(report.of(rows, OURS), family)
    missed = [name for name, mine in each.items() if report.outcome(mine) != "reached"]
    costs = [report.cost_to(mine, mine[0]["bar"]) for mine in each.values()]
    slowest = max(costs, default=np.nan)
    title = f"{family}: problems of {len(each)} not brought to 1e-12"
    named = f" ({', '.join(missed)})" if missed else ""
    checks = [Check(title + named, len(missed), "= 0", not missed)]
    bar = family in ("stored", "unseen")
    checks.append(
        Check(
            f"{family}: greatest cost of that", slowest, f"<= {SECONDS:g}" if bar else "reported",
            not bar or slowest <= SECONDS, "s",
        )
    )  # fmt: skip
    return checks


def siconos_checks(rows: Sequence[Row]) -> list[Check]:
    """Cost of the best Siconos solver over ours, at the least residual that Siconos reached."""
    leads = {
        name: report.siconos_lead(each)
        for name, each in report.packings_between(rows, 500, 5000).items()
        if report.starting(each, "Siconos")
    }
    checks = [
        Check(
            f"{name}: cost of the best of Siconos over ours, residual {error:.1g}", lead,
            f">= {LEAD:g}", lead >= LEAD,
        )
        for name, (error, lead) in leads.items()
    ]  # fmt: skip
    for name, each in report.packings_between(rows, LARGE, 5000).items():
        for level, ours, theirs in report.ladder(each, LADDER):
            if np.isfinite(theirs):
                title = f"{name}: the same at residual {level:.0e}"
                checks.append(Check(title, theirs / ours, "reported", True))
    return checks


def hybrid_checks(rows: Sequence[Row]) -> list[Check]:
    """On packings of 500 to 5,000 contacts ours is not slower than the convex start with Newton
    polish; on all problems together the greatest ratio is reported, times below 1 ms as 1 ms."""
    large = report.packings_between(rows, 500, 5000)
    found = report.cost_ratios(rows, HYBRID)
    checks = [
        Check(f"{name}: cost of ours over {HYBRID}'s", found[name], "<= 1", found[name] <= 1)
        for name in large
        if name in found
    ]
    if found:
        worst = max(found, key=lambda name: found[name])
        slower = sum(value > 1 for value in found.values())
        checks += [
            Check(f"all problems: greatest of that ({worst})", found[worst], "reported", True),
            Check(f"all problems: slower, of {len(found)}", slower, "reported", True),
        ]
    return checks


def frictionless_checks(rows: Sequence[Row]) -> list[Check]:
    """Without friction, against OSQP polished."""
    checks = []
    for name, each in report.problems(rows, "frictionless").items():
        theirs = report.of(each, OSQP)
        if not theirs:
            continue
        error = max(report.least_error(theirs), 1e-12)
        cost, mine = (report.cost_to(r, error) for r in (theirs, report.of(each, OURS)))
        value = report.ratio(mine, cost)
        title = f"{name}: cost of ours over OSQP's, polished, residual {error:.1g}"
        checks.append(Check(title, value, "<= 1", value <= 1))
    return checks


def scale_checks(rows: Sequence[Row]) -> list[Check]:
    """A time step of 1e4 contacts warm-started, and 1e5 contacts, where they are recorded."""
    checks = []
    for row in rows:
        if row["case"] == "rigid-scale":
            ok = row["ok"] and row["cost_s"] <= row["bar_s"]
            title = f"{row['problem']} ({row['contacts']}): cost of {row['setting']['tolerance']:g}"
            checks.append(Check(title, row["cost_s"], f"<= {row['bar_s']:g}", ok, "s"))
    return checks


def pivoting_checks(rows: Sequence[Row]) -> list[Check]:
    """Pivoting does not cycle at the friction where Dantzig's algorithm does."""
    each = {
        name: mine
        for name, mine in report.problems(report.of(rows, "rigid_lcp pivoting")).items()
        if name.startswith("discs")
    }
    missed = sum(report.outcome(mine) != "reached" for mine in each.values())
    title = f"pivoting: packings of {len(each)} not solved"
    return [Check(title, missed, "= 0", missed == 0)] if each else []


def dantzig_checks(rows: Sequence[Row]) -> list[Check]:
    """Where the paper's algorithm works; what fails must say so."""
    checks = []
    drives = ("dantzig", "dantzig, reversal")
    for bed, method in itertools.product(report.dantzig_beds(rows), drives):
        for friction, (solved, orders) in report.dantzig_success(rows, method, bed).items():
            title = f"{method}, {bed}, friction {friction:g}: solved of {orders} orders"
            sure = friction == 0
            bar = f"= {orders}" if sure else "reported"
            checks.append(Check(title, solved, bar, solved == orders or not sure))
    ends = report.dantzig_ends(rows)
    silent = sum(count for (_, end, _), count in ends.items() if end == "silent")
    checks.append(Check("dantzig: failures without a status", silent, "= 0", silent == 0))
    return checks


# --- more than one solution -------------------------------------------------------------------


def nonunique_checks() -> list[Check]:
    """Problems with several true solutions, whose velocities differ: residuals judge, not peers."""
    problem, forces = jam_or_part()
    checks = _solutions_checks("one contact that jams or parts", problem, forces)
    folder = data_folder()
    if folder is not None:
        path = folder / f"{NONUNIQUE}.npz"
        checks += _solutions_checks(NONUNIQUE, read_problem(path), read_forces(path))
    return checks


def jam_or_part() -> tuple[FrictionProblem, np.ndarray]:
    """One contact, W symmetric and positive definite, with two solutions.

    ``W = [1, -c; -c, 1]``, ``q = (1, -2)``: r = 0 leaves ``u = q`` with ``u_N = 1 > 0``, and
    ``r = -W^-1 q = (2 c - 1, 2 - c) / (1 - c^2)`` leaves u = 0; both obey Coulomb's law where
    ``mu >= (2 - c) / (2 c - 1)``, here c = 0.9, so mu >= 1.375.
    """
    c, q = 0.9, np.array([1.0, -2.0])
    problem = friction_problem(np.array([[1.0, -c], [-c, 1.0]]), q, 2.0, 2)
    sticking = np.array([2 * c - 1, 2 - c]) / (1 - c**2)
    return problem, np.array([[0.0, 0.0], sticking])


def _solutions_checks(name: str, problem: FrictionProblem, forces: np.ndarray) -> list[Check]:
    residual = max(problem.residual(force) for force in forces)
    velocities = np.array([problem.velocity(force) for force in forces])
    apart = float(np.abs(velocities[:, None] - velocities[None]).max())
    apart /= float(np.abs(problem.offset).max())
    return [
        Check(f"{name}: residual of {len(forces)} solutions", residual, "<= 1e-12",
              residual <= 1e-12),
        Check(f"{name}: difference of their velocities, of the largest q", apart, ">= 0.01",
              apart >= 0.01),
    ]  # fmt: skip
