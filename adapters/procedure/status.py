"""How far a run is, from its folder."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path

from adapters.files import EVENTS
from adapters.jumps import BAND_PROBABILITY
from adapters.procedure.history import History, find_speed_up, list_jumped_spans, sum_cost
from adapters.procedure.record import (
    Record,
    Track,
    estimate_band_of_run,
    find_comparable_cycle,
    read_run_record,
)
from trackbed.run_files import is_written


@dataclass(frozen=True)
class Status:
    """How far a run is; SI units, None for what is not known yet."""

    run_folder: str
    state: str  # ``running``, ``finished`` or ``stopped``
    why: str  # why it stopped, the first of the run's last words
    cycle: int  # load cycles done
    total_cycles: int  # 0 for a scene without loading
    cycles_computed: int
    cycles_jumped: int
    jumps: int
    failed_jumps: int
    settlement_m: float | None
    speed_up_so_far: float | None
    """CPU time of the full run beside it over its own, as in the report; None without one."""
    cpu_s: float  # CPU time of all finished stages, preparation included [s]
    band_m: tuple[float, float] | None
    """Of a run with a tolerance: a full run would be between them with probability 0.9."""
    control_cycle: int | None  # cycles the full run beside it has done; None without one
    damaged: str
    """Stages, which count for nothing then, and records that are not as the run left them."""
    next: str  # the command that goes on from here


def read_status(run_folder: Path) -> Status:
    """How far the run in ``run_folder`` is; raises `UsageError` when it is no run folder."""
    return judge_progress(read_run_record(run_folder))


def judge_progress(record: Record) -> Status:
    """How far a run is."""
    run_folder, history = record.path, record.run.history
    cycle = int(history.cycle[-1]) if len(history.cycle) else 0
    computed = history.count_computed(cycle)
    state = "running" if is_written(run_folder, "lock") else "stopped"
    if state == "stopped" and _is_finished(record) and not set(record.run.damaged) - {EVENTS}:
        state = "finished"
    at, ratio = find_comparable_cycle(record), nan
    if record.control is not None and at:
        full = record.control.history
        ratio = find_speed_up(full.cpu_s[full.row(at)], history.cpu_s[history.row(at)])
    band = estimate_band_of_run(record.run)
    procedure = record.scene.procedure if record.scene.loading is not None else None
    verb = {"running": "status", "stopped": "resume", "finished": "report"}[state]
    last = record.run.events[-1] if record.run.events else {}
    stopped = state == "stopped" == last.get("event")  # a run that was killed left no reason
    return Status(
        run_folder=str(run_folder),
        state=state,
        why=str(last.get("why", "")).partition("\n")[0] if stopped else "",
        cycle=cycle,
        total_cycles=procedure.total_cycles if procedure is not None else 0,
        cycles_computed=computed,
        cycles_jumped=cycle - computed,
        jumps=len(record.run.jumps),
        failed_jumps=len(record.run.failed_jumps),
        settlement_m=float(history.settlement[-1]) if cycle else None,
        speed_up_so_far=float(ratio) if isfinite(ratio) else None,
        cpu_s=sum(sum_cost(outcome.cost) for outcome in record.run.outcomes),
        band_m=None if band is None else (band.low, band.high),
        control_cycle=_find_last_cycle(record.control) if record.control is not None else None,
        damaged=", ".join(record.run.damaged),
        next=f"trackbed {verb} {shlex.quote(str(run_folder))}",
    )


def describe_result(record: Record) -> list[str]:
    """What came out so far, in sentences with millimetres and per cent; none before a cycle."""
    history = record.run.history
    if not len(history.cycle):
        return []
    cycle, settled = int(history.cycle[-1]), float(history.settlement[-1])
    computed = history.count_computed(cycle)
    how = "all of them" if computed == cycle else f"{computed} of them"
    said = [f"The bed settled {_format_millimetres(settled)} in {cycle} cycles, {how} computed."]
    band = estimate_band_of_run(record.run)
    if band is not None:
        ends = f"{_format_millimetres(band.low)} to {_format_millimetres(band.high)}"
        said.append(f"With probability {BAND_PROBABILITY:g} a full run settles {ends}.")
    at = find_comparable_cycle(record)
    if record.control is not None and at and record.run.jumps:
        first = list_jumped_spans(record.run.outcomes)[0][0]
        said.append(compare_with_full(history, record.control.history, at, first))
    return said


def compare_with_full(own: History, full: History, cycle: int, first: int = 0) -> str:
    """The sentence on the full run beside a run with jumps, at the last cycle that both have; the
    error is that of what is gained since cycle ``first``, before the first jump."""
    mine, truth = own.row(cycle), full.row(cycle)
    settled, of_full = float(own.settlement[mine]), float(full.settlement[truth])
    error = 100 * full.gain_error(settled, first, cycle)
    said = f"The full run beside it settled {_format_millimetres(of_full)}"
    if cycle != own.cycle[-1]:
        said += f" in {cycle} cycles, this one {_format_millimetres(settled)}"
    if isfinite(error):
        off = f"{abs(error):.0f} % {'short' if error < 0 else 'over'}"
        said += f": the jumps are {off if abs(error) >= 0.5 else 'within 0.5 %'}"
        said += f" of the gain since cycle {first}" if first else ""
    spent, of_full_s = float(own.cpu_s[mine]), float(full.cpu_s[truth])
    if min(spent, of_full_s) > 0:
        ratio = max(of_full_s / spent, spent / of_full_s)
        said += f", at {ratio:.1f} times {'less' if spent <= of_full_s else 'more'} computing"
    return said + "."


def _format_millimetres(length: float) -> str:
    return f"{1e3 * length:#.3g} mm"


def _find_last_cycle(track: Track) -> int:
    return int(track.history.cycle[-1])


def _is_finished(record: Record) -> bool:
    """All cycles of the run are done, and of its control when it was asked for one."""
    if record.scene.loading is None or record.scene.procedure is None:
        return record.run.preparation is not None
    tracks = [record.run, record.control] if record.manifest.get("control") else [record.run]
    total = record.scene.procedure.total_cycles
    return all(
        track is not None and len(track.history.cycle) > 0 and _find_last_cycle(track) == total
        for track in tracks
    )
