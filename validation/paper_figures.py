"""Figures 3 and 5 to 9 of Karrech et al. (2007), measured again on full runs of their bed.

    python -m validation.paper_figures                 Figs 5 to 9, from stored full runs
    python -m validation.paper_figures --rain FOLDER   Fig. 3: a rain of grains on LIGGGHTS

writes validation/results/paper-figures.jsonl.  TRACKBED_DATA names the folder with the full runs,
of which `validation.cases.jump_without_engine` says what they hold.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from adapters.engine import engine_named
from adapters.laws import law_named
from adapters.progress import Progress
from adapters.provenance import commit, machine
from adapters.relaxation_kernel import BoolArray
from adapters.report_preparation import preparation_series
from adapters.report_record import Record, track_read
from adapters.residual import (
    error_of_coordinates,
    error_of_displacement,
    residual_displacement,
    stability_of_displacement,
    stability_of_error,
)
from adapters.run_folder import RunFolder, write_atomically
from adapters.scene import Scene
from adapters.scene_file import scene_load
from adapters.stages import Run, Variant, prepare
from adapters.state import FloatArray
from scenes import scene_path
from validation.jump_runs import record_read
from validation.move_study_offline import positions_read, states_at
from validation.relaxation_jumps import Jumped
from validation.relaxation_measures import measured
from validation.relaxation_ways import own, rough

Row = dict[str, Any]
RECORD = Path(__file__).parent / "results" / "paper-figures.jsonl"
RUN, TWIN = "paper_scale_a", "paper_scale_b"
"""Two full runs of one bed that began 1e-10 m apart, 300 and 98 cycles."""
LONG_RUN = "coarse_bursty"
"""Another bed, of 150 softer grains, with windows behind 500 cycles."""
LATE_RUNS = ("confined-1-0", "confined-2-0", "confined-3-0")
"""Full runs of three packings of the same bed, by their names in the settlement ensemble, of which
`validation.paper_figures_late` measures jumps behind cycle `PAPER_LAST`; the record has some."""
FIRST = (10, 20, 50, 100, 200)
"""k_i: cycles before the window."""
PAPER_LAST = 500
"""The paper's largest k_i."""
FIRST_LONG = (*FIRST, PAPER_LAST)
PAPER_LARGEST = {"linear": (0.14, 0.025), "log": (0.14, 0.01)}
"""The paper's largest E_r in Figs 6 and 7 at its k_i of 10 and of 500, as its text has them."""
PAPER_LONG = (20, 0.02)
"""k from which on the paper's E_r is below so much."""
WINDOWS = (5, 10, 20, 40, 80)
"""k: cycles of the window."""
JUMPS = (5, 10, 20, 40, 80)
"""h: cycles jumped."""
LAWS = {"linear": law_named("linear"), "log": law_named("log"), "eq. 17": law_named("karrech2007")}
NOTHING, OTHER = "nothing moved", "another member"
ACCURACY_CYCLES = 100
"""Cycles over which Fig. 5 follows g_u and f_xi."""
SHOWN_JUMP = (20, 20, 20)
"""k_i, k, h of the paper's Fig. 9."""
SHARES = (0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95, 0.99, 1.0)
"""Quantiles of the overlaps that Fig. 9 is drawn from."""
CELL_DEPTH = 1.8e-3
"""Overlap of the cell of nine grains [m]: the greatest one of the paper's Fig. 9a."""


def accuracy_row(position: FloatArray, k_i: int) -> Row:
    """Fig. 5: g_u(k) and f_xi(k) of eqs 13, 14 for windows that begin at ``k_i``, linear law."""
    last = min(k_i + ACCURACY_CYCLES, len(position) - 1)
    window, law = position[k_i : last + 1], LAWS["linear"]
    cycle = np.arange(k_i, last + 1.0)
    return {
        "figure": "5",
        "k_i": k_i,
        "g_u": digits(stability_of_displacement(window)),
        "f_xi": digits(stability_of_error(law, cycle, residual_displacement(window))),
    }


def jump_row(
    position: FloatArray, twin: FloatArray, jump: tuple[int, int, int], run: str = RUN
) -> Row:
    """Figs 6, 7: E_r (eq. 22) of a jump by each law, with three displacements as denominator.

    ``coordinates``: u are coordinates, as eq. 22 is explained; ``loading``: displacements since the
    first cycle; ``jump``: those of the jump itself, where 1 is moving nothing.
    """
    k_i, k, h = jump
    cycle, first, last = np.arange(k_i, k_i + k + 1.0), position[k_i + k], position[k_i + k + h]
    window = position[k_i : k_i + k + 1]
    estimates = {NOTHING: first}
    for name, law in LAWS.items():
        rows = slice(law.first_state, None)
        parameters = law.fit(cycle[rows], window[rows] - position[0])
        estimates[name] = first + law.increment(parameters, cycle[-1], cycle[-1] + h)
    if k_i + k + h < len(twin):
        estimates[OTHER] = first + twin[k_i + k + h] - twin[k_i + k]
    return {
        "figure": "6, 7",
        "run": run,
        "jump": list(jump),
        "coordinates": {n: digits(error_of_coordinates(last, e)) for n, e in estimates.items()},
        "loading": {
            n: digits(error_of_displacement(position[0], last, e)) for n, e in estimates.items()
        },
        "of_jump": {n: digits(error_of_displacement(first, last, e)) for n, e in estimates.items()},
        "settlement": {
            n: digits((last - e)[:, 2].mean() / (last - position[0])[:, 2].mean())
            for n, e in estimates.items()
        },
    }


def relaxed_rows(jumped: Jumped, figure: str, frontier: BoolArray | None = None) -> Iterator[Row]:
    """Figs 8, 9: overlaps of an estimate, and after each relaxation, beside those before.

    ``frontier`` (n,): grains that the paper's method holds, where not those at the walls.
    """
    ways = {"before": jumped.before.position, "estimate": jumped.estimate}
    ways["smallest-move"] = own(jumped, "smallest-move").position
    ways["karrech2007"] = own(jumped, "karrech2007", frontier=frontier).position
    for way, position in ways.items():
        overlap = jumped.around.search(position, 0.0).overlap
        yield {
            "figure": figure,
            "way": way,
            "overlaps": digits(np.quantile(overlap, SHARES)) if len(overlap) else [],
            **rough(measured(jumped, position)),
            **(drawn(jumped, position) if figure == "8" else {}),
        }


def drawn(jumped: Jumped, position: FloatArray) -> Row:
    """What Fig. 8 is drawn from: radii and places of all grains from the middle one's first [m]."""
    radius, middle = jumped.before.radius, jumped.before.position[0]
    return {"radius": digits(radius), "position": digits(position - middle, 7)}


def jumped_as_shown(scene: Scene, position: FloatArray, radius: FloatArray) -> Jumped:
    """The jump of Fig. 9: linear law, every grain by itself."""
    k_i, k, h = SHOWN_JUMP
    law, cycle = LAWS["linear"], np.arange(k_i, k_i + k + 1.0)
    parameters = law.fit(cycle, position[k_i : k_i + k + 1])
    before = states_at(scene, position[k_i + k], radius)
    estimate = before.position + law.increment(parameters, cycle[-1], cycle[-1] + h)
    return Jumped("Fig. 9", before, estimate, scene.container.walls(), scene.stiffness)


def jumped_cell(scene: Scene) -> Jumped:
    """The cell of Fig. 8: eight grains around a ninth, which overlaps one of them.

    The paper names no measures: eight equal grains at the corners of a cube touch the one in its
    middle; the estimate puts that `CELL_DEPTH` deep into a corner.  Far from any wall.
    """
    radius = np.full(9, scene.sample.grain_radius.mean)
    corners = np.array(list(product((-1, 1), repeat=3))) / np.sqrt(3)
    middle = np.array([[0.03, 0.03, 0.03]])
    position = np.concatenate([middle, middle + 2 * radius[0] * corners])
    before = states_at(scene, position, radius)
    estimate = position.copy()
    estimate[0] += CELL_DEPTH * corners[-1]
    return Jumped("Fig. 8", before, estimate, scene.container.walls(), scene.stiffness)


def rain_row(folder: Path) -> Row:
    """Fig. 3: weight, contacts, density and energies of a rain of grains at paper scale."""
    scene = scene_load(scene_path("karrech"))
    path = folder / "rain"
    run = Run(
        scene, RunFolder(path), engine_named(scene.engine.name), Variant(), Progress(quiet=False)
    )
    prepare(run)
    track = track_read("rain", run.folder)
    series = preparation_series(Record(path, {}, scene, track, None, ()))
    assert series is not None
    assert track.preparation is not None
    names = ("time", "apparent_weight", "coordination_number", "translational", "rotational")
    return {
        "figure": "3",
        "scene": "karrech",
        **{name: digits(getattr(series, name)) for name in names},
        "frame_time": digits(series.frame_time),
        "relative_density": digits(series.relative_density),
        "figures": track.preparation.notes["figures"],
    }


def digits(value: FloatArray | float, count: int = 4) -> Any:
    """Numbers with few digits, as a record keeps them."""
    if np.ndim(value):
        return [digits(v, count) for v in np.asarray(value).tolist()]
    return float(f"{value:.{count}g}")


def rows_measured() -> Iterator[Row]:
    """Figs 5 to 9."""
    (position, radius), (twin, _) = positions_read(RUN), positions_read(TWIN)
    scene = scene_load(scene_path("karrech"))
    for k_i in (10, 100):
        yield accuracy_row(position, k_i)
    for jump in product(FIRST, WINDOWS, JUMPS):
        if sum(jump) < len(position):
            yield jump_row(position, twin, jump)
    long, _ = positions_read(LONG_RUN)
    for jump in product(FIRST_LONG, WINDOWS, JUMPS):
        yield jump_row(long, long[:1], jump, LONG_RUN)
    yield from relaxed_rows(jumped_cell(scene), "8", frontier=np.arange(9) > 0)
    yield from relaxed_rows(jumped_as_shown(scene, position, radius), "9")


def rows_read() -> list[Row]:
    """All rows of the record."""
    return record_read(RECORD)


def rows_put(measured: Sequence[Row]) -> None:
    """Put rows into the record in place of those of the same figure and run."""
    origin = {"commit": commit(), "machine": machine()}
    known = {place_of(row) for row in measured}
    kept = [row for row in rows_read() if place_of(row) not in known]
    rows = sorted([*kept, *(row | origin for row in measured)], key=place_of)
    write_atomically(RECORD, "".join(json.dumps(row) + "\n" for row in rows))


def place_of(row: Row) -> tuple[str, str]:
    """Figure, and the run where it has one."""
    return row["figure"], row.get("run", "")


def main(words: Sequence[str] | None = None) -> None:
    """Measure, and put what was measured in place of what the record has of it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rain", type=Path, metavar="FOLDER", help="measure Fig. 3 instead")
    folder = parser.parse_args(words).rain
    rows_put([rain_row(folder)] if folder else list(rows_measured()))


if __name__ == "__main__":
    main()
