"""What the record of relaxations says: means over jumps and beds, and what is shown of a way."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from adapters.state import FloatArray
from validation.relaxation_runs import Row
from validation.relaxation_ways import RESUBMITTED, WAYS

CARRIED = 1.01
"""Greatest overlap over the greatest one before the jump, up to which a bed is relaxed."""

TITLES = {
    "smallest-move": "**smallest-move** (default)",
    "proximal": "proximal",
    "hertz gradient": "contacts alone, steepest descent",
    "hertz lbfgs": "contacts alone, L-BFGS (SciPy)",
    "hertz fire": "contacts alone, FIRE (ASE)",
    "eq29 gradient": "eq. 29, frontier fixed, steepest descent (the paper)",
    "eq29 lbfgs": "eq. 29, frontier fixed, L-BFGS",
    "eq29 fire": "eq. 29, frontier fixed, FIRE",
    "eq29-free gradient": "eq. 29, all free, steepest descent",
    "eq29-free lbfgs": "eq. 29, all free, L-BFGS",
    "eq29-free fire": "eq. 29, all free, FIRE",
    "liggghts drag": "LIGGGHTS, steps with drag",
    "liggghts limit": "LIGGGHTS, steps of limited length",
    "lammps quickmin": "LAMMPS `min_style quickmin`, walls' grains held",
    "lammps fire": "LAMMPS `min_style fire`, walls' grains held",
}
"""Ways at paper scale in the order of the table, in words."""

BED_TITLES = {
    RESUBMITTED: "no jump, resubmitted",
    "estimate": "jump, not relaxed",
    "smallest-move": "**smallest-move** (default)",
    "proximal": "proximal",
    "karrech2007": "`karrech2007`: eq. 29, frontier fixed, L-BFGS",
    "eq29 gradient": "the same by steepest descent (the paper)",
    "eq29-free lbfgs": "eq. 29, all free, L-BFGS",
    "hertz gradient, carried": "contacts alone, steepest descent, stopped",
    "hertz lbfgs, carried": "contacts alone, L-BFGS, stopped",
    "hertz lbfgs": "contacts alone, L-BFGS, to its end",
    "hertz fire, carried": "contacts alone, FIRE, stopped",
    "hertz fire": "contacts alone, FIRE, to its end",
    "liggghts drag, 1000": "LIGGGHTS, 1,000 steps with drag",
    "liggghts drag, 10000": "LIGGGHTS, 10,000 steps with drag",
    "liggghts limit, 1000": "LIGGGHTS, 1,000 steps of limited length",
    "lammps fire, 1000": "LAMMPS `fire`, 1,000 iterations, walls' grains held",
}
"""Ways on live beds in the order of the table, in words."""
assert set(BED_TITLES) == {RESUBMITTED, *WAYS}

Ways = dict[str, dict[str, Row]]
"""Way -> bed -> row."""


def by_way(rows: Sequence[Row], kind: str) -> Ways:
    """Rows of a kind by way and bed."""
    found: Ways = {}
    for row in rows:
        if row["kind"] == kind:
            found.setdefault(row["way"], {})[row["bed"]] = row
    return found


def overlap_before(ways: Ways, bed: str) -> float:
    """Greatest overlap before the jump at paper scale [m]."""
    return float(ways["before"][bed]["points"][0]["overlap"])


def point_carried(ways: Ways, way: str, bed: str) -> Row | None:
    """First point of a way whose greatest overlap is no more than before the jump."""
    bound = CARRIED * overlap_before(ways, bed)
    points = ways[way][bed]["points"]
    return next((point for point in points if point["overlap"] <= bound), None)


def values(points: Sequence[Row], key: str) -> FloatArray:
    """A figure of several points, shape (points,)."""
    return np.array([point[key] for point in points], float)


def answers(ways: Ways, way: str) -> dict[str, Row]:
    """The ten cycles behind a way, by bed, where the engine gave them."""
    return {
        bed: row["after"]
        for bed, row in ways.get(way, {}).items()
        if "after" in row and "refused" not in row["after"]
    }


def refused(ways: Ways, way: str) -> list[str]:
    """Why beds of a way gave no answer."""
    rows = ways.get(way, {}).values()
    found = [row.get("refused") or row.get("after", {}).get("refused", "") for row in rows]
    return [why for why in found if why]


def excess(ways: Ways, way: str) -> FloatArray:
    """Settlement since k_i after ten cycles, less the full run's at k_i + h + 10 [m], (beds,)."""
    return np.array(
        [
            after["settlement"][-1] - ways["base"][bed]["met"]["settlement"][-1]
            for bed, after in answers(ways, way).items()
        ]
    )


def gained(ways: Ways, way: str, first: int, last: int) -> FloatArray:
    """Settlement of cycles ``first`` + 1 to ``last`` behind the jump [m], (beds,)."""
    return np.array(
        [
            after["settlement"][last] - after["settlement"][first]
            for after in answers(ways, way).values()
        ]
    )


def gained_met(ways: Ways, first: int, last: int) -> FloatArray:
    """The same of the full run behind cycle k_i + h [m], (beds,)."""
    rows = [row["met"]["settlement"] for row in ways["base"].values()]
    return np.array([row[last] - row[first] for row in rows])


def of_answers(ways: Ways, way: str, key: str, index: int | None = None) -> FloatArray:
    """A figure of the ten cycles, at an ``index`` of its list, (beds,)."""
    found = [after[key] for after in answers(ways, way).values()]
    return np.array([value if index is None else value[index] for value in found])
