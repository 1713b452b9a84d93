"""Statically indeterminate grains: unique forces against springs in time; wear and breakage.

    trackbed validate rigid-indeterminacy            some minutes
    trackbed validate rigid-indeterminacy --quick    fewer settings

`python -m validation.rigid_indeterminacy_page --run` measures the same, keeps every row and writes
``docs/rigid-indeterminacy.md``.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import log10

from validation.case import Check
from validation.rigid_indeterminacy import (
    FROM_SPRINGS,
    LIGGGHTS,
    LIMIT,
    ORDER_BAR,
    RELAXATION,
    SCENES,
    SPRINGS,
    Row,
    Scene,
    order_rows,
    scene_rows,
    warm_up,
)
from validation.rigid_indeterminacy_wear import wear_rows

DENSE_BAR = 1e-12
"""Least energy by dense least squares: round-off of the solution of some hundred equations."""
STIFF, STIFF_BAR = 1e6, 1e-3
"""At a stiffness of 1e6 weights a metre grains of 1 m sink in by some 1e-6 m, which turns normals
and levers by as much: the forces may differ by that times the height of the pile in grains."""


def run(quick: bool) -> list[Check]:
    """Checks of all scenes."""
    warm_up()
    checks = []
    for scene in SCENES:
        checks += scene_checks(scene, list(scene_rows(scene, quick)))
    for row in order_rows((6, 12) if quick else (6, 12, 16, 20, 30)):
        checks.append(Check(f"{row.scene}: limit found", float(row.found), "= 1", row.found))
        if row.found:
            checks.append(below(f"{row.scene}: other order and numbers", row.order, ORDER_BAR))
            checks.append(below(f"{row.scene}: other start", row.start, ORDER_BAR))
    for measured in wear_rows(quick):
        bar = f"<= {measured.bar:g}"
        holds = measured.value <= measured.bar
        checks.append(Check(measured.name, measured.value, bar, holds, measured.unit))
    return checks


def scene_checks(scene: Scene, rows: Sequence[Row]) -> list[Check]:
    """What the rows of one scene must hold."""
    checks = []
    dense = next(row.error for row in rows if row.method == LIMIT)
    if not scene.mobilised:
        checks.append(below(f"{scene.name}: direct limit - least energy", dense, DENSE_BAR))
    for method in (SPRINGS, LIGGGHTS):
        mine = [row for row in rows if row.method == method]
        if mine and scene.mobilised:
            checks += path_checks(f"{scene.name}: {method}", mine)
        elif mine:
            checks += stiffness_checks(f"{scene.name}: {method}", mine, scene)
    checks += [
        Check(f"{scene.name}: {FROM_SPRINGS}, loaded in {row.ramp} steps: other forces",
              row.error, f"known limit: above {ORDER_BAR:g} where there is another state", True)
        for row in rows if row.method == FROM_SPRINGS
    ]  # fmt: skip
    relaxed = [row for row in rows if row.method == RELAXATION]
    best = min(relaxed, key=lambda row: row.residual)
    checks.append(reported(f"{scene.name}: relaxation at residual {best.residual:.0e}", best.error))
    return checks


def stiffness_checks(name: str, rows: Sequence[Row], scene: Scene) -> list[Check]:
    """Agreement in the stiff limit, and the order in which it is reached."""
    slowly = scene.path_matters
    error = {row.stiffness: row.error for row in rows if scene.loads_as_asked(row.ramp)}
    checks = [below(f"{name}: error at stiffness {STIFF:g}", error[STIFF], STIFF_BAR)]
    if error[STIFF] > 0 and not slowly:
        checks.append(reported(f"{name}: order in 1/k", log10(error[1e4] / error[STIFF]) / 2))
    if slowly:
        fast = next(row.error for row in rows if row.ramp == 0)
        checks.append(reported(f"{name}: error where the load comes at once", fast))
    return checks


def path_checks(name: str, rows: Sequence[Row]) -> list[Check]:
    """Where contacts slide: what the time of loading does to the forces."""
    ramps = sorted(rows, key=lambda row: row.ramp)
    checks = [
        reported(f"{name}: error, loaded in {row.ramp} steps", row.error)
        for row in (ramps[0], ramps[-1])
    ]
    # all are solutions of the rigid problem, to the stiffness of the springs
    worst = max(row.residual for row in rows)
    return [*checks, below(f"{name}: worst residual in the rigid problem", worst, 1e-5)]


def below(name: str, value: float, bar: float) -> Check:
    """A value that may not be above its bar."""
    return Check(name, value, f"<= {bar:g}", value <= bar)


def reported(name: str, value: float) -> Check:
    """A value without a bar."""
    return Check(name, value, "reported", True)
