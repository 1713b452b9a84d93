"""The runs of the race and of the examination, a part of the record each.

A part of the race is a problem: ``runs``, by solver the rows ``[asked, cost_s, residual, claims]``,
of Siconos those only that no other of its runs beats in cost and residual.  A part of the
examination is a family of unseen problems of one seed: ``posed``, a column each.  Both need
TRACKBED_DATA and TRACKBED_SICONOS for other people's problems (`validation.bench`).  Set
OPENBLAS_NUM_THREADS and its like to 1: costs are of one thread.
"""

from __future__ import annotations

import multiprocessing
import resource
import time
from collections.abc import Callable, Sequence
from functools import partial
from math import ceil
from typing import Any

import numpy as np
from numba.core.event import install_recorder

from rigid_lcp.friction.auto.solve import solve_friction
from rigid_lcp.friction.problem.definition import FrictionProblem
from rigid_lcp.friction.problem.proofs import gives_energy
from validation.bench.rigid.examination import FAMILIES, Family
from validation.bench.rigid.friction_problems import NamedProblem, list_problems, renew_bodies
from validation.bench.rigid.judge import measure_residual
from validation.bench.rigid.packings import build_tower
from validation.studies.rigid_solvers.peers import (
    Answer,
    choose_solvers,
    has_siconos,
    is_installed,
    solve_by_clarabel,
    solve_by_hybrid,
    solve_by_osqp,
    solve_by_siconos,
)

Row = dict[str, Any]
OURS, HYBRID, OSQP, CLARABEL = "rigid_lcp", "Clarabel + Newton", "OSQP polished", "Clarabel"
TOLERANCES = (1e-4, 1e-8, 1e-12)
"""What every solver is asked for,"""
LADDER = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
"""and on packings of `LARGE` contacts and more, where costs at equal residual are compared."""
LARGE = 500
BUDGET_S = {OURS: 60.0, HYBRID: 5.0, OSQP: 5.0, CLARABEL: 1.0, "Siconos": 5.0}
"""Processor seconds that a run may take; near yield `YIELD_S` for all,"""
YIELD_S = 60.0
SMALL_S = 1.0
"""and for Siconos below `LARGE` contacts, where it has some ten solvers for each problem."""
FEW = {
    "other": (OURS, HYBRID), "frictionless": (OURS, HYBRID, OSQP), "near": (OURS, HYBRID),
}  # fmt: skip
"""What is run on families of many problems, by the first word of their names."""
SHORT_S, REPEATED_S = 0.5, 0.1
"""Runs of less time [s] are repeated for so long; their cost is the median."""
SHARE_LEFT = 0.1
"""Of the natural map without forces; a solution leaves less, forces without bound do not."""
SEEDS = (2026, 101)
"""Seeds of the examination; the first for all families, the other for `OTHER_FAMILIES`."""
OTHER_FAMILIES = ("beds kicked", "beds tilted", "large packings")


def run_limited(job: Callable[[], Row], seconds: float) -> Row | None:
    """Do a job in a process that ends when it has used so many processor seconds; None then.

    The clock of a process with such a limit may tick by milliseconds (Linux 6.18), so costs are
    read from that of the thread.
    """
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe(duplex=False)

    def serve() -> None:
        resource.setrlimit(resource.RLIMIT_CPU, (ceil(seconds), resource.RLIM_INFINITY))
        theirs.send(job())

    process = context.Process(target=serve)
    process.start()
    theirs.close()
    try:
        return dict(ours.recv())
    except EOFError:
        return None
    finally:
        process.join()


def time_answer(solve: Callable[[], Answer]) -> Answer:
    """An answer, its cost the median of many where it is short, without that of compiling."""
    with install_recorder("numba:compile") as compiled:
        answer = solve()
    if compiled.buffer:
        answer = solve()
    if answer.cost_s > SHORT_S:
        return answer
    costs: list[float] = []
    spent = 0.0
    while spent < REPEATED_S or len(costs) < 3:
        costs.append(solve().cost_s)
        spent += max(costs[-1], 1e-4)
    return Answer(answer.tolerance, answer.force, float(np.median(costs)), answer.claims)


def solve_by_ours(problem: FrictionProblem, tolerance: float, _: float = 0.0) -> Answer:
    """`solve_friction` by its default settings."""
    w = problem.delassus if problem.bodies is None else renew_bodies(problem)
    start = time.thread_time()
    found = solve_friction(
        w, problem.offset, problem.friction, problem.dim, tolerance=tolerance
    )  # fmt: skip
    return Answer(tolerance, found.r, time.thread_time() - start, found.solved)


def load_kernels() -> None:
    """Compile, or load, what is timed later."""
    for dim in (2, 3):
        small = build_tower(2, dim)
        for w in (small.bodies, small.delassus):
            solve_friction(w, small.offset, small.friction, dim)


# --- the race ---------------------------------------------------------------------------------

SOLVERS: dict[str, Callable[[FrictionProblem, float, float], Answer]] = {
    OURS: solve_by_ours,
    HYBRID: solve_by_hybrid,
    CLARABEL: solve_by_clarabel,
    OSQP: lambda problem, tolerance, _: solve_by_osqp(problem, tolerance),
}


def race(named: NamedProblem) -> Row:
    """All solvers that are installed and meant for a problem."""
    problem = named.make()
    kind, friction = named.family.split()[0], bool(problem.friction.any())
    large = problem.contacts >= LARGE and friction
    asked = LADDER if large and kind != "near" else TOLERANCES
    there = {OURS, *([HYBRID, CLARABEL] if is_installed("clarabel") else [])}
    there |= {OSQP} if not friction and is_installed("osqp") else set()
    load_kernels()
    runs: dict[str, list[list[Any]]] = {}
    for name in SOLVERS:
        if name not in there or name not in FEW.get(kind, (name,)):
            continue
        most = YIELD_S if kind == "near" else BUDGET_S[name]
        for tolerance in asked:
            solve = partial(SOLVERS[name], problem, tolerance, most)
            made = run_limited(partial(_measure, problem, solve), 2 * most + 10)
            runs.setdefault(name, []).append([tolerance, *(made["run"] if made else [None] * 3)])
    if friction and has_siconos() and (kind not in FEW or (kind == "other" and large)):
        most = BUDGET_S["Siconos"] if large else SMALL_S
        answers = [
            [tolerance, *_judge(problem, answer)["run"]]
            for solver in choose_solvers(problem)
            for tolerance in asked
            for answer in solve_by_siconos(problem, solver, tolerance, most)
        ]
        runs["Siconos"] = keep_best(answers)
    return {"family": named.family, "contacts": problem.contacts, "dim": problem.dim,
            "bar": named.bar, "runs": runs}  # fmt: skip


def _measure(problem: FrictionProblem, solve: Callable[[], Answer]) -> Row:
    return _judge(problem, time_answer(solve))


def _judge(problem: FrictionProblem, answer: Answer) -> Row:
    finite = np.isfinite(answer.force).all()
    error = float(f"{problem.residual(answer.force):.3g}") if finite else None
    return {"run": [float(f"{answer.cost_s:.4g}"), error, bool(answer.claims)]}


def keep_best(runs: Sequence[list[Any]]) -> list[list[Any]]:
    """Runs ``[asked, cost, residual, claims]`` that none beats in both cost and residual."""
    kept, least = [], float("inf")
    for run in sorted((run for run in runs if run[2] is not None), key=lambda run: run[1]):
        if run[2] < least:
            kept.append(run)
            least = run[2]
    return kept


# --- the examination --------------------------------------------------------------------------


def examine(family: Family, seed: int) -> Row:
    """All problems of a family and a seed, by ours and the hybrid, judged apart."""
    load_kernels()
    posed: dict[str, list[Any]] = {}
    for index in range(family.count):
        problem = family.pose(seed, index)
        row = {"index": index, "contacts": problem.problem.contacts, "cpu_s": None,
               "residual": None, "ok": False, "claims": False, "status": "out of time",
               "rival_s": None, "rival_ok": False}  # fmt: skip
        row |= run_limited(partial(_solve_posed, problem), 2 * BUDGET_S[OURS]) or {}
        if is_installed("clarabel"):
            row |= run_limited(partial(_solve_by_rival, problem), 4 * BUDGET_S[HYBRID]) or {}
        for name, value in row.items():
            posed.setdefault(name, []).append(value)
    return {"family": family.name, "belongs": family.belongs, "seed": seed, "posed": posed}


def _solve_posed(posed: Any) -> Row:
    problem, bar = posed.problem, posed.bar
    status = ""

    def solve() -> Answer:
        nonlocal status
        w = problem.delassus if problem.bodies is None else renew_bodies(problem)
        start = time.thread_time()
        found = solve_friction(w, problem.offset, problem.friction, problem.dim, posed.start)
        status = found.status
        return Answer(bar, found.r, time.thread_time() - start, found.solved)

    answer = time_answer(solve)
    residual, left = measure_residual(problem, answer.force)
    ok = residual <= bar and left <= SHARE_LEFT
    if not ok and gives_energy(problem):
        status += ", W gives energy"
    return {"cpu_s": answer.cost_s, "residual": residual, "ok": bool(ok),
            "claims": answer.claims, "status": status}  # fmt: skip


def _solve_by_rival(posed: Any) -> Row:
    answer = time_answer(lambda: solve_by_hybrid(posed.problem, posed.bar, BUDGET_S[HYBRID]))
    residual, left = measure_residual(posed.problem, answer.force)
    return {"rival_s": answer.cost_s, "rival_ok": bool(residual <= posed.bar and left < SHARE_LEFT)}


PARTS: dict[str, Callable[[], Row]] = {
    **{named.name: partial(race, named) for named in list_problems()},
    **{
        f"seed {seed}: {family.name}": partial(examine, family, seed)
        for seed in SEEDS
        for family in FAMILIES
        if seed == SEEDS[0] or family.name in OTHER_FAMILIES
    },
}
