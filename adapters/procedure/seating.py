"""Whether the bed carries the piston, or the piston hangs on a grain or two: no jump before.

The rain may leave a piston on grains that stand beside it, under its rim.  It then settles by next
to nothing until they give way, which no law of the cycles before can predict.  Its elastic
deflection shows it: under one load it is many times that of a bed of such grains, whose stiffness
is known to a factor of two from the mean field of Walton (1987).

With ``procedure.seating = "waits"`` the k_i first cycles, or ``seating_cycles`` in their place,
count from the last one in which the piston hung, and so do the cycles N by which jumps by history
forecast: from there on the bed takes the load for the first time.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from adapters.bed import FloatArray, IntArray
from adapters.files import Outcome
from adapters.procedure import stages
from adapters.procedure.stages import Bed, Run
from adapters.scene import Scene

CONSTRAINED = 9 / 5
"""M / K of smooth spheres under isotropic stress: the mean of n_z^4 over that of n_z^2 / 3."""


@dataclass(frozen=True)
class SeatingNumbers:
    """Which cycles are judged, and by what."""

    first_share: float = 0.2  # of the first k_i cycles [-]: the rained bed takes the load
    hung: float = 5.0
    """Elastic deflection over that of the mean field, above which the piston hangs [-].  Ten beds
    of the reference ensemble have 0.6 to 2.2 from the fifth cycle on, the one whose piston hangs 10
    to 40 (docs/history.md); bars from 3 to 10 tell the same, some a few cycles later."""


SEATING = SeatingNumbers()


def estimate_constrained_modulus(
    young: float, poisson: float, density: FloatArray, coordination: FloatArray, pressure: float
) -> FloatArray:
    """Constrained modulus M [Pa] of a bed of equal smooth spheres, Walton (1987).

    K = (1/6) (3 phi^2 Z^2 p / (pi^4 B^2))^(1/3), M = 9/5 K, B = (1/4 pi) (1/mu + 1/(lambda + mu)).

    ``young`` [Pa] and ``poisson`` of the grains, relative ``density`` phi and ``coordination``
    number Z, shape (c,), mean ``pressure`` p [Pa].  Every grain moves with the mean strain here:
    right to a factor of two, no more; not for beds under their own weight alone.  Walton's p is the
    mean stress: with the vertical one in its place, of which it is some two thirds in a confined
    bed, M is too great by a seventh.
    """
    mu = young / (2 * (1 + poisson))
    lame = young * poisson / ((1 + poisson) * (1 - 2 * poisson))
    b = (1 / mu + 1 / (lame + mu)) / (4 * np.pi)
    bulk = np.cbrt(3 * (density * coordination) ** 2 * pressure / (np.pi**4 * b**2)) / 6
    return CONSTRAINED * bulk


def compare_deflection(scene: Scene, rows: Sequence[dict[str, Any]]) -> FloatArray:
    """Elastic deflection of each cycle over that of a bed of such grains, shape (c,).

    Strain from the stress s_0 at a cycle's end to the peak s_1: the integral of ds / M(s), which is
    (3/2) (s_1 / M(s_1) - s_0 / M(s_0)), as M goes as s^(1/3).  nan where no two grains touch
    (contacts with floor and piston are not counted) and where s_0 is the peak.
    """
    grain = scene.material.grain
    names = ("relative_density", "coordination_number", "piston_height", "elastic_deflection")
    density, coordination, height, deflection = (
        np.array([row[name] for row in rows], float) for name in names
    )
    strain = np.zeros(len(rows))
    for sign, level in zip((-1, 1), bound_stress(scene), strict=True):
        if level > 0:
            modulus = estimate_constrained_modulus(
                grain.young, grain.poisson, density, coordination, level
            )
            strain += sign * 1.5 * level / np.where(modulus > 0, modulus, np.nan)
    return np.asarray(deflection / (np.where(strain > 0, strain, np.nan) * height))


def bound_stress(scene: Scene) -> tuple[float, float]:
    """Stress of the load [Pa] at a cycle's end, and the greatest in it."""
    loading = scene.loading
    assert loading is not None
    samples = loading.samples
    peak = loading.stress_at(0.5) if samples is None else samples.stress.max()
    return float(loading.stress_at(0.0)), float(peak)


def find_hung_cycles(scene: Scene, outcomes: Sequence[Outcome]) -> IntArray:
    """Computed cycles in which the piston hung, ascending.

    Without those of `SEATING.first_share`, and healing ones: contacts that a jump moved bear late.
    """
    assert scene.procedure is not None
    rows = [row for one in outcomes for row in one.rows if row["kind"] == "computed"]
    cycle = np.array([row["cycle"] for row in rows], int)
    hung = compare_deflection(scene, rows) > SEATING.hung
    return cycle[hung & (cycle > SEATING.first_share * scene.procedure.k_i)]


def find_last_hung_cycle(run: Run, bed: Bed) -> int:
    """The last cycle up to the bed's in which its piston hung; 0 where it did not.

    A run that is resumed decides again as it did, whatever its folder holds beyond that cycle.
    """
    outcomes = [one for one in run.folder.outcomes() if one.first_cycle >= run.first_cycle]
    hung = find_hung_cycles(run.scene, outcomes)
    return int(hung[hung <= bed.cycle].max(initial=0))


def find_count_start(run: Run, bed: Bed) -> int:
    """Cycle from which the first k_i count: where this load began, or its piston last hung."""
    hung = find_last_hung_cycle(run, bed) if run.procedure.seating == "waits" else 0
    return max(run.first_cycle, hung)


def seat_piston(run: Run, bed: Bed, cycles: int) -> Bed:
    """Windows until the bed has carried its piston for so many ``cycles``, where the run waits."""
    p = run.procedure
    while (hung := find_count_start(run, bed)) and bed.cycle < min(hung + cycles, p.total_cycles):
        why = "the piston hung on few grains until" if hung > run.first_cycle else "new load from"
        run.progress.print_line(f"{why} cycle {hung}: computing on")
        bed = stages.compute(run, bed, min(p.window_cycles, p.total_cycles - bed.cycle))
    return bed


def warn_if_hung(run: Run, bed: Bed) -> None:
    """Before a jump of a run that does not wait: that its piston hangs, or did so shortly before.

    Once: not where the jump, or a try of it, is in the folder.
    """
    p = run.procedure
    if p.seating == "waits" or f"jump_{bed.cycle:06d}_1" in run.folder.stage_names():
        return
    hung = find_last_hung_cycle(run, bed)
    if hung and bed.cycle < hung + p.k_i:
        run.progress.print_line(
            f"warning: the piston hung on few grains until cycle {hung}: it gave way by more than "
            f"{SEATING.hung:g} times what a bed of such grains does; a jump from cycle {bed.cycle} "
            'cannot predict when they let it go. procedure.seating = "waits" computes on instead'
        )


def format_spans(cycles: IntArray) -> str:
    """Ascending cycles in words, such as ``1 to 43, 68 to 87``; empty for none."""
    parts = np.split(cycles, np.flatnonzero(np.diff(cycles) > 1) + 1) if len(cycles) else []
    return ", ".join(f"{part[0]} to {part[-1]}" for part in parts)
