"""Tables of numbers as laboratories, loggers and spreadsheets write them.

Cells are separated by commas, semicolons, tabs or blanks; where not by commas, a comma may be the
decimal sign.  What stands above the line that names the columns is skipped.  A unit stands behind
a column's name or in a row below it.  Text is UTF-8, UTF-16 with its mark, or Windows-1252;
lines that begin with # are comments.  Of an .xlsx file the first sheet is read.
"""

import csv
import io
import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from errno import EINVAL
from functools import partial
from importlib import import_module
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trackbed.errors import LibraryMissing, UsageError

Floats = NDArray[np.float64]

SPREADSHEET = ".xlsx"
PREAMBLE_MOST = 200
"""Lines that are looked through for the one that names the columns."""

SI = {
    "s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0, "h": 3600.0,
    "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6,
    "N": 1.0, "kN": 1e3, "MN": 1e6, "Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9,
    "m/s": 1.0, "mm/s": 1e-3, "km/h": 1 / 3.6, "m/s2": 1.0, "m/s^2": 1.0, "g": 9.80665,
    "rad": 1.0, "deg": np.pi / 180, "°": np.pi / 180, "rad/s": 1.0, "Hz": 1.0, "%": 1e-2,
    "-": 1.0, "1": 1.0,
}  # fmt: skip
"""Units that a table may give, and what one of them is in SI."""
TIMES = ("s", "ms", "us", "µs", "min", "h")
BRACKETED = re.compile(r"(.*?),?\s*[\[(]\s*([^\])]*?)\s*[\])]\s*")
"""A name with a unit in brackets, known or not."""
FACTOR = re.compile(
    r"[x\u00d7*\u00b7/]\s*1[0e]|10\s*(\^|\*\*)|\b1e[+-]?\d|in\s+10{2,}\b|\b(log(10)?|lg|ln)\b|"
    r"(?<![a-z])(thousand|million|tausend|tsd|mio|kcycle|tenth|hundredth)",
    re.IGNORECASE,
)
"""Signs in a column's name that its numbers are to be multiplied, or are logarithms."""
LABEL = re.compile(r"([^\[\]()]*[^\d.,])?[\d.,]+\s*(kPa|MPa|Pa|kN|MN|N|Hz)")
"""What a specimen was tested at, such as ``70 kPa``: no settlement is in it."""
MARKS = "' \u2019\u00a0\u2009\u202f"
"""Apostrophes and blanks, which mark thousands and nothing else."""
GROUPS = re.compile(rf"([+-]?\d{{1,3}}(?:[{MARKS}]\d{{3}})+)(?=[.,]|$)(.*)")
"""A number whose thousands are marked by apostrophes or blanks."""


@dataclass(frozen=True)
class Table:
    """Rows of text cells, k of them, as long as the header."""

    path: Path
    header: list[str]  # empty for a table of two columns that has none
    header_line: int
    units: list[str]
    """Cells of a row of units below the header, without brackets; [] where there is none."""
    lines: list[int]  # line of each row in the file, for those who have to look there
    rows: list[list[str]]
    decimal_comma: bool
    """True where a comma may stand for a decimal point, as it separates no cells."""

    def where(self, row: int, column: str = "") -> str:
        """Place of a row, as errors name it."""
        return f"{self.path}:{self.lines[row]}" + (f", column {column}" if column else "")

    def split_title(self, place: int, units: Collection[str]) -> tuple[str, str]:
        """Name of a column in lower case, and its unit, empty where none of ``units`` is known."""
        title = self.header[place]
        pattern = "|".join(map(re.escape, sorted(units, key=len, reverse=True)))
        found = re.fullmatch(
            rf"(.+?)(?:\s*[\[(]\s*|[\s_,/]+(?:in\s+)?)({pattern})\s*[\])]?", title, re.IGNORECASE
        )
        if found:
            return found[1].lower(), found[2]
        unit = self.units[place] if self.units else ""
        return title.lower(), unit if unit.lower() in {one.lower() for one in units} else ""

    def find_unit(self, place: int) -> str:
        """What stands in brackets behind a column's name, if no `LABEL`, else in the row of units;
        or nothing."""
        bracketed = BRACKETED.fullmatch(self.header[place])
        if bracketed and not LABEL.fullmatch(bracketed[2]):
            return bracketed[2]
        return self.units[place] if self.units else ""

    def read_numbers(self, places: Sequence[int], names: Sequence[str]) -> Floats:
        """Columns as numbers, shape (columns, k); ``names`` for errors.

        Raises `UsageError`, with line and column, for what is no number or not finite, and where
        a point may be a decimal sign or a mark for thousands.
        """
        columns = [[row[place] for row in self.rows] for place in places]
        columns = self._unify_signs(columns, names)
        try:
            numbers = np.array([list(map(float, cells)) for cells in columns])
            if np.isfinite(numbers).all():
                return numbers
        except ValueError:
            pass  # which one it is, is looked for in both cases
        row, place, kind = next(
            (row, place, "a finite number" if is_number(cell) else "a number")
            for row, cells in enumerate(zip(*columns, strict=True))
            for place, cell in enumerate(cells)
            if not is_number(cell) or not isfinite(float(cell))
        )
        raise UsageError(
            f"'{columns[place][row].strip()}' is not {kind}", where=self.where(row, names[place]),
            remedy=("below the header a row is a reading: leave out what is none" if row else
                    "a row of units has one word a column: write others into the header, such as "
                    "settlement [mm], and their factors into the numbers")
            + (", and write no marks for thousands" if "," in columns[place][row] else ""),
        )  # fmt: skip

    def _unify_signs(self, columns: list[list[str]], names: Sequence[str]) -> list[list[str]]:
        """The cells with decimal points and without marks for thousands."""
        every = "".join(map("".join, columns))
        if any(mark in every for mark in MARKS):
            plain = partial(GROUPS.sub, lambda it: re.sub(r"[^\d+-]", "", it[1]) + it[2])
            columns = [[plain(cell.strip()) for cell in one] for one in columns]
        if "," not in every:
            return columns
        both = next((c for cells in columns for c in cells if "," in c and "." in c), "")
        if not self.decimal_comma:  # commas that separate no cells stand in quotes, beside points
            both = both or ("." if "." in every else "")
            if not both:
                return columns
        comma = self.decimal_comma and both.rfind(",") >= both.rfind(".")
        sign, mark = (",", ".") if comma else (".", ",")
        for name, cells in zip(names, columns, strict=True):
            for row, cell in enumerate(cells):
                head, _, tail = cell.strip().partition(sign)
                grouped = re.fullmatch(rf"[+-]?\d{{1,3}}(\{mark}\d{{3}})+", head)
                if mark in head + tail and not (both and grouped and mark not in tail):
                    what = "a point, and other numbers have a decimal comma"
                    raise UsageError(
                        f"'{cell.strip()}' has {what if comma else 'a comma out of its place'}",
                        where=self.where(row, name),
                        remedy="write numbers with one decimal sign and no marks for thousands",
                    )
        return [[c.replace(mark, "").replace(sign, ".") for c in cells] for cells in columns]


def read_table(path: Path, wanted: Sequence[Collection[str]] = ()) -> Table:
    """Header and rows of a file.

    ``wanted``: for each column that is looked for the names, in lower case, it may have; the first
    line that has one of each is the header, and the lines above it are skipped.

    Raises `UsageError` for a file that can not be read, is no text, or has rows of other lengths.
    """
    try:
        if path.is_char_device():
            raise OSError(EINVAL, "it is a device without an end")
        if path.suffix.lower() == SPREADSHEET:
            return _make_table(path, *_read_spreadsheet(path), wanted, comma=True)
        text = _decode_text(path.read_bytes())
        skipped, separator = _find_header(text, wanted)
        lines, rows = _split_rows(text, separator, skipped)
    except OSError as error:
        raise UsageError(
            f"can not read the series ({error.strerror})", where=str(path),
            remedy="give a table, a run folder or dumps that are there and may be read",
        ) from error  # fmt: skip
    except (ValueError, csv.Error) as error:
        raise UsageError(
            f"this is no text table ({error})",
            where=str(path),
            remedy="write text in UTF-8, one row a line; a dump must not be named .csv",
        ) from error
    return _make_table(path, lines, rows, wanted, comma=separator != ",")


def read_columns(
    path: Path | Table, names: Sequence[str], quantities: Sequence[Collection[str]]
) -> tuple[Floats, list[int]]:
    """Columns of a table, or its file, in SI units, shape (columns, k), and the line of each row.

    ``names``: of the columns, with or without the unit that stands behind them; ``quantities``:
    the units of `SI` that each may have.  Without a unit numbers are in SI units.  Raises
    `UsageError`.
    """
    wanted = [(name.strip().lower(),) for name in names]
    table = path if isinstance(path, Table) else read_table(path, wanted)
    places, factors = [], []
    for name, units in zip(names, quantities, strict=True):
        place = find_column(table, (name.strip().lower(),), units)
        unit, title = table.find_unit(place), table.header[place]
        found = table.split_title(place, units)[1]
        if not unit and (title.lower() != name.strip().lower() or found[1:]):
            unit = found  # named in full, x_h may be a name and x_kN is none
        if unit and unit not in units:
            raise UsageError(
                f"the column {table.header[place]} is in {unit}, which is not known here",
                where=f"{table.path}:{table.header_line}",
                remedy=f"the units are {', '.join(units)}; without one numbers are in SI units",
            )
        places.append(place)
        factors.append(SI[unit] if unit else 1.0)
    if not table.rows:
        remedy = "give a row for each instant"
        raise UsageError("it has no rows", where=str(table.path), remedy=remedy)
    return table.read_numbers(places, names) * np.array(factors)[:, None], table.lines


def find_column(table: Table, names: Sequence[str], units: Collection[str]) -> int:
    """Place of the column that has one of the ``names``, in lower case, the first ones first.

    Raises `UsageError` when there is none, or two, or its numbers are to be multiplied.
    """
    titles = [table.split_title(place, units)[0] for place in range(len(table.header))]
    for name in names:
        found = [
            place
            for place, title in enumerate(table.header)
            if name in _list_names(title, titles[place])
        ]
        where = f"{table.path}:{table.header_line}"
        if len(found) > 1:
            raise UsageError(
                f"there are two columns {name}", where=where, remedy="name each column once"
            )
        if found:
            title, unit = table.header[found[0]], table.find_unit(found[0])
            if FACTOR.search(title) or (unit not in SI and re.search(r"\d|^[kM]$", unit)):
                raise UsageError(
                    f"the numbers of the column {title} have a factor, which is not read",
                    where=where, remedy="write them out, and name the column without it",
                )  # fmt: skip
            return found[0]
    near = [one for title in titles for one in get_close_matches(title, names, n=1)]
    if len(names) == 1:
        near = get_close_matches(names[0], titles, n=1)
    raise UsageError(
        f"there is no column {names[0]} among {', '.join(table.header) or 'columns without names'}"
        + (f"; did you mean {near[0]}?" if near else ""),
        where=f"{table.path}:{table.header_line}",
        remedy="the first line names the columns",
    )


def is_number(text: str, comma: bool = False) -> bool:
    """Whether a cell is a number, with a decimal ``comma`` if that may be."""
    try:
        float(text.replace(",", ".") if comma else text)
    except ValueError:
        return False
    return True


def _list_names(title: str, split: str) -> set[str]:
    """Names that a column answers to: its title, with and without its unit."""
    bracketed = BRACKETED.fullmatch(title)
    return {title.lower(), split, *([bracketed[1].lower()] if bracketed else [])}


def _decode_text(data: bytes) -> str:
    """Text of a file; raises `UnicodeError` for what is none."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data.decode("utf-16")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252")


def _find_header(text: str, wanted: Sequence[Collection[str]]) -> tuple[int, str]:
    """Lines above the header, and what separates its cells.

    Raises `UnicodeError` where the first line is no text.
    """
    stream = io.StringIO(text, newline=None)
    first = next((line for line in stream if line.strip() and line.lstrip()[0] != "#"), "")
    if not first.expandtabs().strip().isprintable():
        raise UnicodeError("it has signs that are no letters")
    stream.seek(0)
    for number, line in enumerate(stream):
        if number >= PREAMBLE_MOST or not wanted:
            break
        for separator in ";\t,":
            cells = line.split(separator)
            if len(cells) >= len(wanted) and _has_all_names(cells, wanted):
                return number, separator
    return 0, next((mark for mark in ";\t," if mark in first), " ")


def _has_all_names(cells: Sequence[str], wanted: Sequence[Collection[str]]) -> bool:
    """Whether the cells of a line name all columns that are looked for."""
    names: set[str] = set()
    for cell in cells:
        title = cell.strip().strip('"').strip()
        names |= _list_names(title, re.sub(r"[\s_,/]+(in\s+)?[^\s_,/]+$", "", title).lower())
    return all(any(name in names for name in one) for one in wanted)


def _split_rows(text: str, separator: str, skipped: int) -> tuple[list[int], list[list[str]]]:
    """Line numbers and cells of the rows that are neither empty nor a comment."""
    stream = io.StringIO(text, newline=None)
    for _ in range(skipped):
        stream.readline()
    reader = csv.reader(
        (line.strip() + "\n" for line in stream) if separator == " " else stream,
        delimiter=separator,
        skipinitialspace=True,
        strict=True,
    )
    lines, rows = [], []
    for row in reader:
        if "".join(row).strip() and not row[0].lstrip().startswith("#"):
            lines.append(reader.line_num + skipped)
            rows.append(row)
    return lines, rows


def _read_spreadsheet(path: Path) -> tuple[list[int], list[list[str]]]:
    """Rows of the first sheet, by number, as texts."""
    try:
        openpyxl: Any = import_module("openpyxl")
    except ImportError as error:
        raise LibraryMissing(
            "reading a spreadsheet needs openpyxl", where=str(path),
            remedy="pip install openpyxl, or save the sheet as CSV",
        ) from error  # fmt: skip
    try:
        sheet = openpyxl.load_workbook(path, read_only=True, data_only=True).worksheets[0]
        rows = [["" if v is None else str(v) for v in row] for row in sheet.values]
    except OSError:
        raise
    except Exception as error:  # whatever a damaged archive makes of it
        raise ValueError(error) from error
    kept = [(number, row) for number, row in enumerate(rows, 1) if any(row)]
    return [number for number, _ in kept], [row for _, row in kept]


def _make_table(
    path: Path, lines: list[int], rows: list[list[str]], wanted: Sequence[Collection[str]],
    *, comma: bool,
) -> Table:  # fmt: skip
    """Rows as a table: header, units, and rows that are all as long."""
    remedy = "the first line names the columns, and every row below it has a cell for each"
    if path.suffix.lower() == SPREADSHEET and wanted:
        first = next((i for i, row in enumerate(rows) if _has_all_names(row, wanted)), 0)
        lines, rows = lines[first:], rows[first:]
    if not rows:
        raise UsageError("the file is empty", where=str(path), remedy=remedy)
    header = [cell.strip() for cell in rows[0]]
    if len(header) == 2 and all(is_number(cell, comma) for cell in header):
        header = []
    for line, cells in zip(lines, rows, strict=True):
        if len(cells) != len(rows[0]):
            raise UsageError(
                f"{len(cells)} cells under a header of {len(rows[0])}",
                where=f"{path}:{line}", remedy=remedy,
            )  # fmt: skip
    start = 1 if header else 0
    units = [cell.strip().strip("[]()").strip() for cell in rows[1]] if header and rows[1:] else []
    if units and set(units) <= {*SI, ""} and any(u and not is_number(u) for u in units):
        start = 2
    else:
        units = []
    return Table(path, header, lines[0], units, lines[start:], rows[start:], comma)
