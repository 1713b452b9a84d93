"""Figures of the study of what a jump moves, from its record: means over windows and over beds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from adapters.state import FloatArray
from validation.move_study import Row
from validation.move_study_engine import FULL, PAPER, TWIN
from validation.move_study_members import member_name
from validation.move_study_offline import OTHER_MEMBER

SCALES = {
    "paper scale": ("paper_scale_a", "paper_scale_b"),
    "small bed": ("coarse_bursty",),
}
"""Runs of the offline part by what they are."""
ORDER = (
    "still", "per-grain", "robust", "smoothed", "shrunk", "modes", "smooth-field", "profile",
    OTHER_MEMBER, FULL, TWIN, *map(member_name, range(PAPER.kind.members)),
)  # fmt: skip
"""Ways as the page lists them, then runs of every cycle."""
CONTINUES = ("rate", "coordination_number", "elastic_deflection", "piston_stiffness")
"""What is to go on after a jump as it was before."""
SPREADS = 2.0
"""Standard deviations of the cycles before that the mean of those after may be off."""


def ways_of(rows: Iterable[Row]) -> list[str]:
    """Ways of the record in the order of the page."""
    found = {row["move"] for row in rows}
    return [way for way in ORDER if way in found]


def offline_rows(rows: Sequence[Row], scale: str, way: str) -> list[Row]:
    """Rows of a way on the runs of a scale."""
    return [row for row in rows if row["run"] in SCALES[scale] and row["move"] == way]


def median_of(rows: Sequence[Row], key: str) -> float:
    """Median of a column over the windows: the relaxation turns round-off into other contacts, and
    one window of a small bed into another field."""
    return float(np.median([row[key] for row in rows]))


def cost_of(rows: Sequence[Row]) -> float:
    """CPU time of a jump [s]: estimate and relaxation, median."""
    return float(np.median([row["move_s"] + row["relax_s"] for row in rows]))


def wins(rows: Sequence[Row], scale: str, way: str, other: str, key: str) -> tuple[int, int]:
    """In how many windows a way has the smaller ``key`` than another, and of how many."""
    mine = {(r["run"], *r["jump"]): r[key] for r in offline_rows(rows, scale, way)}
    yours = {(r["run"], *r["jump"]): r[key] for r in offline_rows(rows, scale, other)}
    shared = mine.keys() & yours.keys()
    return sum(mine[name] < yours[name] for name in shared), len(shared)


# --- engine -----------------------------------------------------------------------------------


def cycles(row: Row, when: str, measure: str) -> FloatArray:
    """A measure in the cycles ``before`` or ``after`` the jump; ``rate`` is settlement's [m]."""
    if measure != "rate":
        return np.array(row[when][measure], float)
    path = row[when]["settlement"]
    if when == "after":
        path = [row["start"]["settlement"], *path]
    return np.diff(np.array(path, float))


def rows_of_kind(rows: Sequence[Row], kind: str) -> list[Row]:
    """Rows of the engine's part on beds of a kind."""
    return [row for row in rows if row["run"].rpartition("-")[0] == kind]


def beds(rows: Sequence[Row], way: str) -> list[Row]:
    """Rows of a way, one a bed."""
    return [row for row in rows if row["move"] == way]


def over_beds(rows: Sequence[Row], figure: Callable[[Row], float]) -> tuple[float, float]:
    """Mean over the beds and its standard error; nan for one bed."""
    values = np.array([figure(row) for row in rows])
    error = values.std(ddof=1) / np.sqrt(len(values)) if len(values) > 1 else np.nan
    return float(values.mean()), float(error)


def change(row: Row, measure: str) -> float:
    """Mean of the cycles after the jump over that of those before, less 1."""
    return float(cycles(row, "after", measure).mean() / cycles(row, "before", measure).mean() - 1)


def goes_on(row: Row, measure: str) -> bool:
    """Whether the mean after the jump lies within `SPREADS` deviations of the cycles before."""
    before, after = cycles(row, "before", measure), cycles(row, "after", measure)
    return bool(abs(after.mean() - before.mean()) <= SPREADS * before.std(ddof=1))


def way_to_end(row: Row) -> float:
    """Settlement from the window's end to the last cycle behind the jump [m]."""
    return float(row["after"]["settlement"][-1] - row["before"]["settlement"][-1])
