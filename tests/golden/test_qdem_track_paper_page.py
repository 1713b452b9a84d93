"""docs/qdem-track-paper.md is what its command makes of the committed records."""

from __future__ import annotations

import pytest

from qdem_fem.track_bed import STAGES
from validation.track_paper_page import PAGE, page, records


def test_page_is_the_records() -> None:
    """Byte for byte."""
    assert PAGE.read_text(encoding="utf-8") == page(*records())


def test_sentences_about_the_whole() -> None:
    """At rest by the scene's bars, the paper's measures within 10 %, no search; 30 % of a step."""
    record = records()[0]
    rest, (stand,) = record["rests"]["rest"], record["stands"].values()
    assert list(record["rests"]) == list(STAGES)
    assert rest["unbalanced"] <= 0.05
    assert rest["kinetic"] <= 0.01
    assert rest["loose"] <= 0.02
    assert stand["slid"] <= 0.01 * stand["elastic"]
    paper = {"foot": 4.6, "top": 3.0, "height": 0.4}
    assert all(abs(record["shape"][name] / one - 1) < 0.1 for name, one in paper.items())
    assert record["shape"]["alone"] == record["shape"]["alone_on_sleeper"] == 4  # no towers
    assert 0.55 < record["shape"]["solid"] < 0.65
    marches = record["marches"]
    assert record["axle"]["searches"] == marches["1"]["searches"] == 0
    assert marches["2"]["wall_a_step"] < 0.6 * marches["1"]["wall_a_step"]
    search = marches["1"]["parts"]["a search for pairs"] / marches["1"]["seconds_a_step"]
    assert search < 0.3 * record["axle"]["steps"]


def test_sentences_about_half_a_sleeper() -> None:
    """Greatest under the rail, lifted at the middle; the end lowest; peaks of the middle."""
    half = records()[-1]
    points, peaks = half["run"]["points"], half["run"]["peaks"]
    behind = {name: point["passages"][-1]["end"] for name, point in points.items()}
    assert behind["B2"] == pytest.approx(1.3e-3, rel=0.02)
    assert behind["B3"] < 0 < behind["B1"] < 2e-5 < behind["B2a"] < behind["B2"]
    larger = {
        name for name in ("B1", "B2", "B3", "B2a") if points[name]["lateral_over_vertical"] > 1
    }
    assert larger == {"B1"}
    assert half["bending"]["S1 below S3"] == pytest.approx(166e-6, rel=0.01)
    assert half["bending"]["S2 below S3"] == pytest.approx(71e-6, rel=0.01)
    assert [round(f) for f in peaks["S3"][:3]] == [100, 208, 440]
    assert {212, 440} <= {round(f) for f in peaks["S2"]}
    assert {212, 348, 444, 792} <= {round(f) for f in peaks["load"]}
    assert min(abs(f - 100) for f in peaks["load"]) > 10
    assert {332, 789} <= {round(f) for f in peaks["S1"]}
