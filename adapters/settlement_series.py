"""A settlement series, one value a cycle, read from a CSV file, a run folder or dumps."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from math import isfinite
from pathlib import Path

import numpy as np

from adapters.errors import UsageError
from adapters.state import FloatArray

UNITS = ("m", "cm", "mm", "um")
"""Units a header may give, as in ``settlement_mm``; without one it is m."""
KINDS = ("computed", "healing", "jumped")
"""What a row of a run's table may be; only computed ones are data for a law."""


@dataclass(frozen=True)
class Series:
    """Settlement at ascending cycles, k of them."""

    cycle: FloatArray
    """Load cycles done, not always whole numbers, none twice, shape (k,)."""
    settlement: FloatArray
    """Settlement, positive downwards, in ``unit``, shape (k,)."""
    unit: str = "m"

    def since(self, cycle: float) -> Series:
        """The rows from ``cycle`` on, to leave out a bedding-in that no law describes."""
        rows = self.cycle >= cycle
        return Series(self.cycle[rows], self.settlement[rows], self.unit)


def series_read(paths: Sequence[Path], steps_per_cycle: float | None = None) -> Series:
    """The series of one CSV file, one run folder, or dumps with one frame a cycle end.

    Dumps may be one file of many frames or many files, taken in natural order of their names
    (``2.dump`` before ``10.dump``); a frame that repeats the time step before it is skipped.
    Settlement is the drop of the mean height of the grains since the first frame.  Frames are
    cycles 0, 1, 2 ...; with ``steps_per_cycle`` their time step counts: give it when the first
    frame is not the start of the loading.

    Raises `UsageError` or `DumpError`, naming file, line and column.
    """
    if not paths:
        raise UsageError("no series was named", remedy="give a CSV file, a run folder or dumps")
    alone = len(paths) == 1
    if alone and paths[0].is_dir():
        return series_of_csv(paths[0] / "settlement.csv")
    if alone and paths[0].suffix.lower() == ".csv":
        return series_of_csv(paths[0])
    for path in paths:
        if path.is_dir() or path.suffix.lower() == ".csv":
            raise UsageError(
                "only dumps can be joined to one series",
                where=str(path),
                remedy="give one CSV file, or one run folder, or dumps",
            )
    return series_of_dumps(paths, steps_per_cycle)


def series_of_csv(path: Path) -> Series:
    """Columns ``cycle`` and ``settlement`` (m) or ``settlement_UNIT`` of a CSV file.

    Rows may be in any order.  Of a column ``kind`` only rows ``computed`` are taken; other
    columns and lines that begin with # are ignored.
    """
    try:
        rows = list(_csv_rows(path))
    except OSError as error:
        raise UsageError(f"can not read the series ({error.strerror})", where=str(path)) from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise UsageError(
            f"this is not a text file of comma-separated values ({error})",
            where=str(path),
            remedy="a dump must not be named .csv",
        ) from error
    if not rows:
        raise UsageError("the file is empty", where=str(path), remedy=_REMEDY)
    (header_line, header), *body = rows
    columns, unit = _columns(header, f"{path}:{header_line}")
    lines: dict[float, int] = {}
    values: list[tuple[float, float]] = []
    for line, cells in body:
        where = f"{path}:{line}"
        if len(cells) != len(header):
            raise UsageError(
                f"{len(cells)} cells under a header of {len(header)}", where=where, remedy=_REMEDY
            )
        if not _computed(cells, columns.get("kind"), where):
            continue
        cycle = _number(cells[columns["cycle"]], f"{where}, column cycle")
        settlement_name = header[columns["settlement"]]
        settlement = _number(cells[columns["settlement"]], f"{where}, column {settlement_name}")
        if cycle < 0:
            raise UsageError(f"cycle {cycle:g} is negative", where=f"{where}, column cycle")
        if cycle in lines:
            raise UsageError(
                f"cycle {cycle:g} was given in line {lines[cycle]} already",
                where=f"{where}, column cycle",
            )
        lines[cycle] = line
        values.append((cycle, settlement))
    if not values:
        raise UsageError("there is no computed cycle in the table", where=str(path))
    table = np.array(sorted(values))
    return Series(table[:, 0], table[:, 1], unit)


def series_of_dumps(paths: Sequence[Path], steps_per_cycle: float | None = None) -> Series:
    """Settlement of the same grains in every frame of dumps; see `series_read`."""
    from adapters.dump import dump_frames

    if steps_per_cycle is not None and not (steps_per_cycle > 0 and isfinite(steps_per_cycle)):
        raise UsageError(f"steps per cycle must be positive, not {steps_per_cycle:g}")
    steps: list[int] = []
    heights: list[float] = []
    grains: FloatArray | None = None
    for path in sorted(paths, key=_natural):
        for frame in dump_frames(path):
            where = f"{path}, time step {frame.time_step}"
            identifiers = frame.column("id")
            if grains is None:
                grains = identifiers
            elif not np.array_equal(grains, identifiers):
                raise UsageError(
                    "the grains are not those of the first frame",
                    where=where,
                    remedy="give dumps of one sample, from the start of its loading on",
                )
            if steps and frame.time_step == steps[-1]:
                continue
            if steps and frame.time_step < steps[-1]:
                raise UsageError(
                    f"the time step falls from {steps[-1]}",
                    where=where,
                    remedy="name the files so that their numbers ascend with time",
                )
            steps.append(frame.time_step)
            heights.append(float(frame.column("z").mean()))
    if steps_per_cycle is None:
        cycle = np.arange(len(steps), dtype=float)
    else:
        cycle = np.array(steps) / steps_per_cycle
    return Series(cycle, heights[0] - np.array(heights))


_REMEDY = "the first line names the columns, such as cycle,settlement or cycle,settlement_mm"


def _csv_rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Line number and stripped cells of each row that is neither empty nor a comment."""
    with path.open(encoding="utf-8-sig", newline="") as stream:
        reader = csv.reader(stream, strict=True)
        for row in reader:
            cells = [cell.strip() for cell in row]
            if any(cells) and not cells[0].startswith("#"):
                yield reader.line_num, cells


def _columns(header: list[str], where: str) -> tuple[dict[str, int], str]:
    """Places of the columns cycle, settlement and, if there, kind; and the unit."""
    names = [name.lower() for name in header]
    spelled = {"settlement": "m"} | {f"settlement_{unit}": unit for unit in UNITS}
    found: dict[str, int] = {}
    unit = "m"
    for place, name in enumerate(names):
        column = "settlement" if name in spelled else name
        if column not in ("cycle", "settlement", "kind"):
            continue
        if column in found:
            raise UsageError(f"there are two columns {column}", where=where, remedy=_REMEDY)
        found[column] = place
        unit = spelled.get(name, unit)
    for column, words in (("cycle", ["cycle"]), ("settlement", list(spelled))):
        if column not in found:
            near = [match for name in names for match in get_close_matches(name, words, n=1)]
            raise UsageError(
                f"there is no column {column} among {', '.join(header)}"
                + (f"; did you mean {near[0]}?" if near else ""),
                where=where,
                remedy=f"{_REMEDY}; units are {', '.join(UNITS)}",
            )
    return found, unit


def _computed(cells: list[str], place: int | None, where: str) -> bool:
    """True for a row that the engine computed and that is no transient."""
    if place is None or cells[place] == "computed":
        return True
    if cells[place] not in KINDS:
        raise UsageError(
            f"'{cells[place]}' is no kind of row",
            where=f"{where}, column kind",
            remedy=f"the kinds are {', '.join(KINDS)}",
        )
    return False


def _number(text: str, where: str) -> float:
    try:
        number = float(text)
    except ValueError:
        raise UsageError(f"'{text}' is not a number", where=where) from None
    if not isfinite(number):
        raise UsageError(f"{text} is not a finite number", where=where)
    return number


def _natural(path: Path) -> list[tuple[int, str]]:
    """Sorting key by which 2 comes before 10: digits as numbers, the rest as text."""
    parts = re.findall(r"\d+|\D+", str(path))
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]
