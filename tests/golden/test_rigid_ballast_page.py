"""docs/rigid-ballast.md is made from the committed record, and says what it holds."""

from __future__ import annotations

from validation.cases.rigid_ballast import record_checks
from validation.rigid_ballast_judge import limits_of, summaries
from validation.rigid_ballast_page import PAGE, kept_words, page, turn_words
from validation.rigid_ballast_runs import PICTURED, RECORD, rows_read

ROWS = rows_read(RECORD)


def test_page_is_that_of_the_record() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(ROWS)
    assert PAGE.with_suffix(".png").is_file()


def test_record_holds_its_bars() -> None:
    assert [check.name for check in record_checks(ROWS) if not check.holds] == []


def test_both_methods_have_an_ensemble() -> None:
    """At least ten beds a level, steps of both sides of 1e-3 s, three decades of stiffness."""
    found = [s for s in summaries(ROWS, limits_of(ROWS)) if s.beds >= 10]
    steps = [s.level["value"] for s in found if s.method == "rigid"]
    stiffness = [s.level["value"] for s in found if s.method == "soft"]
    assert min(steps) < 1e-3 < max(steps)
    assert max(stiffness) / min(stiffness) >= 1e3


def test_force_chains_of_both_methods_are_there() -> None:
    drawn = {row["name"] for row in ROWS if row["kind"] == "state"}
    assert drawn == {level.name for level in PICTURED}


def test_no_table_has_a_column_twice() -> None:
    """The last cycle may be one of those that are shown anyway."""
    heads = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if "cycle 1 [" in line]
    assert len(heads) == 1
    columns = [cell.strip() for cell in heads[0].strip("|").split("|")]
    assert len(set(columns)) == len(columns)


def test_a_step_above_its_residual_is_told() -> None:
    """Of three rigid runs one missed by a factor of two; a run cut off counts as none."""

    def run(residual: float, ok: bool = True) -> dict[str, object]:
        level = {"method": "rigid", "value": 1e-3, "extra": 1e-6}
        return {"kind": "rigid", "ok": ok, "level": level, "residual": residual, "name": "h",
                "bed": {"seed": 7}}  # fmt: skip

    assert kept_words([run(1e-6), run(5e-7)]) == "all 2 runs"
    words = kept_words([run(1e-6), run(2e-6), run(5e-7), run(9.0, ok=False)])
    assert words == "2 of 3 runs; the worst step of the others leaves 2.0 times that (h, seed 7)"


def test_the_sleepers_turn_is_that_of_all_runs() -> None:
    """Long runs turn it more than short ones: each by its cycles."""
    rows = [{"kind": kind, "ok": True, "cycles": cycles, "tilt": tilt}
            for kind, cycles, tilt in (("rigid", 5, -2e-5), ("soft", 5, 1e-5),
                                       ("long", 40, 6.2e-4))]  # fmt: skip
    assert turn_words(rows) == (
        "2.0e-05 rad at most in 5 cycles (2 runs) and 6.2e-04 rad at most in 40 cycles (1 runs)"
    )
