"""Where the paper's modified Dantzig algorithm works: its success by friction, and a cycle of it.

Settled packings of discs with other friction and their contacts in random order, as the seed
drives them and with reversal.  Rows for the record of `rigid_runs`.
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from rigid_lcp.dantzig import Event, dantzig
from rigid_lcp.friction_problem import FrictionProblem, friction_problem
from rigid_lcp.problem_files import read_problem
from rigid_lcp.solver import solve_friction
from validation.rigid_packings import packing, tower
from validation.rigid_problems import data_folder

Row = dict[str, Any]
FRICTIONS = (0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 0.8)
ORDERS = 10
GRAINS = (60, 125)
"""Discs of the packings that are settled here,"""
STORED = "discs_125"
"""and one of the stored problems, which other code settled; all with friction of one's own."""
SHOWN = 60
"""Events of a cycling run that are kept, its last ones."""


def warm() -> None:
    """Compile, or load, what is timed later: each method in 2D and 3D, by bodies and by W."""
    for dim in (2, 3):
        small = tower(2, dim)
        methods: tuple[Any, ...] = ("auto", "newton", "interior-point", "gauss-seidel")
        methods += ("pivoting", "dantzig") if dim == 2 else ()
        for method in methods:
            for w in (small.bodies, small.delassus):
                solve_friction(w, small.offset, small.friction, dim, method=method)


def beds(quick: bool) -> dict[str, FrictionProblem]:
    """Packings by name: some settled here with friction 0.5, and the stored one where it is."""
    found: dict[str, FrictionProblem] = {
        f"{grains} discs": packing(grains, 2, seed=1) for grains in GRAINS[: 1 if quick else None]
    }
    folder = data_folder()
    if folder is not None and not quick:
        found[STORED] = read_problem(folder / f"{STORED}.npz")
    return found


def with_friction(bed: FrictionProblem, friction: float) -> FrictionProblem:
    """A packing with other friction."""
    problem: FrictionProblem = friction_problem(bed.bodies or bed.delassus, bed.offset, friction, 2)
    return problem


def dantzig_rows(quick: bool) -> list[Row]:
    """A row for every packing, friction, order and drive; and one with the trace of a cycle."""
    frictions = FRICTIONS[:5:4] if quick else FRICTIONS
    orders = 2 if quick else ORDERS
    dantzig(tower(2, 2))  # compiled before it is timed
    made = beds(quick)
    rows: list[Row] = []
    for name, bed in made.items():
        for friction in frictions:
            problem = with_friction(bed, friction)
            sliding = contacts_sliding(problem)
            rows += [
                _row(name, problem, friction, order, reversal) | {"sliding": sliding}
                for reversal in (False, True)
                for order in range(orders)
            ]
    return [*rows, *_trace_rows(rows, made)]


def contacts_sliding(problem: FrictionProblem) -> int:
    """Contacts at Coulomb's limit in the solution that `rigid_lcp.solver.solve_friction` finds."""
    w: Any = problem.bodies or problem.delassus
    found = solve_friction(w, problem.offset, problem.friction, 2)
    normal, tangential = np.abs(found.r.reshape(-1, 2)).T
    carries = normal > 1e-9 * normal.max()
    return int((carries & (tangential >= problem.friction * normal * (1 - 1e-6))).sum())


def _row(
    bed: str, problem: FrictionProblem, friction: float, seed: int, reversal: bool
) -> Row:  # fmt: skip
    order = np.random.default_rng(seed).permutation(problem.contacts)
    start = time.process_time()
    found = dantzig(problem, order=order, reversal=reversal)
    cost = time.process_time() - start
    method = "dantzig, reversal" if reversal else "dantzig"
    return {
        "case": "rigid-dantzig", "bed": bed, "method": method, "setting": {"friction": friction},
        "contacts": problem.contacts, "seed": seed, "error": found.residual,
        "error_kind": "natural residual", "cost_s": cost, "work": found.work.get("pivots"),
        "work_unit": "pivots", "ok": found.solved, "why": "" if found.solved else found.status,
        "how": how_it_ended(found.message),
    }  # fmt: skip


def how_it_ended(message: str) -> str:
    """What a solution says of its end, without the solver's name, the contact and the remedy."""
    first = message.partition("\n")[0].removeprefix("dantzig: ")
    return first.partition(" at contact ")[0]


def _trace_rows(rows: list[Row], made: dict[str, FrictionProblem]) -> list[Row]:
    """The last events of the first run that cycled."""
    cycled = next((r for r in rows if r["why"] == "cycled" and r["method"] == "dantzig"), None)
    if cycled is None:
        return []
    events: list[Event] = []
    problem = with_friction(made[cycled["bed"]], cycled["setting"]["friction"])
    order = np.random.default_rng(cycled["seed"]).permutation(problem.contacts)
    dantzig(problem, order=order, trace=events)
    kept = [
        [e.driven, e.force, e.contact, e.origin, e.target, e.step, e.travelled]
        for e in events[-SHOWN:]
    ]
    same = {key: cycled[key] for key in ("bed", "method", "setting", "contacts", "seed")}
    return [
        {"case": "rigid-dantzig-trace", **same, "error": cycled["error"],
         "error_kind": "natural residual", "cost_s": cycled["cost_s"], "work": len(events),
         "work_unit": "pivots", "ok": True, "why": "", "events": kept}
    ]  # fmt: skip
