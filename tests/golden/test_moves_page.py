"""docs/moves.md is what its record says, and its sentences hold in the record."""

from __future__ import annotations

import numpy as np
import pytest

from adapters.moves import moves_known
from validation.move_study import Row, record_read
from validation.move_study_engine import FULL, JUDGED, PAPER, SMALL, TWIN
from validation.move_study_offline import OTHER_MEMBER
from validation.move_study_page import PAGE, page
from validation.move_study_reading import (
    ORDER,
    SCALES,
    beds,
    cycles,
    median_of,
    offline_rows,
    over_beds,
    rows_of_kind,
    way_to_end,
    wins,
)


@pytest.fixture(scope="module")
def offline() -> list[Row]:
    return record_read("offline")


@pytest.fixture(scope="module")
def engine() -> list[Row]:
    return record_read("engine")


def test_page_is_made_from_the_record(offline: list[Row], engine: list[Row]) -> None:
    """Made again, the page is the one that ships; every way is on it."""
    text = PAGE.read_text(encoding="utf-8")
    assert page(offline, engine) == text
    assert "{{" not in text
    assert all(f"| `{way}` |" in text for way in moves_known())
    assert set(ORDER) == {*moves_known(), OTHER_MEMBER, FULL, TWIN}


def test_every_way_is_judged_on_the_same_jumps(offline: list[Row], engine: list[Row]) -> None:
    """The same windows for all; at least four beds a way on the engine; each row once."""
    keys = [(row["run"], *row["jump"], row["move"]) for row in [*offline, *engine]]
    assert len(keys) == len(set(keys))
    for scale in SCALES:
        windows = {
            frozenset((row["run"], *row["jump"]) for row in offline_rows(offline, scale, way))
            for way in moves_known()
        }
        assert len(windows) == 1
    small = rows_of_kind(engine, SMALL.kind.name)
    counts = {way: len(beds(small, way)) for way in (*moves_known(), FULL, TWIN)}
    assert len(set(counts.values())) == 1
    assert min(counts.values()) >= 4
    assert {row["run"].rpartition("-")[0] for row in engine} == {j.kind.name for j in JUDGED}
    assert len(rows_of_kind(engine, PAPER.kind.name)) >= 4


def test_sentences_about_fields(offline: list[Row]) -> None:
    """What the page says of the offline part in words."""
    for scale in SCALES:
        rows = {way: offline_rows(offline, scale, way) for way in moves_known()}
        error = {way: median_of(mine, "field") for way, mine in rows.items()}
        assert min(error, key=error.__getitem__) == "shrunk"
        assert error["per-grain"] > 1.1
        assert 0.9 < error["modes"] / error["per-grain"] < 1
        for way in moves_known():
            before = median_of(rows[way], "coordination_before")
            assert median_of(rows[way], "coordination_relaxed") == pytest.approx(before, rel=0.02)
        relaxed = [median_of(rows[way], "field_relaxed") for way in ("shrunk", "smoothed")]
        assert relaxed[0] == pytest.approx(relaxed[1], abs=0.02)
        fewer, count = wins(offline, scale, "shrunk", "smoothed", "median_relaxed")
        assert fewer > count / 2
        assert median_of(rows["shrunk"], "pushed_most") < median_of(rows["smoothed"], "pushed_most")


def test_sentences_about_the_first_cycle(engine: list[Row]) -> None:
    """On the coarse bed the first cycle after a jump settles more than the later ones, any way."""
    small = rows_of_kind(engine, SMALL.kind.name)
    for way in moves_known():
        path = np.mean([cycles(row, "after", "rate") for row in beds(small, way)], axis=0)
        assert path[0] > 2 * abs(path[1:].mean())


def test_sentences_about_ways_that_can_not_be_told_apart(engine: list[Row]) -> None:
    """On the coarse bed what moves ends within two errors of every other; twins differ by as much.

    At paper scale the rate from the second cycle on is within a half of that before.
    """
    small = rows_of_kind(engine, SMALL.kind.name)
    ends = [over_beds(beds(small, way), way_to_end) for way in moves_known() if way != "still"]
    for mean, error in ends:
        for other, its in ends:
            assert abs(mean - other) < 2 * np.hypot(error, its)
    for row in rows_of_kind(engine, PAPER.kind.name):
        before, after = (
            cycles(row, "before", "rate").mean(),
            cycles(row, "after", "rate")[1:].mean(),
        )
        assert after == pytest.approx(before, rel=0.5)
