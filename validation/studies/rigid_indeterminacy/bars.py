"""The bars: the limit is least energy, springs tend to it, order does not matter."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from validation.case import Check
from validation.studies.rigid_indeterminacy.run import LIGGGHTS, SCENES, SLOW, SPRINGS, Row

DENSE_BAR = 1e-12
"""Least energy by dense least squares: round-off of the solution of some hundred equations."""
STIFF, STIFF_BAR = 1e6, 1e-3
"""At a stiffness of 1e6 weights a metre grains of 1 m sink in by some 1e-6 m, which turns normals
and levers by as much: the forces may differ by that times the height of the pile in grains."""
ORDER_BAR = 1e-10
RESIDUAL_BAR = 1e-5
"""Where contacts slide all states solve the rigid problem, to the stiffness of the springs."""
WHY = "Coulomb's law has no potential: with many sliding contacts the relaxation tends nowhere"


def check_bars(rows: Sequence[Row]) -> list[Check]:
    """Bars of all scenes and piles."""
    checks = []
    for row in rows:
        checks += list(_check_order(row) if row["part"] == "order" else _check_scene(row))
    return checks


def _check_max(name: str, value: float, bar: float) -> Check:
    return Check(name, value, f"<= {bar:g}", value <= bar)


def _check_scene(row: Row) -> Iterator[Check]:
    name, scene = row["part"], SCENES[row["part"]]
    if not scene.slides:
        yield _check_max(f"{name}: direct limit - least energy", row["dense"], DENSE_BAR)
    for method in (SPRINGS, LIGGGHTS):
        mine = [run for run in row["runs"] if run["method"] == method]
        if not mine:
            continue
        if scene.slides:
            worst = max(run["residual"] for run in mine)
            yield _check_max(f"{name}: {method}: worst residual", worst, RESIDUAL_BAR)
            continue
        ramp = SLOW if scene.friction else 0
        error = next(run["error"] for run in mine
                     if (run["stiffness"], run["ramp"]) == (STIFF, ramp))  # fmt: skip
        yield _check_max(f"{name}: {method}: error at stiffness {STIFF:g}", error, STIFF_BAR)


def _check_order(row: Row) -> Iterator[Check]:
    for pile in row["piles"]:
        yield Check(f"{pile['pile']}: limit found", float(pile["found"]), "= 1", pile["found"],
                    why=WHY)  # fmt: skip
        if pile["found"]:
            yield _check_max(f"{pile['pile']}: other order", pile["order"], ORDER_BAR)
