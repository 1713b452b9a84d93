"""The numbers of a report, from a run folder: what ``report.json`` holds and ``report.html`` shows."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from math import isfinite, nan
from typing import Any

import numpy as np

from adapters.checks import FORCE_ERROR_GOAL, FORCE_START_CYCLES
from adapters.errors import UsageError
from adapters.laws import law_named
from adapters.report_error import (
    COORDINATION_BAR,
    HEIGHT_BAR,
    PYTHON_BAR,
    Beds,
    CostLine,
    ErrorRow,
    JumpFigures,
    cost_total,
    curve_fitted,
    cycles_computed,
    error_row,
    jump_figures,
    jumped_spans,
    last_common_cycle,
    stopped_early,
)
from adapters.report_model import left_out
from adapters.report_record import Record, Track
from adapters.scene import flat_keys
from adapters.state import FloatArray

PROCEDURE, NOTHING, FITTED, FULL = (
    "this run",
    "jump and move nothing",
    "fit the curve, no bed",
    "full run (control)",
)
"""Names of the rows of the error table."""

FITTED_POINTS = 24
"""Costs at which the fit of the curve is tried."""

TWIN_SCATTER = 0.013
"""Standard deviation of the settlement at cycle 100, over its mean, of five continuations of one
state of the Karrech bed at cycle 50, apart by round-off."""

FEW_GRAINS = 500
"""Fewer grains than this settle in bursts: one such bed can not judge a law."""


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
    """How well the piston's force followed its target in one window; nan for three cycles or less."""

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
class PreparationFigures:
    """The settled bed before loading."""

    weight: float
    """All grains [N]."""
    apparent_weight: float
    """Force on the floor [N]."""
    coordination_grains: float
    coordination_with_walls: float
    coordination_without_rattlers: float
    rattler_share: float
    relative_density: float
    """Below nine tenths of the bed's height."""
    height: float
    """[m]"""
    energy_ratio: float
    """Translational kinetic over potential energy at the end."""
    energy_ratio_with_rotation: float
    duration: float
    """Simulated time [s]."""
    cpu_s: float


@dataclass(frozen=True)
class PreparationSeries:
    """The rain of grains in time: t instants, and f of the dumped frames."""

    time: FloatArray
    """[s], shape (t,)."""
    apparent_weight: FloatArray
    """[N], shape (t,)."""
    coordination_number: FloatArray
    """Contacts with other grains, shape (t,)."""
    translational: FloatArray
    """Translational kinetic over potential energy, shape (t,)."""
    rotational: FloatArray
    """Rotational kinetic over potential energy, shape (t,)."""
    frame_time: FloatArray
    """[s], shape (f,)."""
    relative_density: FloatArray
    """Below a fixed height, nine tenths of the settled bed's, shape (f,)."""


@dataclass(frozen=True)
class Bar:
    """A figure against its bar."""

    name: str
    value: float
    bar: float
    ok: bool | None
    """None where the figure is not known."""


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
    speed_up_of_cycles: float
    """Cycles done over cycles computed: what the speed-up is without a control to measure it."""
    compared_at: int
    """Cycle at which run and control are compared; 0 without a control."""
    error_rows: tuple[ErrorRow, ...]
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

    def row(self, name: str) -> ErrorRow | None:
        """A row of the error table."""
        return next((row for row in self.error_rows if row.name == name), None)

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
    rows = error_rows(record)
    jumps = tuple(
        jump_figures(name, jump, history, None if control is None else control.history)
        for name, jump in run.jumps
    )
    costs = tuple(_cost(record, track) for track in (run, control) if track is not None)
    piston = tuple(_piston(name, outcome.rows) for name, outcome in run.windows)
    bars = tuple(_bars(rows, jumps, costs, piston))
    spans = jumped_spans(run.outcomes)
    lines: tuple[CostLine | None, CostLine | None] = (None, None)
    compared_at = 0 if control is None else last_common_cycle(history, control.history)
    if control is not None and compared_at and spans:
        lines = (stopped_early(control.history, compared_at), _fitted_line(record, compared_at))
    provenance = dict(record.manifest.get("provenance", {}))
    return Numbers(
        scene=_scene_sentence(record),
        grains=scene.grain_count,
        finished=run.preparation is not None if not total else cycle == total,
        cycle=cycle,
        total_cycles=total,
        cycles_computed=computed,
        settlement=float(history.settlement[-1]) if cycle else nan,
        speed_up_of_cycles=cycle / computed if computed else nan,
        compared_at=compared_at,
        error_rows=rows,
        stopped_early=lines[0],
        curve_fitted=lines[1],
        jumps=jumps,
        preparation=preparation_figures(run),
        piston=piston,
        costs=costs,
        bars=bars,
        fails=tuple(_fails(record, rows, bars)),
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


def error_rows(record: Record) -> tuple[ErrorRow, ...]:
    """The table of error against speed-up; empty without a control."""
    run, control = record.run, record.control
    if control is None:
        return ()
    own, full = run.history, control.history
    cycle = last_common_cycle(own, full)
    if not cycle:
        return ()
    spans = [span for span in jumped_spans(run.outcomes) if span[1] <= cycle]
    prepared = run.preparation
    preparation_s = 0.0 if prepared is None else cost_total(prepared.cost)
    start, truth = run.start().position, control.position(cycle)
    before_jump = run.position(spans[0][0]) if spans else None

    def row(name: str, track: Track, at: int, against: int) -> ErrorRow:
        beds = Beds(start, before_jump, control.position(against), track.position(at))
        return error_row(name, track.history, at, full, against, preparation_s, beds)

    rows = [row(PROCEDURE, run, cycle, cycle)]
    if spans:
        early = cycles_computed(cycle, spans)
        still = Beds(start, before_jump, truth, control.position(early))
        rows.append(error_row(NOTHING, full, early, full, cycle, preparation_s, still))
        rows += _fitted_row(record, cycle, early, preparation_s)
    for other in record.others:
        if common := last_common_cycle(other.history, full):
            name = other.name if common == cycle else f"{other.name}, at cycle {common}"
            rows.append(row(name, other, common, common))
    rows.append(row(FULL, control, cycle, cycle))
    return tuple(rows)


def _fitted_row(record: Record, cycle: int, early: int, preparation_s: float) -> list[ErrorRow]:
    """The law of the scene fitted to as many cycles of the control as this run computed."""
    assert record.control is not None
    assert record.scene.procedure is not None
    full = record.control.history
    law = law_named(record.scene.procedure.law)
    line = curve_fitted(full, law, record.scene.procedure.k_i, cycle, [early])
    if not len(line.computed):
        return []
    cost, full_cost = float(line.cpu_s[0]), float(full.cpu_s[full.row(cycle)])
    error = float(line.settlement_error[0])
    return [
        ErrorRow(
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


def _fitted_line(record: Record, cycle: int) -> CostLine:
    """The law of the scene fitted to the control's curve at several costs."""
    assert record.control is not None
    procedure = record.scene.procedure
    assert procedure is not None
    law = law_named(procedure.law)
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


def _cost(record: Record, track: Track) -> CostSplit:
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
        preparation=nan if prepared is None else cost_total(prepared.cost),
        cycles_computed=computed,
        grain_steps=float(record.scene.grain_count * _time_steps(track)),
    )


def _time_steps(track: Track) -> int:
    """Time steps computed since the preparation; the engine's count goes on through jumps."""
    ends = [o.notes["time_step"] for o in track.outcomes if o.stage in ("preparation", "window")]
    return int(ends[-1] - ends[0]) if ends else 0


def _piston(name: str, rows: list[dict[str, Any]]) -> PistonFigures:
    """Force errors of one window after its first three cycles."""
    errors = np.array([row["force_error"] for row in rows[FORCE_START_CYCLES:]], float)
    ends = (rows[0]["cycle"] - 1, rows[-1]["cycle"])
    if not len(errors):
        return PistonFigures(name, *ends, nan, nan, None)
    worst = float(errors.max())
    mean = float(np.sqrt(np.mean(errors**2)))
    return PistonFigures(name, *ends, mean, worst, worst <= FORCE_ERROR_GOAL)


def preparation_figures(run: Track) -> PreparationFigures | None:
    """The settled bed; None while it is not settled."""
    outcome = run.preparation
    series = preparation_history(run)
    if outcome is None or series is None:
        return None
    figures = outcome.notes["figures"]
    coordination = figures["coordination"]
    potential = series["potential_J"][-1]
    still, spinning = series["kinetic_translational_J"][-1], series["kinetic_rotational_J"][-1]
    return PreparationFigures(
        weight=figures["weight"],
        apparent_weight=figures["apparent_weight"],
        coordination_grains=coordination["grains"],
        coordination_with_walls=coordination["with_walls"],
        coordination_without_rattlers=coordination["without_rattlers"],
        rattler_share=coordination["rattler_share"],
        relative_density=figures["relative_density"],
        height=figures["height"],
        energy_ratio=float(still / potential),
        energy_ratio_with_rotation=float((still + spinning) / potential),
        duration=float(series["time_s"][-1]),
        cpu_s=cost_total(outcome.cost),
    )


def preparation_history(run: Track) -> dict[str, FloatArray] | None:
    """Columns of ``history.txt`` by the names in its header; None while there is no settled bed."""
    path = run.folder.path / "preparation" / "history.txt"
    if run.preparation is None or not path.exists():
        return None
    with path.open(encoding="utf-8") as stream:
        names = stream.readline().lstrip("# ").split()
        try:
            table = np.loadtxt(stream, ndmin=2)
        except ValueError as error:
            raise UsageError(f"this is no table of numbers ({error})", where=str(path)) from error
    return dict(zip(names, table.T, strict=True))


def preparation_series(record: Record) -> PreparationSeries | None:
    """Fig. 3 of the paper: the rain of grains in time."""
    from adapters.dump import dump_frames
    from adapters.sample import relative_density

    run, container = record.run, record.scene.container
    history = preparation_history(run)
    if history is None:
        return None
    assert run.preparation is not None
    height = run.preparation.notes["density_height"]
    steps, times = history["step"], history["time_s"]
    time_step = times[-1] / steps[-1] if steps[-1] else record.scene.time_step
    frames = [
        (
            frame.time_step * time_step,
            relative_density(frame.block("x", "y", "z"), frame.column("radius"), container, height),
        )
        for frame in dump_frames(run.folder.path / "preparation" / "rain.dump")
    ]
    frame_times, densities = np.array(frames).T
    return PreparationSeries(
        time=times,
        apparent_weight=history["floor_force_N"],
        coordination_number=history["coordination_number"],
        translational=history["kinetic_translational_J"] / history["potential_J"],
        rotational=history["kinetic_rotational_J"] / history["potential_J"],
        frame_time=frame_times,
        relative_density=densities,
    )


def _bars(
    rows: tuple[ErrorRow, ...],
    jumps: tuple[JumpFigures, ...],
    costs: tuple[CostSplit, ...],
    piston: tuple[PistonFigures, ...],
) -> Iterator[Bar]:
    """Figures against their bars."""

    def bar(name: str, values: list[float], limit: float) -> Bar:
        known = [abs(value) for value in values if isfinite(value)]
        worst = max(known, default=nan)
        return Bar(name, worst, limit, worst <= limit if known else None)

    errors = [row.coordination_error for row in rows if row.name == PROCEDURE]
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


def _fails(
    record: Record, rows: tuple[ErrorRow, ...], bars: tuple[Bar, ...]
) -> Iterator[str]:
    """Where the claim fails: bars missed, and cheaper ways that do as well."""
    by_name = {row.name: row for row in rows}
    run = by_name.get(PROCEDURE)
    if not record.run.history.cycle.size:
        return
    if run is None:
        yield "no full run stands beside this one, so its error is not known (--control adds it)"
    else:
        error = abs(run.settlement_error)
        for name, how in (
            (NOTHING, "jumping and moving nothing"),
            (FITTED, "fitting the law to the full run's curve, which leaves no bed,"),
        ):
            other = by_name.get(name)
            if other is not None and abs(other.settlement_error) <= error:
                yield (
                    f"{how} comes as near to the full run ({100 * other.settlement_error:+.1f} %) "
                    "for about the same cost"
                )
        if run.jump_displacement_error >= 1:
            yield (
                "single grains are not predicted: E_r of their displacement since the first jump is "
                f"{run.jump_displacement_error:.2f}, and 1 is the error of not moving them"
            )
        if run.speed_up < 1:
            yield "the procedure cost more than the full run"
    for bar in bars:
        if bar.ok is False:
            yield f"{bar.name} is {100 * bar.value:.1f} %, above {100 * bar.bar:.0f} %"
    if record.run.failed_jumps:
        yield f"{len(record.run.failed_jumps)} jumps failed and were tried again, shorter"
    if record.scene.grain_count < FEW_GRAINS:
        yield (
            f"a bed of {record.scene.grain_count} grains settles in bursts: it shows the machinery "
            "and can not judge a law"
        )


def _scene_sentence(record: Record) -> str:
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
    flat = flat_keys(record.manifest["scene"])
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
