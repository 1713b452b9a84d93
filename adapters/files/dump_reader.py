"""Reading of text dumps: header, rows and grains of one frame after the other, each checked."""

import re
import zlib
from collections import deque
from collections.abc import Iterator
from io import BufferedIOBase, FileIO
from lzma import LZMAError
from pathlib import Path
from typing import NoReturn

import numpy as np

from adapters.bed import FloatArray, IntArray
from adapters.errors import DumpError
from adapters.files.dump import Frame, Header, Kind, describe_format, list_grains, open_dump
from adapters.files.ondem import ENDING, read_bodies
from trackbed.run_verbs import refuse_scene

TEXT_BLOCK = 1 << 20
"""Bytes read at once; also the longest line that is taken for text."""
_VALUES_AT_FIRST = 1 << 24
"""Values to take memory for before a row is seen: a header may lie about its rows."""
_WHOLE_LARGEST = 2**53
"""Whole numbers below it are exact in float64."""
_TOKEN = re.compile(rb"[^ \t\r\n]+")
_WHOLE = re.compile(r"[+-]?\d{1,19}", re.ASCII)
_NUMBER = re.compile(rb"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_NOT_FINITE = re.compile(rb"[+-]?(nan(\(\w*\))?|inf(inity)?)", re.IGNORECASE)
WRITE_TEXT = "write text with 'dump ID all custom N FILE id x y z ...' or 'dump ID all local ...'"
DAMAGED = "the header is damaged: run again, or cut this frame out"


def read_frames(path: str | Path, whole: bool = True) -> Iterator[Frame]:
    """Frames of a text dump (`PACKED` too), in order; memory for one frame and a block of text.

    Every number is the float64 nearest to its decimal text.  A frame that repeats the one before is
    left out, as of a run that went on in the same file.  Where the ``whole`` series counts, a grain
    that was in a frame must be in all later ones.  Raises `DumpError` at the first fault, after the
    whole frames before it; `UsageError` when the file cannot be opened.
    A ``.vtkhdf`` is one frame (`ondem`).  Not for ``.bin``, VTK or image dumps, nor text columns.
    """
    path = Path(path)
    refuse_scene(path, "no series and no state", ", then give what came out")
    with open_dump(path) as stream:
        if path.suffix == ENDING:
            yield Frame(*read_bodies(path))
            return
        reader = Reader(path, stream)
        while (frame := reader.read_frame()) is not None:
            if not reader.repeated:
                yield frame
            if not whole:
                reader.known = reader.header_before = None


def read_last_frame(path: str | Path) -> Frame:
    """The last frame of a text dump, whatever grains left before it; raises as `read_frames`."""
    return deque(read_frames(path, whole=False), maxlen=1).pop()


class Reader:
    """A dump on its way: a block of its text, and what the frames so far allow of the next."""

    def __init__(self, path: Path, stream: FileIO | BufferedIOBase) -> None:
        self.path, self.stream = path, stream
        self.block = bytearray(TEXT_BLOCK)
        self.text = np.frombuffer(self.block, np.uint8)
        self.begin = self.end = 0  # block[begin:end] is read from the file, but not yet used
        self.line = 0  # lines used so far
        self.cut = False  # compressed data stopped before their end mark
        self.step: int | None = None
        self.step_line = self.mark = 0  # line of the step; checksum of the rows before
        self.step_before: int | None = None
        self.header_before: Header | None = None
        self.known: IntArray | None = None  # identifiers of the grains of the frame before
        self.complete, self.repeated = 0, False  # frames read; the last one is that before

    # --- text and faults --------------------------------------------------------------------
    def read_more(self) -> bool:
        """Read on behind what is not yet used; False at the end of the file."""
        unused = self.end - self.begin
        if unused == TEXT_BLOCK:
            what = f"a line is longer than {TEXT_BLOCK} bytes: this is no text dump"
            self.refuse(what, WRITE_TEXT, line=self.line + 1)
        self.block[:unused] = self.block[self.begin : self.end]
        self.begin, self.end = 0, unused
        try:
            count = self.stream.readinto(memoryview(self.block)[unused:])
        except EOFError:
            self.cut, count = True, 0
        except (OSError, zlib.error, LZMAError) as error:
            what = f"the file cannot be read further ({error})"
            self.refuse(what, "copy or write the file again", line=self.line + 1)
        self.end += count
        return bool(count)

    def read_line(self) -> str | None:
        """The next line; None when the file ends first."""
        while (stop := self.block.find(b"\n", self.begin, self.end)) < 0:
            if not self.read_more():
                return None
        line = self.block[self.begin : stop].decode(errors="backslashreplace")
        self.begin, self.line = stop + 1, self.line + 1
        return line.strip()

    def read_header_line(self) -> str:
        """The next line, which belongs to a header."""
        line = self.read_line()
        return self.refuse_cut_header() if line is None else line

    def refuse(self, what: str, remedy: str, *, line: int | None = None) -> NoReturn:
        """Raise the error of a fault at a line, else at the last one used."""
        step = f"time step {self.step}"
        if self.step is None:
            before = self.step_before
            step = "before the first time step" if before is None else f"after time step {before}"
        where = f"{self.path}, line {self.line if line is None else line}, {step}"
        raise DumpError(what, where=where, remedy=remedy)

    def refuse_incomplete(self, what: str) -> NoReturn:
        """Raise the error of a file that ends inside a frame."""
        remedy = (
            f"the engine was stopped or is still writing: keep the {self.complete} whole frames"
            " before, or run again; a whole file ends with a line end"
        )
        self.refuse(what, remedy, line=self.line + 1)

    def refuse_cut_header(self) -> NoReturn:
        """Raise the error of a file that ends inside a header."""
        what = "compressed data end" if self.cut else "the file ends"
        self.refuse_incomplete(f"{what} inside the header of a frame")

    # --- header -----------------------------------------------------------------------------
    def check_opening(self) -> None:
        """Refuse what is no text dump, by its first bytes."""
        self.read_more()
        if self.block.startswith(b"\xef\xbb\xbf"):  # a mark that Windows editors leave
            self.begin = 3
        head = bytes(self.block[self.begin : min(self.end, 4096)])
        if self.cut and not head:
            self.refuse_cut_header()
        if not head.strip():
            self.refuse(
                "the file is empty",
                "let the engine reach a dump step; 'dump_modify ID first yes' writes at the start",
                line=1,
            )
        start = head.lstrip()[:5]
        if start != b"ITEM:"[: len(start)]:
            text = "it begins with " + repr(head[:16])[1:]
            table = "; a table is named .csv, .tsv, .txt, .dat or .xlsx, and not packed"
            remedy = describe_format(head) or WRITE_TEXT + table
            self.refuse(f"this is no text dump: {text}", remedy, line=1)

    def read_whole(self, item: str) -> int:
        """The whole number on the line after an item of the header."""
        line = self.read_header_line()
        if not _WHOLE.fullmatch(line):
            self.refuse(f"a whole number should follow 'ITEM: {item}', not {line[:40]!r}", DAMAGED)
        return int(line)

    def read_header(self) -> Header | None:
        """The items up to the column names; None at the end of the file."""
        self.step = None
        label, rows, bounds, boundary = "", -1, np.empty((0, 2)), ""
        begun = False
        while (line := self.read_line()) is not None:
            if not line and not begun:
                continue
            if not line.startswith("ITEM:"):
                self.refuse_rows_above(line)
            item = line.removeprefix("ITEM:").strip()
            begun = True
            if item == "TIMESTEP":
                self.read_step()
            elif item.startswith("NUMBER OF "):
                label, rows = item.removeprefix("NUMBER OF "), self.read_whole(item)
            elif item.startswith("BOX BOUNDS"):
                boundary, bounds = item.removeprefix("BOX BOUNDS").strip(), self.read_bounds()
            elif item in ("UNITS", "TIME"):
                if (text := self.read_header_line().strip()) != "si" and item == "UNITS":
                    self.refuse(f"the units are {text!r}, not si", "run with 'units si'")
            elif label and self.step is not None and (item + " ").startswith(label + " "):
                columns = tuple(item.removeprefix(label).split())
                return self.check_header(Header(label, rows, columns, bounds, boundary))
            else:
                self.refuse(
                    f"the line {line[:60]!r} has no place here in the header of a frame:"
                    " TIMESTEP, NUMBER OF ..., BOX BOUNDS, then the column names",
                    WRITE_TEXT,
                )
        if begun or self.cut or self.block[self.begin : self.end].strip():
            self.refuse_cut_header()
        return None

    def refuse_rows_above(self, line: str) -> NoReturn:
        """Raise the error of a line where a header should begin or go on."""
        before = self.header_before
        if self.step is None and before is not None:
            self.step, self.step_before = self.step_before, None
            what = f"more rows than the {before.rows} of the frame's header: {line[:40]!r}"
        else:
            what = f"a line of the header should begin with 'ITEM:', not {line[:40]!r}"
        self.refuse(what, "the frame is damaged: run again, or cut it out")

    def read_step(self) -> None:
        """Read the time step."""
        if self.step is not None:
            self.refuse(
                "the next frame begins inside the header of this one",
                "the engine was stopped here: cut this frame out",
            )
        self.step, self.step_line = self.read_whole("TIMESTEP"), self.line

    def read_bounds(self) -> FloatArray:
        """Three rows of box bounds, two to four numbers each."""
        table: list[list[float]] = []
        for _ in range(3):
            line = self.read_header_line()
            words = line.encode().split()
            numbers = all(_NUMBER.fullmatch(word) for word in words) and len(words) in (2, 3, 4)
            if not numbers or (table and len(words) != len(table[0])):
                what = "box bounds should be two to four numbers, as many in each line"
                self.refuse(f"{what}, not {line[:60]!r}", DAMAGED)
            table.append([float(word) for word in words])
        return np.array(table)

    def check_header(self, header: Header) -> Header:
        """The header, when its columns can be those of this dump."""
        if header.rows < 0 or not header.columns:
            what = f"the header announces {header.rows} rows of {len(header.columns)} columns"
            self.refuse(what, DAMAGED)
        if twice := {name for name in header.columns if header.columns.count(name) > 1}:
            what = f"columns are there twice: {' '.join(sorted(twice))}"
            self.refuse(what, "name each once in the engine's dump command")
        before = self.header_before
        if before is not None and (before.label, before.columns) != (header.label, header.columns):
            missing = [name for name in before.columns if name not in header.columns]
            new = [name for name in header.columns if name not in before.columns]
            self.refuse(
                f"the columns change from '{before.label} {' '.join(before.columns)}' to"
                f" '{header.label} {' '.join(header.columns)}'"
                f" (missing: {' '.join(missing) or 'none'}; new: {' '.join(new) or 'none'})",
                "give each dump command a file of its own",
            )
        return header

    # --- rows -------------------------------------------------------------------------------
    def read_frame(self) -> Frame | None:
        """The next frame, checked; None at the end of the file."""
        if not self.complete:
            self.check_opening()
        header = self.read_header()
        if header is None:
            return None
        values = self.read_frame_rows(header)
        if header.label == "ATOMS":
            values = self.check_grains(header, values)
        assert self.step is not None
        mark, before = zlib.crc32(np.ascontiguousarray(values).data), self.step_before
        self.repeated = before == self.step and mark == self.mark
        if before is not None and before >= self.step and not self.repeated:
            what = f"time steps must increase, but {self.step} follows {before}"
            remedy = "a run was appended to an older dump: give each run a file of its own"
            self.refuse(what, remedy, line=self.step_line)
        self.mark = mark
        self.complete += 1
        self.header_before, self.step_before = header, self.step
        kind: Kind = "atoms" if header.label == "ATOMS" else "entries"
        return Frame(self.step, header.columns, values, header.bounds, kind, header.boundary)

    def read_frame_rows(self, header: Header) -> FloatArray:
        """All rows of a frame, shape (n, c), in the order of the file."""
        from adapters.files import dump_kernel as kernel  # loads the compiler

        columns = len(header.columns)
        values = np.empty((min(header.rows, _VALUES_AT_FIRST // columns + 1), columns))
        first, row, column = self.line, 0, 0
        while row < header.rows:
            if row == len(values):
                values.resize((min(header.rows, 2 * row), columns), refcheck=False)
            stop = self.block.rfind(b"\n", self.begin, self.end) + 1
            if stop <= self.begin:
                if not self.read_more():
                    what = f"{row} of {header.rows} rows are whole"
                    self.refuse_incomplete(f"the file ends inside the frame: {what}")
                continue
            status, row, column, self.begin = kernel.read_rows(
                self.text, self.begin, stop, values, row, column
            )
            self.line = first + row
            if status == kernel.TOKEN_UNUSUAL:
                values[row, column] = self.read_unusual(header, values, row, column)
                column += 1
            elif status != kernel.BLOCK_READ:
                what = f"row {row + 1} has {len(self.row_words())} values for {columns} columns"
                remedy = "the row is damaged: run again, or cut this frame out"
                self.refuse(what, remedy, line=self.line + 1)
        return values

    def row_words(self) -> list[bytes]:
        """Tokens of the line that holds `begin`."""
        start = self.block.rfind(b"\n", 0, self.begin) + 1
        return bytes(self.block[start : self.block.find(b"\n", self.begin, self.end)]).split()

    def read_unusual(self, header: Header, values: FloatArray, row: int, column: int) -> float:
        """The token at `begin`, which the compiled loop left: a number or a fault."""
        line, name = self.line + 1, header.columns[column]
        match = _TOKEN.match(self.block, self.begin)
        assert match is not None
        token = bytes(match.group())
        if column == 0 and token.startswith(b"ITEM:"):
            lost = self.list_lost(header, values[:row])
            self.refuse(
                f"the frame is short: its header says {header.rows} rows, {row} are there{lost}",
                "the engine lost grains or was stopped here: run again, or cut this frame out",
                line=line,
            )
        value = float(token) if _NUMBER.fullmatch(token) else np.nan
        if np.isnan(value) and not _NOT_FINITE.fullmatch(token):
            binary = any(byte < 32 or byte > 126 for byte in token)
            self.refuse(
                f"column {name} holds {'binary data' if binary else 'no number'}:"
                f" {repr(token[:40])[1:]}",
                "cut this frame out; dump columns of numbers only (no element, no mol names)",
                line=line,
            )
        if not np.isfinite(value):
            words, grain = self.row_words(), ""
            if header.label == "ATOMS" and "id" in header.columns[: len(words)]:
                grain = f" of grain {words[header.columns.index('id')].decode('latin-1')}"
            self.refuse(
                f"column {name}{grain} is {token.decode('latin-1')}",
                "the run blew up at or before this step: use a smaller time step, or look for"
                " grains that coincide",
                line=line,
            )
        self.begin = match.end()
        return value

    # --- grains -----------------------------------------------------------------------------
    def list_lost(self, header: Header, values: FloatArray) -> str:
        """Known grains that are not among rows, in words; empty where none is missed."""
        if self.known is None or header.label != "ATOMS":
            return ""
        found = values[:, header.columns.index("id")].astype(np.int64)
        lost = self.known[~np.isin(self.known, found)]
        return f"; lost grains: {list_grains(lost)}" if len(lost) else ""

    def check_grains(self, header: Header, values: FloatArray) -> FloatArray:
        """Rows of grains, sorted by identifier, when none is lost or there twice."""
        above = self.line - header.rows
        if "id" not in header.columns:
            before = self.header_before
            if before is not None and header.rows < before.rows:
                what = f"grains are lost: {before.rows} before, {header.rows} here"
                remedy = "add id to the dump command; use a smaller time step"
                self.refuse(f"{what}; no column id says which", remedy, line=above)
            return values
        number = values[:, header.columns.index("id")]
        odd = np.flatnonzero(~(np.abs(number) < _WHOLE_LARGEST) | (number != np.floor(number)))
        if len(odd):
            self.refuse(
                f"{number[odd[0]]!r} is no identifier of a grain: not whole, or 2^53 and more",
                "write id as %d in dump_modify format",
                line=above + 1 + int(odd[0]),
            )
        identifier = number.astype(np.int64)
        if not np.all(identifier[1:] > identifier[:-1]):
            order = np.argsort(identifier)
            identifier, values = identifier[order], np.take(values, order, axis=0)
            twice = np.flatnonzero(identifier[1:] == identifier[:-1])
            if len(twice):
                self.refuse(
                    f"grains are there twice: {list_grains(np.unique(identifier[twice]))}",
                    "the dump is damaged, or two runs wrote to it: give each a file of its own",
                    line=above + 1 + int(max(order[twice[0] : twice[0] + 2])),
                )
        if lost := self.list_lost(header, values):
            what = "grains are lost" if header.rows else "the frame holds no grains"
            self.refuse(
                what + lost,
                "grains left the box or the step was too long: use a smaller time step, wider"
                " bounds, and 'thermo_modify lost error'",
                line=above,
            )
        self.known = identifier
        return values
