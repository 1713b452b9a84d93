"""The page on the validation of QDEM against its record, and the picture's tables."""

from __future__ import annotations

import pytest

from validation.cases.qdem import FULL
from validation.qdem_record import checks_of, record_lines, table_path, table_read
from validation.qdem_validation_page import PAGE_PATH, page
from validation.qdem_validation_picture import PANELS, PICTURE, quadratic_limit

LINES = record_lines()


def test_the_page_is_what_the_record_says() -> None:
    """Written by `python -m validation.qdem_validation_page`, and not by hand."""
    assert PAGE_PATH.read_text(encoding="utf-8") == page(LINES)


def test_every_part_is_recorded_and_every_check_holds() -> None:
    """What the page claims holds; nothing is left out."""
    assert [line["part"] for line in LINES] == list(FULL)
    failing = [check.name for line in LINES for check in checks_of(line) if not check.holds]
    assert failing == []


def test_every_table_of_the_picture_is_there() -> None:
    """So that it can be drawn again without a run."""
    assert PICTURE.exists()
    recorded = {name for line in LINES for name in line["tables"]}
    for _, *names in PANELS:
        for name in names:
            assert name in recorded
            assert table_path(name).exists()


def test_tips_of_the_table_follow_the_reference() -> None:
    """Linear elements are too stiff, ever less so, and quadratic ones are near 92.66 um."""
    table = table_read("static")
    limit = quadratic_limit(table)
    assert limit == pytest.approx(92.66, abs=0.02)
    for pattern in ("six", "five"):
        chosen = (table["method"] == "QDEM, settled") & (table["tetrahedra a cell"] == pattern)
        tips = table["tip [um]"][chosen][table["elements"][chosen].argsort()]
        assert (tips[1:] > tips[:-1]).all()
        assert tips.max() < limit


def test_what_the_page_says_of_costs() -> None:
    """Relaxation costs about what multigrid costs; quadratic elements are far ahead of both."""
    large, table = table_read("static-paper-size"), table_read("static")
    cost = dict(zip(large["method"], large["processor time [s]"], strict=True))
    assert 0.5 < cost["QDEM, relaxed"] / cost["scikit-fem, linear"] < 2
    limit = quadratic_limit(table)
    dear = large["tip [um]"][large["method"] == "QDEM, relaxed"][0]
    middle = (table["method"] == "scikit-fem, quadratic") & (table["elements"] == 2304)
    assert table["processor time [s]"][middle] < 0.2 * cost["QDEM, relaxed"]
    assert abs(table["tip [um]"][middle][0] / limit - 1) < 0.2 * abs(dear / limit - 1)
