"""YADE at the paper's size: what Python costs, a stiff bed of 1,085 grains, seams of a piston.

trackbed validate yade            six minutes of CPU time
trackbed validate yade --quick    150 grains, no stiff bed
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from validation.case import Check
from validation.yade_scale import (
    Bed,
    after,
    paper_scale,
    python_share,
    scene_of,
    seams_of,
    soft_bed,
)

CYCLES, REPEATS = 2, 3
GRAINS = {True: 150, False: 1085}


def run(quick: bool) -> list[Check]:
    """All checks; the beds are kept in the folder TRACKBED_VALIDATION, where that is set."""
    with tempfile.TemporaryDirectory() as temporary:
        home = Path(os.environ.get("TRACKBED_VALIDATION", temporary)) / f"yade-{GRAINS[quick]}"
        bed, first = soft_bed(home / "soft", GRAINS[quick])
        checks = [*seam_checks(), *share_checks(after(bed, first, home / "soft" / "first"), home)]
        if not quick:
            figures = paper_scale(first, 1, home / "paper")
            checks += [
                Check(
                    "1,085 grains, 46.9 GPa: steps a cycle", figures.steps_per_cycle, "> 0", True
                ),
                Check("the same: CPU time of a load cycle", figures.cycle_s, "> 0", True, "s"),
                Check(
                    "the same: grain-steps a CPU second", figures.grain_steps, "> 0", True, "1/s"
                ),
                Check("the same: piston's work in the last cycle", figures.work, "> 0", True, "J"),
                bounded("kinetic energy over that work, greatest", figures.kinetic_share, 1.0),
                bounded("the same at the cycle's end", figures.kinetic_at_end_share, 0.1),
                bounded("rms force error of the piston over the peak", figures.force_error, 0.25),
                bounded("greatest overlap over smallest radius", figures.overlap_share, 0.05),
            ]
        return checks


def bounded(name: str, value: float, bar: float) -> Check:
    """A figure of the stiff bed with an upper bar."""
    return Check(f"the same: {name}", value, f"<= {bar:g}", value <= bar)


def share_checks(bed: Bed, home: Path) -> list[Check]:
    """The same cycles by YADE alone and through the adapter."""
    grains = bed.scene.grain_count
    share = python_share(bed, CYCLES, REPEATS, home / "share")
    bar = 0.95 if grains >= 1000 else 0.9
    what = f"{grains} grains, {bed.scene.steps_per_cycle} steps a cycle"
    return [
        Check(f"{what}: speed through the adapter over YADE alone", share.speed, f">= {bar:g}",
              share.speed >= bar),
        Check(f"{what}: CPU time of YADE alone", share.bare_s, "> 0", True, "s"),
        Check(f"{what}: CPU time of Python beside YADE", share.python_s, "> 0", True, "s"),
    ]  # fmt: skip


def seam_checks() -> list[Check]:
    """The piston over a part of the paper's bed: contacts on a seam, stiffness they add."""
    seams = seams_of(scene_of("karrech-partial"))
    return [
        Check("partial piston: contacts on a seam", seams.touched, "<= 0.02",
              seams.touched <= 0.02),
        Check("partial piston: mean stiffness added", seams.stiffness, "<= 0.01",
              seams.stiffness <= 0.01),
    ]  # fmt: skip
