"""The race of friction solvers: which runs are made, and their record.

    python -m validation.rigid_runs                all runs that the record has not yet
    python -m validation.rigid_runs --fresh        those too that another commit made; goes on
                                                   where it was stopped
    python -m validation.rigid_runs --methods rigid_lcp --problems stored --fresh     some again
    python -m validation.rigid_runs --quick --out quick.jsonl     small generated problems only

With those of Dantzig's algorithm and of large packings (`rigid_dantzig_runs`, `rigid_scale_runs`).
The page is made of it by `python -m validation.rigid_page`.

One JSON line a run in ``validation/results/rigid-solvers.jsonl``: problem, method, what it was
asked for, its error and its cost.  Every answer is judged by the same residual (`rigid_lcp.cones`),
with the tolerance asked for, other settings as they come, cold start, one thread.  A run that
fails is a line that says how.  Costs are processor seconds (`rigid_timing`), where a run is short
the median of five means over `rigid_peers.batch_size` runs.  With the variable TRACKBED_DATA set,
the stored problems are raced too (`rigid_problems`).
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from adapters.provenance import provenance
from rigid_lcp.friction_problem import FrictionProblem
from validation import rigid_peers as peers
from validation.rigid_cone_programs import library_missing
from validation.rigid_dantzig_runs import dantzig_rows, warm
from validation.rigid_peers import PeerRun
from validation.rigid_problems import NamedProblem, all_problems, bodies_anew
from validation.rigid_report import least_error, starting
from validation.rigid_scale_runs import SCALES, Scale, scale_row
from validation.rigid_timing import repeated

Row = dict[str, Any]
RECORD = Path(__file__).parent / "results" / "rigid-solvers.jsonl"
TOLERANCES = (1e-4, 1e-8, 1e-12)
"""What every method is asked for,"""
LADDER = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
"""and on packings of `LARGE` contacts and more, where costs at equal residual are compared."""
LARGE, HUGE = 500, 2000
MOST_S = 60.0
"""Processor seconds of a run of ours, and of all runs unless told otherwise."""
RIVAL_S, OTHER_S = 5.0, 1.0
"""Of the nearest rivals, and of the other methods."""
SICONOS_S = {0: 1.0, LARGE: 5.0, HUGE: 15.0}
"""Of Siconos, by the least number of contacts; large ones are packings only."""
DANTZIG_MOST, PIVOTING_MOST = 500, 1000
OURS = ("auto", "newton", "interior-point", "gauss-seidel", "pivoting", "dantzig")
FEW_METHODS = {
    "unseen": ("rigid_lcp", "Clarabel + Newton"),
    "other": ("rigid_lcp", "Clarabel + Newton"),
    "frictionless": ("rigid_lcp", "Clarabel + Newton", "OSQP polished"),
}
"""What is run on families of many problems, by the first word of their names: our default and its
nearest rivals; all methods on the others."""
RIVALS = ("Clarabel + Newton", "OSQP polished")
NAMES = ("rigid_lcp", "Clarabel")
"""Names of methods with which others begin too: asked for, they are meant alone."""
ORIGIN = ("commit", "command", "machine", "started")


# --- methods ----------------------------------------------------------------------------------


def methods(
    problem: FrictionProblem, quick: bool, rows: Callable[[], Sequence[Row]] = tuple
) -> dict[str, Callable[[float], list[PeerRun]]]:
    """What is run on a problem, by name; each makes all its runs with a budget [s] at most.

    ``quick``: without Siconos, which takes most of the time.  ``rows``: what is recorded of the
    problem when a run begins; our default is asked for what Siconos reached, too, so that costs
    at equal residual can be compared.
    """
    runs: dict[str, Callable[[float], list[PeerRun]]] = {}
    if not quick and problem.friction.any() and not peers.siconos_missing():
        for solver in peers.siconos_solvers(problem):
            runs[f"Siconos {solver}"] = _siconos(problem, solver)
    for name in OURS:
        if _fits(name, problem):
            title = "rigid_lcp" if name == "auto" else f"rigid_lcp {name}"
            runs[title] = _ours(problem, name, rows if name == "auto" else tuple)
    frictionless = not problem.friction.any()
    if not library_missing("clarabel"):
        runs["Clarabel"] = _each(problem, lambda t, s: peers.clarabel(problem, t, s))
        runs["Clarabel + Newton"] = _each(
            problem, lambda t, s: peers.clarabel_newton(problem, t, s)
        )
    if frictionless and not library_missing("osqp"):
        runs["OSQP polished"] = _each(problem, lambda t, s: peers.osqp(problem, t))
    return runs


def budget(named: NamedProblem, problem: FrictionProblem, method: str) -> float:
    """Processor seconds that a run of a method on a problem may take."""
    if method == "rigid_lcp":
        return MOST_S
    if method.startswith("Siconos"):
        contacts = problem.contacts if named.hyperstatic else 0
        return max(seconds for least, seconds in SICONOS_S.items() if least <= contacts)
    return RIVAL_S if method in RIVALS else OTHER_S


def raced(named: NamedProblem, problem: FrictionProblem, method: str) -> bool:
    """Whether a method is run on a problem: see `FEW_METHODS`; Siconos also on other packings of
    the size for which there is a bar beside it."""
    kind = named.family.split()[0]
    if kind == "other" and method.startswith("Siconos"):
        return problem.contacts >= LARGE
    return method in FEW_METHODS.get(kind, (method,))


def tolerances(problem: FrictionProblem) -> tuple[float, ...]:
    """What is asked for on a problem."""
    return LADDER if problem.contacts >= LARGE and problem.friction.any() else TOLERANCES


def _fits(name: str, problem: FrictionProblem) -> bool:
    most = {"dantzig": DANTZIG_MOST, "pivoting": PIVOTING_MOST}.get(name, 10**9)
    return problem.contacts <= most and not (most < 10**9 and problem.dim == 3)


def _ours(
    problem: FrictionProblem, name: str, rows: Callable[[], Sequence[Row]]
) -> Callable[[float], list[PeerRun]]:
    from rigid_lcp.solver import solve_friction

    method: Any = name

    def solve(tolerance: float, _: float) -> PeerRun:
        w: Any = problem.matrix if problem.bodies is None else bodies_anew(problem)
        start = time.process_time()
        found = solve_friction(
            w, problem.offset, problem.friction, problem.dim, tolerance=tolerance, method=method
        )
        cost = time.process_time() - start
        unit, count = max(found.work.items(), key=lambda each: each[1], default=("", 0.0))
        why = "" if found.solved else f"{found.status}: {found.message.splitlines()[0]}"
        return PeerRun({"tolerance": tolerance}, found.r, cost, (), count, unit, found.solved, why)

    return _each(problem, solve, rows)


def _each(
    problem: FrictionProblem, solve: Callable[[float, float], PeerRun],
    rows: Callable[[], Sequence[Row]] = tuple,
) -> Callable[[float], list[PeerRun]]:  # fmt: skip
    """All tolerances, and what Siconos reached by ``rows``, within the budget each, repeated where
    short."""

    def runs(budget_s: float) -> list[PeerRun]:
        asked = tolerances(problem)
        reached = least_error(starting(rows(), "Siconos"))
        if problem.contacts >= LARGE and asked[-1] < reached < asked[0]:
            asked = tuple(sorted({*asked, reached}, reverse=True))
        return [repeated(solve, tolerance, budget_s) for tolerance in asked]

    return runs


def _siconos(problem: FrictionProblem, solver: str) -> Callable[[float], list[PeerRun]]:
    return lambda budget_s: peers.siconos(problem, solver, tolerances(problem), budget_s)


# --- rows -------------------------------------------------------------------------------------


def row_of(
    named: NamedProblem, problem: FrictionProblem, method: str, run: PeerRun, budget_s: float
) -> Row:
    """A line of the record.  ``ok``: the residual is the one that was asked for, or less."""
    error = None
    if run.force is not None and np.isfinite(run.force).all():
        error = problem.residual(run.force)
    ok = error is not None and error <= max(run.setting["tolerance"], named.bar)
    why = run.why
    if error is None and not why:
        why = "its forces are not finite"
    return {
        "case": "rigid-solvers", "problem": named.name, "family": named.family,
        "contacts": problem.contacts, "dim": problem.dim, "bar": named.bar, "method": method,
        "setting": run.setting, "seed": named.seed, "budget_s": budget_s, "error": error,
        "error_kind": "natural residual", "cost_s": run.cost_s, "repeats_s": list(run.repeats_s),
        "work": run.work, "work_unit": run.work_unit, "ok": ok, "claims": run.claims, "why": why,
    }  # fmt: skip


def rows_read(path: Path = RECORD) -> list[Row]:
    """The rows of a record, none if there is no file."""
    if not path.exists():
        return []
    return [json.loads(text) for text in path.read_text(encoding="utf-8").splitlines() if text]


def rows_named(rows: Sequence[Row], problem: str) -> list[Row]:
    """The rows of a problem."""
    return [row for row in rows if row.get("problem") == problem]


def rows_write(path: Path, rows: Sequence[Row]) -> None:
    """Write a record, whole or not at all."""
    temporary = path.with_name(path.name + ".partial")
    temporary.write_text("".join(json.dumps(row) + "\n" for row in rows), encoding="utf-8")
    temporary.replace(path)


# --- the race ---------------------------------------------------------------------------------


def race(
    path: Path, quick: bool, *, only_problems: str = "", only_methods: str = "",
    fresh: bool = False, budget_s: float = MOST_S, command: Sequence[str] = (),
) -> list[Row]:  # fmt: skip
    """Make the runs that ``path`` has not, all methods of a problem after another; all rows.

    ``only_problems``: words, with commas, of which the name of the problem or of its family holds
    one; ``only_methods``: names of methods, or how some begin.  Both empty for all.
    ``fresh``: what another commit recorded is made again.
    """
    origin = {key: value for key, value in provenance(command).items() if key in ORIGIN}
    rows = rows_read(path)

    def done(have: list[Row]) -> bool:
        """What is recorded need not be made again."""
        return bool(have) and not (fresh and any(r["commit"] != origin["commit"] for r in have))

    some_problems, some_methods = (
        [word for word in words.split(",") if word] for words in (only_problems, only_methods)
    )
    warm()
    for named in all_problems(quick):
        title = f"{named.family} {named.name}"
        if some_problems and not any(word in title for word in some_problems):
            continue
        problem = named.make()
        recorded = partial(rows_named, rows, named.name)
        for method, runs in methods(problem, quick, recorded).items():
            if some_methods and not any(
                method == word if word in NAMES else method.startswith(word)
                for word in some_methods
            ):
                continue
            if not raced(named, problem, method):
                continue
            have = [row for row in recorded() if row["method"] == method]
            if done(have):
                continue
            most = min(budget_s, budget(named, problem, method))
            made = [row_of(named, problem, method, run, most) | origin for run in runs(most)]
            rows[:] = [row for row in rows if row not in have] + made
            rows_write(path, rows)
            best = min((r["error"] for r in made if r["error"] is not None), default=None)
            print(f"{time.strftime('%H:%M:%S')} {named.name} {method}: {best}", flush=True)
    for title, belongs, make in () if some_methods else further(quick):
        have = [row for row in rows if belongs(row)]
        if done(have) or (some_problems and not any(word in title for word in some_problems)):
            continue
        rows[:] = [row for row in rows if not belongs(row)] + [row | origin for row in make()]
        rows_write(path, rows)
        print(f"{time.strftime('%H:%M:%S')} {title}", flush=True)
    return rows


def further(quick: bool) -> list[tuple[str, Callable[[Row], bool], Callable[[], list[Row]]]]:
    """What else is recorded: name, which rows belong to it, and how they are made."""
    scales = () if quick else SCALES
    return [
        ("dantzig", lambda row: row["case"].startswith("rigid-dantzig"),
         lambda: dantzig_rows(quick)),
        *(
            (f"scale {scale.name}", partial(_of_scale, scale.name), partial(_scale_rows, scale))
            for scale in scales
        ),
    ]  # fmt: skip


def _of_scale(name: str, row: Row) -> bool:
    return row["case"] == "rigid-scale" and bool(row["problem"] == name)


def _scale_rows(scale: Scale) -> list[Row]:
    return [scale_row(scale)]


def main(arguments: Sequence[str] | None = None) -> None:
    """The command line above."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="small generated problems, no Siconos")
    parser.add_argument("--problems", default="", help="words in names of problems or families")
    parser.add_argument("--methods", default="", help="names of methods, or how some begin")
    parser.add_argument(
        "--fresh", action="store_true", help="make again what another commit recorded"
    )
    parser.add_argument("--budget", type=float, default=MOST_S, help="most seconds of a run")
    parser.add_argument("--out", type=Path, default=RECORD, help="the record (JSON lines)")
    asked = parser.parse_args(arguments)
    if asked.quick and asked.out == RECORD:
        parser.error("--quick needs an --out of its own")
    for name in peers.ONE_THREAD:
        if os.environ.get(name) != "1":
            raise SystemExit(f"set {', '.join(peers.ONE_THREAD)} to 1: costs are of one thread")
    words = sys.argv[1:] if arguments is None else arguments
    place = str(asked.out)  # of one machine: rows name the file alone
    told = [str(word).replace(place, asked.out.name) for word in words]
    command = ["python", "-m", "validation.rigid_runs", *told]
    race(
        asked.out, asked.quick, only_problems=asked.problems, only_methods=asked.methods,
        fresh=asked.fresh, budget_s=asked.budget, command=command,
    )  # fmt: skip


if __name__ == "__main__":
    main()
