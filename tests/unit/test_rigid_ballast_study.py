"""The ballast study's bed, record and judgement on small and made-up data."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest

from rigid_lcp.scene import world_of
from validation import rigid_ballast_bed as bed_of
from validation.rigid_ballast_bed import Bed, bed_scene, load_at, sleeper_of
from validation.rigid_ballast_judge import duels, limits_of, summaries
from validation.rigid_ballast_runs import Level, bed_again, run_row

SMALL = Bed(1, stones=4, width=0.15, sleeper=0.08, peak=2e3)
RIGID = [Level("rigid", h, 1e-6) for h in (2e-3, 1e-3, 5e-4)]
SOFT = [Level("soft", k, 0.05) for k in (1e7, 1e8, 1e9)]


def test_default_bed_is_that_of_the_scene_file() -> None:
    from rigid_lcp.scene_file import scene_read

    plain = scene_read(bed_of.SCENE).tables
    made = scene_read(bed_of.SCENE, Bed(1).scene_words()).tables
    assert made == plain


def test_load_runs_from_least_to_peak_and_back() -> None:
    period = bed_of.PERIOD
    times = np.array([-1.0, 0.0, 0.25 * period, 0.5 * period, period])
    found = load_at(Bed(1, peak=5e3), times)
    np.testing.assert_allclose(found[:, 1], [-1e3, -1e3, -3e3, -5e3, -1e3], rtol=1e-12)
    np.testing.assert_allclose(found[:, 0], [0, 0, 5e2, 1e3, 0], atol=1e-9)


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


def made_rows(settled: dict[Level, float]) -> list[dict[str, Any]]:
    """A record of three beds whose settlement is that of the level, times one to three."""
    rows: list[dict[str, Any]] = []
    for seed in (1, 2, 3):
        bed = asdict(replace(SMALL, seed=seed))
        rows.append({"kind": "bed", "bed": bed})
        for cost, (level, value) in enumerate(settled.items(), 1):
            rows.append({
                "kind": level.method, "level": asdict(level), "name": level.name, "bed": bed,
                "ok": True, "settlement": [0.5 * value * seed, value * seed], "cpu_s": float(cost),
                "step_s": 1e-3 / cost, "deflection": 1e-4, "dissipated": [2.0, 1.0],
                "fabric": {"coordination": 3.0},
            })  # fmt: skip
    return rows


def test_errors_are_of_the_mean_and_the_soft_limit_is_extrapolated() -> None:
    """1.2 against 1.0 mm errs by a fifth; 4, 2, 1.5: geometric, their limit 4/3."""
    settled = dict(zip([*RIGID, *SOFT], [1.6e-3, 1.2e-3, 1e-3, 4e-3, 2e-3, 1.5e-3], strict=True))
    rows = made_rows(settled)
    limits = limits_of(rows)
    assert (limits.rigid, limits.soft) == (RIGID[2].name, SOFT[2].name)
    assert limits.mean == pytest.approx(2e-3)
    assert limits.difference == pytest.approx(-1e-3)
    assert limits.soft_limit == pytest.approx(2 * 4e-3 / 3)
    found = {s.name: s for s in summaries(rows, limits)}
    assert found[RIGID[1].name].bias == pytest.approx(0.2)
    assert found[SOFT[2].name].bias == pytest.approx(0.5)
    assert found[SOFT[2].name].is_limit
    first, second = duels(list(found.values()))
    assert first.soft is not None
    assert first.soft.name == SOFT[2].name
    assert first.cost_ratio == pytest.approx(6.0)
    assert second.soft is None
    assert second.cost_ratio == float("inf")


def test_a_level_that_one_bed_lacks_is_no_limit() -> None:
    settled = dict(zip([*RIGID, *SOFT], [1.0] * 6, strict=True))
    rows = made_rows(settled)
    lacking = [r for r in rows if r.get("name") != SOFT[2].name or r["bed"]["seed"] != 3]
    assert limits_of(lacking).soft == SOFT[1].name
