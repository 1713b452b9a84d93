"""Quantities over time of a scene: ramps, tables and CSV columns become instants and values."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from qdem_fem.files import Series, make_ramp
from qdem_fem.tables.keys import SeriesTable
from qdem_fem.tables.types import WrongKey
from trackbed.errors import LibraryMissing, UsageError
from trackbed.series_file import TIMES, read_columns

WAYS = {"ramp": ("ramp", "value"), "times": ("times", "values"), "csv": ("csv", "value")}
"""First key of each way to give a series, and the keys that it needs."""
UNITS = {
    "force": ("N", "kN", "MN"), "pressure": ("Pa", "kPa", "MPa", "GPa"),
    "value": ("m", "cm", "mm", "um", "µm"),
}  # fmt: skip
"""Units that a column may have, by the key that it is given for."""


def make_series(
    table: SeriesTable | float | tuple[float, ...], key: str, folder: Path, *, vector: bool
) -> Series:
    """The series that a scene gives at ``key``; a relative CSV path counts from ``folder``.

    Values are numbers, or vectors where ``vector``.  Raises `WrongKey`.
    """
    if not isinstance(table, SeriesTable):
        return Series([0.0], [table])
    way = _choose_way(table, key)
    if way == "ramp":
        if isinstance(table.value, str) or table.value is None or table.ramp is None:
            raise WrongKey(f"{key}.value", "a ramp needs a value in SI units")
        found = make_ramp(table.ramp, table.value)
    else:
        found = _read_values(table, key) if way == "times" else _read_csv(table, key, folder)
    return _apply_direction(found, table, key, vector)


def _choose_way(table: SeriesTable, key: str) -> str:
    """Which of the ways to give a series; all keys that belong to it and no other are there."""
    given = table.model_fields_set
    ways = [way for way in WAYS if way in given]
    if len(ways) != 1:
        raise WrongKey(key, "give one of ramp, times or csv")
    (way,) = ways
    needed = set(WAYS[way])
    allowed = needed | {"direction"} | ({"time"} if way == "csv" else set())
    missing, extra = sorted(needed - given), sorted(given - allowed)
    if missing:
        raise WrongKey(f"{key}.{missing[0]}", f"missing: {way} needs it")
    if extra:
        raise WrongKey(f"{key}.{extra[0]}", f"{way} does not use it")
    return way


def _read_values(table: SeriesTable, key: str) -> Series:
    times, values = table.times or (), table.values or ()
    if len(times) != len(values) or not times:
        what = f"{len(times)} times, {len(values)} values: give as many, and at least one"
        raise WrongKey(f"{key}.values", what)
    if len({isinstance(value, tuple) for value in values}) > 1:
        raise WrongKey(f"{key}.values", "numbers and vectors are mixed")
    for index in range(1, len(times)):
        if times[index] <= times[index - 1]:
            what = f"must grow: entry {index}, {times[index]:g} s, follows {times[index - 1]:g} s"
            raise WrongKey(f"{key}.times", what)
    return Series(times, values)


def _read_csv(table: SeriesTable, key: str, folder: Path) -> Series:
    if not isinstance(table.value, str):
        raise WrongKey(f"{key}.value", "name the column of the values")
    path = folder / str(table.csv)

    def refuse(what: str, where: str) -> WrongKey:
        return WrongKey(f"{key}.csv", what, where)

    try:
        units = TIMES, UNITS[key.rpartition(".")[2]]
        (times, values), lines = read_columns(path, (table.time, table.value), units)
    except (UsageError, LibraryMissing) as error:
        raise refuse(error.what, error.where) from error
    back = np.flatnonzero(np.diff(times) <= 0)
    if len(back):
        row = int(back[0]) + 1
        what = f"times must grow: {times[row]:g} s follows {times[row - 1]:g} s"
        raise refuse(what, f"{path}:{lines[row]}")
    return Series(times, values)


def _apply_direction(found: Series, table: SeriesTable, key: str, vector: bool) -> Series:
    """Numbers times the direction for a vector quantity; refuses what does not fit."""
    is_vector = found.values.ndim == 2
    if table.direction is not None:
        if not vector or is_vector:
            raise WrongKey(f"{key}.direction", "only numbers of a force are directed")
        return Series(found.times, found.values[:, None] * np.array(table.direction))
    if vector and not is_vector:
        raise WrongKey(key, "a force is a vector: give vectors, or direction = [...]")
    if is_vector and not vector:
        raise WrongKey(key, "must be numbers, not vectors")
    return found
