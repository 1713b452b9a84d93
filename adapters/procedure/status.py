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
    loaded_body_m: float | None
    """Permanent settlement of the loaded body since the preparation, at the load's trough."""
    stiffness_n_per_m: float | None
    """Secant stiffness under the whole loaded body in the last cycles computed."""
    elastic_deflection_m: float | None
    """Rise of the loaded body on unloading, in the same cycles."""
    mean_grain_m: float | None
    """Settlement of the mean grain since the preparation."""
    speed_up_so_far: float | None
    """CPU time of the full run beside it over its own, as in the report; None without one."""
    cpu_s: float  # CPU time of all finished stages, preparation included [s]
    band_m: tuple[float, float] | None
    """Of a run with a tolerance: the mean grain of a full run would be between them with
    probability 0.9."""
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
        loaded_body_m=float(history.loaded_body[-1]) if cycle else None,
        stiffness_n_per_m=_read_late(history, "stiffness"),
        elastic_deflection_m=_read_late(history, "elastic_deflection"),
        mean_grain_m=float(history.settlement[-1]) if cycle else None,
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
    cycle, sunk = int(history.cycle[-1]), float(history.loaded_body[-1])
    computed = history.count_computed(cycle)
    how = "all of them" if computed == cycle else f"{computed} of them"
    said = [
        f"The loaded body settled {_format_millimetres(sunk)} in {cycle} cycles, {how} computed; "
        f"the mean grain {_format_millimetres(float(history.settlement[-1]))}."
    ]
    deflection, stiffness = (
        history.late_mean(name, cycle) for name in ("elastic_deflection", "stiffness")
    )
    if isfinite(deflection) and isfinite(stiffness):
        said.append(
            f"Under the load it gives way by {_format_millimetres(deflection)}, a stiffness of "
            f"{1e-6 * stiffness:#.3g} kN/mm."
        )
    band = estimate_band_of_run(record.run)
    if band is not None:
        ends = f"{_format_millimetres(band.low)} to {_format_millimetres(band.high)}"
        said.append(
            f"With probability {BAND_PROBABILITY:g} the mean grain of a full run settles {ends}."
        )
    at = find_comparable_cycle(record)
    if record.control is not None and at and record.run.jumps:
        first = list_jumped_spans(record.run.outcomes)[0][0]
        said.append(compare_with_full(history, record.control.history, at, first))
    return said


def compare_with_full(own: History, full: History, cycle: int, first: int = 0) -> str:
    """The sentence on the full run beside a run with jumps, at the last cycle that both have; the
    errors are those of what is gained since cycle ``first``, before the first jump."""
    mine, truth = own.row(cycle), full.row(cycle)
    settled, of_full = float(own.loaded_body[mine]), float(full.loaded_body[truth])
    said = f"In the full run beside it the loaded body settled {_format_millimetres(of_full)}"
    if cycle != own.cycle[-1]:
        said += f" in {cycle} cycles, in this one {_format_millimetres(settled)}"
    errors = [
        100 * full.gain_error(float(getattr(own, of)[mine]), first, cycle, of)
        for of in ("loaded_body", "settlement")
    ]
    if all(map(isfinite, errors)):
        off, of_grains = (
            f"{abs(error):.0f} % {'short' if error < 0 else 'over'}"
            if abs(error) >= 0.5 else "within 0.5 %" for error in errors
        )  # fmt: skip
        since = f" of the gain since cycle {first}" if first else ""
        said += f": the jumps are {off}{since} (mean grain {of_grains})"
    spent, of_full_s = float(own.cpu_s[mine]), float(full.cpu_s[truth])
    if min(spent, of_full_s) > 0:
        ratio = max(of_full_s / spent, spent / of_full_s)
        said += f", at {ratio:.1f} times {'less' if spent <= of_full_s else 'more'} computing"
    return said + "."


def _read_late(history: History, name: str) -> float | None:
    value = history.late_mean(name, int(history.cycle[-1])) if len(history.cycle) else nan
    return value if isfinite(value) else None


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
