"""Whether the bed carries the piston, or the piston hangs on a grain or two: no jump before.

The rain may leave a piston on grains that stand beside it, under its rim.  It then settles by next
to nothing until they give way, which no law of the cycles before can tell.  Its elastic deflection
tells: under one load it is many times that of a bed of such grains, whose stiffness is known to a
factor of two from the mean field of Walton (1987).

With ``procedure.seating = "waits"`` the k_i first cycles count from the last one in which the
piston hung.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from adapters import stages
from adapters.run_folder import Outcome
from adapters.scene import Scene
from adapters.stages import Bed, Run
from adapters.state import FloatArray

SEATING = 0.2
"""Share of the first k_i cycles that is another process: the rained bed takes the load."""
HUNG = 5.0
"""Elastic deflection over that of the mean field, above which the piston hangs.

Ten packings of the reference ensemble have 0.7 to 2.2 in every cycle from the fifth on, the one
whose piston hangs 17 to 35 (docs/settlement-partial.md).
"""
CONSTRAINED = 9 / 5
"""M / K of smooth spheres under isotropic stress: the mean of n_z^4 over that of n_z^2 / 3."""


def modulus_constrained(
    young: float, poisson: float, density: FloatArray, coordination: FloatArray, pressure: float
) -> FloatArray:
    """Constrained modulus M [Pa] of a bed of equal smooth spheres, Walton (1987).

    K = (1/6) (3 phi^2 Z^2 p / (pi^4 B^2))^(1/3), M = 9/5 K, B = (1/4 pi) (1/mu + 1/(lambda + mu)).

    ``young`` [Pa] and ``poisson`` of the grains, relative ``density`` phi and ``coordination``
    number Z, shape (c,), mean ``pressure`` p [Pa].  Every grain moves with the mean strain here:
    right to a factor of two, no more; not for beds under their own weight alone.
    """
    mu = young / (2 * (1 + poisson))
    lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    b = (1 / mu + 1 / (lame + mu)) / (4 * np.pi)
    bulk = np.cbrt(3 * (density * coordination) ** 2 * pressure / (np.pi**4 * b**2)) / 6
    return CONSTRAINED * bulk


def deflection_over_mean_field(scene: Scene, rows: Sequence[dict[str, Any]]) -> FloatArray:
    """Elastic deflection of each cycle over that of a bed of such grains, shape (c,).

    Strain from trough s_0 to peak s_1 of the load: the integral of ds / M(s), which is
    (3/2) (s_1 / M(s_1) - s_0 / M(s_0)), as M goes as s^(1/3).  nan where no two grains touch:
    contacts with floor and piston are not counted.
    """
    assert scene.loading is not None
    grain = scene.material.grain
    names = ("relative_density", "coordination_number", "piston_height", "elastic_deflection")
    density, coordination, height, deflection = (
        np.array([row[name] for row in rows], float) for name in names
    )
    stress = scene.stress_at(np.linspace(0, 1, 1001))
    strain = np.zeros(len(rows))
    for sign, level in ((1, float(stress.max())), (-1, float(stress.min()))):
        if level > 0:
            modulus = modulus_constrained(grain.young, grain.poisson, density, coordination, level)
            strain += sign * 1.5 * level / np.where(modulus > 0, modulus, np.nan)
    return np.asarray(deflection / (strain * height))


def hung_until(scene: Scene, outcomes: Sequence[Outcome], end: int) -> int:
    """The last cycle computed up to ``end`` in which the piston hung; 0 where it did not.

    Left out are cycles in which a bed takes the load for the first time (`SEATING`), and healing
    ones: contacts that a jump has moved bear late.
    """
    assert scene.procedure is not None
    rows = [row for one in outcomes for row in one.rows if row["kind"] == "computed"]
    cycle = np.array([row["cycle"] for row in rows], int)
    over = deflection_over_mean_field(scene, rows)
    counts = (cycle > SEATING * scene.procedure.k_i) & (cycle <= end)
    hung = cycle[(over > HUNG) & counts]
    return int(hung.max(initial=0))


def hung_cycles(run: Run, bed: Bed) -> int:
    """Cycles that the first k_i are counted from: 0 unless the run waits and its piston hung.

    What the folder holds beyond the bed's cycle is not asked: a run that is resumed decides again
    as it did.
    """
    assert run.scene.procedure is not None
    waits = run.scene.procedure.seating == "waits"
    return hung_until(run.scene, run.folder.outcomes(), bed.cycle) if waits else 0


def seat(run: Run, bed: Bed) -> Bed:
    """Windows until the bed has carried its piston for k_i cycles; the same bed where it has.

    A run that does not wait says that its piston hangs, and goes on.
    """
    p = run.scene.procedure
    assert p is not None
    if p.seating == "any":
        hung = hung_until(run.scene, run.folder.outcomes(), bed.cycle)
        if run.variant.jumps and hung == bed.cycle:
            run.progress.say(
                f"warning: at cycle {hung} the piston hangs on few grains: it gives way by more "
                f"than {HUNG:g} times what a bed of such grains does; "
                'procedure.seating = "waits" computes on until the bed carries it'
            )
        return bed
    while (hung := hung_cycles(run, bed)) and bed.cycle < min(hung + p.k_i, p.total_cycles):
        run.progress.say(f"the piston hung on few grains until cycle {hung}: computing on")
        bed = stages.compute(run, bed, min(p.window_cycles, p.total_cycles - bed.cycle))
    return bed
