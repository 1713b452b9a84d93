"""The ballast study's bed, record and judgement on small and made-up data."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest

from rigid_lcp.scene import world_of
from rigid_lcp.scene_file import loads_of, scene_read
from validation import rigid_ballast_bed as bed_of
from validation.rigid_ballast_bed import Bed, bed_scene, load_at, sleeper_of
from validation.rigid_ballast_judge import cheapest, cost_ratio, limits_of, summaries
from validation.rigid_ballast_page import section_ten
from validation.rigid_ballast_push import (
    cost_at_error,
    equal_error_cost,
    long_words,
    pushes_of,
)
from validation.rigid_ballast_runs import Level, bed_again, push_row, run_row, study

SMALL = Bed(1, stones=4, crib=1, width=0.22, sleeper=0.08, peak=2e3)
RIGID = [Level("rigid", h, 1e-6) for h in (2e-3, 1e-3, 5e-4)]
SOFT = [Level("soft", k, 0.05) for k in (1e7, 1e8, 1e9)]


def test_default_bed_is_that_of_the_scene_file() -> None:
    plain = scene_read(bed_of.SCENE).tables
    made = scene_read(bed_of.SCENE, Bed(1).scene_words()).tables
    assert made == plain


def test_load_runs_from_least_to_peak_and_back() -> None:
    period = bed_of.PERIOD
    times = np.array([-1.0, 0.0, 0.25 * period, 0.5 * period, period])
    found = load_at(Bed(1, peak=5e3), times)
    np.testing.assert_allclose(found[:, 1], [-1e3, -1e3, -3e3, -5e3, -1e3], rtol=1e-12)
    np.testing.assert_allclose(found[:, 0], [0, 0, 8e2, 0, 0], atol=1e-9)


def test_load_of_the_study_is_that_of_the_scene() -> None:
    """Tamping is over; the scene's traffic begins where the study counts from."""
    file = scene_read(bed_of.SCENE, Bed(1).scene_words())
    loads, scene = loads_of(file), bed_scene(Bed(1))
    assert loads is not None
    still = world_of(scene)[1]
    for time in (1e-4, 0.003, 0.013, 0.02, 0.031):
        found = np.asarray(loads(bed_of.TAMPED + time, still))[sleeper_of(scene), :2]
        np.testing.assert_allclose(found, load_at(Bed(1), time)[0], atol=1e-6)


def test_sleeper_is_held_upright_by_its_inertia() -> None:
    scene = bed_scene(SMALL)
    assert scene.bodies[sleeper_of(scene)].inertia == 1e6


def test_recorded_bed_is_read_again() -> None:
    scene = bed_scene(SMALL)
    motion = world_of(scene)[1]
    row = {"bed": asdict(SMALL), "position": motion.position.tolist(),
           "angle": motion.angle.tolist()}  # fmt: skip
    again, scene_again, start = bed_again(row)
    assert again == SMALL
    assert sleeper_of(scene_again) == sleeper_of(scene)
    np.testing.assert_array_equal(start.position, motion.position)
    assert not start.rates.any()


@pytest.mark.parametrize("level", [RIGID[0], SOFT[0]])
def test_run_row_balances_its_energy(level: Level) -> None:
    """Falling stones: the row is there, and no cycle gains energy beyond the load's work."""
    scene = bed_scene(SMALL)
    start = world_of(scene)[1]
    (row,) = run_row(level, SMALL, scene, start, 2)
    assert row["ok"]
    assert len(row["settlement"]) == len(row["dissipated"]) == 2
    lost = np.array(row["dissipated"])
    assert lost.min() > -0.02 * np.abs(lost).max()
    assert row["step_s"] <= (level.value if level.method == "rigid" else 1e-3)


def test_first_push_is_followed_to_the_peak() -> None:
    scene = bed_scene(SMALL)
    row = push_row(RIGID[0], SMALL, scene, world_of(scene)[1])
    assert row["ok"]
    assert len(row["sunk"]) == len(row["work"]) == 11
    assert row["sunk"][0] == 0
    assert row["steps"] == 25 + 10  # the rest, and one step of 2 ms a moment


def test_study_goes_on_where_its_record_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cut anywhere, the whole record comes out, each line once."""
    monkeypatch.setattr("validation.rigid_ballast_runs._compile", lambda: None)
    monkeypatch.setattr("validation.rigid_ballast_bed.TAMPED", 0.01)
    rows: list[dict[str, Any]] = []
    study([SMALL], SOFT[:2], 1, [], rows.append)
    assert [row["kind"] for row in rows] == ["bed", "soft", "soft"]
    for known in range(4):
        again = rows[:known]
        study([SMALL], SOFT[:2], 1, list(again), again.append)
        assert [(row["kind"], row.get("settlement")) for row in again] == [
            (row["kind"], row.get("settlement")) for row in rows
        ]


def made_rows(
    settled: dict[Level, float], scatter: float = 0.0, beds: int = 3
) -> list[dict[str, Any]]:
    """A record of beds whose settlement is that of the level, times one to three; levels that are
    not the finest scatter from bed to bed by so much of it."""
    rows: list[dict[str, Any]] = []
    for seed in range(1, beds + 1):
        bed = asdict(replace(SMALL, seed=seed))
        rows.append({"kind": "bed", "bed": bed})
        for cost, (level, value) in enumerate(settled.items(), 1):
            off = 0.0 if level in (RIGID[2], SOFT[2]) else scatter * (-1) ** seed
            end = value * (1 + (seed - 1) % 3 + off)
            rows.append({
                "kind": level.method, "level": asdict(level), "name": level.name, "bed": bed,
                "ok": True, "settlement": [0.5 * end, end], "cpu_s": float(cost),
                "step_s": 1e-3 / cost, "deflection": 1e-4, "dissipated": [2.0, 1.0],
                "fabric": {"coordination": 3.0},
            })  # fmt: skip
    return rows


LEVELS = [*RIGID, *SOFT]


def test_reference_is_the_mean_of_both_limits_and_a_limit_is_judged_by_the_other() -> None:
    """Limits 1.0 and 1.5 mm: reference 1.25; 1.6 mm errs by 0.28, the limits by -1/3 and 1/2."""
    settled = dict(zip(LEVELS, [1.6e-3, 1.2e-3, 1e-3, 4e-3, 2e-3, 1.5e-3], strict=True))
    rows = made_rows(settled)
    limits = limits_of(rows)
    assert (limits.rigid, limits.soft) == (RIGID[2].name, SOFT[2].name)
    assert limits.mean == pytest.approx(2 * 1.25e-3)
    assert limits.difference == pytest.approx(-1e-3)
    error = {s.name: s.error for s in summaries(rows, limits)}
    assert error[RIGID[0].name] == pytest.approx(0.28)
    assert error[RIGID[2].name] == pytest.approx(-1 / 3)
    assert error[SOFT[2].name] == pytest.approx(0.5)


def test_costs_are_compared_where_the_whole_interval_lies_within() -> None:
    """Scatter of a fifth of a level on 30 beds: t(0.975, 29) = 2.0452 times s / sqrt(30), of 2."""
    settled = dict(zip(LEVELS, [2e-3, 1.15e-3, 1e-3, 4e-3, 1.23e-3, 1e-3], strict=True))
    found = summaries(rows := made_rows(settled, 0.2, 30), limits_of(rows))
    named = {s.name: s for s in found}
    rigid, soft = named[RIGID[1].name], named[SOFT[1].name]
    off = np.array([1.15 * (k % 3 + 1 - 0.2 * (-1) ** k) - (k % 3 + 1) for k in range(30)])
    wide = 2.0452 * off.std(ddof=1) / np.sqrt(30) / 2
    assert rigid.error_interval == pytest.approx(wide, rel=1e-4)
    assert [rigid.error, soft.error] == pytest.approx([0.15, 0.23])
    assert (rigid.within(0.25), soft.within(0.25), soft.within(0.19)) == ("yes", "open", "open")
    assert named[SOFT[0].name].within(0.5) == "no"
    assert cheapest(found, "rigid", 0.25, True) is rigid
    assert cheapest(found, "soft", 0.25, True) is named[SOFT[2].name]
    assert cheapest(found, "soft", 0.25, False) is soft
    assert cheapest([named[SOFT[0].name]], "soft", 0.25, False) is None
    assert cost_ratio(soft, rigid) == pytest.approx((2.5, 2.5, 2.5))


def test_the_papers_claim_is_judged_at_the_error_of_its_step() -> None:
    """Rigid 1 ms errs by at most 15 % and its interval; only the stiffest soft level is shown to
    err as little, the middle one is open where it scatters, and out where it does not."""
    settled = dict(zip(LEVELS, [2e-3, 1.15e-3, 1e-3, 4e-3, 1.23e-3, 1e-3], strict=True))
    found = summaries(rows := made_rows(settled, 0.2, 30), limits_of(rows))
    paper = next(s for s in found if s.name == RIGID[1].name)
    said = section_ten(paper, found)
    assert "err by 20 % at most" in said
    assert "not shown to err by more has k = 1e8" in said
    assert "shown to err as little has k = 1e9, steps of 1.7e-04 s and 3 (3 to 3) times" in said
    sure = summaries(rows := made_rows(settled, 0.0, 30), limits_of(rows))
    paper = next(s for s in sure if s.name == RIGID[1].name)
    assert "not shown to err by more has k = 1e9" in section_ten(paper, sure)


def test_long_runs_name_the_better_law() -> None:
    """1 + ln N / 2 mm is met by the law of logarithms."""
    settlement = [1e-3 + 5e-4 * np.log(n) for n in range(1, 41)]
    row = {"kind": "long", "ok": True, "name": "k", "level": {"method": "soft"},
           "settlement": settlement}  # fmt: skip
    said = long_words([row])
    assert "2.15 mm after 10" in said
    assert "1.00 mm +0.500 mm · ln N (rms 0.00 mm)" in said


def test_a_level_that_one_bed_lacks_is_no_limit() -> None:
    settled = dict(zip(LEVELS, [1.0] * 6, strict=True))
    rows = made_rows(settled)
    lacking = [r for r in rows if r.get("name") != SOFT[2].name or r["bed"]["seed"] != 3]
    assert limits_of(lacking).soft == SOFT[1].name


def push_rows(depths: dict[Level, float], beds: int = 1) -> list[dict[str, Any]]:
    """First pushes whose sleeper sinks evenly to so many millimetres."""
    return [
        {
            "kind": "push", "ok": True, "name": level.name, "level": asdict(level),
            "bed": {"seed": seed}, "sunk": [1e-4 * depth * k for k in range(11)],
            "cpu_s": float(cost), "steps": 10 * cost,
            "work": [1.0] * 10 + [6.0], "energy": [2.0] * 10 + [4.0],
        }
        for cost, (level, depth) in enumerate(depths.items(), 1) for seed in range(beds)
    ]  # fmt: skip


def test_first_pushes_are_compared_with_both_finest_levels() -> None:
    """Sunk by 10, 11 (rigid) and 14, 12 mm (soft) at the peak: reference 11.5, the finest differ
    by 1 mm."""
    rows = push_rows(dict(zip([*RIGID[:2], *SOFT[:2]], [10, 11, 14, 12], strict=True)))
    found = {p.name: p for p in pushes_of(rows)}
    error = [found[level.name].error for level in (*RIGID[:2], *SOFT[:2])]
    assert error == pytest.approx([1.5e-3, 1e-3, 2.5e-3, 1e-3])
    assert found[RIGID[0].name].dissipated == pytest.approx(3.0)
    assert pushes_of(rows[:2]) == []


def test_cost_at_equal_error_is_interpolated() -> None:
    """Errors 8 and 2 at costs 3 and 12: 4 lies halfway in logarithms, at 6."""
    assert cost_at_error(4.0, [8.0, 2.0], [3.0, 12.0]) == pytest.approx(6.0)
    assert cost_at_error(9.0, [8.0, 2.0], [3.0, 12.0]) == 3.0
    assert np.isnan(cost_at_error(1.0, [8.0, 2.0], [3.0, 12.0]))


def test_cost_ratio_of_the_first_push_has_an_interval() -> None:
    """Equal beds: no scatter; rigid errs by 2 mm at cost 1, soft by 4 and 1 at costs 3 and 4, so
    by 2 at sqrt(12)."""
    levels = [RIGID[0], RIGID[1], *SOFT]
    found = pushes_of(push_rows(dict(zip(levels, [8, 10, 14, 11, 10], strict=True)), beds=4))
    rigid, soft = found[0], [p for p in found if p.method == "soft"][:2]
    assert list(equal_error_cost(rigid, soft)) == pytest.approx([12**0.5] * 3)
    worse = pushes_of(push_rows(dict(zip(levels, [9.5, 10, 14, 11, 10], strict=True)), beds=4))
    assert equal_error_cost(worse[0], soft)[0] == float("inf")
