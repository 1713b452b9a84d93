"""What a table of settlements says beside its numbers is used, or refused with a sentence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from adapters.errors import UsageError
from adapters.files import UNKNOWN, read_series
from trackbed.command import main

ROWS = "\n".join(
    f"{n},{s}" for n, s in zip((1, 2, 5, 10, 50), (1.1, 1.3, 1.6, 1.8, 2.4), strict=True)
)


def write(path: Path, header: str, rows: str = ROWS) -> Path:
    path.write_text(f"{header}\n{rows}\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "header",
    [
        "Cycles (x1000),settlement_mm", "Cycles [x 1000],settlement_mm",
        "Cycles (\u00d710^3),settlement_mm", "N [1e3],settlement_mm", "N (thousands),settlement_mm",
        "Cycles [k],settlement_mm", "Cycles [Mio],settlement_mm", "Cycle,Settlement (x10 mm)",
        "Cycle,Settlement [0.01 mm]", "Cycle,strain [1e-6]", "Cycle,Settlement [tenths mm]",
    ],
)  # fmt: skip
def test_factors_in_headers_are_refused(tmp_path: Path, header: str) -> None:
    """Numbers that a header multiplies: read as they are they are wrong by the factor."""
    with pytest.raises(UsageError, match=r":1: the numbers of the column .* have a factor"):
        read_series([write(tmp_path / "a.csv", header)])
    for one in (header, "Cycles in 1000,strain", "kcycles,strain", "log10(N),strain"):
        with pytest.raises(UsageError, match="have a factor"):
            read_series([write(tmp_path / "a.csv", one)], columns=one.split(","))


@pytest.mark.parametrize("title", ["S1 (70 kPa)", "S1 [sigma_3 = 140 kPa]", "S1 (20 Hz)"])
def test_what_a_specimen_was_tested_at_is_no_factor(tmp_path: Path, title: str) -> None:
    """Nor the unit of its settlement, which is then not known."""
    for columns in (["N", title], ["N", "S1"]):
        series = read_series([write(tmp_path / "a.csv", f"N,{title}")], columns=columns)
        assert series.unit == UNKNOWN
    with pytest.raises(UsageError, match="have a factor"):
        read_series([write(tmp_path / "a.csv", "N,S1 (70 mm)")], columns=["N", "S1 (70 mm)"])


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("N,Settlement [inch]", "is in inch, which is not known"),
        ("N,settlement (kN)", "is in kN, which is not known"),
        ("N,settlement [microstrain]", "is in microstrain, which is not known"),
        ("Cycles,Settlement\n[-],[ms]", "is in ms, which is not known"),
        ("Cycles [h],settlement_mm", "is in h, and cycles are plain numbers"),
        ("N/mm,settlement_mm", "is in mm, and cycles are plain numbers"),
    ],
)
def test_units_that_are_none_are_refused(tmp_path: Path, header: str, said: str) -> None:
    """Whatever stands in brackets or in a row of units is a unit that is known, or refused."""
    with pytest.raises(UsageError, match=said):
        read_series([write(tmp_path / "a.csv", header)])


def test_what_is_named_in_full_is_counted(tmp_path: Path) -> None:
    """Tonnes for cycles, where the user names that column with its unit; and plain counts."""
    path = write(tmp_path / "a.csv", "Load [MGT],Settlement [mm]")
    assert read_series([path], columns=("Load [MGT]", "Settlement")).cycle[-1] == 50
    for header in ("Cycles [-],settlement_mm", "Cycle (no.),settlement_mm", "N [1],settlement_mm"):
        assert read_series([write(path, header)]).unit == "mm"


def test_thousands_beside_points(tmp_path: Path) -> None:
    """In quotes, as American spreadsheets write: 1,000 is a thousand where 3.35 has a point."""
    rows = '"1",1.10\n"100",2.62\n"1,000",3.35\n"100,000",4.80'
    series = read_series([write(tmp_path / "a.csv", "Cycles,Settlement (mm)", rows)])
    assert series.cycle.tolist() == [1, 100, 1000, 100_000]
    with pytest.raises(UsageError, match="comma out of its place"):
        read_series([write(tmp_path / "a.csv", "N,settlement", '"1,00",1.10')])


@pytest.mark.parametrize("sign", [".", ","])
def test_cycles_that_may_be_one_or_a_thousand_are_refused(tmp_path: Path, sign: str) -> None:
    """Marks of thousands read as decimal signs put cycle 1,000 before cycle 500."""
    rows = f"500;800\n1{sign}000;850\n10{sign}000;1100"
    with pytest.raises(UsageError, match=r"a.csv:3, .*'1.000' may be 1.000 or 1000 cycles"):
        read_series([write(tmp_path / "a.csv", "Cycles;Settlement [um]", rows)])
    rows = f"1{sign}000;0{sign}850\n10{sign}000;1{sign}100"  # every number has three decimals
    series = read_series([write(tmp_path / "a.csv", "Cycles;Settlement [mm]", rows)])
    assert series.cycle.tolist() == [1.0, 10.0]


@pytest.mark.parametrize(
    ("header", "meant"), [("N,settlement", "as mm it would be 0.0024"), ("N,strain", "as % it")]
)
def test_metres_that_are_hardly_meant_are_warned_of(tmp_path, capsys, header, meant) -> None:
    path = write(tmp_path / "a.csv", header)
    assert main(["fit", str(path)]) == 0
    assert f"warning: {path}: a " in (said := capsys.readouterr().err)
    assert meant in said


def test_what_was_read_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Columns, the line that names them below a preamble, and a row of units."""
    text = "Test No: 7\n\nCycles;Load;Settlement\n[-];[kN];[mm]\n1;4;1,1\n10;4;1,8\n90;4;2,6"
    path = tmp_path / "a.csv"
    path.write_text(text)
    assert main(["fit", str(path)]) == 0
    said = capsys.readouterr().out
    assert "3 cycles of Cycles and Settlement, named in line 3 with units below" in said


def test_heights_are_no_settlement(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Named so, or by what they do: sink from 59.8 towards zero; a heave, or a rest, does not."""
    heights = "1,59.8\n2,59.7\n5,59.5\n10,59.4\n50,59.41\n100,59.2"
    path = write(tmp_path / "a.csv", "cycle,piston_height", heights)
    with pytest.raises(UsageError, match="piston_height is a height"):
        read_series([path], columns=("cycle", "piston_height"))
    assert main(["fit", str(write(path, "cycle,settlement_mm", heights))]) == 2
    assert "sink from 59.8 towards zero" in capsys.readouterr().err
    noisy = 299 - np.log(np.arange(1, 1001)) / 2 + np.random.default_rng(1).normal(0, 0.05, 1000)
    for rows in (
        "\n".join(f"{i},{one:.4f}" for i, one in enumerate(noisy, 1)),
        "1,300\n10,299\n100,298", "1,2\n10,0.8\n100,-0.3\n1000,-1.4", "1,3\n10,2\n50,1\n90,0",
    ):  # fmt: skip
        assert main(["fit", str(write(path, "cycle,settlement_mm", rows))]) == 2
    for rows in ("1,-0.1\n2,-0.2\n5,-0.3\n10,-0.4", "1,5\n2,4.99\n5,5.01\n10,5\n20,4.99"):
        assert main(["fit", str(write(path, "cycle,settlement_mm", rows))]) == 0


def test_a_reading_that_marks_none_is_refused(tmp_path: Path) -> None:
    """-999 in the middle, with its line; a first reading of zero and a failure at the end pass."""
    path, good = tmp_path / "a.csv", ["1,1.0", "2,1.3", "5,1.8", "10,2.1", "20,2.5"]
    for row, mark in ((2, "5,-999"), (4, "20,-999"), (3, "10,9999")):
        rows = [mark if i == row else one for i, one in enumerate(good)]
        with pytest.raises(UsageError, match=rf"a.csv:{row + 2}.* no neighbour"):
            read_series([write(path, "cycle,settlement_mm", "\n".join(rows))])
    for rows in (["0,-90", *good], [*good, "50,90"]):
        assert len(read_series([write(path, "cycle,settlement_mm", "\n".join(rows))]).cycle) == 6


def test_a_factor_in_a_row_of_units_is_not_left_out(tmp_path: Path) -> None:
    """1/10 mm below the header is refused, and the remedy keeps the factor."""
    with pytest.raises(UsageError, match="is not a number") as raised:
        read_series([write(tmp_path / "a.csv", "cycle,settlement", "-,1/10 mm\n1,1\n2,1.3\n5,2")])
    assert "their factors into the numbers" in str(raised.value.remedy)


@pytest.mark.parametrize(
    ("words", "said", "remedy"),
    [
        (["absent.csv"], "No such file", "that are there"),
        (["."], "settlement.csv: can not read", "this folder is no run"),
        (["scene.toml"], "this is a scene", "trackbed run"),
        (["head.csv"], "no computed cycle", "below the header"),
        (["minus.csv"], "negative", "cycle 0"),
        (["good.csv", "--to-cycle", "1e300"], "no number of load cycles", "from 0 to 1e+12"),
        (["good.csv", "--from-cycle", "nan"], "no number of load cycles", "from 0"),
        (["good.csv", "--load-change", "-5"], "no number of load cycles", "from 0"),
        (["good.csv", "--probability", "1"], "between 0 and 1", "--probability 0.9"),
        (["good.csv", "--fail-at", "nan"], "positive number", "in the unit of the series, mm"),
        (["good.csv", "--steps-per-cycle", "9"], "not time steps", "leave it out"),
    ],
)
def test_remedies_are_those_of_the_cause(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str],
    words: list[str], said: str, remedy: str,
) -> None:  # fmt: skip
    """Exit code 2, what happened, and what to do about it."""
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "good.csv", "cycle,settlement_mm")
    write(tmp_path / "head.csv", "cycle,settlement_mm", "")
    write(tmp_path / "minus.csv", "cycle,settlement_mm", "-1,0.5")
    assert main(["fit", *words]) == 2
    what, arrow, do = capsys.readouterr().err.partition("\n  -> ")
    assert said in what
    assert arrow
    assert remedy in do


def test_a_run_of_another_kind_has_no_settlement(tmp_path: Path) -> None:
    """A QDEM run's folder given to fit: named so, with what to open."""
    (tmp_path / "manifest.json").write_text('{"scene": {"simulation": {}}}')
    with pytest.raises(UsageError, match=r"this is a qdem run, which has no settlement"):
        read_series([tmp_path])
