"""docs/relaxation.md is what its record says, and its sentences hold there."""

from __future__ import annotations

import numpy as np
import pytest

from validation.relaxation_jumps import PAPER, Jumped, jumps_load
from validation.relaxation_measures import figures_before, measured
from validation.relaxation_page import PAGE, page
from validation.relaxation_reading import (
    CARRIED,
    TITLES,
    Ways,
    by_way,
    gained,
    gained_met,
    of_answers,
    overlap_before,
    point_carried,
    refused,
)
from validation.relaxation_runs import Row, key, record_read
from validation.relaxation_ways import WAYS, own, rough
from validation.student import interval


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    return record_read()


@pytest.fixture(scope="module")
def paper(rows: list[Row]) -> Ways:
    return by_way(rows, "paper")


@pytest.fixture(scope="module")
def beds(rows: list[Row]) -> Ways:
    return by_way(rows, "bed")


def end(paper: Ways, way: str, figure: str) -> float:
    """Median over the jumps of a figure at a way's end."""
    return float(np.median([row["points"][-1][figure] for row in paper[way].values()]))


def test_page_is_made_from_the_record(rows: list[Row]) -> None:
    """Made again, the page is the one that ships; no run is there twice."""
    text = PAGE.read_text(encoding="utf-8")
    assert page(rows) == text
    assert "TABLE_" not in text
    assert len({key(row) for row in rows}) == len(rows)


def test_record_is_whole(paper: Ways, beds: Ways) -> None:
    """Every way at every jump, and on at least four live beds."""
    assert all(len(paper[way]) == len(PAPER) for way in TITLES)
    assert all(len(beds[way]) >= 4 for way in ("base", "resubmitted", *WAYS))


@pytest.mark.parametrize("jump", jumps_load(), ids=lambda jump: jump.name)
def test_jumps_are_those_of_the_record(paper: Ways, jump: Jumped) -> None:
    """Figures of the stored states are the record's; relaxed again, the bars of a jump hold.

    Contacts within 3 %, overlaps no greater than before, the mean height that of the estimate.
    """
    before = rough(figures_before(jump))
    assert paper["before"][jump.name]["points"] == [before]
    assert paper["estimate"][jump.name]["points"] == [rough(measured(jump, jump.estimate))]
    found = measured(jump, own(jump, "smallest-move").position)
    assert abs(found["coordination_error"]) < 0.03
    assert found["overlap"] < 1.01 * before["overlap"]
    assert abs(found["height"]) < 1e-3 * before["settlement"]


def test_sentences_at_paper_scale(paper: Ways) -> None:
    """What the reading says of overlaps, contacts, heights and cost."""

    def carried(way: str, figure: str) -> float:
        points = [point_carried(paper, way, bed) for bed in paper[way]]
        assert all(point is not None for point in points)
        return float(np.median([point[figure] for point in points if point]))

    for way in ("hertz lbfgs", "hertz fire"):
        assert end(paper, way, "coordination_error") < -0.9
        assert carried(way, "coordination_error") < -0.5
        assert end(paper, way, "height") > 0
    assert abs(carried("hertz gradient", "coordination_error")) < 0.1
    assert carried("hertz gradient", "cpu_s") > 5 * end(paper, "smallest-move", "cpu_s")
    for bed, row in paper["hertz gradient"].items():
        settled = paper["before"][bed]["points"][0]["settlement"]
        assert 0.2 < row["points"][-1]["height"] / settled < 0.4
        drag = paper["liggghts drag"][bed]["points"][-1]["overlap"]
        assert 4 < drag / overlap_before(paper, bed) < 20
    for minimiser in ("gradient", "lbfgs", "fire"):
        assert end(paper, f"eq29 {minimiser}", "overlap") > 3e-4
    assert end(paper, "eq29-free lbfgs", "height") < -5e-4
    assert not any(row["points"][-1]["ended"] for row in paper["eq29-free lbfgs"].values())
    for bed in paper["liggghts drag"]:
        assert point_carried(paper, "liggghts drag", bed) is None
    for bed in paper["smallest-move"]:
        last = paper["smallest-move"][bed]["points"][-1]
        assert last["overlap"] <= CARRIED * overlap_before(paper, bed)


def test_sentences_about_live_beds(beds: Ways) -> None:
    """First cycles beside the full run's, forces of deep overlaps, and history."""
    assert 2 * len(refused(beds, "estimate")) > len(beds["estimate"])
    met, first = gained_met(beds, 0, 1), gained(beds, "smallest-move", 0, 1)
    assert np.abs(met).max() < 2e-5
    greatest = 0.0
    for way in ("hertz gradient, carried", "hertz fire, carried"):
        mean, half = interval(gained(beds, way, 0, 1) - met)
        assert mean > half
        assert np.abs(gained(beds, way, 0, 1)).max() < 5e-5
        assert np.median(first) < np.median(gained(beds, way, 0, 1))
        greatest = max(greatest, gained(beds, way, 0, 1).max())
    assert first.max() > 2 * greatest
    rival = gained(beds, "hertz gradient, carried", 0, 1).mean()
    for way in ("hertz lbfgs", "hertz lbfgs, carried", "hertz fire"):
        assert gained(beds, way, 0, 1).mean() > 1.5 * rival
    extra = np.mean([row["coordination_error"] for row in beds["hertz gradient, carried"].values()])
    assert 0.2 < extra < 0.4
    assert not refused(beds, "smallest-move")
    for way in ("karrech2007", "eq29 gradient", "liggghts drag, 1000", "liggghts drag, 10000"):
        assert of_answers(beds, way, "peak_force", 0).mean() > 1.2
        assert gained(beds, way, 0, 1).mean() < -1e-4
    assert of_answers(beds, "hertz lbfgs", "tangential_start").max() < 1e-3
    for way in ("smallest-move", "hertz gradient, carried", "hertz lbfgs", "hertz fire"):
        mean, half = interval(of_answers(beds, way, "tangential_first"))
        assert abs(mean - 1) < half
