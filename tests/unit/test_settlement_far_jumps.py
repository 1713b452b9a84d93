"""Jumps to 10,000 cycles beside the reference: the table, from made-up runs."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest

from adapters.state import FloatArray
from validation.settlement_ensemble import COARSE
from validation.settlement_ensemble_record import EnsembleRecord
from validation.settlement_far_jumps import HEAD, STUDY, owed, table_jumps
from validation.settlement_far_room import (
    REARRANGED,
    short_of,
    table_behind,
    table_changed,
    table_parting,
    table_room,
)
from validation.settlement_rivals import STATE, Row
from validation.settlement_rivals_budget import EVERY


def made_up(part: str, method: str, seed: int, member: int, settled: float, cpu_s: float) -> Row:
    """A run that settled so far [m] at such a cost, every figure of its state 1."""
    return {
        "part": part, "method": method, "seed": seed, "member": member, "last": STUDY.last,
        "settlement": {str(STUDY.last): settled}, "state": dict.fromkeys(STATE, 1.0),
        "computed": 500, "steps_per_cycle": 10, "cpu_s": cpu_s, "cost": {"engine": 0.5 * cpu_s},
        "refused": "", "lost": [],
    }  # fmt: skip


def cells(text: str, name: str) -> dict[str, str]:
    """The line of a way, by the head of its column."""
    (line,) = [line for line in text.splitlines() if line.startswith(f"| {name} ")]
    return dict(zip(HEAD, (cell.strip() for cell in line.strip("|").split("|")), strict=True))


def runs(settled: float) -> list[Row]:
    """A way on five packings that scatter by 100 um."""
    name = STUDY.methods[0].name
    scatter = (-1e-4, 0.0, 1e-4, 0.0, 0.0)
    return [made_up("rivals", name, k + 1, 0, settled + off, 50.0) for k, off in enumerate(scatter)]


def test_without_the_reference_nothing_is_judged() -> None:
    found = cells(table_jumps(runs(1e-3)), STUDY.methods[0].name)
    assert found["settlement since kᵢ, µm"] == "1,000"
    assert found["cheaper by"] == found["at equal cost a step"] == found[HEAD[6]] == "-"


def test_error_is_told_in_half_intervals_of_the_reference() -> None:
    """Two members of five packings, each 10 um off their packing's mean: the pooled variance within
    is 2 (10 um)^2, and half of the interval of the mean t(5) sqrt(2 / 2 / 5) 10 um = 11.5 um."""
    truth = [
        made_up("reference", EVERY, seed, member, 1e-3 + (1e-5 if member else -1e-5), 1000.0)
        for seed in range(1, 6)
        for member in range(2)
    ]
    text = table_jumps([*truth, *runs(1.023e-3)])
    assert cells(text, "every cycle (the reference)")["settlement since kᵢ, µm"] == "1,000 ± 11"
    found = cells(text, STUDY.methods[0].name)
    assert found["with what is owed, µm"] == "-"
    assert float(found["cheaper by"]) == pytest.approx(20.0)
    assert float(found["at equal cost a step"]) == pytest.approx(0.5)
    assert float(found[HEAD[6]]) == pytest.approx(2.0, abs=0.01)
    assert found["coordination number"] == "+0 ± 0 %"


def test_what_is_owed_at_the_end_is_foretold() -> None:
    """Each run moved 30 of the last 70 um: the mean foretold is 40 um more; 0 with nothing owed."""
    rows = [row | {"moved": [[9e-5, 1e-5], [7e-5, 3e-5]]} for row in runs(1e-3)]
    assert [owed(row) for row in rows] == pytest.approx([4e-5] * 5)
    truth = [
        made_up("reference", EVERY, seed, member, 1e-3 + (1e-5 if member else -1e-5), 1000.0)
        for seed in range(1, 6)
        for member in range(2)
    ]
    found = cells(table_jumps([*truth, *rows]), STUDY.methods[0].name)
    assert found["with what is owed, µm"] == "1,040"
    assert short_of(rows).startswith(
        "Of 10 jumps by history whose grains keep their places, 0 of which were asked for no "
        "settlement, 10 found no room"
    )
    assert owed(runs(1e-3)[0]) == 0
    assert "| 60 to 100 | 10 | 0 |" in table_room(rows)


def jumped(hops: int | None, contacts: float) -> Row:
    """Both sides of a jump: 2 contacts a grain before it, so many behind; n um in cycle n."""
    after = {
        "settlement": [1e-6 * n for n in range(1, 11)], "coordination_number": 10 * [contacts],
        "piston_stiffness": 10 * [1e6],
    }  # fmt: skip
    before = {name: 10 * [2.0] for name in after}
    return {"first": 10, "last": 20, "before": before, "after": after} | (
        {} if hops is None else {"hops": hops, "asked": 4e-5, "gain": 2e-5}
    )


def test_grains_that_changed_places_are_told_apart_from_those_that_did_not() -> None:
    """Each run: of 40 and 50 um a jump with 7 hops settles 20, one by the smallest move 50."""
    row = made_up("rivals", REARRANGED[0], 1, 0, 1e-3, 50.0)
    row |= {
        "moved": [[4e-5, 2e-5], [5e-5, 5e-5]], "sides": [jumped(7, 3.0), jumped(None, 2.2)],
        "cost": {"relax": 3.0},
    }  # fmt: skip
    rows = [row, row | {"member": 1}]
    assert "| 4 | 2 | 20 | 50, 50, 50 | 7, 7, 7 | 0.0 | 3 |" in table_changed(rows)
    changed, kept = (
        [line for line in table_behind(rows).splitlines() if line.startswith(f"| {words}")]
        for words in ("grains changed places", "smallest move")
    )
    assert "| +1.0 ± 0.0 | +2.0 ± 0.0 | +3.0 ± 0.0 | +5.0 ± 0.0 | +10.0 ± 0.0 |" in changed[0]
    assert changed[1].count("+50.0 ± 0.0") == kept[1].count("+10.0 ± 0.0") == 5
    assert "Of 0 jumps" in short_of(rows)
    assert "| 30 to 60 | 0 | 0 |" in table_room(rows)


def test_how_far_grains_part_does_not_count_an_even_strain() -> None:
    """150 grains of 1 mm that a strain of 1 % moves part by nothing; moved by 1 mm in x and by that
    strain while cycles double, by a radius, and by 1 / sqrt(log2 2.5) of it for 2.5 times."""
    generator = np.random.default_rng(0)
    start = generator.random((150, 3))

    class Record:
        def __init__(self, aside: float) -> None:
            self.aside = aside

        def states(self, name: str) -> tuple[FloatArray, dict[int, FloatArray]]:
            del name
            position = {}
            for number, mark in enumerate(mark for mark in COARSE.marks if mark):
                strained = start * [1.0, 1.0, 0.99**number]
                position[mark] = strained + np.array([self.aside * number, 0.0, 0.0])
            return np.full(150, 1e-3), position

    still = table_parting(cast(EnsembleRecord, Record(0.0)))
    assert still.count("| 0.00 | 0.00 ± 0.00 |") == 5
    aside = table_parting(cast(EnsembleRecord, Record(1e-3)))
    assert aside.count("| 1.00 | 1.00 ± 0.00 |") == 3
    assert aside.count(f"| 1.00 | {1 / np.sqrt(np.log2(2.5)):.2f} ± 0.00 |") == 2
