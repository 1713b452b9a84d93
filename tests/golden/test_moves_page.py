"""docs/moves.md is what its record says, and its sentences hold in the record."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from adapters.moves import moves_known
from validation.move_study import Row, record_read
from validation.move_study_engine import FULL, JUDGED, PAPER, SMALL, TWIN
from validation.move_study_members import member_name, rows_of_members
from validation.move_study_offline import OTHER_MEMBER
from validation.move_study_page import FIRST_CYCLES, PAGE, first_change, page
from validation.move_study_paper import first_rate, kinds_of, softer, stiffer
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
from validation.settlement_ensemble_record import EnsembleRecord


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
    members = map(member_name, range(PAPER.kind.members))
    assert set(ORDER) == {*moves_known(), OTHER_MEMBER, FULL, TWIN, *members}


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
    """Coarse bed: what moves ends within two errors of every other; twins differ by as much."""
    small = rows_of_kind(engine, SMALL.kind.name)
    ends = [over_beds(beds(small, way), way_to_end) for way in moves_known() if way != "still"]
    for mean, error in ends:
        for other, its in ends:
            assert abs(mean - other) < 2 * np.hypot(error, its)


@pytest.fixture(scope="module")
def at_paper_scale(engine: list[Row]) -> list[Row]:
    """With the ensemble's members."""
    (seed,) = PAPER.seeds
    members = rows_of_members(PAPER, seed, EnsembleRecord())
    return [*rows_of_kind(engine, PAPER.kind.name), *members]


def test_members_are_read_where_the_jump_is(at_paper_scale: list[Row]) -> None:
    """Cycles as the record's; settlement goes on from the window over the jump's cycles."""
    record = EnsembleRecord()
    for number in range(PAPER.kind.members):
        table = record.table(f"confined-1-{number}")
        path = dict(zip(table["cycle"], table["settlement"], strict=True))
        (row,) = beds(at_paper_scale, member_name(number))
        assert row["before"]["settlement"] == [path[cycle] for cycle in range(66, 71)]
        assert row["start"]["settlement"] == path[90]
        assert row["after"]["settlement"] == [path[cycle] for cycle in range(91, 96)]


def test_sentences_about_the_piston(engine: list[Row], at_paper_scale: list[Row]) -> None:
    """Force error: less than half in the first cycle, within a fifth later; overlaps."""
    for rows in (rows_of_kind(engine, SMALL.kind.name), at_paper_scale):
        for way in {row["move"] for row in rows}:
            mine = beds(rows, way)
            before = np.mean([cycles(row, "before", "force_error").mean() for row in mine])
            after = np.mean([cycles(row, "after", "force_error") for row in mine], axis=0)
            if way in moves_known():
                assert after[0] < before / 2
            later = [*(after[:FIRST_CYCLES] if way not in moves_known() else after[1:FIRST_CYCLES])]
            assert np.allclose([*later, after[FIRST_CYCLES:].mean()], before, rtol=0.2)
            more = over_beds(mine, partial(first_change, "maximum_overlap"))[0]
            assert more < (26.5 if way in moves_known() else 13.5)


def test_sentences_about_the_bed_at_paper_scale(
    offline: list[Row], at_paper_scale: list[Row]
) -> None:
    """Every way goes on from one state; runs of every cycle grow stiffer, and so do beds that were
    moved, but not the one that nothing moved; profile's field is the worse, its bed is not."""
    kinds = kinds_of(at_paper_scale)
    assert [len(kinds[kind]) for kind in ("STILL", "MOVED", "FULL")] == [1, 4, 3]
    recorded = [row for row in at_paper_scale if "jump" in row]
    assert all(row["before"] == recorded[0]["before"] for row in recorded)
    (still,) = kinds["STILL"]
    for row in (*kinds["MOVED"], *kinds["FULL"]):
        assert softer(row) < -0.04
        assert stiffer(row) > 0.07
        assert first_rate(row) > first_rate(still) or row in kinds["FULL"]
    assert softer(still) > 0
    assert stiffer(still) < 0.03
    assert max(map(first_rate, kinds["FULL"])) < min(map(first_rate, kinds["MOVED"])) / 2
    profile, smoothed = (beds(at_paper_scale, way)[0] for way in ("profile", "smoothed"))
    field = {
        way: median_of(offline_rows(offline, "paper scale", way), "field_relaxed")
        for way in ("profile", "smoothed")
    }
    assert field["profile"] > field["smoothed"] + 0.1
    settled = [way_to_end(row) for row in kinds["FULL"]]
    for row in (profile, smoothed):
        assert min(settled) < way_to_end(row) < max(settled)
    target = min(map(stiffer, kinds["FULL"]))
    assert abs(stiffer(profile) - target) < abs(stiffer(smoothed) - target)
