"""docs/engines.md is made from the committed records, and its statistics are Student's."""

from __future__ import annotations

import re

import numpy as np
import pytest

from validation.same_packing import SEEDS, WAYS
from validation.same_packing_page import PAGE, failures, loop_energies, page
from validation.same_packing_reading import ENGINES, PAIRS, by_way, paired, real
from validation.same_packing_runs import Row, plan, record_read
from validation.student import interval
from validation.yade_page import yade_read


def row(way: str, seed: int, settlement: float, ok: bool = True) -> Row:
    return {"way": way, "seed": seed, "ok": ok, "why": "" if ok else "lost", "cpu_s": 1.0,
            "settlement": settlement}  # fmt: skip


def test_page_is_that_of_the_records() -> None:
    assert PAGE.read_text(encoding="utf-8") == page(record_read(), yade_read())


def test_no_place_of_the_template_is_left_open() -> None:
    assert not re.search("<[A-Z_]+>", PAGE.read_text(encoding="utf-8"))


def test_record_has_the_three_engines_on_five_beds_and_each_run_once() -> None:
    """A study that goes on may lack runs; none is there twice, none that the plan does not name."""
    made = [(each["way"], each["seed"]) for each in record_read()]
    assert len(set(made)) == len(made)
    assert set(made) <= {(way.name, seed) for way, seed in plan()}
    assert {(name, seed) for name in ENGINES for seed in SEEDS[:5]} <= set(made)


def test_runs_started_from_one_bed_and_computed_every_cycle() -> None:
    for each in filter(lambda row: row["ok"], record_read()):
        assert len(each["curve"]) == 51
        assert each["curve"][0] == 0
        assert each["curve"][-1] == each["settlement"]
        # At rest and under the seated piston the engines are within a few per cent of a radius.
        assert abs(each["settlement_of_start"]) < 3.2e-3


def test_interval_is_students() -> None:
    """Of 1, 2, 3: mean 2, t(0.975, 2) = 4.3027 times 1/sqrt(3); twice the level, more."""
    mean, half = interval(np.array([1.0, 2.0, 3.0]))
    assert mean == 2
    assert half == pytest.approx(4.30265 / 3**0.5, rel=1e-5)
    assert interval(np.array([1.0, 2.0, 3.0]), 0.99)[1] > 2 * half
    assert np.isnan(interval(np.array([1.0]))[1])


def test_differences_are_taken_bed_by_bed() -> None:
    rows = [
        row("liggghts", 1, 1.0),
        row("lammps", 2, 5.0),
        row("lammps", 1, 3.0),
        row("liggghts", 2, 4.5),
        row("lammps", 3, 9.0),
        row("liggghts", 3, 0.0, ok=False),
    ]
    runs = by_way(rows)
    assert paired(runs, "lammps", "liggghts", "settlement") == pytest.approx([2.0, 0.5])
    assert "seed 3: lost" in failures(rows)


def test_a_difference_is_real_when_zero_is_outside() -> None:
    assert real(np.array([1.0, 1.1, 0.9]))
    assert not real(np.array([1.0, -1.1, 0.9]))
    assert not real(np.array([1.0, 1.1, 0.5]), 0.999)


def test_pairs_name_ways() -> None:
    names = {way.name for way in WAYS}
    assert {name for _, way, other in PAIRS for name in (way, other)} <= names
    assert len(names) == len(WAYS)


def test_loop_energies() -> None:
    """Closed forms: a rule that follows k_t, one that ignores it, and their sum of signs."""
    energies = loop_energies()
    assert energies["mindlin"] == pytest.approx([1, -1, 0], abs=1e-3)
    assert energies["mindlin/force"] == pytest.approx([-1, 1, 0], abs=1e-3)
    assert energies["paper"][:2] == pytest.approx([1, 1], abs=1e-3)
    assert 0 < energies["paper"][2] < 1
