"""The numbers of a report: what ``report.json`` holds and ``report.html`` shows."""

from __future__ import annotations

import json
import shlex
from dataclasses import asdict, dataclass
from math import isfinite, nan
from typing import Any

import numpy as np

from adapters.jumps import Band
from adapters.laws import get_law
from adapters.procedure import (
    CONTROL_STILL,
    Record,
    Track,
    cycles_computed,
    estimate_band_of_run,
    find_comparable_cycle,
    find_last_common_cycle,
    list_jumped_spans,
    sum_cost,
)
from adapters.report.error import (
    Beds,
    Comparison,
    CostLine,
    JumpFigures,
    comparison,
    curve_fitted,
    measure_jump,
    stopped_early,
)
from adapters.report.preparation import PreparationFigures, measure_preparation
from adapters.report.verdict import (
    FITTED,
    FULL,
    NOTHING,
    PROCEDURE,
    Bar,
    CostSplit,
    PistonFigures,
    list_bars,
    list_fails,
    measure_piston,
    split_cost,
)
from adapters.scene import flatten_keys, left_out

FITTED_POINTS = 24
"""Costs at which the fit of the curve is tried."""

TWIN_SCATTER = 0.013
"""Standard deviation of the settlement at cycle 100, over its mean, of five continuations of one
state of the Karrech bed at cycle 50, apart by round-off."""


@dataclass(frozen=True)
class Numbers:
    """All numbers of a report; SI units, errors and shares as fractions of one."""

    scene: str
    """What it is in one sentence."""
    grains: int
    finished: bool
    cycle: int
    """Cycles done."""
    total_cycles: int
    cycles_computed: int
    settlement: float
    """At ``cycle`` [m]."""
    band: Band | None
    """Settlement of a run with a tolerance and how far it can be off."""
    speed_up_of_cycles: float
    """Cycles done over cycles computed: what the speed-up is without a control to measure it."""
    compared_at: int
    """Cycle at which run and control are compared; 0 without a control."""
    error_rows: tuple[Comparison, ...]
    stopped_early: CostLine | None
    curve_fitted: CostLine | None
    jumps: tuple[JumpFigures, ...]
    preparation: PreparationFigures | None
    piston: tuple[PistonFigures, ...]
    costs: tuple[CostSplit, ...]
    bars: tuple[Bar, ...]
    fails: tuple[str, ...]
    """Where the claim fails, in sentences."""
    left_out: tuple[str, ...]
    """What the model leaves out."""
    failed_jumps: tuple[tuple[str, str], ...]
    """Stage and reason."""
    stops: tuple[tuple[str, str], ...]
    """Time and reason of every stop of the run before its end."""
    discarded: tuple[str, ...]
    engines: tuple[str, ...]
    """Name and version banner."""
    provenance: dict[str, Any]
    parameters: dict[str, Any]
    """Effective parameters of the scene."""
    decks: dict[str, str]
    """SHA-256 of every static deck used."""
    reproduce: str
    """The command that makes this run again from its folder."""

    def row(self, name: str) -> Comparison | None:
        """A row of the error table."""
        return next((row for row in self.error_rows if row.name == name), None)

    @property
    def floor(self) -> float | None:
        """Greatest settlement error of the runs beside that should agree; None without them."""
        own = (PROCEDURE, NOTHING, FITTED, FULL)
        errors = [abs(row.settlement_error) for row in self.error_rows if row.name not in own]
        return max(errors, default=None)

    def to_json(self) -> str:
        """JSON text; a number that is not finite is null."""
        return json.dumps(_plain(asdict(self)), indent=1, allow_nan=False) + "\n"


def numbers_of(record: Record) -> Numbers:
    """All numbers of the report of a run, as far as it has come."""
    scene, run, control = record.scene, record.run, record.control
    history = run.history
    cycle = int(history.cycle[-1]) if len(history.cycle) else 0
    procedure = scene.procedure if scene.loading is not None else None
    total = procedure.total_cycles if procedure is not None else 0
    computed = history.computed(cycle)
    compared_at = find_comparable_cycle(record)
    rows = error_rows(record, compared_at)
    jumps = tuple(
        measure_jump(name, jump, history, None if control is None else control.history)
        for name, jump in run.jumps
    )
    costs = tuple(split_cost(record, track) for track in (run, control) if track is not None)
    piston = tuple(measure_piston(name, outcome.rows) for name, outcome in run.windows)
    bars = tuple(list_bars(rows, jumps, costs, piston))
    spans = list_jumped_spans(run.outcomes)
    lines: tuple[CostLine | None, CostLine | None] = (None, None)
    if control is not None and compared_at and spans:
        lines = (stopped_early(control.history, compared_at), trace_fitted(record, compared_at))
    provenance = dict(record.manifest.get("provenance", {}))
    return Numbers(
        scene=describe_scene(record),
        grains=scene.grain_count,
        finished=run.preparation is not None if not total else cycle == total,
        cycle=cycle,
        total_cycles=total,
        cycles_computed=computed,
        settlement=float(history.settlement[-1]) if cycle else nan,
        band=estimate_band_of_run(run),
        speed_up_of_cycles=cycle / computed if computed else nan,
        compared_at=compared_at,
        error_rows=rows,
        stopped_early=lines[0],
        curve_fitted=lines[1],
        jumps=jumps,
        preparation=measure_preparation(run),
        piston=piston,
        costs=costs,
        bars=bars,
        fails=tuple(list_fails(record, rows, bars)),
        left_out=left_out(scene),
        failed_jumps=tuple((jump.stage, jump.why) for jump in run.failed_jumps),
        stops=tuple((e["time"], e.get("why", "")) for e in run.events if e["event"] == "stopped"),
        discarded=run.discarded + (() if control is None else control.discarded),
        engines=tuple(
            dict.fromkeys(
                f"{e['name']}: {e['version']}" for e in run.events if e["event"] == "engine"
            )
        ),
        provenance=provenance,
        parameters=_parameters(record),
        decks={k: v for o in run.outcomes for k, v in o.notes.get("decks", {}).items()},
        reproduce=_reproduce(record),
    )


def error_rows(record: Record, cycle: int) -> tuple[Comparison, ...]:
    """The table of error against speed-up at ``cycle``; empty without a control (cycle 0)."""
    run, control = record.run, record.control
    if control is None or not cycle:
        return ()
    full = control.history
    spans = [span for span in list_jumped_spans(run.outcomes) if span[1] <= cycle]
    prepared = run.preparation
    preparation_s = 0.0 if prepared is None else sum_cost(prepared.cost)
    start, truth = run.start().position, control.position(cycle)
    before_jump = run.position(spans[0][0]) if spans else None

    def row(name: str, track: Track, at: int, against: int) -> Comparison:
        beds = Beds(start, before_jump, control.position(against), track.position(at))
        return comparison(name, track.history, at, full, against, preparation_s, beds)

    rows = [row(PROCEDURE, run, cycle, cycle)]
    if spans:
        early = cycles_computed(cycle, spans)
        still = Beds(start, before_jump, truth, control.position(early))
        rows.append(comparison(NOTHING, full, early, full, cycle, preparation_s, still))
        rows += compare_fitted(record, cycle, early, preparation_s)
    for other in record.others:
        if common := find_last_common_cycle(other.history, full):
            name = name_variant(other.name)
            name = name if common == cycle else f"{name}, at cycle {common}"
            rows.append(row(name, other, common, common))
    rows.append(row(FULL, control, cycle, cycle))
    return tuple(rows)


def name_variant(folder: str) -> str:
    """A further run of the scene by the name of its folder, as the report calls it."""
    if folder == CONTROL_STILL.name:
        return "h = 0, resubmitted"
    return folder.replace("control_perturbed_", "full run, perturbed ")


def compare_fitted(
    record: Record, cycle: int, early: int, preparation_s: float
) -> list[Comparison]:
    """The law of the scene fitted to as many cycles of the control as this run computed."""
    assert record.control is not None
    assert record.scene.procedure is not None
    full = record.control.history
    law = get_law(record.scene.procedure.law)
    line = curve_fitted(full, law, record.scene.procedure.k_i, cycle, [early])
    if not len(line.computed):
        return []
    cost, full_cost = float(line.cpu_s[0]), float(full.cpu_s[full.row(cycle)])
    error = float(line.settlement_error[0])
    return [
        Comparison(
            FITTED,
            early,
            settlement=float(full.settlement[full.row(cycle)]) * (1 + error),
            settlement_error=error,
            cpu_s=cost,
            speed_up=full_cost / cost,
            gained_time=full_cost / cost - 1,
            speed_up_with_preparation=(full_cost + preparation_s) / (cost + preparation_s),
        )
    ]


def trace_fitted(record: Record, cycle: int) -> CostLine:
    """The law of the scene fitted to the control's curve at several costs."""
    assert record.control is not None
    procedure = record.scene.procedure
    assert procedure is not None
    law = get_law(procedure.law)
    fewest = procedure.k_i + law.minimum_cycles
    ends = np.unique(np.geomspace(fewest, max(cycle - 1, fewest), FITTED_POINTS).astype(int))
    known = set(record.control.history.cycle.tolist())
    return curve_fitted(
        record.control.history,
        law,
        procedure.k_i,
        cycle,
        [int(end) for end in ends if int(end) in known and end < cycle],
    )


def describe_scene(record: Record) -> str:
    """The scene in one sentence."""
    scene = record.scene
    shape = {0: "", 1: "half of a ", 2: "quarter of a "}[len(scene.sample.symmetry)]
    text = f"{scene.grain_count} grains in a {shape}{scene.sample.container}"
    if scene.loading is None or scene.procedure is None:
        return text + ", prepared and not loaded"
    peak = float(np.max(scene.stress_at(np.linspace(0, 1, 201))))
    text += f", up to {peak / 1e3:.4g} kPa at {1 / scene.loading.period:.4g} Hz"
    if scene.loading.area_share < 1:
        text += f" on {100 * scene.loading.area_share:.0f} % of the section"
    return f"{text}, engine {scene.engine.name}"


def _parameters(record: Record) -> dict[str, Any]:
    """Effective parameters by dotted key, those not given left out."""
    flat = flatten_keys(record.manifest["scene"])
    return {key: value for key, value in flat.items() if value is not None}


def _reproduce(record: Record) -> str:
    """The command that makes the run again, from inside its folder."""
    words = ["trackbed", "run", "scene.toml", "--run-folder", "../again"]
    words += ["--control"] if record.manifest.get("control") else []
    for override in record.manifest["overrides"]:
        words += ["--set", override]
    return shlex.join(words)


def _plain(value: Any) -> Any:
    """The same in types that JSON has."""
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, np.generic):
        return _plain(value.item())
    return None if isinstance(value, float) and not isfinite(value) else value
