"""What the record says: costs at equal residual, ratios beside a rival, outcomes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from validation.bench.rigid.friction_problems import GRAINS
from validation.studies.rigid_solvers.run import HYBRID, OURS

Row = dict[str, Any]
TIE_S = 1e-3
"""Costs below this are not compared: they are the overhead of calls [s]."""
YIELDING = "near yield"


def select(rows: Iterable[Row], begins: str = "") -> list[Row]:
    """Problems of the race, of the families whose names begin so."""
    return [row for row in rows if "runs" in row and row["family"].startswith(begins)]


def list_examinations(rows: Iterable[Row]) -> list[Row]:
    """Families of unseen problems."""
    return [row for row in rows if "posed" in row]


def find_least_error(row: Row, solver: str) -> float:
    """The smallest residual of a solver on a problem; infinite for none."""
    errors = [run[2] for run in row["runs"].get(solver, []) if run[2] is not None]
    return min(errors, default=np.inf)


def find_cost(row: Row, solver: str, error: float | None = None) -> float:
    """The least cost [s] of a residual at or below ``error``, the problem's bar if not given;
    infinite if it was not reached."""
    wanted = row["bar"] if error is None else error
    runs = row["runs"].get(solver, [])
    return min((run[1] for run in runs if run[2] is not None and run[2] <= wanted), default=np.inf)


def find_ratio(row: Row, solver: str) -> float:
    """Our cost of the bar over that of a solver, both at least `TIE_S`; infinite where ours is not
    there, nan where the other is not."""
    theirs = find_cost(row, solver)
    return max(find_cost(row, OURS), TIE_S) / max(theirs, TIE_S) if np.isfinite(theirs) else np.nan


def list_ratios(rows: Sequence[Row], solver: str = HYBRID) -> dict[str, float]:
    """`find_ratio` by problem, where the other solver reaches the bar."""
    found = {row["part"]: find_ratio(row, solver) for row in rows}
    return {name: value for name, value in found.items() if not np.isnan(value)}


def list_packings(rows: Iterable[Row], least: int, most: int) -> list[Row]:
    """Settled packings with friction by their numbers of contacts; not those near yield."""
    return [
        row for row in select(rows)
        if row["part"].startswith(tuple(GRAINS.values()))
        and row["family"] not in ("frictionless", YIELDING) and least <= row["contacts"] <= most
    ]  # fmt: skip


def join_columns(rows: Iterable[Row], **wanted: Any) -> dict[str, list[Any]]:
    """Columns of all families whose keys are as wanted, put one after the other, with a column
    ``name`` of family, seed and number."""
    columns: dict[str, list[Any]] = {}
    for row in list_examinations(rows):
        if any(row[key] != value for key, value in wanted.items()):
            continue
        posed, count = row["posed"], len(row["posed"]["index"])
        names = [f"{row['family']} {index} of seed {row['seed']}" for index in posed["index"]]
        for key in ("contacts", "cpu_s", "residual", "ok", "claims", "status", "rival_s",
                    "rival_ok"):  # fmt: skip
            columns.setdefault(key, []).extend(posed.get(key, [None] * count))
        columns.setdefault("name", []).extend(names)
    return columns


def find_profile(rows: Sequence[Row], solver: str, solvers: Sequence[str], factors: Any) -> Any:
    """Performance profile (Dolan and More, Math. Program. 91 (2002) 201): the share of problems
    brought to their bar within each factor of the least cost of these solvers."""
    shares = [
        max(find_cost(row, solver), TIE_S)
        / max(min(find_cost(row, each) for each in solvers), TIE_S)
        if np.isfinite(find_cost(row, solver)) else np.inf
        for row in rows
    ]  # fmt: skip
    return np.mean(np.asarray(shares)[:, None] <= np.asarray(factors), axis=0)
