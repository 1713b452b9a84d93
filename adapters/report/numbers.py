"""The numbers of a report: what ``report.json`` holds and ``report.html`` shows."""

import json
import shlex
from contextlib import suppress
from dataclasses import asdict, dataclass
from math import isfinite, nan
from typing import Any

import numpy as np

from adapters.errors import UsageError
from adapters.jumps import Band
from adapters.laws import get_law
from adapters.procedure import Record, Settled, judge_members, make_plain, sum_cost
from adapters.report.error import (
    Comparison,
    JumpFigures,
    compare_runs,
    extrapolate_curve,
    measure_jump,
)
from adapters.report.verdict import FITTED, FULL, NOTHING, PROCEDURE, list_failures, split_cost
from adapters.scene import flatten_keys, list_omissions, list_stages, measure_porosity


@dataclass(frozen=True)
class Numbers:
    """All numbers of a report; SI units, errors and shares as fractions of one."""

    scene: str  # what it is in one sentence
    grains: int
    finished: bool
    cycle: int  # cycles done
    total_cycles: int
    cycles_computed: int
    loaded_body: float  # permanent settlement of the loaded body at ``cycle`` [m]
    elastic_deflection: float  # its rise on unloading in the last cycles computed [m]
    stiffness: float  # secant stiffness under it in the same cycles [N/m]
    mean_grain: float  # settlement of the mean grain at ``cycle`` [m]
    band: Band | None  # of the mean grain in a run with a tolerance, and how far it can be off
    settled: Settled | None  # over all members, of which the other numbers are the first's
    speed_up_most: float
    """Cycles done over cycles computed: a bound on the speed-up, which is one of CPU times."""
    compared_at: int  # cycle at which run and control are compared; 0 without a control
    error_rows: tuple[Comparison, ...]
    jumps: tuple[JumpFigures, ...]
    preparation: dict[str, float]
    """Figures of the settled bed by dotted name; empty before it is settled."""
    costs: tuple[dict[str, Any], ...]  # by `adapters.report.verdict.PURPOSES`
    fails: tuple[str, ...]  # where the claim fails, in sentences
    left_out: tuple[str, ...]  # what the model leaves out
    failed_jumps: tuple[tuple[str, str], ...]  # stage and reason
    stops: tuple[tuple[str, str], ...]  # time and reason of every stop of the run before its end
    discarded: tuple[str, ...]
    damaged: tuple[str, ...]
    engines: tuple[str, ...]  # name and version banner
    provenance: dict[str, Any]
    parameters: dict[str, Any]  # effective parameters of the scene
    decks: dict[str, str]  # SHA-256 of every static deck used
    reproduce: str  # the command that makes this run again from its folder

    def row(self, name: str) -> Comparison | None:
        """A row of the error table."""
        return next((row for row in self.error_rows if row.name == name), None)

    def to_json(self) -> str:
        """JSON text; a number that is not finite is null."""
        return json.dumps(make_plain(asdict(self)), indent=1, allow_nan=False) + "\n"


def gather_numbers(record: Record) -> Numbers:
    """All numbers of the report of a run, as far as it has come."""
    scene, run, control = record.scene, record.run, record.control
    history, prepared = run.history, run.preparation
    cycle = int(history.cycle[-1]) if len(history.cycle) else 0
    procedure = scene.procedure if scene.loading is not None else None
    total = procedure.total_cycles if procedure is not None else 0
    computed = history.count_computed(cycle)
    compared_at = record.comparable_cycle
    rows = tabulate_errors(record, compared_at)
    jumps = tuple(
        measure_jump(name, jump, history, None if control is None else control.history)
        for name, jump in run.jumps
    )
    costs = tuple(split_cost(record, track) for track in (run, control) if track is not None)
    engines = [e for e in run.events if e["event"] == "engine"]
    parameters = flatten_keys(record.manifest["scene"])
    return Numbers(
        scene=describe_scene(record),
        grains=scene.grain_count,
        finished=prepared is not None if not total else cycle == total,
        cycle=cycle,
        total_cycles=total,
        cycles_computed=computed,
        loaded_body=float(history.loaded_body[-1]) if cycle else nan,
        elastic_deflection=history.late_mean("elastic_deflection", cycle),
        stiffness=history.late_mean("stiffness", cycle),
        mean_grain=float(history.settlement[-1]) if cycle else nan,
        band=run.estimate_band(),
        settled=judge_members(record),
        speed_up_most=cycle / computed if computed else nan,
        compared_at=compared_at,
        error_rows=rows,
        jumps=jumps,
        preparation=find_bed_figures(record),
        costs=costs,
        fails=tuple(list_failures(record, rows, jumps)),
        left_out=list_omissions(scene),
        failed_jumps=tuple((jump.stage, jump.why) for jump in run.failed_jumps),
        stops=tuple((e["time"], e.get("why", "")) for e in run.events if e["event"] == "stopped"),
        discarded=run.discarded + (() if control is None else control.discarded),
        damaged=record.damaged,
        engines=tuple(dict.fromkeys(f"{e['name']}: {e['version']}" for e in engines)),
        provenance=dict(record.manifest.get("provenance", {})),
        parameters={key: value for key, value in parameters.items() if value is not None},
        decks={k: v for o in run.outcomes for k, v in o.notes.get("decks", {}).items()},
        reproduce=_format_command(record),
    )


def find_bed_figures(record: Record) -> dict[str, float]:
    """Figures of the settled bed as its run noted them; porosity where its state is sound."""
    if record.run.preparation is None:
        return {}
    figures: dict[str, float] = flatten_keys(record.run.preparation.notes["figures"])
    if not record.scene.stones:
        with suppress(UsageError, OSError):
            bed, container = record.run.start(), record.scene.container
            figures["porosity"] = measure_porosity(bed.position, bed.radius, container)
    return figures


def tabulate_errors(record: Record, cycle: int) -> tuple[Comparison, ...]:
    """The table of error against speed-up at ``cycle``; empty without a control (cycle 0).

    Beside run and control two cheaper ways, both from as many cycles of the control as the run
    computed: moving nothing, and the scene's law fitted to the control's curve.
    """
    run, control, procedure = record.run, record.control, record.scene.procedure
    if control is None or procedure is None or not cycle:
        return ()
    full = control.history
    spans = [span for span in run.spans if span[1] <= cycle]
    preparation_s = 0.0 if run.preparation is None else sum_cost(run.preparation.cost)
    truth = control.position(cycle)
    before = spans[0][0] if spans else cycle
    before_jump = run.position(before) if spans else None
    beds = (before_jump, truth, run.position(cycle))
    rows = [compare_runs(PROCEDURE, run.history, cycle, full, cycle, preparation_s, beds, before)]
    if spans:
        early = run.history.count_computed(cycle)
        beds = (before_jump, truth, control.position(early))
        still = compare_runs(NOTHING, full, early, full, cycle, preparation_s, beds, before)
        rows.append(still)
        sunk, settled = (
            extrapolate_curve(full, get_law(procedure.law), procedure.k_i, early, cycle, of)
            for of in ("loaded_body", "settlement")
        )
        if isfinite(sunk):
            rows.append(
                Comparison(
                    FITTED,
                    early,
                    sunk,
                    full.gain_error(sunk, before, cycle, "loaded_body"),
                    settled,
                    full.gain_error(settled, before, cycle),
                    cpu_s=still.cpu_s,
                    speed_up=still.speed_up,
                    speed_up_with_preparation=still.speed_up_with_preparation,
                )
            )
    beds = (before_jump, truth, truth)
    rows.append(compare_runs(FULL, full, cycle, full, cycle, preparation_s, beds, before))
    return tuple(rows)


def describe_scene(record: Record) -> str:
    """The scene in one sentence."""
    scene = record.scene
    shape = {0: "", 1: "half of a ", 2: "quarter of a "}[len(scene.sample.symmetry)]
    text = f"{scene.grain_count} grains in a {shape}{scene.sample.container}"
    if scene.loading is None or scene.procedure is None:
        return text + ", prepared and not loaded"
    for begin, stage in list_stages(scene):
        peak = np.max(stage.stress_at(np.linspace(0, 1, 201)))
        text += f", from cycle {begin} on" if begin else ""
        period = stage.time_step * stage.steps_per_cycle
        text += f", up to {peak / 1e3:.4g} kPa at {1 / period:.4g} Hz"
    if scene.loaded_area < scene.container.area:
        text += f" on {100 * scene.loaded_area / scene.container.area:.0f} % of the section"
    return f"{text}, engine {scene.engine.name}"


def _format_command(record: Record) -> str:
    """The command that makes the run again, from inside its folder."""
    words = ["trackbed", "run", "scene.toml", "--run-folder", "../again"]
    words += ["--control"] if record.manifest.get("control") else []
    words += ["--members", str(record.asked)] if record.asked > 1 else []
    for override in record.manifest["overrides"]:
        words += ["--set", override]
    return shlex.join(words)
