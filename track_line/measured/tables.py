"""Tables of beds: those of ``trackbed sweep``, or one with a column for each sleeper."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from track_line.arrays import Floats
from track_line.measured.ensemble import Ensemble, align_beds
from trackbed.errors import UsageError
from trackbed.run_files import MANIFEST, read_object
from trackbed.series_file import Table, find_column, read_columns, read_table

LOADS = ("loading.amplitude", "loading.mean")
"""Keys of a sweep that change the load and nothing else."""
SEED = "sample.seed"
LENGTHS = ("m", "mm", "cm", "um", "µm")
CYCLES = ("cycle", "cycles", "n", "axle", "axles")
"""Names of the column of cycles."""
GAPS = ("", "-", "nan")
"""Cells of a sleeper that was not read."""
LATE = 10.0
"""The elastic deflection is the mean over cycles from the last one over this."""
CURVE = ("cycle", "loaded_body_settlement", "elastic_deflection")


def read_beds(path: Path) -> Ensemble:
    """The beds of a sweep's folder, or of a table with cycles and a column for each sleeper.

    Raises `UsageError` for what is neither, and for a sweep over other keys than load and seed.
    """
    return _read_sweep(path) if path.is_dir() else _read_sleepers(path)


def _read_sleepers(path: Path) -> Ensemble:
    """Settlements [m, or the unit behind a column's name] of sleepers as they lie in a track."""
    try:
        table = read_table(path, [CYCLES])
        place = find_column(table, CYCLES, ("-", "1"))
    except UsageError as error:
        remedy = f"call it {', '.join(CYCLES)}; tonnes over those of an axle are cycles, days none"
        raise UsageError(error.what, where=error.where, remedy=remedy) from None
    others = [at for at in range(len(table.header)) if at != place]
    names = [table.header[at] for at in (place, *others)]
    gap = np.array([[row[at].strip().lower() in GAPS for row in table.rows] for at in others])
    filled = [["0" if at != place and cell.strip().lower() in GAPS else cell
               for at, cell in enumerate(row)] for row in table.rows]  # fmt: skip
    units = [("-", "1"), *[LENGTHS] * len(others)]
    (cycle, *settled), _ = read_columns(replace(table, rows=filled), names, units)
    if len({table.split_title(at, LENGTHS)[1] for at in others}) > 1:
        raise UsageError(
            "only some columns have this unit", where=f"{path}:{table.header_line}",
            remedy="name cycles and sleepers alone, each sleeper with its unit, such as s1 [mm]",
        )  # fmt: skip
    if not (cycle[0] >= 0 and (np.diff(cycle) > 0).all()):
        raise UsageError(
            "cycles do not ascend", where=str(path), remedy="give each reading once, in order"
        )
    curves = {name: (cycle[~none], one[~none])
              for name, one, none in zip(names[1:], settled, gap, strict=True)
              if not none.all()}  # fmt: skip
    unknown = np.full(len(curves), np.nan)
    notes = [f"{gap.sum()} cells without a number are no readings"] if gap.any() else []
    return align_beds(
        list(curves.values()), str(path), names=list(curves), packing=np.arange(len(curves)),
        pressure=unknown, bedding=unknown, in_order=True, notes=notes,
    )  # fmt: skip


def _read_sweep(folder: Path) -> Ensemble:
    """The finished members of a sweep, each a bed."""
    try:
        members = read_table(folder / "members.csv", [("member",), ("state",)])
        rows = read_table(folder / "settlement.csv", [("member",), ("cycle",)])
        names, states, runs, seeds = (
            _take(members, name) for name in ("member", "state", "run_folder", SEED)
        )
    except UsageError as error:
        raise UsageError(
            error.what, where=error.where,
            remedy="give the folder that trackbed sweep --into wrote, or a table with a column "
            "for each sleeper",
        ) from None  # fmt: skip
    _refuse_other_keys(members, folder)
    whose, kinds = np.array(_take(rows, "member")), np.array(_take(rows, "kind"))
    curves, found, taken, notes = [], [], [], []
    for name, state, run, seed in zip(names, states, runs, seeds, strict=True):
        mine = np.flatnonzero((whose == name) & (kinds == "computed"))
        if state != "finished" or not mine.size:
            notes.append(f"{name} is {state} with {mine.size} cycles, and left out")
            continue
        cycle, settled, deflection = _read_curve(rows, mine)
        if np.count_nonzero((whose == name) & (kinds == "jumped")):
            notes.append(f"{name} has jumps: what it gained there is its procedure's")
        curves.append((cycle, settled))
        greatest, swing = read_pressure(folder / run)
        late = deflection[cycle >= cycle[-1] / LATE]
        late = late[late > 0]
        if not np.isfinite(greatest):
            notes.append(f"{name}: its load is not known, nor its stiffness")
        taken.append(name)
        found.append((int(seed), greatest, swing / late.mean() if late.size else np.nan))
    packing, pressure, bedding = np.array(found, float).reshape(-1, 3).T
    return align_beds(
        curves, str(folder), names=taken, packing=packing.astype(int), pressure=pressure,
        bedding=bedding, in_order=False, notes=notes,
    )  # fmt: skip


def _take(table: Table, name: str) -> list[str]:
    """The cells of a column."""
    place = find_column(table, (name,), ())
    return [row[place].strip() for row in table.rows]


def _read_curve(rows: Table, mine: Any) -> Floats:
    """`CURVE` of the rows ``mine``, shape (3, k), in order of cycles; nan for an empty cell."""
    own = replace(rows, rows=[rows.rows[i] for i in mine], lines=[rows.lines[i] for i in mine])
    places = [find_column(own, (name,), ()) for name in CURVE]
    cells = [["nan" if place == places[2] and not row[place].strip() else row[place]
              for place in places] for row in own.rows]  # fmt: skip
    try:
        curve = np.array(cells, float).reshape(-1, 3).T
    except ValueError as error:
        raise UsageError(f"{error}", where=str(rows.path), remedy="sweep again") from None
    if not np.isfinite(curve[:2]).all():
        place = own.where(int(np.argmin(np.isfinite(curve[:2]).all(axis=0))))
        raise UsageError("a settlement is not a finite number", where=place, remedy="sweep again")
    return np.asarray(curve[:, np.argsort(curve[0], kind="stable")])


def _refuse_other_keys(members: Table, folder: Path) -> None:
    """Raise `UsageError` where beds differ by more than their load and their rain of grains."""
    state = find_column(members, ("state",), ())
    for key in members.header[1:state]:
        if key not in (*LOADS, SEED) and len(set(_take(members, key))) > 1:
            raise UsageError(
                f"the beds differ by {key}, which no settlement law knows", where=str(folder),
                remedy="sweep each value into a folder of its own, over "
                f"{' and '.join(LOADS)} and seeds alone",
            )  # fmt: skip


def read_pressure(run: Path) -> tuple[float, float]:
    """Greatest pressure on a bed, and its swing in a cycle [Pa], from the scene in a member's
    manifest; nan where that is gone, or gives its load as a table."""
    loading = ((read_object(run / MANIFEST) or {}).get("scene") or {}).get("loading") or {}
    mean, swing = loading.get("mean"), loading.get("amplitude")
    if not isinstance(mean, float | int) or not isinstance(swing, float | int):
        return np.nan, np.nan
    return mean + swing / 2, float(swing)
