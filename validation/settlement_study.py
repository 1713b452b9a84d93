"""The settlement study's verdict: every bar, its value from the records, and why one is missed.

No engine runs here; values come from the functions that make the pages of the documentation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import isfinite, nan
from pathlib import Path

from validation import (
    jump_runs,
    jump_study,
    law_study,
    relaxation_runs,
    settlement_hard_runs,
)
from validation.case import Check
from validation.settlement_ensemble_record import RECORD as ENSEMBLE
from validation.settlement_rivals_studies import STUDIES
from validation.settlement_study_beds import (
    confined_checks,
    ensemble_checks,
    far_checks,
    partial_checks,
)
from validation.settlement_study_parts import (
    hard_checks,
    jump_checks,
    law_checks,
    relaxation_checks,
)


@dataclass(frozen=True)
class Section:
    """A part of the study."""

    title: str
    records: tuple[Path, ...]
    """What it is read from."""
    checks: Callable[[], list[Check]]
    studies: tuple[str, ...] = ()
    """Names of the studies whose pictures of error against cost belong to it."""

    def judged(self) -> list[Check]:
        """Its checks; for a record that is absent one that says so, and no other."""
        absent = [path for path in self.records if not path.exists()]
        if absent:
            return [absence(self.title, path) for path in absent]
        return [replace(explained(check), section=self.title) for check in self.checks()]


def absence(title: str, path: Path) -> Check:
    """A record that is not here: nothing of its section can be judged."""
    name = f"{title}: the record validation/results/{path.name} is not here"
    return Check(name, nan, "fetch it again from the repository", ok=False, section=title)


SECTIONS = (
    Section("Reference ensemble", (ENSEMBLE,), ensemble_checks),
    Section("Confined bed of the paper, to cycle 500", (STUDIES["confined"].record, ENSEMBLE),
            confined_checks, ("confined",)),
    Section("Partially confined bed of the paper, to cycle 100",
            (STUDIES["partial"].record, ENSEMBLE), partial_checks, ("partial",)),
    Section("Coarse bed, to 10,000 cycles and beyond", (STUDIES["far"].record, ENSEMBLE),
            far_checks, ("coarse", "far")),
    Section("Laws of settlement", (law_study.RECORD,), law_checks),
    Section("Jump control", (jump_study.RECORD, jump_runs.STUDY.record), jump_checks),
    Section("Hard cases", (settlement_hard_runs.RECORD,), hard_checks),
    Section("Relaxation", (relaxation_runs.RECORD,), relaxation_checks),
)  # fmt: skip

LONG_JUMPS = "behind jumps of some hundred cycles the rate is known no better than a window tells"
CHAOS = "two full runs of one packing, which part by chaos alone, gain the same in fewer than 90 %"
WHY = {
    "confined: rate behind healing stays": "single cycles scatter: full runs have it in few more",
    "confined: rate behind healing goes on": "full runs themselves have it in fewer",
    "confined: rate behind the first cycle goes on":
        "full runs of one packing part by little here, and only just meet it themselves",
    "partial: gained time":
        "one packing's piston hangs by its rim, and the cycles of waiting for it are computed",
    "partial: gained time at equal cost a step":
        "one packing's piston hangs by its rim, and the cycles of waiting for it are computed",
    "partial: rate stays":
        "behind the default move the first cycle settles too much; full runs have it in few",
    "partial: rate behind healing stays": "full runs themselves have it in few",
    "partial: rate behind healing goes on":
        "a bed moved by the default settles more for some cycles; full runs do not meet it either",
    "partial: rate behind the first cycle goes on":
        "a bed moved by the default settles more for some cycles; one moved by the profile less so",
    "partial: rate goes on":
        "behind the default move contacts do not bear yet, and the first cycle settles too much",
    "coarse, cycle 10,000: rate behind healing goes on": LONG_JUMPS,
    "coarse, cycle 10,000: rate behind the first cycle goes on": LONG_JUMPS,
    "coarse, cycle 10,000: rate goes on": LONG_JUMPS,
    "coarse: bands that have the truth, in all tests":
        "ten runs of five packings, whose bursts to come are in no first cycles",
    "jump control, curve of the demo's full run: within":
        "the bed settles in bursts that few windows see",
    "jump control on LIGGGHTS, tolerance 0.1: as the full run gained": CHAOS,
    "jump control on LIGGGHTS, tolerance 0.05: as the full run gained": CHAOS,
    "jump control on LIGGGHTS, tolerance 0.05: observed within":
        "the bursts of the coarse bed scatter its windows by more",
    "hard case, a crystal less three grains, in a box half a percent wider, jumps by history: "
    "checks that do not hold":
        "6 % fewer contacts behind a jump; from one end of a cycle to another it has 2.57 to 3.21",
    "hard case, the same, settled by the history of all 24 cycles: checks that do not hold":
        "12 % fewer contacts behind a jump; from one end of a cycle to another it has 1.95 to 3.16",
}  # fmt: skip
"""By the name of a check: why its bar is known to be missed."""


def explained(check: Check) -> Check:
    """The check with the reason, where it is missed by a known value."""
    why = WHY.get(check.name, "")
    return replace(check, why=why) if why and not check.holds and isfinite(check.value) else check


def study_checks(sections: Sequence[Section] = SECTIONS) -> list[tuple[Section, list[Check]]]:
    """All sections with their checks, some ten seconds."""
    return [(section, section.judged()) for section in sections]
