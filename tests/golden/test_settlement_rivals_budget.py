"""Sentences of docs/settlement-rivals.md about the error budget and healing cycles hold."""

from __future__ import annotations

import numpy as np
import pytest

from validation.settlement_bars import jumps_of, sides_compared
from validation.settlement_ensemble import COARSE
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_rivals import Row
from validation.settlement_rivals_budget import AFTER, EVERY, JUMPED, JUMPS, PARTS, SAME
from validation.settlement_rivals_budget_tables import interval_of_pairs
from validation.settlement_rivals_healing import BEHIND, by_healing, slope, slopes
from validation.settlement_rivals_reading import (
    between_packings,
    chaos,
    effect,
    judged,
    law_alone,
    mean_by_packing,
    of_place,
    over_same,
    rms,
    settled,
)
from validation.settlement_rivals_runs import record_read
from validation.settlement_rivals_studies import STUDIES
from validation.student import interval

LAST = STUDIES["coarse"].last


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    return record_read()


def test_sentences_about_the_budget(rows: list[Row]) -> None:
    """No part but the jump shows in the settlement; the relaxation of an unmoved bed is none."""
    for part in PARTS[1:]:
        mean, half = interval(effect(rows, part.name, settled))
        assert abs(mean) < half, part.name
    gains = [settled(over_same(row, AFTER)) for row in of_place(rows, EVERY).values()]
    assert interval(law_alone(rows))[1] > 0.8 * sum(gains) / len(gains)
    saved, relaxed = (of_place(rows, PARTS[number].name) for number in (6, 7))
    assert saved.keys() == relaxed.keys()
    for place, row in saved.items():
        assert row["settlement"] == relaxed[place]["settlement"]


def first_cycle(rows: list[Row], name: str, cycle: int = 1) -> tuple[float, float]:
    """Settlement of a cycle behind a jump [um]: mean over packings and half of its interval."""
    found = []
    for (seed, _), row in of_place(rows, name).items():
        path = [row["moved"], *row["settlement"]]
        found.append((seed, 1e6 * (path[cycle] - path[cycle - 1])))
    return interval(mean_by_packing(found))


def test_sentences_about_jumps_that_differ_in_one_thing(rows: list[Row]) -> None:
    """Behind no relaxation, and the paper's, a bed springs up by more than it was moved down."""
    moved = {}
    for part in JUMPS:
        places = of_place(rows, part.name)
        assert len(places) == (8 if part.name == "law: karrech2007" else 10)
        found = [(seed, row["moved"] - row["window"][-1]) for (seed, _), row in places.items()]
        moved[part.name] = 1e6 * float(np.mean(mean_by_packing(found)))
    for name, up in (
        ("relaxation: none", 213), ("relaxation: karrech2007", 121), ("relaxation: proximal", 33)
    ):  # fmt: skip
        mean, half = first_cycle(rows, name)
        assert mean == pytest.approx(-up, abs=0.5)
        assert -mean > half
        assert (-mean > moved[name]) == (name != "relaxation: proximal")
    assert first_cycle(rows, "relaxation: none")[0] / moved["relaxation: none"] < -4.5
    mean, half = first_cycle(rows, SAME)
    assert mean > 0
    damped = "relaxation: none, first cycle damped"
    mean, half = first_cycle(rows, damped)
    assert abs(mean) < half
    mean, half = first_cycle(rows, damped, 2)
    assert -mean > half
    for name, off in (
        ("relaxation: none", True), ("relaxation: karrech2007", True), (SAME, False),
        (damped, False), ("relaxation: proximal", False), ("law: by history", False),
    ):  # fmt: skip
        mean, half = interval(effect(rows, name, settled))
        assert (abs(mean) > half) == off, name
    for part in JUMPS[1:5]:
        mean, half = interval(
            effect(rows, part.name, lambda row: row["first"]["force_error"], SAME)
        )
        assert mean > half, part.name
    mean, half = interval(effect(rows, "law: linear", settled, SAME))
    assert abs(mean) < half
    assert moved["law: karrech2007"] / moved[SAME] == pytest.approx(2, abs=0.1)
    for name, less in (("law: by history", 29), ("move: none", 56)):
        mean, half = interval(effect(rows, name, settled, SAME))
        assert 1e6 * mean == pytest.approx(-less, abs=0.6)
        assert -mean > half


def test_sentences_about_another_packing(rows: list[Row]) -> None:
    """It changes twenty cycles' settlement by more than that is, no part by half as much."""
    gains = [settled(over_same(row, AFTER)) for row in of_place(rows, EVERY).values()]
    apart = between_packings(rows, settled)
    assert rms(apart) > np.mean(gains)
    for part in PARTS[1:]:
        if part.jump != JUMPED:
            assert interval(effect(rows, part.name, settled))[1] < 0.5 * interval_of_pairs(apart)


def test_sentences_about_healing(rows: list[Row]) -> None:
    """Errors differ by less than chaos makes; by history the first cycle settles ten times as much
    as full runs, the second up to four times, later ones as full runs."""
    errors = []
    for method in by_healing():
        found = judged(rows, method.name, LAST, "settlement")
        assert found is not None
        assert len(found.error) == 5
        errors.append(found.mean)
    assert max(errors) - min(errors) < chaos(rows, LAST, "settlement")
    compared = sides_compared(rows, COARSE, EnsembleRecord())
    ratios = []
    for method in by_healing():
        jumps = jumps_of(compared, method.name, LAST)
        if not jumps:
            continue
        full = float(np.mean([slope(one, (1, 10)) for jump in jumps for one in jump["others"]]))
        means = [interval(slopes(rows, method.name, LAST, cycles)) for cycles in BEHIND]
        ratios.append((means[0][0] / full, means[1][0] / full))
        for mean, half in means[2:]:
            assert abs(mean - full) < half, method.name
    first, second = np.transpose(ratios)
    assert first.min() > 5
    assert np.median(first) == pytest.approx(12, abs=5)
    assert 1 < second.max() < 5
