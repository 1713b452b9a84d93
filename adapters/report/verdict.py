"""What a run cost, by purpose, and the sentences on where its claim fails."""

from collections.abc import Iterator, Sequence
from math import nan
from typing import Any

import numpy as np

from adapters.procedure import BOUNDS, Record, Track, sum_cost
from adapters.report.error import COORDINATION_BAR, HEIGHT_BAR, Comparison, JumpFigures

PROCEDURE, NOTHING, FITTED, FULL = (
    "this run", "jump and move nothing", "fit the curve, no bed", "full run (control)",
)  # fmt: skip
"""Names of the rows of the error table."""
FEW_GRAINS = 500
"""Fewer grains than this settle in bursts: one such bed cannot judge a law."""


PURPOSES = {
    "engine": ("engine: time steps", ".1f"), "start_up": ("engine: start-up", ".1f"),
    "parse": ("parse", ".2f"), "fit": ("fit", ".2f"), "relax": ("relax", ".2f"),
    "other_python": ("other Python", ".2f"), "failed_jumps": ("failed jumps, by the clock", ".1f"),
    "total": ("total", ".1f"), "preparation": ("preparation, not in the total", ".1f"),
    "cycles_computed": ("load cycles computed", "d"), "grain_steps": ("grain-steps", ".3g"),
}  # fmt: skip
"""What `split_cost` returns, as ``report.json`` has it, with its name and format on the page: CPU
time from the start of loading [s] (start-up is reading, building neighbour lists, writing), cycles,
and work that no machine changes, grains times time steps computed."""


def split_cost(record: Record, track: Track) -> dict[str, Any]:
    """The cost of a track by `PURPOSES`, and its ``name``."""
    loading = [outcome for outcome in track.outcomes if outcome.stage != "preparation"]
    parts = {
        purpose: sum(outcome.cost.get(purpose, 0.0) for outcome in loading)
        for purpose in ("engine", "start_up", "parse", "fit", "relax", "other")
    }
    failed = sum(jump.lost_s for jump in track.failed_jumps)
    # The engine's count of time steps goes on through jumps.
    ends = [o.notes["time_step"] for o in track.outcomes if o.stage in ("preparation", "window")]
    return dict(
        name=PROCEDURE if track is record.run else FULL,
        engine=parts["engine"] - parts["start_up"],
        **{purpose: parts[purpose] for purpose in ("start_up", "parse", "fit", "relax")},
        other_python=parts["other"],
        failed_jumps=failed,
        total=sum_cost(parts) + failed,
        preparation=nan if track.preparation is None else sum_cost(track.preparation.cost),
        cycles_computed=sum(o.last_cycle - o.first_cycle for o in loading if o.stage == "window"),
        grain_steps=float(record.scene.grain_count * (ends[-1] - ends[0])) if ends else 0.0,
    )


def list_failures(
    record: Record, rows: Sequence[Comparison], jumps: Sequence[JumpFigures]
) -> Iterator[str]:
    """Where the claim fails: cheaper ways that do as well, bars missed, a bed too small."""
    if not len(record.run.history.cycle):
        return
    yield from _list_cheaper_ways({row.name: row for row in rows})
    apart = [row.coordination_number_error for row in rows if row.name == PROCEDURE]
    changed = [jump.coordination_change for jump in jumps]
    height = [jump.height_change for jump in jumps]
    force = [
        row["force_error"]
        for _, window in record.run.windows
        for row in window.rows[BOUNDS.force_start_cycles :]
    ]
    for name, values, bar in (
        ("coordination number against the control", apart, COORDINATION_BAR),
        ("coordination number changed by a jump and its relaxation", changed, COORDINATION_BAR),
        ("mean height changed by relaxation, over the jump's own settlement", height, HEIGHT_BAR),
        ("piston's rms force error in its worst cycle after three", force, BOUNDS.force_error_goal),
    ):
        worst = np.nanmax(np.abs([0.0, *values]))
        if worst > bar:
            yield f"{name} is {100 * worst:.1f} %, above {100 * bar:.0f} %"
    if record.run.failed_jumps:
        yield f"attempts at a jump that failed: {len(record.run.failed_jumps)}"
    if record.scene.grain_count < FEW_GRAINS:
        yield (
            f"a bed of {record.scene.grain_count} grains settles in bursts: it shows the machinery "
            "and cannot judge a law"
        )


def _list_cheaper_ways(rows: dict[str, Comparison]) -> Iterator[str]:
    """Where a cheaper way does as well as this run; nothing without a control."""
    run = rows.get(PROCEDURE)
    if run is None:
        return
    for name, how in (
        (NOTHING, "jumping and moving nothing"),
        (FITTED, "fitting the law to the full run's curve, which leaves no bed,"),
    ):
        other = rows.get(name)
        if other is not None and abs(other.loaded_body_error) <= abs(run.loaded_body_error):
            yield (
                f"{how} comes at least as near to the full run "
                f"({100 * other.loaded_body_error:+.1f} %) for about the same cost"
            )
    if run.jump_displacement_error >= 1:
        yield (
            "single grains are not predicted: E_r of their displacement since the first jump is "
            f"{run.jump_displacement_error:.2f}, and 1 is the error of not moving them"
        )
    if run.speed_up < 1:
        yield "the procedure cost more than the full run"
