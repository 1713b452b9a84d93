"""Reading of text dumps: header, rows and grains of one frame after the other, each checked."""

from __future__ import annotations

import re
from collections.abc import Iterable
from gzip import GzipFile
from io import FileIO
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np

from adapters.bed import FloatArray, IntArray
from adapters.files.dump_frame import Frame, Kind
from adapters.files.dump_text import WRITE_TEXT, DumpText, list_grains

_VALUES_AT_FIRST = 1 << 24
"""Values to take memory for before a row is seen: a header may lie about its rows."""
_WHOLE_LARGEST = 2**53
"""Whole numbers below it are exact in float64."""

_TOKEN = re.compile(rb"[^ \t\r\n]+")
_WHOLE = re.compile(r"[+-]?\d{1,19}", re.ASCII)
_NUMBER = re.compile(rb"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")
_NAN = re.compile(rb"[+-]?nan(\(\w*\))?", re.IGNORECASE)
_INFINITE = re.compile(rb"[+-]?inf(inity)?", re.IGNORECASE)
_OTHER_FORMATS = {
    b"\x1f\x8b": "gzip data: give the file a name that ends in .gz",
    b"PK\x03\x04": "a zip or npz archive: give the text dump",
    b"\x89PNG": "a PNG image: give the text dump",
}


class Header(NamedTuple):
    """What is above the rows of a frame."""

    label: str
    rows: int
    columns: tuple[str, ...]
    bounds: FloatArray
    boundary: str


class Reader(DumpText):
    """A dump on its way: a block of its text, and what the frames so far allow of the next."""

    def __init__(
        self, path: Path, stream: FileIO | GzipFile, expected: Iterable[int] | None, allow_nan: bool
    ) -> None:
        super().__init__(path, stream)
        self.allow_nan = allow_nan
        self.header_before: Header | None = None
        self.known: IntArray | None = None
        if expected is not None:
            self.known = np.unique(np.fromiter(expected, np.int64))

    # --- header -----------------------------------------------------------------------------
    def opening(self) -> None:
        """Refuse what is no text dump, by its first bytes."""
        self.more()
        if self.block.startswith(b"\xef\xbb\xbf"):  # a mark that Windows editors leave
            self.begin = 3
        head = bytes(self.block[self.begin : min(self.end, 4096)])
        if self.cut and not head:
            self.refuse_cut_header()
        if not head.strip():
            self.fault(
                "the file is empty",
                "let the engine reach a dump step; 'dump_modify ID first yes' writes at the start",
                line=1,
            )
        start = head.lstrip()[:5]
        if start != b"ITEM:"[: len(start)]:
            known = [text for mark, text in _OTHER_FORMATS.items() if head.startswith(mark)]
            text = "it begins with " + repr(head[:16])[1:]
            remedy = known[0] if known else WRITE_TEXT
            self.fault(f"this is no text dump: {text}", remedy, line=1)

    def whole(self, item: str) -> int:
        """The whole number on the line after an item of the header."""
        line = self.read_line()
        if line is None:
            self.refuse_cut_header()
        if not _WHOLE.fullmatch(line):
            self.fault(
                f"a whole number should follow 'ITEM: {item}', not {line[:40]!r}",
                "the header is damaged: run again, or cut this frame out",
            )
        return int(line)

    def refuse_cut_header(self) -> NoReturn:
        """Raise the error of a file that ends inside a header."""
        what = "compressed data end" if self.cut else "the file ends"
        self.refuse_incomplete(f"{what} inside the header of a frame")

    def read_header(self) -> Header | None:
        """The items up to the column names; None at the end of the file."""
        self.step = None
        label, rows, bounds, boundary = "", -1, np.empty((0, 2)), ""
        begun = False
        while (line := self.read_line()) is not None:
            if not line and not begun:
                continue
            item = line.removeprefix("ITEM:").strip()
            if not line.startswith("ITEM:"):
                self.refuse_rows_above(line)
            begun = True
            if item == "TIMESTEP":
                self.read_step()
            elif item.startswith("NUMBER OF "):
                label, rows = item.removeprefix("NUMBER OF "), self.whole(item)
            elif item.startswith("BOX BOUNDS"):
                boundary, bounds = item.removeprefix("BOX BOUNDS").strip(), self.read_bounds()
            elif item in ("UNITS", "TIME"):
                if self.read_line() is None:
                    self.refuse_cut_header()
            elif label and self.step is not None and (item + " ").startswith(label + " "):
                columns = tuple(item.removeprefix(label).split())
                return self.check_header(Header(label, rows, columns, bounds, boundary))
            else:
                self.fault(
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
        self.fault(what, "the frame is damaged: run again, or cut it out")

    def read_step(self) -> None:
        """Read the time step, which must grow from frame to frame."""
        if self.step is not None:
            self.fault(
                "the next frame begins inside the header of this one",
                "the engine was stopped here: cut this frame out",
            )
        self.step = self.whole("TIMESTEP")
        if self.step_before is not None and self.step <= self.step_before:
            self.fault(
                f"time steps must increase, but {self.step} follows {self.step_before}",
                "a run was appended to an older dump: give each run a file of its own",
            )

    def read_bounds(self) -> FloatArray:
        """Three rows of box bounds."""
        table = []
        for _ in range(3):
            line = self.read_line()
            if line is None:
                self.refuse_cut_header()
            words = line.encode().split()
            if not all(_NUMBER.fullmatch(word) for word in words) or len(words) not in (2, 3, 4):
                self.fault(
                    f"box bounds should be two to four numbers, not {line[:60]!r}",
                    "the header or the run is damaged: run again, or cut this frame out",
                )
            table.append([float(word) for word in words])
        if len({len(row) for row in table}) > 1:
            self.fault("box bounds differ in length", "cut this frame out")
        return np.array(table)

    def check_header(self, header: Header) -> Header:
        """The header, when its columns can be those of this dump."""
        if header.rows < 0 or not header.columns:
            self.fault(
                f"the header announces {header.rows} rows of {len(header.columns)} columns",
                "the header is damaged: run again, or cut this frame out",
            )
        before = self.header_before
        if before is not None and (before.label, before.columns) != (header.label, header.columns):
            missing = [name for name in before.columns if name not in header.columns]
            new = [name for name in header.columns if name not in before.columns]
            self.fault(
                f"the columns change from '{before.label} {' '.join(before.columns)}' to"
                f" '{header.label} {' '.join(header.columns)}'"
                f" (missing: {' '.join(missing) or 'none'}; new: {' '.join(new) or 'none'})",
                "give each dump command a file of its own",
            )
        if header.label == "ATOMS" and self.known is not None and "id" not in header.columns:
            self.fault(
                f"grains cannot be distinguished: no column id in {' '.join(header.columns)}",
                "add id to the engine's dump command",
            )
        return header

    # --- rows -------------------------------------------------------------------------------
    def read_frame(self) -> Frame | None:
        """The next frame, checked; None at the end of the file."""
        if not self.complete:
            self.opening()
        header = self.read_header()
        if header is None:
            return None
        values = self.read_frame_rows(header)
        if header.label == "ATOMS":
            values = self.check_grains(header, values)
        assert self.step is not None
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
                if not self.more():
                    self.refuse_incomplete(
                        f"the file ends inside the frame: {row} of {header.rows} rows are whole",
                        self.lost(header, values[:row]),
                    )
                continue
            status, row, column, self.begin = kernel.read_rows(
                self.text, self.begin, stop, values, row, column
            )
            self.line = first + row
            if status == kernel.TOKEN_UNUSUAL:
                values[row, column] = self.unusual(header, values, row, column)
                column += 1
            elif status != kernel.BLOCK_READ:
                found = len(self.row_words())
                self.fault(
                    f"row {row + 1} has {found} values for {columns} columns",
                    "the row is damaged: run again, or cut this frame out",
                    line=self.line + 1,
                )
        return values

    def row_words(self) -> list[bytes]:
        """Tokens of the line that holds `begin`."""
        start = self.block.rfind(b"\n", 0, self.begin) + 1
        return bytes(self.block[start : self.block.find(b"\n", self.begin, self.end)]).split()

    def unusual(self, header: Header, values: FloatArray, row: int, column: int) -> float:
        """The token at `begin`, which the compiled loop left: a number, nan or a fault."""
        line, name = self.line + 1, header.columns[column]
        match = _TOKEN.match(self.block, self.begin)
        assert match is not None
        token = bytes(match.group())
        if column == 0 and token.startswith(b"ITEM:"):
            self.fault(
                f"the frame is short: its header says {header.rows} rows, {row} are there",
                "the engine lost grains or was stopped here: run again, or cut this frame out",
                line=line,
                lost=self.lost(header, values[:row]),
            )
        if _NUMBER.fullmatch(token) or _INFINITE.fullmatch(token):
            value = float(token)
        elif _NAN.fullmatch(token):
            value = np.nan
        else:
            binary = any(byte < 32 or byte > 126 for byte in token)
            self.fault(
                f"column {name} holds {'binary data' if binary else 'no number'}:"
                f" {repr(token[:40])[1:]}",
                "cut this frame out; dump columns of numbers only (no element, no mol names)",
                line=line,
            )
        if not np.isfinite(value) and not self.allow_nan:
            words, grain = self.row_words(), ""
            if header.label == "ATOMS" and "id" in header.columns[: len(words)]:
                grain = f" of grain {words[header.columns.index('id')].decode('latin-1')}"
            self.fault(
                f"column {name}{grain} is {token.decode('latin-1')}",
                "the run blew up at or before this step: use a smaller time step, or look for"
                " grains that coincide",
                line=line,
            )
        self.begin = match.end()
        return value

    # --- grains -----------------------------------------------------------------------------
    def lost(self, header: Header, values: FloatArray) -> IntArray | None:
        """Known grains that are not among rows; None when grains have no identifier."""
        if self.known is None or header.label != "ATOMS":
            return None
        found = values[:, header.columns.index("id")]
        return self.known[~np.isin(self.known, found[np.isfinite(found)].astype(np.int64))]

    def check_grains(self, header: Header, values: FloatArray) -> FloatArray:
        """Rows of grains, sorted by identifier, when none is lost or there twice."""
        if "id" not in header.columns:
            before = self.header_before
            if before is not None and header.rows < before.rows:
                self.fault(
                    f"grains are lost: {before.rows} before, {header.rows} here; no column id"
                    " says which",
                    "add id to the dump command; use a smaller time step",
                    line=self.line - header.rows,
                )
            return values
        number = values[:, header.columns.index("id")]
        odd = np.flatnonzero(~(np.abs(number) < _WHOLE_LARGEST) | (number != np.floor(number)))
        if len(odd):
            self.fault(
                f"{number[odd[0]]!r} is no identifier of a grain: not whole, or 2^53 and more",
                "write id as %d in dump_modify format",
                line=self.line - header.rows + 1 + int(odd[0]),
            )
        identifier = number.astype(np.int64)
        if not np.all(identifier[1:] > identifier[:-1]):
            order = np.argsort(identifier)
            identifier, values = identifier[order], np.take(values, order, axis=0)
            twice = np.flatnonzero(identifier[1:] == identifier[:-1])
            if len(twice):
                self.fault(
                    f"grains are there twice: {list_grains(np.unique(identifier[twice]))}",
                    "the dump is damaged, or two runs wrote to it: give each a file of its own",
                    line=self.line - header.rows + 1 + int(max(order[twice[0] : twice[0] + 2])),
                )
        lost = self.lost(header, values)
        if lost is not None and len(lost):
            what = "grains are lost" if header.rows else "the frame holds no grains"
            self.fault(
                f"{what}: {len(lost)} that should be there are not",
                "grains left the box or the step was too long: use a smaller time step, wider"
                " bounds, and 'thermo_modify lost error'",
                line=self.line - header.rows,
                lost=lost,
            )
        self.known = identifier
        return values
