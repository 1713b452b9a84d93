"""How far a run is, from its folder."""

import shlex
from dataclasses import dataclass
from pathlib import Path

from adapters.files import EVENTS
from adapters.procedure.history import make_plain
from adapters.procedure.members import Settled, judge_members, sum_members_cost
from adapters.procedure.record import Record, read_run_record
from trackbed.run_files import is_written


@dataclass(frozen=True)
class Status:
    """How far a run is, the first of its members where it has several; SI units, None for what is
    not known yet.  Settlements and stiffness are means over members."""

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
    elastic_deflection_m: float | None  # rise of the loaded body on unloading, in the same cycles
    mean_grain_m: float | None  # settlement of the mean grain since the preparation
    speed_up_so_far: float | None
    """CPU time of the full run beside it over its own, as in the report; None without one."""
    cpu_s: float  # CPU time of all finished stages, preparation included, full runs not [s]
    band_m: tuple[float, float] | None
    """Of the mean grain, with probability 0.9: of one run with a tolerance that of a full run, of
    several members that of their mean."""
    control_cycle: int | None  # cycles the full run beside it has done; None without one
    damaged: str
    """Stages, which count for nothing then, and records that are not as the run left them."""
    next: str  # the command that goes on from here
    result: Settled | None  # over all members: bands, chaos, and the error beside full runs


def read_status(run_folder: Path) -> Status:
    """How far the run in ``run_folder`` is; raises `UsageError` when it is no run folder."""
    return judge_progress(read_run_record(run_folder))


def judge_progress(record: Record) -> Status:
    """How far a run is."""
    run_folder, history = record.path, record.run.history
    cycle = int(history.cycle.max(initial=0))
    computed = history.count_computed(cycle)
    state = "running" if is_written(run_folder, "lock") else "stopped"
    events_alone = all(EVENTS in name for name in record.damaged)
    if state == "stopped" and events_alone and _is_finished(record):
        state = "finished"
    result = judge_members(record)
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
        loaded_body_m=result.loaded_body.value if result else None,
        stiffness_n_per_m=make_plain(result.stiffness.value) if result else None,
        elastic_deflection_m=make_plain(history.late_mean("elastic_deflection", cycle)),
        mean_grain_m=result.mean_grain.value if result else None,
        speed_up_so_far=make_plain(result.speed_up) if result else None,
        cpu_s=sum_members_cost(record),
        band_m=result.mean_grain.band if result else None,
        control_cycle=None if record.control is None else int(record.control.history.cycle[-1]),
        damaged=", ".join(record.damaged),
        next=f"trackbed {verb} {shlex.quote(str(run_folder))}",
        result=result,
    )


def _is_finished(record: Record) -> bool:
    """All cycles of the run and its members are done, and of the full runs that were asked for."""
    if record.scene.loading is None or record.scene.procedure is None:
        return record.run.preparation is not None
    members = (record, *record.members)
    full = [one.control for one in members] if record.manifest.get("control") else []
    total = record.scene.procedure.total_cycles
    return len(members) == record.asked and all(
        track is not None and track.history.cycle.max(initial=0) >= total
        for track in (*(one.run for one in members), *full)
    )
