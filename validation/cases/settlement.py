"""The whole settlement study: every bar from the records, and a run made now beside its floors.

    trackbed validate settlement --json F     F and F.html; the run at paper scale takes hours, and
                                              goes on in the folder TRACKBED_VALIDATION where it
                                              was stopped
    trackbed validate settlement --quick      the run of the coarse scene alone, minutes
    trackbed validate settlement-study        the bars alone, seconds, no engine

A bed is chaotic, so the error of a jump is read against what two equal runs differ by (one grain
moved by 1e-10 m), and against dump, relax and resubmit without a jump (h = 0).
"""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from adapters.procedure import CONTROL, CONTROL_STILL, control_perturbed, run_variant
from adapters.progress import Progress
from adapters.report_error import Comparison, compare
from adapters.run_folder import RunFolder
from adapters.scene_file import scene_load
from adapters.stages import Variant
from scenes import scene_path
from validation.case import Check
from validation.cases import settlement_study
from validation.settlement_study_report import report_write

__all__ = ["report_write", "run"]

MEMBERS = {True: 2, False: 4}
"""Perturbed controls, quick or not: an ensemble is better than a twin."""

FLOORS = 3.0
"""A procedure passes when its error is within so many floors."""


def run(quick: bool) -> list[Check]:
    """The study's bars, unless ``quick``, and a run made now."""
    return [*([] if quick else settlement_study.run(quick)), *run_checks(quick)]


def run_checks(quick: bool) -> list[Check]:
    """Run the coarse scene (quick) or the paper's; resumes in the folder TRACKBED_VALIDATION."""
    name = "karrech-coarse" if quick else "karrech"
    scene = scene_load(scene_path(name))
    with tempfile.TemporaryDirectory() as temporary:
        home = Path(os.environ.get("TRACKBED_VALIDATION", temporary)) / name
        folder = RunFolder(home)
        progress = Progress()
        with folder.locked():
            procedure = run_variant(folder, scene, Variant(), progress)
            control = run_variant(folder, scene, CONTROL, progress)
            still = run_variant(folder, scene, CONTROL_STILL, progress)
            twins = [
                run_variant(folder, scene, control_perturbed(member), progress)
                for member in range(1, MEMBERS[quick] + 1)
            ]
        jumped = compare(procedure, control)
        resubmitted = compare(still, control)
        parted = [compare(twin, control) for twin in twins]
    checks = [
        *_errors("procedure", jumped),
        *_errors("h = 0, resubmitted", resubmitted),
        *(
            check
            for member, comparison in enumerate(parted, 1)
            for check in _errors(f"full run, perturbed {member}", comparison)
        ),
        Check("speed-up in CPU time, loading", jumped.speed_up, "> 1", jumped.speed_up > 1),
    ]
    for quantity in ("settlement", "coordination_number"):
        floor = max(abs(getattr(c, f"{quantity}_error")) for c in (*parted, resubmitted))
        error = abs(getattr(jumped, f"{quantity}_error"))
        checks.append(
            Check(
                f"{quantity} error of the procedure over the greatest floor",
                error / floor,
                f"<= {FLOORS:g}",
                error <= FLOORS * floor,
            )
        )
    return checks


def _errors(name: str, comparison: Comparison) -> list[Check]:
    """The errors of one run against the control, for the record: no bar of their own."""
    figures = {
        "settlement error": comparison.settlement_error,
        "coordination number error": comparison.coordination_number_error,
    }
    return [Check(f"{name}: {what}", value, "finite", True) for what, value in figures.items()]
