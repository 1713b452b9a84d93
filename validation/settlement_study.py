"""The settlement study's verdict: every bar, its value from the records, and why one is missed.

No engine runs here; values come from the functions that make the pages of the documentation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import nan
from pathlib import Path

from validation import (
    jump_runs,
    jump_study,
    jump_twins,
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
    Section("Jump control", (jump_study.RECORD, jump_runs.STUDY.record, jump_twins.RECORD,
            STUDIES["confined"].record, ENSEMBLE), jump_checks),
    Section("Hard cases", (settlement_hard_runs.RECORD,), hard_checks),
    Section("Relaxation", (relaxation_runs.RECORD,), relaxation_checks),
)  # fmt: skip

MEET, MISS = "full runs between the same cycles meet the bar", "full runs miss the bar, too"
STILL = f"{MEET}, and with nothing moved it is missed, too"
RATE = f"moved beds settle more in the first cycle behind a jump and rise in the next; {STILL}"
SLOWER = f"most settle less a cycle than before, not known why; {MEET}"
YOUNGER = f"most settle more than full runs, not known why; {MEET}"
HUNG = f"one packing's piston hangs again in single cycles behind the jump; {MEET}"
LATE = f"most settle more than full runs, with nothing moved, too, not known why; {MISS}"
CHAOS = "two full runs of one packing gain the same in too few, too"
AHEAD = "what comes is settled by the state more than by chance, and rates before do not tell of it"
SWING = "not known why; between ends of cycles the coordination number swings by more"
NOISE = f"{SWING}; by a mean profile, which hardly moves it, there are as many as before"
WHY: dict[str, tuple[float, str]] = {
    "confined: rate behind healing stays": (85, SLOWER),
    "confined: rate behind healing goes on": (88.33, MISS),
    "confined: rate behind the first cycle goes on": (83.33, YOUNGER),
    "partial: rate stays": (60, MISS),
    "partial: rate behind healing stays": (50, MISS),
    "partial: rate behind healing goes on": (50, LATE),
    "partial: rate behind the first cycle goes on": (80, LATE),
    "partial: rate goes on": (60, LATE),
    "partial: stiffness goes on": (80, HUNG),
    "coarse, cycle 10,000: coordination number": (3.52, "not known why"),
    "coarse, cycle 10,000: elastic deflection":
        (8.89, "not known why; the runs do not tell it from none"),
    "coarse, cycle 10,000: rate behind healing goes on": (86.2, RATE),
    "coarse, cycle 10,000: rate behind the first cycle goes on": (80, RATE),
    "coarse, cycle 10,000: rate goes on": (84.6, RATE),
    "bands that have the truth, where they are given":
        (69, "bursts that are still to come are in no first cycles"),
    "jump control, curve of the demo's full run: within":
        (0.84, "the bed settles in bursts that few windows see"),
    "jump control on LIGGGHTS, tolerance 0.1: as the full run gained": (0.767, CHAOS),
    "jump control on LIGGGHTS, tolerance 0.05: as the full run gained": (0.698, CHAOS),
    "jump control on LIGGGHTS, tolerance 0.05: as the bed itself would have gained": (0.830, AHEAD),
    "hard case, a crystal less three grains, in a box half a percent wider, jumps by history: "
    "checks that do not hold": (1, NOISE),
    "hard case, the same, settled by the history of all 24 cycles: checks that do not hold":
        (1, SWING),
}  # fmt: skip
"""By the name of a check: the value at which its bar is known to be missed, and why or that this is
not known; figures are in the records."""
WORSE = 0.1
"""Part by which a value may be worse than that one and its miss is still called known."""


def explained(check: Check) -> Check:
    """The check with the reason, where it is missed by a value no worse than the known one."""
    known, why = WHY.get(check.name, (nan, ""))
    least = check.bar.startswith(">")
    worst = known * (1 - WORSE if least else 1 + WORSE)
    as_known = check.value >= worst if least else check.value <= worst
    return replace(check, why=why) if not check.holds and as_known else check


def study_checks(sections: Sequence[Section] = SECTIONS) -> list[tuple[Section, list[Check]]]:
    """All sections with their checks, some ten seconds."""
    return [(section, section.judged()) for section in sections]
