"""A settlement series, and its table as laboratories, loggers and spreadsheets write it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from adapters.bed import FloatArray
from adapters.errors import UsageError
from trackbed.series_file import Table, find_column, read_table

UNKNOWN = "unknown"
"""Unit of numbers that come without one: they may be metres, millimetres or a strain."""


@dataclass(frozen=True)
class Series:
    """Settlement at ascending cycles, k of them."""

    cycle: FloatArray  # load cycles done, not always whole numbers, none twice, shape (k,)
    settlement: FloatArray  # settlement, positive downwards, in ``unit``, shape (k,)
    unit: str = "m"  # m, cm, mm, um, %, 1 (strain), or `UNKNOWN`
    begun: float = 0.0  # settlement before cycle 0, where that is known, in ``unit``
    counted_from: float = 0.0
    """The user's number of cycle 0: the load change that ``cycle`` is counted from."""
    where: str = ""  # file or folder it was read from, for errors
    left_out: int = 0  # rows that `keep_from` and `restart_after` left out
    columns: str = ""  # columns of a table that were taken, and the line that names them, to tell
    doubts: tuple[str, ...] = ()  # what is hardly meant, a sentence each

    @property
    def sinks_from(self) -> float | None:
        """First reading of what is a height: it begins above zero and has sunk by four fifths of
        the range of all readings; None for a settlement, which begins at zero and grows."""
        if len(self.settlement) < 3:
            return None
        first, span = float(self.settlement[0]), float(np.ptp(self.settlement))
        return first if first - self.settlement[-1] > 0.8 * span and first > 0.2 * span else None

    def keep_from(self, cycle: float) -> Series:
        """The rows from the user's ``cycle`` on, to leave out a bedding-in that no law describes.

        Behind `restart_after`, not before it, which takes what settled before from earlier rows.
        """
        return self._keep(self.cycle + self.counted_from >= cycle)

    def restart_after(self, cycle: float) -> Series:
        """The rows behind ``cycle``, counted from there: a changed load starts the law again."""
        rows = self.cycle > cycle
        begun = float(self.settlement[~rows][-1]) if not rows.all() else self.begun
        kept, counted_from = self._keep(rows), self.counted_from + cycle
        return replace(kept, cycle=kept.cycle - cycle, begun=begun, counted_from=counted_from)

    def _keep(self, rows: NDArray[np.bool_]) -> Series:
        return replace(
            self,
            cycle=self.cycle[rows],
            settlement=self.settlement[rows],
            left_out=self.left_out + int((~rows).sum()),
        )


SUFFIXES = (".csv", ".tsv", ".txt", ".dat", ".xlsx")
"""Names of tables; all but the last may be dumps too, which begin with ``ITEM:``."""
UNITS = {"m": "m", "cm": "cm", "mm": "mm", "um": "um", "µm": "um", "μm": "um", "%": "%", "-": "1"}
"""Units a header may give, as in ``settlement_mm`` or ``Settlement [mm]``, and their names."""
CYCLE_NAMES = ("cycle", "cycles", "n")
NO_UNITS = ("", "-", "1", "cycle", "cycles", "n", "no", "no.", "#", "count")
"""What stands behind the name of a column of cycles without being a unit."""
HEIGHT = re.compile(r"height|level|elevation|höhe|hoehe")
"""Names of columns that are no settlement."""
SETTLEMENT_NAMES = {
    "settlement": "m", "loaded_body_settlement": "m", "strain": "1", "axial strain": "1",
}  # fmt: skip
"""Columns that are found without being named, and their unit where neither header nor user gives
one; of other columns, and of a table without a header, it is then not known."""
KINDS = ("computed", "healing", "jumped")
"""What a row of a run's table may be; only computed ones are data for a law."""
STRAY = 10.0
"""Distance of a reading from all others over their range, above which it is none [-]."""
REMEDY = (
    "the first line names the columns, such as cycle,settlement or cycle,settlement_mm (units are "
    "m, cm, mm, um, %); for other names: --columns CYCLE SETTLEMENT"
)
STRAIN = "strain is marked by 1 or %"


def read_table_series(path: Path, names: Sequence[str] = (), unit: str | None = None) -> Series:
    """The series of a table as `trackbed.series_file` reads it.

    ``names`` are the two columns, where they are not the usual ones; ``unit`` is the settlement's,
    one of `UNITS`, where the header does not give it.

    Columns are `CYCLE_NAMES` and `SETTLEMENT_NAMES`, with a unit behind them; two columns of
    numbers need no header.  Rows may be in any order.  Of a column ``kind`` only rows ``computed``
    are taken; other columns are ignored.

    Raises `UsageError`, which names line and column, for what is no number or not finite, negative
    cycles and a cycle that is given twice: what such rows mean only their author knows; and for a
    ``unit`` that is not the header's.
    """
    unit = _name_unit(unit)
    wanted: list[tuple[str, ...]] = [CYCLE_NAMES, tuple(SETTLEMENT_NAMES)]
    if names:
        wanted = [(name.strip().lower(),) for name in names]
    table = read_table(path, wanted)
    places, title = [0, 1], "settlement"
    if table.header:
        try:
            places = [find_column(table, one, UNITS) for one in wanted]
            kinds = [table.split_title(n, UNITS)[0] == "kind" for n in range(len(table.header))]
            _check_counts(table, places[0], wanted[0] if names else ())
            if any(kinds):
                table = _select_computed(table, find_column(table, ("kind",), UNITS))
        except UsageError as error:
            remedy = REMEDY if "no column" in error.what else error.remedy
            raise UsageError(error.what, where=error.where, remedy=remedy) from None
        title = table.header[places[1]]
        unit = _find_unit(table, places[1], unit)
    if not table.rows:
        raise UsageError(
            "there is no computed cycle in the table", where=str(path),
            remedy="a reading is a row of cycle and settlement below the header; of a run's table "
            "only rows of the kind computed are",
        )  # fmt: skip
    cycle, settlement = table.read_numbers(places, ("cycle", title))
    _refuse_doubtful_cycles(table, places)
    if cycle.min() < 0:
        row = int(np.argmax(cycle < 0))
        raise UsageError(
            f"cycle {cycle[row]:g} is negative", where=table.where(row, "cycle"),
            remedy="count cycles from the start of the loading, which is cycle 0",
        )  # fmt: skip
    order = np.argsort(cycle, kind="stable")
    cycle, settlement = cycle[order], settlement[order]
    again = np.flatnonzero(np.diff(cycle) == 0)
    if len(again):
        first, second = (int(order[again[0] + step]) for step in (0, 1))
        raise UsageError(
            f"cycle {cycle[again[0]]:g} was given in line {table.lines[first]} already",
            where=table.where(second, "cycle"),
            remedy="keep one reading of a cycle; a file for each stage whose count starts again",
        )
    _refuse_stray_reading(table, settlement, order, title)
    source = ""
    if table.header:
        source = " and ".join(table.header[place] for place in places)
        source += f", named in line {table.header_line}" + (" with units below" * bool(table.units))
    return Series(cycle, settlement, unit or UNKNOWN, columns=source)


def _refuse_stray_reading(
    table: Table, settlement: FloatArray, order: NDArray[np.intp], title: str
) -> None:
    """Refuse a reading that lies `STRAY` ranges of all others away, as loggers write -999 for none;
    the first may, as a bed finds its seat, and the last one downwards, as it fails."""
    extremes = (int(settlement.argmin()), int(settlement.argmax())) if len(settlement) > 4 else ()
    for row in extremes:
        others = np.delete(settlement, row)
        away = float(np.abs(others - settlement[row]).min(initial=np.inf))
        failed = row == len(settlement) - 1 and settlement[row] > others.max()
        if row > 0 and not failed and 0 < STRAY * float(np.ptp(others)) < away:
            raise UsageError(
                f"{settlement[row]:g} is no neighbour of the other readings, which lie between "
                f"{others.min():g} and {others.max():g}", where=table.where(int(order[row]), title),
                remedy="leave the row out if it marks a missing reading",
            )  # fmt: skip


def _name_unit(given: str | None) -> str | None:
    """The unit that the user gives, by its name in `UNITS`."""
    unit = None if given is None else UNITS.get(given.strip().lower(), given)
    if unit is not None and unit not in UNITS.values():
        raise UsageError(
            f"{unit} is no unit of settlement or strain",
            remedy=f"the units are {', '.join(dict.fromkeys(UNITS.values()))}; 1 is plain strain",
        )
    return unit


def _find_unit(table: Table, place: int, given: str | None) -> str:
    """The unit of the settlement: the header's, or the one that the user gives."""
    where = f"{table.path}:{table.header_line}"
    title = table.header[place]
    name, found = table.split_title(place, UNITS)
    unit = UNITS.get(found.lower(), "")
    if given and unit and given != unit:
        raise UsageError(
            f"the column {title} is in {unit}, not in {given}", where=where,
            remedy="leave --unit out",
        )  # fmt: skip
    if given and SETTLEMENT_NAMES.get(name) == "1" and given not in ("1", "%"):
        raise UsageError(f"the column {title} has no length, {given}", where=where, remedy=STRAIN)
    if not unit and (other := table.find_unit(place)):
        raise UsageError(
            f"the column {title} is in {other}, which is not known"
            + (f", and not in {given}" if given else ""), where=where,
            remedy=f"convert it to {', '.join(dict.fromkeys(UNITS.values()))}, or name the column "
            "without what is no unit",
        )  # fmt: skip
    if HEIGHT.search(name):
        raise UsageError(
            f"the column {title} is a height, which falls as the bed settles", where=where,
            remedy="give the first height less each: settlement grows; or the run folder",
        )  # fmt: skip
    return unit or given or SETTLEMENT_NAMES.get(name, UNKNOWN)


def _check_counts(table: Table, place: int, named: Sequence[str]) -> None:
    """Refuse cycles with a unit, unless the user ``named`` the column with it: tonnes, hours."""
    title = table.header[place]
    unit = table.find_unit(place) or table.split_title(place, UNITS)[1]
    if unit.lower() not in NO_UNITS and title.lower() not in named:
        raise UsageError(
            f"the column {title} is in {unit}, and cycles are plain numbers",
            where=f"{table.path}:{table.header_line}",
            remedy=f"give cycles, or name what you count in full: --columns '{title}' ...",
        )


def _refuse_doubtful_cycles(table: Table, places: Sequence[int]) -> None:
    """Refuse cycles such as 1.000 that may be one or a thousand: all decimals are three, and the
    readings do not show (as 0.850 does) that every number of the table is written so."""
    cycles, readings = ([row[place].strip() for row in table.rows] for place in places)
    signs = "[.,]" if table.decimal_comma else "[.]"
    broken = [row for row, cell in enumerate(cycles) if re.search(signs, cell)]
    doubtful = all(re.fullmatch(rf"[1-9]\d{{0,2}}{signs}\d{{3}}", cycles[row]) for row in broken)
    rounded = all(re.fullmatch(r"[+-]?\d+[.,]\d{3}", cell) for cell in readings)
    if broken and doubtful and not (rounded and any(re.match("[+-]?0", r) for r in readings)):
        cell = cycles[broken[0]]
        raise UsageError(
            f"'{cell}' may be {cell.replace(',', '.')} or {re.sub('[.,]', '', cell)} cycles",
            where=table.where(broken[0], "cycle"),
            remedy="write whole cycles without decimals and without marks for thousands",
        )


def _select_computed(table: Table, place: int) -> Table:
    """The table without rows that no engine computed and without transients."""
    kinds = [row[place].strip() for row in table.rows]
    for row, kind in enumerate(kinds):
        if kind not in KINDS:
            raise UsageError(
                f"'{kind}' is no kind of row", where=table.where(row, "kind"),
                remedy=f"the kinds are {', '.join(KINDS)}",
            )  # fmt: skip
    kept = [row for row, kind in enumerate(kinds) if kind == "computed"]
    lines, rows = [table.lines[row] for row in kept], [table.rows[row] for row in kept]
    return replace(table, lines=lines, rows=rows)
