"""Figs 11 and 12 of Karrech et al. (2007), read from their record: errors of jumps against what
they gain, beside a full run that differs by one grain's 1e-10 m and beside moving nothing.

`validation.paper_convergence_runs` makes the record, `validation.paper_convergence_page` the page.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import spearmanr

from adapters.state import FloatArray, IntArray
from validation.paper_convergence_runs import JUMPS, STUDY

Row = dict[str, Any]
FULL, MEMBER, STILL = "full", "another member", "k 20, h 10, nothing moved"
AVERAGED = 10
"""Computed cycles whose mean coordination number is compared."""
VARIED_K, VARIED_H = ((10, 10), (20, 10), (40, 10)), ((40, 5), (40, 10), (40, 20), (40, 40))
"""k and h of Figs 11a and 11b."""


@dataclass(frozen=True)
class Path:
    """A way to the last cycle."""

    name: str
    cycle: IntArray
    """Of each row, jumps' ends among them, (c,)."""
    settlement: FloatArray
    """Since the rain [m], (c,)."""
    coordination: FloatArray
    """(c,); nan where it was not counted."""
    computed: int
    cost: float
    """Of the engine behind the rain, attempts that were given up among it [CPU s]."""
    coordinates: float
    displacement: float
    """E_r (eq. 22) at the last cycle, of coordinates and of displacements since cycle 0 [-]."""


@dataclass(frozen=True)
class Errors:
    """Of a way at the last cycle, relative and signed but for E_r; gained time T_full/T - 1."""

    settlement: float
    """Over the settlement since the rain, as the paper has it."""
    since: float
    """Over that behind k_i."""
    coordination: float
    coordinates: float
    displacement: float
    gained: float


def name_of(k: int, h: int) -> str:
    """A way by its k and h."""
    return f"k {k}, h {h}"


JUMPED = tuple(name_of(k, h) for k, h in JUMPS)


def path_of(row: Row) -> Path:
    """A line of the record."""
    cycle, _, settlement, coordination, _ = zip(*row["rows"], strict=True)
    return Path(
        row["way"], np.array(cycle), np.array(settlement, float), np.array(coordination, float),
        row["computed"], row["engine_s"] + sum(lost["lost_s"] for lost in row["lost"]),
        row["coordinates"], row["displacement"],
    )  # fmt: skip


def paths_of(rows: Sequence[Row]) -> dict[str, Path]:
    """Ways of the record by name."""
    return {row["way"]: path_of(row) for row in rows}


def at(path: Path, cycle: int) -> float:
    """Settlement at the end of a cycle [m]."""
    return float(path.settlement[np.flatnonzero(path.cycle == cycle)[-1]])


def errors_of(path: Path, full: Path) -> Errors:
    """A way beside the full run, at the last cycle of the study."""
    last, first = STUDY.last, STUDY.k_i
    away = at(path, last) - at(full, last)
    contacts, truth = (float(np.nanmean(one.coordination[-AVERAGED:])) for one in (path, full))
    return Errors(
        away / at(full, last), away / (at(full, last) - at(full, first)), contacts / truth - 1,
        path.coordinates, path.displacement, full.cost / path.cost - 1,
    )  # fmt: skip


def falls(errors: Sequence[float]) -> bool:
    """Whether errors without their signs become smaller from each to the next."""
    sizes = np.abs(errors)
    return bool((np.diff(sizes) < 0).all())


def rank_with_gain(errors: dict[str, Errors], figure: str) -> float:
    """Spearman's rank correlation of an error's size with the gained time, over ways that jump."""
    chosen = [errors[name] for name in JUMPED if name in errors]
    sizes = [abs(getattr(one, figure)) for one in chosen]
    return float(spearmanr([one.gained for one in chosen], sizes).statistic)
