"""Text dumps: exact numbers, every accepted form, and every fault named with its place."""

from __future__ import annotations

import gzip
import re
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from adapters.errors import DumpError, UsageError
from adapters.files import dump_kernel, dump_reader
from adapters.files.dump import Frame, write_dump
from adapters.files.dump_reader import read_frames


def written_frame(step: int, header: str, *rows: str, height: str = "0 0.25") -> str:
    """As LIGGGHTS 3.8.0 writes it: a blank before each line end of the table."""
    table = "".join(f"{line} \n" for line in (header, *rows))
    return (
        f"ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF {header.split()[1]}\n{len(rows)}\n"
        f"ITEM: BOX BOUNDS ff ff ff\n-0.1 0.1\n-0.1 0.1\n{height}\n{table}"
    )


ATOMS, ENTRIES = "ITEM: ATOMS id type x vx", "ITEM: ENTRIES c_pl[1] c_pl[2] c_pl[7] c_pl[8]"
GRAINS = (  # rows in no order
    written_frame(
        0, ATOMS, "5 1 -0.0089999999999999993 0",
        "2 1 0.010500000000000001 -2.9905695484907615e-16",
        "7 1 0.029999999999999999 0.025074591573576797",
    )
    + written_frame(10, ATOMS, "7 1 0.03 0", "5 1 -0.009 1e-3", "2 1 .0105 -1.5E+02")
    + written_frame(20, ATOMS, "2 1 1 0", "5 1 2 0", "7 1 3 0")
)  # fmt: skip
CONTACTS = written_frame(
    0, ENTRIES, "0.0105 0 2 7", "-0.009 0 5 2", height="-0.1 0.1"
) + written_frame(10, ENTRIES, height="-0.1 0.1")
FILES = settings(max_examples=60)


def written(folder: Path, content: str | bytes) -> Path:
    path = folder / "bed.dump"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def frames_and_error(path: Path) -> tuple[list[Frame], DumpError | None]:
    frames: list[Frame] = []
    try:
        frames.extend(read_frames(path))
    except DumpError as error:
        return frames, error
    return frames, None


def bits(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values).view(np.uint64)


def assert_frames_equal(read: list[Frame], expected: list[Frame]) -> None:
    assert len(read) == len(expected)
    for one, other in zip(read, expected, strict=True):
        assert (one.time_step, one.columns, one.kind) == (
            other.time_step,
            other.columns,
            other.kind,
        )
        assert np.array_equal(bits(one.values), bits(other.values))
        assert np.array_equal(bits(one.bounds), bits(other.bounds))


# --- numbers ------------------------------------------------------------------------------------


def tokens_read(tokens: list[str]) -> np.ndarray:
    text = np.frombuffer(("\n".join(tokens) + "\n").encode(), np.uint8)
    table = np.empty((len(tokens), 1))
    row = start = 0
    while row < len(tokens):
        status, row, column, start = dump_kernel.read_rows(text, start, len(text), table, row, 0)
        if status == dump_kernel.TOKEN_UNUSUAL:  # left to the caller, who reads it as float() does
            table[row, column] = float(tokens[row])
            start, row = start + len(tokens[row]) + 1, row + 1
    return table[:, 0]


@pytest.mark.parametrize("digits", [6, 15, 17, 19, 25])
def test_kernel_agrees_with_numpy_twin(digits: int) -> None:
    """The compiled numbers equal numpy's (correctly rounded) over all of float64's exponents."""
    random = np.random.default_rng(digits)
    pattern = random.integers(0, 2**64, 20_000, np.uint64).view(np.float64)
    tokens = [f"{x:.{digits}g}" for x in pattern[np.isfinite(pattern)]]
    twin = np.array(tokens, dtype=np.float64)
    assert np.array_equal(bits(tokens_read(tokens)), bits(twin))


def test_kernel_reads_common_numbers_by_itself() -> None:
    """The fast path covers what engines write: no token of 1 to 19 digits is left to Python."""
    random = np.random.default_rng(1)
    values = random.normal(size=20_000) * 10.0 ** random.integers(-250, 250, 20_000)
    text = "".join(f"{x:.17g}\n{x:g}\n{x:.0f}\n" if abs(x) < 1e18 else f"{x:e}\n" for x in values)
    data = np.frombuffer(text.encode(), np.uint8)
    table = np.empty((text.count("\n"), 1))
    status, row, _, _ = dump_kernel.read_rows(data, 0, len(data), table, 0, 0)
    assert (status, row) == (dump_kernel.BLOCK_READ, len(table))


@FILES
@given(
    st.lists(
        st.from_regex(
            r"[+-]?(\d{1,45}(\.\d{0,30})?|\.\d{1,40})([eE][+-]?\d{1,4})?", fullmatch=True
        ),
        min_size=1,
    )
)
def test_kernel_rounds_any_decimal_text(tokens: list[str]) -> None:
    """Any decimal text, however long or large, becomes the float64 nearest to it."""
    tokens = [token.encode("ascii", "replace").decode().replace("?", "7") for token in tokens]
    assert np.array_equal(bits(tokens_read(tokens)), bits(np.array([float(t) for t in tokens])))


@given(st.integers(2**52, 2**53 - 1), st.integers(-80, 63))
def test_kernel_rounds_ties_to_even(mantissa: int, exponent: int) -> None:
    """Decimals exactly halfway between two float64, and the nearest decimals beside the half."""
    halves = 2 * mantissa + 1
    if exponent >= 0:
        text, digits_after = str(halves << exponent), 0
    else:
        text, digits_after = str(halves * 5**-exponent), -exponent
    mark = f"e-{digits_after}"
    tokens = [text + mark, text[:-1] + str(int(text[-1]) - 1) + mark] if text[-1] != "0" else []
    tokens += [text + "0" * 30 + f"e-{digits_after + 30}", text + "1" + f"e-{digits_after + 1}"]
    assert np.array_equal(bits(tokens_read(tokens)), bits(np.array([float(t) for t in tokens])))


@pytest.mark.parametrize(
    ("token", "value"),
    [
        ("-0", -0.0),
        ("-0.0e300", -0.0),
        ("1e-300", 1e-300),
        ("5e-324", 5e-324),
        ("2.4703282292062327e-324", 0.0),
        ("2.2250738585072011e-308", 2.225073858507201e-308),
        ("1.7976931348623157e308", np.finfo(float).max),
        ("9007199254740993", 2.0**53),
        ("9007199254740995", 2.0**53 + 4),
        ("18446744073709551615", 2.0**64),
        ("+1.", 1.0),
        (".5", 0.5),
        ("0000000000000000000000000000001.5", 1.5),
        ("1" + "0" * 400 + "e-400", 1.0),
    ],
)
def test_known_numbers(tmp_path: Path, token: str, value: float) -> None:
    """Signed zero, subnormals, the largest float64, integers above 2^53: each to the bit."""
    text = GRAINS.replace("-1.5E+02", token)
    frame = list(read_frames(written(tmp_path, text)))[1]
    assert bits(frame.column("vx"))[0] == bits(np.array([value]))[0]


# --- round trip ---------------------------------------------------------------------------------

finite = st.floats(allow_nan=False, allow_infinity=False, allow_subnormal=True)


@st.composite
def dumps(draw: st.DrawFn) -> list[Frame]:
    kind = draw(st.sampled_from(["atoms", "entries"]))
    names = draw(
        st.lists(
            st.sampled_from(["x", "y", "vz", "c_contacts[1]", "f_wall[3]", "v_é", "radius"]),
            unique=True,
            min_size=1,
        )
    )
    ids = draw(st.lists(st.integers(1, 2**53 - 1), unique=True, max_size=6))
    steps = sorted(draw(st.sets(st.integers(0, 2**63 - 1), min_size=1, max_size=3)))
    frames = []
    for step in steps:
        count = len(ids) if kind == "atoms" else draw(st.integers(0, 6))
        values = draw(
            st.lists(
                st.lists(finite, min_size=len(names), max_size=len(names)),
                min_size=count,
                max_size=count,
            )
        )
        table = np.array(values).reshape(count, len(names))
        columns = tuple(names)
        if kind == "atoms":
            table, columns = np.column_stack([draw(st.permutations(ids)), table]), ("id", *names)
        width = draw(st.sampled_from([0, 2, 3, 4]))
        row = st.lists(finite, min_size=width, max_size=width)
        bounds = draw(st.lists(row, min_size=3, max_size=3)) if width else np.empty((0, 2))
        frames.append(Frame(step, columns, table, np.array(bounds), kind))
    return frames


@FILES
@given(frames=dumps(), suffix=st.sampled_from([".dump", ".gz"]))
def test_round_trip(tmp_path: Path, frames: list[Frame], suffix: str) -> None:
    """What `write_dump` writes, `read_frames` reads back bit for bit, grains sorted by id."""
    path = tmp_path / f"frames{suffix}"
    write_dump(path, frames)
    expected = [
        Frame(
            frame.time_step,
            frame.columns,
            frame.values[np.argsort(frame.values[:, 0])] if frame.kind == "atoms" else frame.values,
            frame.bounds,
            frame.kind,
        )
        for frame in frames
    ]
    assert_frames_equal(list(read_frames(path)), expected)


@FILES
@given(frames=dumps(), block=st.integers(200, 400))
def test_blocks_of_text_do_not_matter(tmp_path: Path, frames: list[Frame], block: int) -> None:
    """Frames are the same wherever the borders of the blocks read from the file fall."""
    path = tmp_path / "frames.dump"
    write_dump(path, frames)
    whole = list(read_frames(path))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dump_reader, "TEXT_BLOCK", block)
        patch.setattr(dump_reader, "_VALUES_AT_FIRST", 1)
        assert_frames_equal(list(read_frames(path)), whole)


def test_write_is_atomic(tmp_path: Path) -> None:
    """A writer that fails half way leaves the old file as it was, and nothing beside it."""
    path = written(tmp_path, GRAINS)

    def half() -> object:
        yield from read_frames(path)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_dump(path, half())
    assert path.read_text() == GRAINS
    assert list(tmp_path.iterdir()) == [path]


# --- accepted forms -----------------------------------------------------------------------------


def test_engine_dump(tmp_path: Path) -> None:
    """A dump as LIGGGHTS writes it: columns by name, grains by id, bounds kept."""
    first, second, third = read_frames(written(tmp_path, GRAINS))
    assert (first.time_step, first.kind, first.boundary) == (0, "atoms", "ff ff ff")
    assert first.column("id").tolist() == [2, 5, 7]
    assert first.column("x").tolist() == [0.0105, -0.009, 0.03]
    assert second.block("vx", "x").tolist() == [[-150, 0.0105], [0.001, -0.009], [0, 0.03]]
    assert second.block("vx", "x").flags.c_contiguous
    assert third.bounds.tolist() == [[-0.1, 0.1], [-0.1, 0.1], [0, 0.25]]
    with pytest.raises(DumpError, match=r"no column radius; there are id type x vx"):
        first.column("radius")


def test_contact_dump(tmp_path: Path) -> None:
    """A dump of contacts keeps the order of its rows, and may have none."""
    first, second = read_frames(written(tmp_path, CONTACTS))
    assert first.kind == "entries"
    assert first.block("c_pl[7]", "c_pl[8]").tolist() == [[2, 7], [5, 2]]
    assert second.values.shape == (0, 4)
    assert second.block("c_pl[1]", "c_pl[2]").shape == (0, 2)


OTHER_FORMS = {
    "windows": GRAINS.replace("\n", "\r\n"),
    "byte-order mark": "\ufeff" + GRAINS,
    "blank lines at the end": GRAINS + "\n \n",
    "no blank before line ends": GRAINS.replace(" \n", "\n"),
    "wide blanks": re.sub(r"(?m)^\d+ .*$", lambda row: row[0].replace(" ", "  \t"), GRAINS),
    "units and time": "ITEM: UNITS\nsi\n"
    + GRAINS.replace("ITEM: TIMESTEP", "ITEM: TIME\n0.5\nITEM: TIMESTEP"),
    "periodic": GRAINS.replace("BOUNDS ff ff ff", "BOUNDS pp pp pp"),
}


@pytest.mark.parametrize("text", OTHER_FORMS.values(), ids=OTHER_FORMS)
def test_other_forms_read_the_same(tmp_path: Path, text: str) -> None:
    """Windows line ends, blanks and optional items change nothing."""
    expected = list(read_frames(written(tmp_path, GRAINS)))
    assert_frames_equal(list(read_frames(written(tmp_path, text))), expected)


def test_tilted_box(tmp_path: Path) -> None:
    """A triclinic box keeps its tilt factors."""
    text = GRAINS.replace("BOUNDS ff", "BOUNDS xy xz yz ff").replace(" 0.1\n", " 0.1 0.5\n")
    frame = next(read_frames(written(tmp_path, text.replace("0 0.25\n", "0 0.25 -0.5\n"))))
    assert frame.boundary == "xy xz yz ff ff ff"
    assert frame.bounds.tolist() == [[-0.1, 0.1, 0.5], [-0.1, 0.1, 0.5], [0, 0.25, -0.5]]


def test_grains_may_come_in(tmp_path: Path) -> None:
    """An insertion: no grains, then some, then more, is no fault."""
    empty = Frame(0, ("id", "x"), np.empty((0, 2)))
    some = Frame(1, ("id", "x"), np.array([[4.0, 0.0]]))
    more = Frame(2, ("id", "x"), np.array([[3.0, 0.0], [4.0, 0.0]]))
    path = tmp_path / "rain.dump"
    write_dump(path, [empty, some, more])
    assert [len(frame.values) for frame in read_frames(path)] == [0, 1, 2]


def test_memory_is_bounded(tmp_path: Path) -> None:
    """Fifty frames take the memory of about two, and of a block of text."""
    path = tmp_path / "long.dump"
    values = np.column_stack([np.arange(1, 5001), np.full((5000, 5), 0.1)])
    write_dump(path, (Frame(step, ("id", *"xyzuv"), values) for step in range(50)))
    next(read_frames(path))  # compiles
    tracemalloc.start()
    assert sum(len(frame.values) for frame in read_frames(path)) == 250_000
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 5 * values.nbytes + 2 * dump_reader.TEXT_BLOCK


# --- faults -------------------------------------------------------------------------------------


def line_of(text: str, part: str, occurrence: int = 1) -> int:
    """Number of the line that holds an occurrence of ``part``."""
    place = -1
    for _ in range(occurrence):
        place = text.index(part, place + 1)
    return text.count("\n", 0, place) + 1


LAST = GRAINS.index("ITEM: TIMESTEP\n20")
LOST = GRAINS.replace("2 1 .0105 -1.5E+02 \n", "").replace("ATOMS\n3", "ATOMS\n2")
LOST = LOST.replace("ATOMS\n2", "ATOMS\n3", 1)  # the first frame keeps its three
EMPTIED = GRAINS[:LAST] + GRAINS[LAST:-24].replace("ATOMS\n3", "ATOMS\n0")
SHORT = GRAINS.replace("5 1 -0.009 1e-3 \n", "")
MID_ROW = GRAINS[: GRAINS.index("-0.009 1e-3") + 6]
ROW_END = GRAINS[: GRAINS.index("5 1 -0.009 1e-3")]


@pytest.mark.parametrize(
    ("text", "line", "step", "says", "whole"),
    [
        (MID_ROW, line_of(MID_ROW, "5 1 -0.009"), 10, "1 of 3 rows are whole", 1),
        (ROW_END, line_of(ROW_END, "7 1 0.03 0") + 1, 10, "1 of 3 rows are whole", 1),
        (GRAINS[:-1].rstrip(), 36, 20, "2 of 3 rows are whole", 2),
        (GRAINS[: GRAINS.index("10\n") + 3], 15, 10, "inside the header", 1),
        (GRAINS[: GRAINS.index("10\n") + 1], 14, None, "inside the header", 1),
        (LOST, line_of(LOST, "ITEM: ATOMS", 2), 10, "grains are lost; lost grains: 2", 1),
        (SHORT, line_of(SHORT, "ITEM: TIMESTEP", 3), 10, "2 are there; lost grains: 5", 1),
        (EMPTIED, 33, 20, "holds no grains; lost grains: 2, 5, 7", 2),
        (GRAINS.replace("1e-3", "-nan"), 23, 10, "column vx of grain 5 is -nan", 1),
        (GRAINS.replace("-0.009 1", "inf 1"), 23, 10, "column x of grain 5 is inf", 1),
        (GRAINS.replace("1e-3", "1e999"), 23, 10, "column vx of grain 5 is 1e999", 1),
        (GRAINS.replace("1e-3", "1.8e308"), 23, 10, "column vx of grain 5 is 1.8e308", 1),
        (GRAINS.replace("1e-3", "-3.5e308"), 23, 10, "column vx of grain 5 is -3.5e308", 1),
        (GRAINS.replace("x vx \n7", "x vy \n7"), 21, 10, "missing: vx; new: vy", 1),
        (GRAINS.replace("x vx \n7", "vx x \n7"), 21, 10, "the columns change", 1),
        (GRAINS + CONTACTS.replace("P\n0", "P\n30"), 45, 30, "to 'ENTRIES c_pl[1]", 3),
        (GRAINS.replace("7 1 0.03", "5 1 0.03"), 23, 10, "there twice: 5", 1),
        (GRAINS.replace("7 1 0.03 0", "7 1 0.03"), 22, 10, "3 values for 4 columns", 1),
        (GRAINS.replace("7 1 0.03 0", "7 1 0.03 0 0"), 22, 10, "5 values for 4 columns", 1),
        (GRAINS.replace("7 1 0.03 0", ""), 22, 10, "0 values for 4 columns", 1),
        (GRAINS.replace("7 1 0.03", "7 Fe 0.03"), 22, 10, "type holds no number: 'Fe'", 1),
        (GRAINS.replace("7 1 0.03", "7 1 0.03.1"), 22, 10, "x holds no number", 1),
        (GRAINS.replace("7 1 0.03", "7 1_0 0.03"), 22, 10, "type holds no number", 1),
        (GRAINS.replace("7 1 0.03", "7 1 0x1p3"), 22, 10, "x holds no number", 1),
        (GRAINS.replace("7 1 0.03", "7 1 \x00\x07\x00"), 22, 10, "x holds binary data", 1),
        (GRAINS.replace("7 1 0.03", "7.5 1 0.03"), 22, 10, "no identifier of a grain", 1),
        (GRAINS.replace("7 1 0.03", "9007199254740993 1 0.03"), 22, 10, "2^53", 1),
        (GRAINS.replace("P\n20", "P\n10"), 26, 10, "10 follows 10", 2),
        (GRAINS.replace("P\n20", "P\n5"), 26, 5, "5 follows 10", 2),
        (GRAINS.replace("P\n20", "P\n2.5"), 26, None, "a whole number should follow", 2),
        (GRAINS.replace("ATOMS\n3", "ATOMS\n-3"), 9, 0, "announces -3 rows", 0),
        (GRAINS.replace("ATOMS\n3", "ATOMS\n2"), 12, 0, "more rows than the 2", 1),
        (GRAINS.replace("ATOMS\n3", "ATOMS\n" + "9" * 15), 13, 0, "says 9999", 0),
        (GRAINS.replace("\n3\n", "\n" + "9" * 30 + "\n"), 4, 0, "a whole number should", 0),
        (GRAINS.replace("-0.1 0.1", "-0.1 nan"), 6, 0, "box bounds should be", 0),
        (GRAINS.replace("ITEM: ATOMS id type x vx", "ITEM: ATOMS"), 9, 0, "of 0 columns", 0),
        (GRAINS.replace("ITEM: TIMESTEP\n10\n", ""), 19, None, "has no place", 1),
        (GRAINS.replace("ITEM: NUMBER OF ATOMS\n3\n", "", 1), 7, 0, "has no place", 0),
        (GRAINS[: GRAINS.index("-0.1")] + GRAINS, 6, 0, "box bounds should be", 0),
        ("ITEM: TIMESTEP\n0\n" + GRAINS, 3, 0, "next frame begins inside the header", 0),
    ],
)  # fmt: skip
def test_fault_is_named(
    tmp_path: Path, text: str, line: int, step: int | None, says: str, whole: int
) -> None:
    """Each fault: file, line, time step, lost grains, a remedy; frames before it are kept."""
    path = written(tmp_path, text)
    frames, error = frames_and_error(path)
    assert error is not None
    assert says in error.what
    assert error.where.startswith(f"{path}, line {line},")
    assert step is None or error.where.endswith(f"time step {step}")
    assert error.remedy
    assert len(frames) == whole


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "is empty"),
        (b" \r\n\n", "is empty"),
        (b"\x00\x00\x00\x00\x01\x00", "no text dump"),
        (b"\x89PNG\r\n\x1a\n", "PNG image"),
        (gzip.compress(GRAINS.encode()), "ends in .gz"),
        (b"PK\x03\x04\x14\x00", "npz archive"),
        (b"LIGGGHTS (Version 3.8.0)\n", "no text dump"),
        (b"ITEM: TIMESTEP\n" + b"\xff" * 3_000_000, "longer than"),
    ],
)
def test_other_files_are_refused(tmp_path: Path, content: bytes, says: str) -> None:
    """An empty file, binary dumps, archives and images are told apart from a dump."""
    _, error = frames_and_error(written(tmp_path, content))
    assert says in str(error)
    assert "line" in str(error)


def test_missing_file_is_a_usage_error(tmp_path: Path) -> None:
    """A file that is not there, or a folder, is the user's mistake, and named."""
    for path in (tmp_path / "none.dump", tmp_path):
        with pytest.raises(UsageError, match=re.escape(str(path))):
            list(read_frames(path))


def test_lost_grains_without_identifiers(tmp_path: Path) -> None:
    """Without an id column the loss is still seen, by number."""
    path = written(tmp_path, LOST.replace(" id ", " mol "))
    _, error = frames_and_error(path)
    assert "3 before, 2 here" in str(error)


def test_every_cut_is_seen(tmp_path: Path) -> None:
    """A dump cut at any byte yields its whole frames, then an error that says it is incomplete."""
    whole = list(read_frames(written(tmp_path, GRAINS)))
    ends = [GRAINS.index("ITEM: TIMESTEP\n10"), GRAINS.index("ITEM: TIMESTEP\n20"), len(GRAINS)]
    for cut in range(1, len(GRAINS)):
        frames, error = frames_and_error(written(tmp_path, GRAINS[:cut]))
        assert_frames_equal(frames, whole[: sum(end <= cut for end in ends)])
        if cut in ends:
            assert error is None
        else:
            assert error is not None
            assert "ends inside" in error.what or not frames


def test_cut_compressed_dump(tmp_path: Path) -> None:
    """Compressed data that end too early are incomplete, even when all frames came through."""
    data = gzip.compress(GRAINS.encode())
    path = tmp_path / "bed.dump.gz"
    for cut in (*range(2, len(data), 7), len(data) - 1):
        path.write_bytes(data[:cut])
        _, error = frames_and_error(path)
        assert "ends inside" in str(error) or "data end inside" in str(error)
    for content in (b"ITEM: TIMESTEP\n", data[:40] + b"damage" + data[46:]):
        path.write_bytes(content)
        assert "cannot be read" in str(frames_and_error(path)[1])


@settings(FILES, max_examples=200)
@given(st.data())
def test_any_damage_is_refused_or_read(tmp_path: Path, data: st.DataObject) -> None:
    """A dump with a piece replaced by other bytes raises only a `DumpError` that says where.

    So do any bytes, alone or behind the begin of a header.
    """
    good = data.draw(
        st.sampled_from([GRAINS, CONTACTS, "", "ITEM: ", "ITEM: TIMESTEP\n1\n"])
    ).encode()
    begin = data.draw(st.integers(0, len(good)))
    end = begin + data.draw(st.integers(0, 30))
    other = data.draw(st.one_of(st.binary(max_size=300), st.sampled_from([b"1e5", b" ", b"\n"])))
    path = written(tmp_path, good[:begin] + other + good[end:])
    _, error = frames_and_error(path)
    if error is not None:
        assert re.match(re.escape(str(path)) + r", line \d+, (time step|after|before)", str(error))
