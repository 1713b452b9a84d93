"""Settlement series from CSV files, run folders and dumps, and what is said of faulty ones."""

from __future__ import annotations

import csv
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adapters.errors import TrackbedError, UsageError
from adapters.files.dump import Frame, write_dump
from adapters.files.series import Series, read_series

pytestmark = pytest.mark.lowest


def written(path: Path, text: str) -> Path:
    """``path`` with this text in it."""
    path.write_text(text, encoding="utf-8")
    return path


def dumped(path: Path, heights: dict[int, list[float]], first_id: int = 1) -> Path:
    """A dump of grains at these heights [m], by time step."""
    frames = []
    for step, z in heights.items():
        identifier = np.arange(first_id, first_id + len(z), dtype=float)
        values = np.stack([identifier, np.array(z)], axis=1)
        frames.append(Frame(step, ("id", "z"), values, np.array([[0.0, 1.0]] * 3)))
    write_dump(path, frames)
    return path


@pytest.mark.parametrize(("column", "unit"), [("settlement", "m"), ("settlement_mm", "mm")])
def test_unit_is_that_of_the_header(tmp_path: Path, column: str, unit: str) -> None:
    """A plain column is in m, settlement_mm in mm; other columns, comments, order do not matter."""
    text = f"# a track\nstress, Cycle ,{column}\n5,20,0.5\n\n5,10,0.25\n# end\n5,30.5,0.75\n"
    series = read_series([written(tmp_path / "series.csv", text)])
    assert series.unit == unit
    assert series.cycle.tolist() == [10.0, 20.0, 30.5]
    assert series.settlement.tolist() == [0.25, 0.5, 0.75]
    assert series.keep_from(20).settlement.tolist() == [0.5, 0.75]


def test_a_run_is_fitted_by_its_loaded_body(tmp_path: Path) -> None:
    """Of the two settlements in a run's table the loaded body's; the other by its name."""
    text = (
        "cycle,loaded_body_settlement,stiffness,mean_grain_settlement,kind\n"
        "1,4e-5,1e7,1e-5,computed\n2,8e-5,,2e-5,computed\n"
    )
    table = written(tmp_path / "settlement.csv", text)
    for path in (table, tmp_path):
        series = read_series([path])
        assert series.settlement.tolist() == [4e-5, 8e-5]
        assert "loaded_body_settlement" in series.columns
    of_grains = read_series([table], columns=("cycle", "mean_grain_settlement"))
    assert of_grains.settlement.tolist() == [1e-5, 2e-5]


def test_only_computed_rows_are_taken(tmp_path: Path) -> None:
    """Of a run folder's table, healing and jumped cycles stay out, cells they leave empty too."""
    text = (
        "cycle,settlement,kind,coordination_number\n1,1e-5,computed,4.5\n2,2e-5,computed,\n"
        "12,,jumped,\n13,9e-5,healing,4.5\n14,4e-5,computed,4.6\n"
    )
    written(tmp_path / "settlement.csv", text)
    series = read_series([tmp_path])
    assert series.cycle.tolist() == [1.0, 2.0, 14.0]
    assert series.settlement.tolist() == [1e-5, 2e-5, 4e-5]


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("cycle;settlement_mm\n1;0,5\n20;0,75\n", "mm"),
        ("Cycles (-);Settlement [mm];remark\n20;0.75;wet, cold\n1;0.5;\n", "mm"),
        ("N\tSettlement, in µm\n1e0\t0.5\n2e1\t7.5e-1\n", "um"),
        ("  cycle   settlement_cm \n  1   0.5 \n 20   0.75\n", "cm"),
        ('"cycle","Axial strain (%)"\r\n1,0.5\r\n20,0.75\r\n', "%"),
        ("cycle, strain\r1, 0.5\r20, 0.75\r", "1"),
        ("1, 0.5\n20, 0.75\n", "unknown"),
        ("20;0,75\n1;0,5\n", "unknown"),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize("suffix", ["csv", "txt"])
def test_tables_of_laboratories_are_read(
    tmp_path: Path, text: str, unit: str, encoding: str, suffix: str
) -> None:
    """Separators, decimal commas, units in the header or none: the same two readings."""
    path = tmp_path / f"series.{suffix}"
    path.write_bytes(text.encode(encoding))
    series = read_series([path])
    assert (series.cycle.tolist(), series.settlement.tolist()) == ([1.0, 20.0], [0.5, 0.75])
    assert series.unit == unit


def test_unit_is_told_where_no_header_gives_it(tmp_path: Path) -> None:
    """Of no header and of a column that the user names nothing is supposed; a header wins."""
    bare = written(tmp_path / "bare.txt", "1, 0.5\n20, 0.75\n")
    named = written(tmp_path / "named.csv", "N,eps_a\n1,0.5\n20,0.75\n")
    plain = written(tmp_path / "plain.csv", "N,settlement\n1,0.5\n20,0.75\n")
    percent = written(tmp_path / "percent.csv", "N,strain [%]\n1,0.5\n20,0.75\n")
    assert read_series([bare]).unit == "unknown"
    assert read_series([bare], unit="1").unit == "1"
    assert read_series([named], columns=("N", "eps_a")).unit == "unknown"
    assert read_series([named], columns=("N", "eps_a"), unit="%").unit == "%"
    assert read_series([plain], unit="mm").unit == "mm"
    assert read_series([percent], unit="%").unit == "%"
    with pytest.raises(UsageError, match="is in %, not in mm"):
        read_series([percent], unit="mm")
    with pytest.raises(UsageError, match="inch is no unit"):
        read_series([bare], unit="inch")
    dump = dumped(tmp_path / "dump.txt", {100: [1.0, 2.0], 200: [0.8, 2.0]})
    with pytest.raises(UsageError, match="dumps are in m"):
        read_series([dump], unit="mm")


def test_columns_of_other_names_are_named(tmp_path: Path) -> None:
    """With or without its unit; the usual names then say nothing; dumps have none."""
    text = "Lastwechsel;Setzung [mm];Setzung rechts [mm];settlement\n1;0,5;9;8\n2;0,6;9;8\n"
    path = written(tmp_path / "series.csv", text)
    for name, expected in (("setzung", 0.5), ("Setzung [mm]", 0.5), ("Setzung rechts", 9.0)):
        series = read_series([path], columns=("Lastwechsel", name))
        assert (series.settlement[0], series.unit) == (expected, "mm")
    with pytest.raises(UsageError, match=r"no column setzun among .*did you mean setzung\?"):
        read_series([path], columns=("Lastwechsel", "setzun"))
    dump = dumped(tmp_path / "dump.txt", {100: [1.0, 2.0], 200: [0.8, 2.0]})
    assert read_series([dump]).settlement.tolist() == pytest.approx([0.0, 0.1])
    with pytest.raises(UsageError, match="dumps have no columns"):
        read_series([dump], columns=("cycle", "z"))


@pytest.mark.long
def test_long_tables_are_read_fast(tmp_path: Path) -> None:
    """200,000 readings within four times what Python's csv module takes to tell their numbers
    alone, in one run: 1.9 to 3 times here, 6 times if each row were looked at by itself."""
    cycle = np.arange(1.0, 200_001.0)
    rows = "".join(f"{n:.0f},{n / 7:.9g}\n" for n in cycle)
    path = written(tmp_path / "series.csv", "cycle,settlement_mm\n" + rows)
    seconds, least = [], []
    for _ in range(5):
        start = time.process_time()
        series = read_series([path])
        read = time.process_time()
        with path.open() as file:
            said = {float(n): float(value) for n, value in list(csv.reader(file))[1:]}
        least.append(time.process_time() - read)
        seconds.append(read - start)
    assert len(said) == len(series.settlement)
    assert np.median(seconds) < 4.0 * np.median(least)
    np.testing.assert_allclose(series.settlement, cycle / 7, rtol=1e-8)


@given(
    rows=st.dictionaries(
        st.floats(0, 1e7), st.floats(-1.0, 1.0, allow_subnormal=False), min_size=1, max_size=20
    ),
    bom=st.booleans(),
    end=st.sampled_from(["\n", "\r\n"]),
)
@settings(max_examples=50)
def test_csv_is_read_exactly(tmp_path: Path, rows: dict[float, float], bom: bool, end: str) -> None:
    """Any cycles and settlements written in full come back to the last bit, sorted; between a
    first and a last reading from which none is far."""
    rows |= {0.0: -1.0, 2e7: 1.0}
    lines = ["cycle,settlement", *(f"{cycle!r},{value!r}" for cycle, value in rows.items())]
    path = tmp_path / "series.csv"
    path.write_bytes(("\ufeff" * bom + end.join(lines)).encode())
    series = read_series([path])
    expected = sorted({cycle + 0.0: value for cycle, value in rows.items()}.items())
    assert list(zip(series.cycle.tolist(), series.settlement.tolist(), strict=True)) == expected


@given(content=st.one_of(st.text(max_size=80), st.binary(max_size=80)))
@settings(max_examples=100)
def test_any_file_is_read_or_refused_with_a_sentence(tmp_path: Path, content: str | bytes) -> None:
    """Text and bytes of any kind, named .csv or after a dump, never end in a traceback."""
    data = content if isinstance(content, bytes) else content.encode(errors="surrogatepass")
    for head, name in ((b"", "a.csv"), (b"cycle,settlement\n", "b.csv"), (b"", "c.dump")):
        path = tmp_path / name
        path.write_bytes(head + data)
        try:
            series = read_series([path])
        except TrackbedError as error:
            assert name in str(error)  # noqa: PT017
        else:
            assert np.isfinite(series.settlement).all()


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("", "", "empty"),
        ("cycle,settlement\n", "", "no computed cycle"),
        ("cycle,settlement,kind\n1,0.0,jumped\n", "", "no computed cycle"),
        ("1,0.5,7\n2,0.6,7\n", ":1", "no column cycle"),
        ("cycel,settlement\n", ":1", "did you mean cycle?"),
        ("cycle,setlement\n", ":1", "did you mean settlement?"),
        ("cycle,settlement_inch\n", ":1", "no column settlement"),
        ("Zyklus;Setzung [mm]\n1;2\n", ":1", "no column cycle"),
        ("cycle;settlement\n1.000;0,5\n", ":2, column cycle", "'1.000' has a point"),
        ('cycle,settlement\n"1,000",5\n', ":2, column cycle", "'1,000' is not a number"),
        ("cycle,settlement,settlement_mm\n", ":1", "two columns settlement"),
        ("cycle,settlement,cycle\n", ":1", "two columns cycle"),
        ("cycle,settlement\n1,0.0\n2\n", ":3", "1 cells under a header of 2"),
        ("cycle,settlement\n1,0.0\n2,0.1,\n", ":3", "3 cells under a header of 2"),
        ("cycle,settlement\n1,0.0\n2,abc\n", ":3, column settlement", "'abc' is not a number"),
        ("cycle,settlement\n,0.0\n", ":2, column cycle", "'' is not a number"),
        ("cycle,settlement_mm\n1,nan\n", ":2, column settlement_mm", "not a finite number"),
        ("cycle,settlement\n\n\n-1,0.0\n", ":4, column cycle", "negative"),
        ("cycle,settlement\n5,0.0\n6,0.1\n5,0.2\n", ":4, column cycle", "given in line 2 already"),
        ("cycle,settlement,kind\n1,0,guessed\n", ":2, column kind", "'guessed' is no kind"),
        ('cycle,settlement\n"1,0.5\n', "", "no text table"),
    ],
)
def test_faulty_csv_names_its_place(tmp_path: Path, text: str, place: str, message: str) -> None:
    """Each fault of a CSV is refused where it is."""
    path = written(tmp_path / "series.csv", text)
    with pytest.raises(UsageError) as raised:
        read_series([path])
    assert raised.value.where == f"{path}{place}"
    assert message in raised.value.what


def test_dumps_are_taken_in_natural_order(tmp_path: Path) -> None:
    """2.dump comes before 10.dump; settlement is the drop of the mean height, frame by frame."""
    late = dumped(tmp_path / "10.dump", {300: [1.0, 2.0], 400: [0.8, 2.0]})
    early = dumped(tmp_path / "2.dump", {100: [1.5, 2.5], 200: [1.2, 2.6], 300: [1.0, 2.0]})
    series = read_series([late, early])
    assert series.unit == "m"
    assert series.cycle.tolist() == [0.0, 1.0, 2.0, 3.0]
    np.testing.assert_allclose(series.settlement, [0.0, 0.1, 0.5, 0.6], atol=1e-15)
    steps = read_series([late, early], steps_per_cycle=50)
    assert steps.cycle.tolist() == [2.0, 4.0, 6.0, 8.0]


def test_series_of_unlike_files_is_refused(tmp_path: Path) -> None:
    """Other grains, time that runs back, and mixed kinds of files are named."""
    first = dumped(tmp_path / "1.dump", {100: [1.0, 2.0]})
    others = dumped(tmp_path / "2.dump", {200: [1.0, 2.0]}, first_id=7)
    earlier = dumped(tmp_path / "3.dump", {50: [1.0, 2.0]})
    table = written(tmp_path / "series.csv", "cycle,settlement\n1,0\n")
    for paths, message in (
        ([first, others], r"2.dump, time step 200: the grains are not those"),
        ([first, earlier], r"3.dump, time step 50: the time step falls from 100"),
        ([first, table], r"series.csv: only dumps can be joined"),
        ([first, tmp_path], r"only dumps can be joined"),
        ([tmp_path], r"settlement.csv: can not read the series \(No such file"),
        ([tmp_path / "absent.dump"], r"absent.dump"),
        ([], "no series was named"),
    ):
        with pytest.raises(UsageError, match=message):
            read_series(paths)
    with pytest.raises(UsageError, match="steps per cycle"):
        read_series([first], steps_per_cycle=0)


def test_a_unit_that_the_data_has_is_not_given_another(tmp_path: Path) -> None:
    """A run's metres, a strain, a unit that nobody knows: refused, not called mm."""
    run = tmp_path / "run"
    run.mkdir()
    rows = "1,0.001\n2,0.002\n"
    (run / "settlement.csv").write_text("cycle,settlement\n" + rows)
    assert read_series([run], unit="m").unit == "m"
    with pytest.raises(UsageError, match="a run's settlement is in m, not in mm"):
        read_series([run], unit="mm")
    table = tmp_path / "one.csv"
    table.write_text("cycle,strain\n" + rows)
    assert read_series([table], unit="%").unit == "%"
    with pytest.raises(UsageError, match="has no length, mm"):
        read_series([table], unit="mm")
    table.write_text("cycle,Settlement [inch]\n" + rows)
    with pytest.raises(UsageError, match="is in inch, which is not known"):
        read_series([table], columns=("cycle", "Settlement [inch]"), unit="mm")


@pytest.mark.parametrize(("said", "unit"), [("µm", "um"), (" MM ", "mm"), ("-", "1"), ("1", "1")])
def test_units_are_given_as_headers_give_them(tmp_path: Path, said: str, unit: str) -> None:
    """Case, blanks and the other letter mu do not count."""
    table = tmp_path / "bare.csv"
    table.write_text("1,0.001\n2,0.002\n")
    assert read_series([table], unit=said).unit == unit


def test_settlement_before_the_count_began_is_known() -> None:
    """Behind a change of the load: the last reading up to it; rows left out change nothing."""
    series = Series(np.array([1.0, 2.0, 5.0, 9.0]), np.array([0.1, 0.2, 0.3, 0.4]))
    assert series.begun == 0
    assert series.restart_after(2).begun == series.restart_after(4).begun == 0.2
    assert series.keep_from(5).begun == 0
    assert series.restart_after(2).keep_from(4).begun == 0.2
