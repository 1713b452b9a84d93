"""A table of cycles and settlement as laboratories, loggers and spreadsheets write them."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from math import isfinite
from pathlib import Path

import numpy as np

from adapters.errors import UsageError
from adapters.settlement_series import UNKNOWN, Series
from adapters.state import FloatArray

SUFFIXES = (".csv", ".tsv", ".txt", ".dat")
"""Names of tables; all but the first may be dumps too, which begin with ``ITEM:``."""
UNITS = {"m": "m", "cm": "cm", "mm": "mm", "um": "um", "µm": "um", "μm": "um", "%": "%", "-": "1"}
"""Units a header may give, as in ``settlement_mm`` or ``Settlement [mm]``, and their names."""
CYCLE_NAMES = ("cycle", "cycles", "n")
SETTLEMENT_NAMES = {"settlement": "m", "strain": "1", "axial strain": "1"}
"""Columns that are found without being named, and their unit where neither header nor user gives
one; of other columns, and of a table without a header, it is then not known."""
KINDS = ("computed", "healing", "jumped")
"""What a row of a run's table may be; only computed ones are data for a law."""
REMEDY = (
    "the first line names the columns, such as cycle,settlement or cycle,settlement_mm (units are "
    "m, cm, mm, um, %); for other names: --columns CYCLE SETTLEMENT"
)
NAME_AND_UNIT = re.compile(
    rf"(.+?)(?:\s*[\[(]\s*|[\s_,/]+(?:in\s+)?)({'|'.join(UNITS)})\s*[\])]?", re.IGNORECASE
)


BRACKETED = re.compile(r"[\[(]\s*([^\])]+?)\s*[\])]")
"""A unit in brackets, known or not."""
STRAIN = "strain is told by 1 or %"


@dataclass(frozen=True)
class Table:
    """Rows of text cells, k of them, as long as the header."""

    path: Path
    header: list[str]
    """Empty for a table of two columns that has none."""
    header_line: int
    lines: list[int]
    """Line of each row in the file, for those who have to look there."""
    rows: list[list[str]]
    decimal_comma: bool
    """True where a comma may stand for a decimal point, as it separates no cells."""

    def where(self, row: int, column: str = "") -> str:
        """Place of a row, as errors name it."""
        return f"{self.path}:{self.lines[row]}" + (f", column {column}" if column else "")


def series_of_table(path: Path, names: Sequence[str] = (), unit: str | None = None) -> Series:
    """The series of a text table; ``names`` are the two columns, where they are not the usual ones.

    ``unit`` is the settlement's, one of `UNITS`, where the header does not give it.

    Cells are separated by commas, semicolons, tabs or blanks, whichever the first line has; where
    not by commas, a comma may be the decimal sign.  Columns are `CYCLE_NAMES` and
    `SETTLEMENT_NAMES`, with a unit behind them; two columns of numbers need no header.  Rows may
    be in any order.  Of a column ``kind`` only rows ``computed`` are taken; other columns and
    lines that begin with # are ignored.  Text is UTF-8, UTF-16 with its mark, or Windows-1252.

    Raises `UsageError`, which names line and column, for what is no number or not finite, negative
    cycles and a cycle that is given twice: what such rows mean only their author knows; and for a
    ``unit`` that is not the header's.
    """
    table = _table(path)
    places, unit = _columns(table, names, unit)
    if "kind" in places:
        table = _computed_rows(table, places["kind"])
    if not table.rows:
        raise UsageError("there is no computed cycle in the table", where=str(path))
    names = ["cycle", table.header[places["settlement"]] if table.header else "settlement"]
    cycle, settlement = _numbers(table, [places["cycle"], places["settlement"]], names)
    if cycle.min() < 0:
        row = int(np.argmax(cycle < 0))
        raise UsageError(f"cycle {cycle[row]:g} is negative", where=table.where(row, "cycle"))
    order = np.argsort(cycle, kind="stable")
    cycle, settlement = cycle[order], settlement[order]
    again = np.flatnonzero(np.diff(cycle) == 0)
    if len(again):
        first, second = (int(order[again[0] + step]) for step in (0, 1))
        raise UsageError(
            f"cycle {cycle[again[0]]:g} was given in line {table.lines[first]} already",
            where=table.where(second, "cycle"),
            remedy="keep one reading of a cycle; stages whose count starts anew: a file each",
        )
    return Series(cycle, settlement, unit)


def _table(path: Path) -> Table:
    """Header and rows of a file."""
    try:
        text = _text(path.read_bytes())
        stream = io.StringIO(text, newline=None)
        first = next((line for line in stream if line.strip() and line.lstrip()[0] != "#"), "")
        if not first.expandtabs().strip().isprintable():
            raise UnicodeError("it has signs that are no letters")
        separator = next((mark for mark in ";\t," if mark in first), " ")
        lines, rows = _rows(text, separator)
    except OSError as error:
        raise UsageError(f"can not read the series ({error.strerror})", where=str(path)) from error
    except (UnicodeError, csv.Error) as error:
        raise UsageError(
            f"this is no text table ({error})",
            where=str(path),
            remedy="write text in UTF-8, one row a line; a dump must not be named .csv",
        ) from error
    if not rows:
        raise UsageError("the file is empty", where=str(path), remedy=REMEDY)
    header = [cell.strip() for cell in rows[0]]
    comma = separator != ","
    if len(header) == 2 and all(_is_number(cell, comma) for cell in header):
        header = []
    for line, cells in zip(lines, rows, strict=True):
        if len(cells) != len(rows[0]):
            raise UsageError(
                f"{len(cells)} cells under a header of {len(rows[0])}",
                where=f"{path}:{line}",
                remedy=REMEDY,
            )
    start = 1 if header else 0
    return Table(path, header, lines[0], lines[start:], rows[start:], comma)


def _text(data: bytes) -> str:
    """Text of a file; raises `UnicodeError` for what is none."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252")


def _rows(text: str, separator: str) -> tuple[list[int], list[list[str]]]:
    """Line numbers and cells of the rows that are neither empty nor a comment."""
    stream = io.StringIO(text, newline=None)
    reader = csv.reader(
        (line.strip() + "\n" for line in stream) if separator == " " else stream,
        delimiter=separator,
        skipinitialspace=True,
        strict=True,
    )
    lines, rows = [], []
    for row in reader:
        if "".join(row).strip() and not row[0].lstrip().startswith("#"):
            lines.append(reader.line_num)
            rows.append(row)
    return lines, rows


def _columns(table: Table, names: Sequence[str], told: str | None) -> tuple[dict[str, int], str]:
    """Places of the columns cycle, settlement and, if there, kind; and the unit.

    ``told`` is the unit that the user gives.
    """
    if told is not None:
        told = UNITS.get(told.strip().lower(), told)
    if told is not None and told not in UNITS.values():
        raise UsageError(
            f"{told} is no unit of settlement or strain",
            remedy=f"the units are {', '.join(dict.fromkeys(UNITS.values()))}; 1 is plain strain",
        )
    if not table.header:
        return {"cycle": 0, "settlement": 1}, told or UNKNOWN
    split = [_name_and_unit(name) for name in table.header]
    places: dict[str, int] = {}
    wanted = {"cycle": CYCLE_NAMES, "settlement": tuple(SETTLEMENT_NAMES), "kind": ("kind",)}
    wanted |= {column: (name.strip().lower(),) for column, name in zip(wanted, names, strict=False)}
    where = f"{table.path}:{table.header_line}"
    for column, known in wanted.items():
        for word in known:
            found = [
                place
                for place, (name, _) in enumerate(split)
                if word in (name, table.header[place].lower())
            ]
            if len(found) > 1:
                raise UsageError(f"there are two columns {word}", where=where, remedy=REMEDY)
            if found:
                places[column] = found[0]
                break
        if column not in places and column != "kind":
            words = [name for name, _ in split]
            near = [m for word in words for m in get_close_matches(word, known, n=1)]
            if names:
                near = get_close_matches(known[0], words, n=1)
            raise UsageError(
                f"there is no column {known[0]} among {', '.join(table.header)}"
                + (f"; did you mean {near[0]}?" if near else ""),
                where=where,
                remedy=REMEDY,
            )
    name, unit = split[places["settlement"]]
    if told and unit and told != unit:
        raise UsageError(
            f"the column {table.header[places['settlement']]} is in {unit}, not in {told}",
            where=where,
            remedy="leave --unit out",
        )
    title = table.header[places["settlement"]]
    if told and SETTLEMENT_NAMES.get(name) == "1" and told not in ("1", "%"):
        raise UsageError(f"the column {title} has no length, {told}", where=where, remedy=STRAIN)
    if told and not unit and (given := BRACKETED.search(title)):
        raise UsageError(
            f"the column {title} is in {given[1]}, which is not known, and not in {told}",
            where=where,
            remedy="convert it, or name the column without a unit",
        )
    return places, unit or told or SETTLEMENT_NAMES.get(name, UNKNOWN)


def _name_and_unit(title: str) -> tuple[str, str]:
    """``Settlement [mm]`` to ``("settlement", "mm")``; no unit where none is known."""
    found = NAME_AND_UNIT.fullmatch(title)
    return (found[1].lower(), UNITS[found[2].lower()]) if found else (title.lower(), "")


def _computed_rows(table: Table, place: int) -> Table:
    """The table without rows that no engine computed and without transients."""
    kinds = [row[place].strip() for row in table.rows]
    for row, kind in enumerate(kinds):
        if kind not in KINDS:
            raise UsageError(
                f"'{kind}' is no kind of row",
                where=table.where(row, "kind"),
                remedy=f"the kinds are {', '.join(KINDS)}",
            )
    kept = [row for row, kind in enumerate(kinds) if kind == "computed"]
    lines, rows = [table.lines[row] for row in kept], [table.rows[row] for row in kept]
    return replace(table, lines=lines, rows=rows)


def _numbers(table: Table, places: Sequence[int], names: Sequence[str]) -> FloatArray:
    """Columns as numbers, shape (columns, k)."""
    columns = [[row[place] for row in table.rows] for place in places]
    if table.decimal_comma and any("," in cell for cells in columns for cell in cells):
        for name, cells in zip(names, columns, strict=True):
            row = next((row for row, cell in enumerate(cells) if "." in cell), -1)
            if row >= 0:
                raise UsageError(
                    f"'{cells[row]}' has a point, and other numbers have a decimal comma",
                    where=table.where(row, name),
                    remedy="write numbers with one decimal sign and no marks for thousands",
                )
        columns = [[cell.replace(",", ".") for cell in cells] for cells in columns]
    try:
        numbers = np.array([list(map(float, cells)) for cells in columns])
        if np.isfinite(numbers).all():
            return numbers
    except ValueError:
        pass  # which one it is, is looked for in both cases
    row, place, kind = next(
        (row, place, "a finite number" if _is_number(cell) else "a number")
        for row, cells in enumerate(zip(*columns, strict=True))
        for place, cell in enumerate(cells)
        if not _is_number(cell) or not isfinite(float(cell))
    )
    raise UsageError(
        f"'{columns[place][row].strip()}' is not {kind}",
        where=table.where(row, names[place]),
        remedy="below the header a row is a reading: leave out what is none",
    )


def _is_number(text: str, comma: bool = False) -> bool:
    try:
        float(text.replace(",", ".") if comma else text)
    except ValueError:
        return False
    return True
