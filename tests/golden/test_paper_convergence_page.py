"""Figs 11 and 12: the page is made from its record, and the record is what the study names."""

from __future__ import annotations

from typing import Any

import pytest

from validation.jump_runs import record_read
from validation.paper_convergence import (
    FULL,
    JUMPED,
    MEMBER,
    STILL,
    VARIED_H,
    VARIED_K,
    errors_of,
    falls,
    name_of,
    paths_of,
)
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


def test_what_the_page_says_in_short_is_so(rows: list[dict[str, Any]]) -> None:
    """A full run parts from itself by more than any way misses; and what comes at 180 %."""
    paths = paths_of(rows)
    errors = {name: errors_of(path, paths[FULL]) for name, path in paths.items()}
    member = abs(errors[MEMBER].settlement)
    assert max(abs(errors[name].settlement) for name in JUMPED) < member
    for varied in (VARIED_K, VARIED_H[::-1]):
        assert not falls([errors[name_of(k, h)].settlement for k, h in varied])
    most = errors[max(JUMPED, key=lambda name: errors[name].gained)]
    assert 1.6 < most.gained < 2.0
    assert abs(most.coordination) < 0.12
    assert most.coordinates < 0.01
    assert abs(most.settlement) > 0.005
    assert member / 0.005 == pytest.approx(16, abs=1)
    assert errors[STILL].settlement < 0
    assert errors[STILL].coordinates < 1.01 * min(errors[name].coordinates for name in JUMPED)
