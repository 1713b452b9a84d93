"""docs/settlement-study.md is what the records say, and its values are those of the other pages."""

from __future__ import annotations

import pytest

from validation.case import Check
from validation.settlement_bars import BARS, BARS_CONTINUITY, BARS_PARTIAL, told
from validation.settlement_partial_page import way
from validation.settlement_study import WHY, Section, study_checks
from validation.settlement_study_beds import BEDS, CHOSEN, FAR_PAGE, PARTLY, RIVALS
from validation.settlement_study_page import PAGE, page

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
    """No miss without its reason, and no reason that outlives its miss."""
    assert {name for name, check in checks.items() if not check.holds} == set(WHY)
    assert all(check.known for check in checks.values() if not check.holds)


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
        ("jump control on LIGGGHTS, tolerance 0.05: observed within", "44 of 51 ({:.0%})"),
        ("jump control on LIGGGHTS, tolerance 0.1: as the full run gained", "36 of 44 ({:.0%})"),
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
