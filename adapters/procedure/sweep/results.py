"""What a sweep leaves for other tools: tables as CSV, and as Parquet where PyArrow is; the band.

================ =====================================================================
``members``      a row for each member: settings, state, settlement, cost, its error
``settlement``   a row for each cycle of each member, as in its ``settlement.csv``
``band``         a row for each cycle of each setting: mean over seeds, confidence band
================ =====================================================================

Of another story, ``members`` has what each run came to, and the story draws it.
The tables are derived from the run folders and can be written again at any time.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from adapters.bed import FloatArray
from adapters.files import COLUMNS, RunFolder
from adapters.procedure import estimate_mean, make_plain, read_run_record
from adapters.procedure.sweep.plan import Member, Sweep
from adapters.procedure.sweep.run import Result, read_summary
from adapters.scene import flatten_keys
from trackbed.run_files import replace_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CONFIDENCE = 0.95
"""Probability that a band holds the mean, for seeds whose settlements are normal."""
SAMPLE_FIGURES = ("coordination_number", "relative_density")
"""Columns of the last row that the table of members has too."""


@dataclass(frozen=True)
class Band:
    """Settlement over the finished seeds of one setting, at the cycles that all of them have."""

    group: str
    settings: Mapping[str, Any]
    seeds: int  # finished members
    asked: int  # members in all
    cycle: FloatArray  # load cycles, shape (c,)
    mean: FloatArray  # of the loaded body's settlement [m], shape (c,)
    half: FloatArray  # half the width of the confidence band [m], shape (c,); nan for a single seed

    @property
    def half_at_end(self) -> float | None:
        """`half` at the last cycle [m]; None for a single seed."""
        return make_plain(self.half[-1])


def convert_settings(member: Member) -> dict[str, Any]:
    """Values of the keys swept over, as the checked scene has them; lists as JSON text."""
    values = flatten_keys(member.scene.model_dump(mode="json"))
    typed = {key: values.get(key, asked) for key, asked in member.settings.items()}
    return {k: json.dumps(v) if isinstance(v, list) else v for k, v in typed.items()}


def estimate_bands(sweep: Sweep, finished: set[str]) -> list[Band]:
    """The band of every setting of which a member is ``finished``."""
    bands = []
    for group, members in sweep.groups().items():
        histories = [
            read_run_record(sweep.run_folder(member)).run.history
            for member in members
            if member.name in finished
        ]
        curves = [dict(zip(one.cycle.tolist(), one.loaded_body, strict=True)) for one in histories]
        if not curves:
            continue
        cycles = sorted(set.intersection(*map(set, curves)))
        values = np.array([[curve[cycle] for cycle in cycles] for curve in curves])
        mean, half = estimate_mean(values, CONFIDENCE)
        settings = convert_settings(members[0])
        cycle = np.array(cycles, float)
        bands.append(Band(group, settings, len(curves), len(members), cycle, mean, half))
    return bands


def write_results(sweep: Sweep, results: Sequence[Result]) -> tuple[list[Band], dict[str, str]]:
    """Write the tables and the picture; the bands, and the path of every file."""
    if not sweep.settles:
        return [], join_summaries(sweep, results)
    bands = estimate_bands(sweep, {one.member for one in results if one.state == "finished"})
    member_rows, curve_rows = [], []
    for member, result in zip(sweep.members, results, strict=True):
        key = {"member": member.name, **convert_settings(member), sweep.kind.seed: member.seed}
        outcomes = RunFolder(sweep.run_folder(member)).outcomes()
        found = [row for outcome in outcomes for row in outcome.rows]
        curve_rows += [key | {name: one.get(k) for name, k in COLUMNS.items()} for one in found]
        figures = {name: found[-1].get(name) if found else None for name in SAMPLE_FIGURES}
        own = {
            name: value for name, value in vars(result).items() if name not in ("member", "seed")
        }
        member_rows.append(key | own | figures)
    band_rows = [
        {
            **band.settings, "cycle": int(cycle), "seeds": band.seeds, "loaded_body_m": float(mean),
            "low_m": make_plain(mean - half), "high_m": make_plain(mean + half),
        }
        for band in bands
        for cycle, mean, half in zip(band.cycle, band.mean, band.half, strict=True)
    ]  # fmt: skip
    tables = {"members": member_rows, "settlement": curve_rows, "band": band_rows}
    paths: dict[str, str] = {}
    for name, rows in tables.items():
        paths |= save_table(sweep.folder / name, rows)
    if bands:
        from trackbed.report import save_figure

        picture = save_figure(lambda: draw_bands(bands), sweep.folder / "settlement.png")
        paths["picture"] = str(picture)
    return bands, paths


def join_summaries(sweep: Sweep, results: Sequence[Result]) -> dict[str, str]:
    """Write what runs of another story came to, a row each, and their picture; paths by name."""
    rows: list[dict[str, Any]] = []
    for member, result in zip(sweep.members, results, strict=True):
        key = {"member": member.name, **convert_settings(member), sweep.kind.seed: member.seed}
        ended = {name: vars(result)[name] for name in ("state", "exit_code", "run_folder")}
        figures = {k: v for k, v in read_summary(sweep, member).items() if not isinstance(v, dict)}
        rows.append(key | ended | figures | {"sentence": result.sentence})
    names = dict.fromkeys(name for row in rows for name in row)
    paths = save_table(sweep.folder / "members", [{n: row.get(n) for n in names} for row in rows])
    if any(row["state"] == "finished" for row in rows):
        from trackbed.report import save_figure

        draw = import_module(sweep.kind.scenes).draw_members
        paths["picture"] = str(save_figure(lambda: draw(rows), sweep.folder / "members.png"))
    return paths


def save_table(stem: Path, rows: Sequence[Mapping[str, Any]]) -> dict[str, str]:
    """Write rows to ``stem.csv``, and to ``stem.parquet`` where PyArrow is, atomically; their paths
    by name.  In the latter a column whose values are of several kinds becomes text."""
    paths = {f"{stem.name}.csv": str(stem.with_name(f"{stem.name}.csv"))}
    names = list(rows[0]) if rows else []
    with replace_file(Path(paths[f"{stem.name}.csv"])) as temporary, temporary.open("w") as stream:
        table = csv.DictWriter(stream, names, lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
    if find_spec("pyarrow") is None:
        return paths
    import pyarrow as pa
    from pyarrow import parquet

    columns = {}
    for name in names:
        values = [row[name] for row in rows]
        try:
            columns[name] = pa.array(values)
        except (pa.ArrowInvalid, pa.ArrowTypeError):
            columns[name] = pa.array([None if value is None else str(value) for value in values])
    path = stem.with_name(f"{stem.name}.parquet")
    with replace_file(path) as temporary:
        parquet.write_table(pa.table(columns), temporary)
    return paths | {path.name: str(path)}


def draw_bands(bands: Sequence[Band]) -> Figure:
    """Mean settlement of every setting with its band, against load cycles, linear and log."""
    from matplotlib import colormaps

    from adapters.report import add_legend, make_panels

    figure, *panels = make_panels(f"mean over seeds, {100 * CONFIDENCE:.0f} % band")
    for number, band in enumerate(bands):
        colour = colormaps["viridis"](0.05 + 0.85 * number / max(len(bands) - 1, 1))
        label = f"{band.group} ({band.seeds} of {band.asked} seeds)"
        for panel in panels:
            panel.plot(band.cycle, 1e6 * band.mean, color=colour, label=label)
            low, high = band.mean - band.half, band.mean + band.half
            panel.fill_between(band.cycle, 1e6 * low, 1e6 * high, color=colour, alpha=0.2, lw=0.8)
    add_legend(figure, 2)
    return figure
