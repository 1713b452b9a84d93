"""YADE at the paper's size: what Python costs, ten cycles of a stiff bed, seams of a piston.

trackbed validate yade            a quarter of an hour of CPU time
trackbed validate yade --quick    150 grains, no stiff bed
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from validation.case import Check
from validation.yade_paper import LAST, PaperScale, paper_scale
from validation.yade_scale import Bed, after, scene_of, soft_bed
from validation.yade_seams import seams_of
from validation.yade_share import window_timed

CYCLES = 2
GRAINS = {True: 150, False: 1085}


def run(quick: bool) -> list[Check]:
    """All checks; the beds are kept in the folder TRACKBED_VALIDATION, where that is set."""
    with tempfile.TemporaryDirectory() as temporary:
        home = Path(os.environ.get("TRACKBED_VALIDATION", temporary)) / f"yade-{GRAINS[quick]}"
        bed, first = soft_bed(home / "soft", GRAINS[quick])
        checks = [
            *seam_checks(),
            *share_checks(after(bed, first, home / "soft" / "first"), home / "timed"),
        ]
        return checks if quick else checks + paper_checks(paper_scale(first, home / "paper"))


def paper_checks(figures: PaperScale) -> list[Check]:
    """Cost and stability of the stiff bed."""
    ends = figures.kinetic_at_ends
    return [
        Check("1,085 grains, 46.9 GPa: steps a cycle", figures.steps_per_cycle, "> 0", True),
        Check("the same: load cycles", len(ends), "> 0", True),
        Check(f"the same: CPU time of a load cycle, mean of the last {LAST}", figures.cycle_s,
              "> 0", True, "s"),
        Check("the same: grain-steps a CPU second", figures.grain_steps, "> 0", True, "1/s"),
        Check("the same: speed left by what the adapter adds", figures.speed, ">= 0.95",
              figures.speed >= 0.95),
        *(
            Check(f"the same: kinetic energy at the end of cycle {cycle}", energy, "> 0", True, "J")
            for cycle, energy in enumerate(ends, 1)
        ),
        bounded("greatest of these behind the first cycle over the first", max(ends[1:]) / ends[0],
                1.0),
        Check("the same: piston's work in the last cycle", figures.work, "> 0", True, "J"),
        bounded("kinetic energy over that work, greatest", figures.kinetic_share, 1.0),
        bounded("kinetic energy over that work, at the cycle's end", ends[-1] / figures.work, 0.1),
        Check("the same: settlement in all cycles", figures.settlement, "> 0",
              figures.settlement > 0, "m"),
        bounded("rms force error of the piston over the peak", figures.force_error, 0.25),
        bounded("greatest overlap over smallest radius", figures.overlap_share, 0.05),
    ]  # fmt: skip


def bounded(name: str, value: float, bar: float) -> Check:
    """A figure of the stiff bed with an upper bar."""
    return Check(f"the same: {name}", value, f"<= {bar:g}", value <= bar)


def share_checks(bed: Bed, folder: Path) -> list[Check]:
    """What the adapter adds to load cycles of a soft bed, timed in one run."""
    grains = bed.scene.grain_count
    _, added = window_timed(bed, CYCLES, folder)
    bar = 0.95 if grains >= 1000 else 0.9
    what = f"{grains} grains, {CYCLES} cycles of {bed.scene.steps_per_cycle} steps"
    return [
        Check(f"{what}: speed left by what the adapter adds", added.speed, f">= {bar:g}",
              added.speed >= bar),
        Check(f"{what}: CPU time of YADE", added.engine_s, "> 0", True, "s"),
        Check(f"{what}: of it frames and record", added.added_s, "> 0", True, "s"),
        Check(f"{what}: CPU time of Python beside YADE", added.python_s, "> 0", True, "s"),
    ]  # fmt: skip


def seam_checks() -> list[Check]:
    """The piston over a part of the paper's bed: contacts on a seam, stiffness they add."""
    seams = seams_of(scene_of("karrech-partial"))
    return [
        Check("partial piston: contacts on a seam", seams.touched, "<= 0.001",
              seams.touched <= 0.001),
        Check("partial piston: mean stiffness added", seams.stiffness, "<= 0.0005",
              seams.stiffness <= 0.0005),
    ]  # fmt: skip
