"""The text of a dump, block by block and line by line, and the words for its faults."""

from __future__ import annotations

import zlib
from gzip import GzipFile
from io import FileIO
from pathlib import Path
from typing import NoReturn

import numpy as np

from adapters.bed import IntArray
from adapters.errors import DumpError

TEXT_BLOCK = 1 << 20
"""Bytes read at once; also the longest line that is taken for text."""
WRITE_TEXT = "write text with 'dump ID all custom N FILE id x y z ...' or 'dump ID all local ...'"


class DumpText:
    """A dump on its way: a block of its text, and the frames that are read so far."""

    def __init__(self, path: Path, stream: FileIO | GzipFile) -> None:
        self.path, self.stream = path, stream
        self.block = bytearray(TEXT_BLOCK)
        self.text = np.frombuffer(self.block, np.uint8)
        self.begin = self.end = 0  # block[begin:end] is read from the file, but not yet used
        self.line = 0  # lines used so far
        self.cut = False  # compressed data stopped before their end mark
        self.step: int | None = None
        self.step_before: int | None = None
        self.complete = 0

    def more(self) -> bool:
        """Read on behind what is not yet used; False at the end of the file."""
        unused = self.end - self.begin
        if unused == TEXT_BLOCK:
            self.fault(
                f"a line is longer than {TEXT_BLOCK} bytes: this is no text dump",
                WRITE_TEXT,
                line=self.line + 1,
            )
        self.block[:unused] = self.block[self.begin : self.end]
        self.begin, self.end = 0, unused
        try:
            count = self.stream.readinto(memoryview(self.block)[unused:])
        except EOFError:
            self.cut, count = True, 0
        except (OSError, zlib.error) as error:
            self.fault(
                f"the file cannot be read further ({error})",
                "copy or write the file again",
                line=self.line + 1,
            )
        self.end += count
        return bool(count)

    def read_line(self) -> str | None:
        """The next line; None when the file ends before it does."""
        while (stop := self.block.find(b"\n", self.begin, self.end)) < 0:
            if not self.more():
                return None
        line = self.block[self.begin : stop].decode(errors="backslashreplace")
        self.begin, self.line = stop + 1, self.line + 1
        return line.strip()

    def fault(
        self,
        what: str,
        remedy: str,
        *,
        line: int | None = None,
        incomplete_end: bool = False,
        lost: IntArray | None = None,
    ) -> NoReturn:
        """Raise the error of a fault at a line, else at the last one used."""
        place = [str(self.path), f"line {self.line if line is None else line}"]
        if self.step is not None:
            place.append(f"time step {self.step}")
        elif self.step_before is not None:
            place.append(f"after time step {self.step_before}")
        else:
            place.append("before the first time step")
        if lost is not None and len(lost):
            what += f"; lost grains: {list_grains(lost)}"
        raise DumpError(
            what,
            where=", ".join(place),
            remedy=remedy,
            complete_frames=self.complete,
            incomplete_end=incomplete_end,
            lost_ids=() if lost is None else tuple(lost.tolist()),
        )

    def refuse_incomplete(self, what: str, lost: IntArray | None = None) -> NoReturn:
        """Raise the error of a file that ends inside a frame."""
        self.fault(
            what,
            f"the engine was stopped or is still writing: keep the {self.complete} whole frames"
            " before, or run again; a whole file ends with a line end",
            line=self.line + 1,
            incomplete_end=True,
            lost=lost,
        )


def list_grains(identifiers: IntArray) -> str:
    """At most ten identifiers as text, and how many there are."""
    text = ", ".join(map(str, identifiers[:10].tolist()))
    return text if len(identifiers) <= 10 else f"{text}, ... ({len(identifiers)} in all)"
