"""What the record of `rigid_runs` says: costs at equal residual, profiles, how methods fail."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from validation.rigid_problems import GRAINS

Row = dict[str, Any]
OURS, HYBRID, OSQP = "rigid_lcp", "Clarabel + Newton", "OSQP polished"
WRONG = 1e-3
"""A residual above this, and above a hundred times what was asked for, is a wrong answer if the
method says it has solved the problem."""
TIE_S = 1e-3
"""Costs below this are not compared: they are the overhead of calls [s]."""
OUTCOMES = (
    "reached", "stopped short", "wrong, though it says solved", "out of time", "raised an error",
    "died",
)  # fmt: skip
"""Died: the process ended with the run.  Raised an error: it did not, and there is no answer."""
HYPERSTATIC = tuple(GRAINS.values())
"""How the names of packings begin."""


def races(rows: Iterable[Row]) -> list[Row]:
    """The rows of the race, without those of Dantzig's algorithm by itself."""
    return [row for row in rows if row["case"] == "rigid-solvers"]


def problems(rows: Iterable[Row], family: str | None = None) -> dict[str, list[Row]]:
    """Rows by problem, in order of appearance."""
    found: dict[str, list[Row]] = {}
    for row in races(rows):
        if family in (None, row["family"]):
            found.setdefault(row["problem"], []).append(row)
    return found


def families(rows: Iterable[Row]) -> list[str]:
    """Families, in order of appearance."""
    return list(dict.fromkeys(row["family"] for row in races(rows)))


def method_names(rows: Iterable[Row]) -> list[str]:
    """Methods: ours first, then the others as they come."""
    names = list(dict.fromkeys(row["method"] for row in races(rows)))
    return sorted(names, key=lambda name: (not name.startswith(OURS), name))


def of(rows: Iterable[Row], method: str) -> list[Row]:
    """Rows of a method."""
    return [row for row in rows if row["method"] == method]


def starting(rows: Iterable[Row], prefix: str) -> list[Row]:
    """Rows of the methods whose names begin so."""
    return [row for row in rows if row["method"].startswith(prefix)]


def least_error(rows: Iterable[Row]) -> float:
    """The smallest residual; infinite for none."""
    return min((row["error"] for row in rows if row["error"] is not None), default=np.inf)


def cost_to(rows: Iterable[Row], error: float) -> float:
    """The least cost [s] of a residual at or below ``error``; infinite if it was not reached."""
    return min(
        (row["cost_s"] for row in rows if row["error"] is not None and row["error"] <= error),
        default=np.inf,
    )


def ratio(ours: float, theirs: float) -> float:
    """Cost of ours over theirs, both at least `TIE_S`."""
    return max(ours, TIE_S) / max(theirs, TIE_S)


def cost_ratios(rows: Iterable[Row], rival: str) -> dict[str, float]:
    """Our cost of the bar over a rival's, on the problems that the rival brings to it."""
    found = {}
    for name, each in problems(rows).items():
        mine, theirs = (cost_to(of(each, method), each[0]["bar"]) for method in (OURS, rival))
        if np.isfinite(theirs):
            found[name] = ratio(mine, theirs)
    return found


def outcome(rows: Sequence[Row]) -> str:
    """What a method made of a problem, over all its runs: one of `OUTCOMES`."""
    if least_error(rows) <= rows[0]["bar"]:
        return "reached"
    tightest = min(row["setting"]["tolerance"] for row in rows)
    if any(_wrong(row) for row in rows if row["setting"]["tolerance"] == tightest):
        return "wrong, though it says solved"
    if all(row["error"] is None for row in rows):
        if any("out of time" in row["why"] for row in rows):
            return "out of time"
        return "died" if deaths(rows) else "raised an error"
    return "stopped short"


def outcomes(rows: Iterable[Row], method: str) -> Counter[str]:
    """How often a method ended how, a problem each."""
    counted: Counter[str] = Counter()
    for each in problems(of(rows, method)).values():
        counted[outcome(each)] += 1
    return counted


def deaths(rows: Iterable[Row]) -> list[Row]:
    """Runs that ended the process."""
    return [row for row in races(rows) if row["why"].startswith("died")]


def wrong_answers(rows: Iterable[Row]) -> list[Row]:
    """Runs that say solved at a residual above `WRONG` and a hundred times what was asked for."""
    return [row for row in races(rows) if _wrong(row)]


def _wrong(row: Row) -> bool:
    limit = max(WRONG, 100 * row["setting"]["tolerance"])
    return bool(row["claims"]) and row["error"] is not None and row["error"] > limit


def silent_failures(rows: Iterable[Row]) -> list[Row]:
    """Runs of ours that are not what was asked for and do not say so."""
    return [
        row for row in starting(races(rows), OURS)
        if not row["ok"] and (row["claims"] or not row["why"])
    ]  # fmt: skip


def siconos_lead(rows: Sequence[Row]) -> tuple[float, float]:
    """On one problem: the least residual of any Siconos solver, and its cost over ours there.

    Infinite lead where Siconos reached nothing.
    """
    theirs = starting(rows, "Siconos")
    error = least_error(theirs)
    return error, cost_to(theirs, error) / cost_to(of(rows, OURS), error)


def ladder(rows: Sequence[Row], levels: Sequence[float]) -> list[tuple[float, float, float]]:
    """On one problem, a residual each: our cost, and that of the best solver of Siconos [s]."""
    mine, theirs = of(rows, OURS), starting(rows, "Siconos")
    return [(level, cost_to(mine, level), cost_to(theirs, level)) for level in levels]


def packings_between(rows: Iterable[Row], least: int, most: int) -> dict[str, list[Row]]:
    """Packings with friction by their numbers of contacts."""
    return {
        name: each for name, each in problems(rows).items()
        if name.startswith(HYPERSTATIC) and each[0]["family"] != "frictionless"
        and least <= each[0]["contacts"] <= most
    }  # fmt: skip


def profile(
    rows: Iterable[Row], method: str, names: Sequence[str], factors: Any
) -> np.ndarray[Any, Any]:
    """Performance profile (Dolan and More, Math. Program. 91 (2002) 201).

    The share of problems that the method brought to their bar within each factor of the best
    method's cost; ``names``: methods that are compared.
    """
    shares = []
    for each in problems(rows).values():
        best = min(cost_to(of(each, name), each[0]["bar"]) for name in names)
        mine = cost_to(of(each, method), each[0]["bar"])
        shares.append(ratio(mine, best) if np.isfinite(mine) else np.inf)
    return np.mean(np.asarray(shares)[:, None] <= np.asarray(factors), axis=0)


# --- Dantzig ----------------------------------------------------------------------------------


def dantzig_beds(rows: Iterable[Row]) -> dict[str, int]:
    """Packings that Dantzig's algorithm was run on: name and number of contacts."""
    return {row["bed"]: row["contacts"] for row in rows if row["case"] == "rigid-dantzig"}


def dantzig_success(
    rows: Iterable[Row], method: str, bed: str
) -> dict[float, tuple[int, int]]:  # fmt: skip
    """Of a packing, by friction: number of solved orders, and of orders."""
    found: dict[float, tuple[int, int]] = {}
    for row in rows:
        if row["case"] == "rigid-dantzig" and row["method"] == method and row["bed"] == bed:
            solved, all_of = found.get(row["setting"]["friction"], (0, 0))
            found[row["setting"]["friction"]] = (solved + bool(row["ok"]), all_of + 1)
    return found


def dantzig_ends(rows: Iterable[Row]) -> Counter[tuple[str, str, str]]:
    """How runs that did not solve ended: method, status, and what happened."""
    return Counter(
        (row["method"], row["why"] or "silent", row["how"])
        for row in rows
        if row["case"] == "rigid-dantzig" and not row["ok"]
    )


def dantzig_sliding(rows: Iterable[Row], bed: str) -> dict[float, int]:
    """Of a packing, by friction: contacts that slide in the default solver's solution."""
    return {
        row["setting"]["friction"]: row["sliding"]
        for row in rows
        if row["case"] == "rigid-dantzig" and row["bed"] == bed
    }


def trace(rows: Iterable[Row]) -> Row | None:
    """The trace of a cycle, if it is recorded."""
    return next((row for row in rows if row["case"] == "rigid-dantzig-trace"), None)
