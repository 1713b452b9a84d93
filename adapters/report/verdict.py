"""A run's figures against their bars, and the sentences on where its claim fails."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import isfinite, nan
from typing import Any

import numpy as np

from adapters.procedure import FORCE_ERROR_GOAL, FORCE_START_CYCLES, Record, Track, sum_cost
from adapters.report.error import COORDINATION_BAR, HEIGHT_BAR, PYTHON_BAR, Comparison, JumpFigures

PROCEDURE, NOTHING, FITTED, FULL = (
    "this run",
    "jump and move nothing",
    "fit the curve, no bed",
    "full run (control)",
)
"""Names of the rows of the error table."""

FEW_GRAINS = 500
"""Fewer grains than this settle in bursts: one such bed cannot judge a law."""


@dataclass(frozen=True)
class CostSplit:
    """CPU time of one run from the start of loading, by purpose [s]."""

    name: str
    engine: float
    """Time steps, without start-up."""
    start_up: float
    """Of the engine: reading, building neighbour lists, writing."""
    parse: float
    fit: float
    relax: float
    other_python: float
    failed_jumps: float
    """What failed jumps lost."""
    total: float
    python_share: float
    """Parse, fit, relax and other Python over the total."""
    preparation: float
    """CPU time of the rain of grains, not in ``total`` [s]."""
    cycles_computed: int
    grain_steps: float
    """Work that no machine changes: grains times time steps computed."""


@dataclass(frozen=True)
class PistonFigures:
    """How the piston's force followed its target in one window; nan for three cycles or less."""

    window: str
    first_cycle: int
    last_cycle: int
    mean_error: float
    """Root mean square over all cycles after the first three, over the peak force."""
    worst_error: float
    """The greatest of single cycles."""
    ok: bool | None
    """``worst_error`` within the bar; None where there is none."""


@dataclass(frozen=True)
class Bar:
    """A figure against its bar."""

    name: str
    value: float
    bar: float
    ok: bool | None
    """None where the figure is not known."""


def split_cost(record: Record, track: Track) -> CostSplit:
    """CPU time of a track by purpose."""
    loading = [outcome for outcome in track.outcomes if outcome.stage != "preparation"]
    parts = {
        purpose: sum(outcome.cost.get(purpose, 0.0) for outcome in loading)
        for purpose in ("engine", "start_up", "parse", "fit", "relax", "other")
    }
    python = sum(parts[purpose] for purpose in ("parse", "fit", "relax", "other"))
    failed = sum(jump.lost_s for jump in track.failed_jumps)
    total = parts["engine"] + python + failed
    computed = sum(o.last_cycle - o.first_cycle for o in loading if o.stage == "window")
    prepared = track.preparation
    return CostSplit(
        name=PROCEDURE if track is record.run else FULL,
        engine=parts["engine"] - parts["start_up"],
        start_up=parts["start_up"],
        parse=parts["parse"],
        fit=parts["fit"],
        relax=parts["relax"],
        other_python=parts["other"],
        failed_jumps=failed,
        total=total,
        python_share=python / total if total > 0 else nan,
        preparation=nan if prepared is None else sum_cost(prepared.cost),
        cycles_computed=computed,
        grain_steps=float(record.scene.grain_count * count_time_steps(track)),
    )


def count_time_steps(track: Track) -> int:
    """Time steps computed since the preparation; the engine's count goes on through jumps."""
    ends = [o.notes["time_step"] for o in track.outcomes if o.stage in ("preparation", "window")]
    return int(ends[-1] - ends[0]) if ends else 0


def measure_piston(name: str, rows: list[dict[str, Any]]) -> PistonFigures:
    """Force errors of one window after its first three cycles."""
    errors = np.array([row["force_error"] for row in rows[FORCE_START_CYCLES:]], float)
    ends = (rows[0]["cycle"] - 1, rows[-1]["cycle"])
    if not len(errors):
        return PistonFigures(name, *ends, nan, nan, None)
    worst = float(errors.max())
    mean = float(np.sqrt(np.mean(errors**2)))
    return PistonFigures(name, *ends, mean, worst, worst <= FORCE_ERROR_GOAL)


def list_bars(
    rows: tuple[Comparison, ...],
    jumps: tuple[JumpFigures, ...],
    costs: tuple[CostSplit, ...],
    piston: tuple[PistonFigures, ...],
) -> Iterator[Bar]:
    """Figures against their bars."""

    def bar(name: str, values: list[float], limit: float) -> Bar:
        known = [abs(value) for value in values if isfinite(value)]
        worst = max(known, default=nan)
        return Bar(name, worst, limit, worst <= limit if known else None)

    errors = [row.coordination_number_error for row in rows if row.name == PROCEDURE]
    yield bar("coordination number against the control", errors, COORDINATION_BAR)
    yield bar(
        "coordination number changed by a jump and its relaxation",
        [jump.coordination_change for jump in jumps],
        COORDINATION_BAR,
    )
    yield bar(
        "mean height changed by relaxation, over the jump's own settlement",
        [jump.height_change for jump in jumps],
        HEIGHT_BAR,
    )
    yield bar(
        "piston's rms force error in its worst cycle after three",
        [window.worst_error for window in piston],
        FORCE_ERROR_GOAL,
    )
    yield bar("Python's share of the CPU time", [c.python_share for c in costs[:1]], PYTHON_BAR)


def list_fails(
    record: Record, rows: tuple[Comparison, ...], bars: tuple[Bar, ...]
) -> Iterator[str]:
    """Where the claim fails: cheaper ways that do as well, bars missed, a bed too small."""
    if not len(record.run.history.cycle):
        return
    yield from _beaten({row.name: row for row in rows})
    for bar in bars:
        if bar.ok is False:
            yield f"{bar.name} is {100 * bar.value:.1f} %, above {100 * bar.bar:.0f} %"
    if record.run.failed_jumps:
        yield f"attempts at a jump that failed: {len(record.run.failed_jumps)}"
    if record.scene.grain_count < FEW_GRAINS:
        yield (
            f"a bed of {record.scene.grain_count} grains settles in bursts: it shows the machinery "
            "and cannot judge a law"
        )


def _beaten(rows: dict[str, Comparison]) -> Iterator[str]:
    """Where a cheaper way does as well as this run; nothing without a control."""
    run = rows.get(PROCEDURE)
    if run is None:
        return
    for name, how in (
        (NOTHING, "jumping and moving nothing"),
        (FITTED, "fitting the law to the full run's curve, which leaves no bed,"),
    ):
        other = rows.get(name)
        if other is not None and abs(other.settlement_error) <= abs(run.settlement_error):
            yield (
                f"{how} comes at least as near to the full run "
                f"({100 * other.settlement_error:+.1f} %) for about the same cost"
            )
    if run.jump_displacement_error >= 1:
        yield (
            "single grains are not predicted: E_r of their displacement since the first jump is "
            f"{run.jump_displacement_error:.2f}, and 1 is the error of not moving them"
        )
    if run.speed_up < 1:
        yield "the procedure cost more than the full run"
