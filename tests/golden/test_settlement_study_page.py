"""docs/settlement-study.md is what the records say, and its values are those of the other pages."""

from __future__ import annotations

import re

import numpy as np
import pytest

from validation import jump_runs, settlement_hard_runs
from validation.case import Check
from validation.jump_liggghts import chaos_within
from validation.jump_reading import BAR
from validation.settlement_bars import (
    BARS,
    BARS_CONTINUITY,
    BARS_PARTIAL,
    beside_full,
    jumps_of,
    settled_more,
    sides_compared,
    told,
)
from validation.settlement_ensemble import COARSE, PARTIAL, Kind
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_hard_page import failing
from validation.settlement_partial_page import way
from validation.settlement_rivals import HEALING
from validation.settlement_rivals_reading import finished
from validation.settlement_rivals_reading import judged as judged_of
from validation.settlement_rivals_runs import record_read
from validation.settlement_rivals_studies import STUDIES
from validation.settlement_study import (
    CHAOS,
    LATE,
    MEET,
    MISS,
    NOISE,
    RATE,
    SWING,
    WHY,
    Section,
    study_checks,
)
from validation.settlement_study_beds import BEDS, CHOSEN, FAR_PAGE, PARTLY, RIVALS
from validation.settlement_study_page import PAGE, page
from validation.student import interval

DOCS = PAGE.parent.parent


@pytest.fixture(scope="module")
def judged() -> list[tuple[Section, list[Check]]]:
    return study_checks()


@pytest.fixture(scope="module")
def checks(judged: list[tuple[Section, list[Check]]]) -> dict[str, Check]:
    return {check.name: check for _, found in judged for check in found}


def test_page_is_made_from_the_records(judged: list[tuple[Section, list[Check]]]) -> None:
    """Made again, the page is the one that ships."""
    assert page(judged) == PAGE.read_text(encoding="utf-8")


def test_names_are_told_apart_and_pages_are_there(
    judged: list[tuple[Section, list[Check]]], checks: dict[str, Check]
) -> None:
    """A name, by which a reason is found, is that of one check; its page exists."""
    assert len(checks) == sum(len(found) for _, found in judged)
    assert all((DOCS / check.page).is_file() for check in checks.values())


def test_every_missed_bar_has_a_reason_and_every_reason_a_missed_bar(
    checks: dict[str, Check],
) -> None:
    """No miss without its reason, no reason that outlives its miss, and the value that is known is
    the record's; reasons have no figures of their own."""
    assert {name for name, check in checks.items() if not check.holds} == set(WHY)
    assert all(check.known for check in checks.values() if not check.holds)
    for name, (known, why) in WHY.items():
        assert known == pytest.approx(checks[name].value, rel=0.01)
        assert not re.search(r"\d", why)


def test_reasons_say_of_full_runs_what_the_records_say(checks: dict[str, Check]) -> None:
    """Where they stand beside the bar: that they meet it, or miss it, too."""
    missed = [check for check in checks.values() if not check.holds and "full runs" in check.bar]
    assert len(missed) > 8
    for check in missed:
        bound, full = map(float, re.findall(r"\d+", check.bar))
        assert (MEET in check.why, MISS in check.why) == (full >= bound, full < bound)


@pytest.mark.parametrize(
    ("bed", "kind", "reason"), [("partial", PARTIAL, LATE), ("far", COARSE, RATE)]
)
@pytest.mark.long
def test_bars_that_are_missed_with_nothing_moved_too(bed: str, kind: Kind, reason: str) -> None:
    """As their reason says, which tells whether most settle more or less than full runs, too."""
    study = STUDIES[bed]
    rows = sides_compared(record_read(study.record), kind, EnsembleRecord())
    (still,) = (one.name for one in study.methods if one.name.endswith("nothing moved"))
    bars = [bar for bar in BARS_CONTINUITY if reason in WHY.get(f"{BEDS[bed]}: {bar.words}", ())]
    assert len(bars) > 1
    assert not any(bar.met(bar.value(rows, still, study.last)) for bar in bars)
    jumps = jumps_of(rows, CHOSEN[bed], study.last)
    if reason == RATE:
        first, after = (
            interval(values) for values in settled_more(rows, CHOSEN[bed], study.last).T
        )
        assert first[0] - first[1] > 0 > after[0] + after[1]
    for skipped in (1, HEALING):
        found = [beside_full(jump, "settlement", skipped) for jump in jumps]
        missed = [(more > 0) == (reason == LATE) for more, goes_on in found if not goes_on]
        assert missed.count(True) > missed.count(False)


def test_chaos_swings_and_scatter_are_what_reasons_say() -> None:
    """Full runs beside full runs miss the bar; contacts swing by more than a jump changes them; no
    deflection is told from none."""
    runs, record = jump_runs.record_read(), EnsembleRecord()
    for one in ("tolerance 0.05", "tolerance 0.1"):
        assert WHY[f"jump control on LIGGGHTS, {one}: as the full run gained"][1] == CHAOS
        assert np.mean(chaos_within([run for run in runs if run["way"] == one], record)) < BAR
    known = {row["name"]: row for row in settlement_hard_runs.record_read()}
    wrong = [row for row in known.values() if failing(row)]
    assert len(wrong) == sum(why in (SWING, NOISE) for _, why in WHY.values())
    assert not failing(known["near-crystal-by-profile"])
    for row in wrong:
        (change,) = (check["value"] for check in row["checks"] if not check["ok"])
        computed = np.diff([0, *row["figures"]["cycle"]]) == 1
        ends = np.array(row["figures"]["coordination"])[computed]
        assert np.ptp(ends) / ends.mean() > change
    far = judged_of(
        record_read(STUDIES["far"].record), CHOSEN["far"], STUDIES["far"].last, "deflection"
    )
    assert far
    assert far.half > abs(far.mean)


def test_a_piston_hangs_again_where_stiffness_does_not_go_on() -> None:
    """Jumps of one packing, behind which the unloading stiffness of some cycles is negative."""
    rows = sides_compared(record_read(STUDIES["partial"].record), PARTIAL, EnsembleRecord())
    for row in finished(rows, CHOSEN["partial"], STUDIES["partial"].last):
        for jump in jumps_of([row], CHOSEN["partial"], STUDIES["partial"].last):
            hangs = min(jump["after"]["piston_stiffness"]) < 0
            assert beside_full(jump, "piston_stiffness", 0)[1] != hangs
            assert hangs == (row["seed"] == 2)


@pytest.mark.parametrize(
    ("bed", "of", "bars", "head"),
    [
        ("confined", RIVALS, BARS, "At paper scale"),
        ("partial", PARTLY, BARS_PARTIAL, "Beside the bars"),
        ("far", FAR_PAGE, BARS_CONTINUITY, "Whether a bed goes on"),
    ],
)
def test_values_of_beds_are_those_of_their_pages(
    bed: str, of: str, bars: tuple, head: str, checks: dict[str, Check]
) -> None:
    """The cell of the bars' table on the page, value and verdict, is what the check tells."""
    text = (DOCS / of).read_text(encoding="utf-8").partition(head)[2]
    table = text[text.index(f"| way | {bars[0].words} |") :]
    columns, line = (
        [cell.strip() for cell in row.split("|")[1:-1]]
        for row in (table.split("\n")[0], next(
            row for row in table.split("\n") if row.startswith(f"| {way(CHOSEN[bed])} |")
        ))
    )  # fmt: skip
    cells = dict(zip(columns, line, strict=True))
    compared = 0
    for bar in bars:
        check = checks.get(f"{BEDS[bed]}: {bar.words}")
        if check is not None:
            assert cells[bar.words].partition(" (")[0] == told(bar, check.value)
            assert check.ok == cells[bar.words].startswith("**")
            compared += 1
    assert compared >= len(bars) - 2


@pytest.mark.parametrize(
    ("name", "told_there"),
    [
        ("laws, real ballast: median error", "| real ballast | 27 of 38 | {:.1%} |"),
        ("laws, families: coverage of the 90 % band", "| {:.0%} | 20 % |"),
        ("jump control, curves: jumps within the tolerance", "({:.0%}) within the tolerance"),
        ("jump control, curve of the demo's full run: within", "42 of 50 ({:.0%})"),
        ("jump control on LIGGGHTS, tolerance 0.05: observed within", "49 of 53 ({:.0%})"),
        ("jump control on LIGGGHTS, tolerance 0.1: as the full run gained", "33 of 43 ({:.0%})"),
        ("coarse, cycle 10,000: cheaper by", "| 345 | {:.1f} | 20.9 |"),
        ("coarse, cycle 10,000: bias over half the reference's interval", "| 695 | {:.2f} |"),
    ],
)
def test_values_of_parts_are_those_of_their_pages(
    name: str, told_there: str, checks: dict[str, Check]
) -> None:
    """The page has the value, rounded as it rounds."""
    text = (DOCS / checks[name].page).read_text(encoding="utf-8")
    assert told_there.format(checks[name].value).replace("%", " %").replace("  ", " ") in text
