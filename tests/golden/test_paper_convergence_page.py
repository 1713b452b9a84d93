"""Figs 11 and 12: the page is made from its record, and the record is what the study names."""

from __future__ import annotations

from typing import Any

import pytest

from validation.jump_runs import record_read
from validation.paper_convergence import FULL, STILL, errors_of, paths_of
from validation.paper_convergence_page import PAGE, page
from validation.paper_convergence_runs import STUDY


@pytest.fixture(scope="module")
def rows() -> list[dict[str, Any]]:
    return record_read(STUDY.record)


def test_page_is_made_from_the_record(rows: list[dict[str, Any]]) -> None:
    assert page(rows) == PAGE.read_text(encoding="utf-8")
    assert PAGE.with_suffix(".png").exists()


def test_every_way_comes_to_the_last_cycle_by_computing_or_jumping(
    rows: list[dict[str, Any]],
) -> None:
    """Every way once, from the same cycles; those that jump computed fewer and cost less, and the
    full run is without error."""
    assert sorted(row["way"] for row in rows) == sorted(way.name for way in STUDY.ways)
    paths = paths_of(rows)
    full = paths[FULL]
    assert not any(row["refused"] for row in rows)
    assert errors_of(full, full).displacement == 0.0
    for path in paths.values():
        shared = full.cycle <= STUDY.shared
        assert path.cycle[-1] == STUDY.last
        assert (path.settlement[: shared.sum()] == full.settlement[shared]).all()
    assert paths[STILL].computed < full.computed == STUDY.last
