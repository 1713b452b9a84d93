"""The report of a run: ``report.html``, ``report.json`` and ``figures/`` in its folder.

The page is one file that loads nothing.  It begins with one claim and where it fails, and gives
the error beside the cost it saved; `adapters.report.error` defines both.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from adapters.bed import PAPER_COORDINATION, FloatArray, load_state, neighbours
from adapters.files import Outcome, name_full_disk
from adapters.procedure import Record, Track, list_jumped_spans, read_run_record
from adapters.report.bed import PAPER_DENSITY, karrech
from adapters.report.numbers import TWIN_SCATTER, Numbers, name_variant, numbers_of
from adapters.report.preparation import read_preparation
from adapters.report.sections import body
from adapters.report.verdict import PROCEDURE
from trackbed.report import page
from trackbed.run_files import write_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

JUMPS_SHOWN = 4
"""Jumps whose penetrations are drawn: the first ones and the last."""


def write_report(run_folder: Path) -> Path:
    """Write the report of a run, finished or not; returns the path of ``report.html``.

    Raises `UsageError` when ``run_folder`` is no run folder.  Only reads what finished stages
    left, so it may be called while the run goes on.
    """
    record = read_run_record(run_folder)
    numbers = numbers_of(record)
    with name_full_disk(run_folder):
        figures = write_figures(record, numbers)
        write_whole(run_folder / "report.json", numbers.to_json())
        html = page(f"Settlement of {numbers.scene}", body(record, numbers, figures))
        write_whole(run_folder / "report.html", html)
    return run_folder / "report.html"


def write_figures(record: Record, numbers: Numbers) -> dict[str, Path]:
    """Draw every figure that the run has reached; their files by name."""
    from trackbed.report import save_figure

    folder = record.path / "figures"
    folder.mkdir(exist_ok=True)
    files = {name: save_figure(draw, folder / name) for name, draw in _figures(record, numbers)}
    return {name.partition(".")[0]: path for name, path in files.items()}


def _figures(record: Record, numbers: Numbers) -> Iterator[tuple[str, Callable[[], Figure]]]:
    """File name and drawing of each figure."""
    from adapters.report import figures

    series = read_preparation(record)
    if series is not None:
        paper = (PAPER_DENSITY, PAPER_COORDINATION) if karrech(record) else (None, None)
        yield "preparation.svg", partial(figures.draw_preparation, series, *paper)
    run = record.run.history
    if not len(run.cycle):
        return
    control = None if record.control is None else record.control.history
    spans = list_jumped_spans(record.run.outcomes)
    others = [(name_variant(track.name), track.history) for track in record.others]
    title = ""
    if (row := numbers.row(PROCEDURE)) is not None:
        title = f"error {100 * row.settlement_error:+.1f} % at a speed-up of {row.speed_up:.2f}"
    settlement = partial(figures.draw_settlement, run, control, others, spans, title)
    yield "settlement.png", settlement
    if numbers.stopped_early is not None and numbers.curve_fitted is not None:
        lines = (
            ("full run stopped early, nothing moved", numbers.stopped_early),
            ("law fitted to the full run's curve, no bed", numbers.curve_fitted),
        )
        yield (
            "error_cost.svg",
            partial(figures.draw_error_cost, numbers.error_rows, lines, *_scatter(record, numbers)),
        )
    yield "coordination.svg", partial(figures.draw_coordination, run, control, spans)
    if beds := list(_penetrations(record)):
        yield "penetration.svg", partial(figures.draw_penetration, beds)
    yield "sample.png", partial(figures.draw_sample, _samples(record), record.run.start().radius)
    yield "piston.svg", partial(figures.draw_piston, run, spans, *_last_cycle(record))
    yield "cost.svg", partial(figures.draw_cost, numbers.costs)


def _scatter(record: Record, numbers: Numbers) -> tuple[float, str]:
    """Error below which two full runs do not differ, and how it is known; nan when not."""
    if (floor := numbers.floor) is not None:
        return floor, "h = 0 and perturbed full runs"
    if karrech(record):
        return TWIN_SCATTER, "scatter of twin runs"
    return np.nan, ""


def _penetrations(record: Record) -> Iterator[tuple[str, dict[str, FloatArray]]]:
    """Title and overlaps [m] before, as estimated and relaxed, for the jumps shown."""
    jumps = record.run.jumps
    shown = jumps if len(jumps) <= JUMPS_SHOWN else [*jumps[: JUMPS_SHOWN - 1], jumps[-1]]
    for name, jump in shown:
        overlaps = {when: bed for when, bed in _overlaps(record, name, jump) if len(bed)}
        if overlaps:
            yield f"jump from cycle {jump.first_cycle} to {jump.last_cycle}", overlaps


def _overlaps(record: Record, name: str, jump: Outcome) -> Iterator[tuple[str, FloatArray]]:
    folder = record.run.folder.path / name
    relaxed = load_state(folder / "relaxed.npz")
    before = record.run.before(jump)
    estimated = load_state(folder / "estimated.npz")
    for when, state, height in (
        ("before", before, np.nan if before is None else before.piston_height),
        ("estimated", estimated, relaxed.piston_height),
        ("relaxed", relaxed, relaxed.piston_height),
    ):
        if state is not None:
            walls = record.scene.container.walls(height, record.scene.piston_reach)
            touching = neighbours(state.position, state.radius, walls)
            yield when, touching.overlap[touching.overlap > 0]


def _samples(record: Record) -> list[tuple[str, FloatArray, FloatArray]]:
    """Title, centres [m] and residual displacements [m] of the beds that are drawn."""

    def moved(track: Track, cycle: int) -> tuple[FloatArray, FloatArray]:
        position = track.position(cycle)
        return position, np.linalg.norm(position - start, axis=1)

    start = record.run.start().position
    cycle = int(record.run.history.cycle[-1])
    now, displacement = moved(record.run, cycle)
    panels = [
        ("before loading", start, displacement),
        (f"after {cycle} cycles, this run", now, displacement),
    ]
    if record.control is not None and cycle in record.control.history.cycle:
        panels.append((f"after {cycle} cycles, full run", *moved(record.control, cycle)))
    return panels


def _last_cycle(record: Record) -> tuple[int, FloatArray, FloatArray, FloatArray]:
    """The last computed cycle: its number, phase, target and contact force [N]."""
    name, outcome = record.run.windows[-1]
    window = record.run.window(name)
    piston, (start, end) = window.piston, window.time_step[-2:]
    last = piston.time_step > start
    phase = (piston.time_step[last] - start) / (end - start)
    return outcome.last_cycle, phase, piston.target_force[last], piston.contact_force[last]
