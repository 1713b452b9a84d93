"""Tables of numbers: units, preambles, decimal commas, thousands, spreadsheets."""

from __future__ import annotations

import sys
from math import pi
from pathlib import Path
from types import SimpleNamespace

import pytest

from trackbed.errors import LibraryMissing, UsageError
from trackbed.series_file import SI, TIMES, read_columns, read_table


def columns(path: Path, text: str, names: tuple[str, str] = ("time", "p")) -> list[list[float]]:
    path.write_text(text, encoding="utf-8")
    numbers, _ = read_columns(path, names, (TIMES, tuple(SI)))
    return [row.tolist() for row in numbers]


@pytest.mark.parametrize(
    "text",
    [
        "time,p\n0,1000\n0.5,2000\n",
        "p,time\n1000,0\n2000,0.5\n",
        "time [ms];p [kPa];note\n0;1,0;a, b\n500;2,0;c\n",
        "time (s)\tp, in kPa\n0\t1\n0.5\t2\n",
        "time;p\ns;kPa\n0;1\n0,5;2\n",
        "time;p\n[ms];[MPa]\n0;0,001\n500;0,002\n",
        "time_ms,p_kPa\n0,1\n500,2\n",
        "# by hand\n time   p \n 0   1e3\n .5  2e3\n",
    ],
)
def test_units_and_separators(tmp_path: Path, text: str) -> None:
    """Behind names, in brackets, in a row below; without one numbers are in SI units."""
    assert columns(tmp_path / "a.csv", text) == [[0.0, 0.5], pytest.approx([1e3, 2e3])]


def test_units_are_what_they_are_named_after() -> None:
    """Every one: 36 km/h are 10 m/s, a day of 24 h has 86,400 s, half a turn of 180 deg is pi."""
    known = {
        1: "s m N Pa m/s m/s2 m/s^2 rad rad/s Hz - 1", 1e-3: "ms mm mm/s", 1e-6: "us µs um µm",
        1e-2: "cm %", 60: "min", 86400 / 24: "h", 1e3: "kN kPa", 1e6: "MN MPa", 1e9: "GPa",
        10 / 36: "km/h", pi / 180: "deg °", 9.80665: "g",
    }  # fmt: skip
    expected = {unit: value for value, units in known.items() for unit in units.split()}
    assert pytest.approx(expected, rel=1e-15, abs=0) == SI


@pytest.mark.parametrize(
    ("cells", "value"),
    [
        ("1.234,5;2.000", 1234.5),
        ("1 234,5;2 000,0", 1234.5),
        ("1'234.5;2'000", 1234.5),
        ("1\u00a0234,5;2\u00a0000", 1234.5),
        ("1,234.5;2,000", 1234.5),
        ("1234,5;2000", 1234.5),
        ("-1.234.567,5;2", -1234567.5),
    ],
)
def test_marks_for_thousands(tmp_path: Path, cells: str, value: float) -> None:
    """Read where they can be nothing else."""
    first, second = cells.split(";")
    text = f"time;p\n0;{first}\n1;{second}\n"
    assert columns(tmp_path / "a.csv", text)[1][0] == value


@pytest.mark.parametrize("cells", ["1.000;0,5", "1.2;3,4", "1.234,5;1.5", "1.23.4,5;1"])
def test_marks_that_may_be_either_are_refused(tmp_path: Path, cells: str) -> None:
    """A point beside decimal commas may be a decimal sign too: only the author knows."""
    first, second = cells.split(";")
    with pytest.raises(UsageError, match="has a point, and other numbers have a decimal comma"):
        columns(tmp_path / "a.csv", f"time;p\n0;{first}\n1;{second}\n")


def test_preambles_are_skipped(tmp_path: Path) -> None:
    """Lines above the header, whatever they hold; lines are counted in the file."""
    text = 'Logger 7, serial 12\nDate;26.11.2026\n\n"time [ms]";"p [kPa]"\n0;1\n500;x\n'
    with pytest.raises(UsageError, match=r"a\.csv:6, column p: 'x' is not a number"):
        columns(tmp_path / "a.csv", text)
    assert columns(tmp_path / "a.csv", text.replace("x", "2"))[1] == [1000.0, 2000.0]


def test_a_name_that_ends_like_a_unit_is_a_name(tmp_path: Path) -> None:
    """Who names the column in full says nothing of a unit of one letter; kN is no name."""
    path = tmp_path / "a.csv"
    assert columns(path, "time,x_h\n0,1\n", ("time", "x_h"))[1] == [1.0]
    assert columns(path, "time,x_h\n0,1\n", ("time", "x"))[1] == [3600.0]
    for name in ("Force_kN", "Force kN", "Force, kN", "Force in kN"):
        text = f'time;"{name}"\n0;1,5\n'
        path.write_text(text)
        assert read_columns(path, ("time", name), (TIMES, ("N", "kN")))[0][1] == [1500.0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("time,q\n0,1\n", ":1: there is no column p among time, q"),
        ("time,p,p\n0,1,2\n", ":1: there are two columns p"),
        ("time [furlong],p\n0,1\n", ":1: the column time .furlong. is in furlong, which is not"),
        ("time [kPa],p\n0,1\n", ":1: the column time .kPa. is in kPa, which is not known here"),
        ("time,p\n", ": it has no rows"),
        ("", ": the file is empty"),
        ("time,p\n0\n", ":2: 1 cells under a header of 2"),
        ("time,p\n0,inf\n", ":2, column p: 'inf' is not a finite number"),
        ("\0\1", ": this is no text table"),
    ],
)
def test_faults_are_named_with_their_line(tmp_path: Path, text: str, said: str) -> None:
    """Each with file, line and column, and what to do where that helps."""
    with pytest.raises(UsageError, match=rf"a\.csv{said}"):
        columns(tmp_path / "a.csv", text)


def test_devices_without_an_end_are_refused() -> None:
    """They filled the memory."""
    with pytest.raises(UsageError, match="can not read the series"):
        read_table(Path("/dev/zero"))


def test_spreadsheets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first sheet, by a library that only this needs."""
    path = tmp_path / "a.xlsx"
    path.touch()
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    with pytest.raises(LibraryMissing, match="needs openpyxl"):
        read_table(path)
    values = [("Logger", None), (None, None), ("time [ms]", "p [kPa]"), (0, 1), (500, 2.5)]
    book = SimpleNamespace(worksheets=[SimpleNamespace(values=values)])
    library = SimpleNamespace(load_workbook=lambda *_, **__: book)
    monkeypatch.setitem(sys.modules, "openpyxl", library)
    numbers, lines = read_columns(path, ("time", "p"), (TIMES, ("kPa",)))
    assert (numbers.tolist(), lines) == ([[0.0, 0.5], [1000.0, 2500.0]], [4, 5])
