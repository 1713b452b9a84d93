"""Progress of a run: one line rewritten on a terminal, plain lines elsewhere; always on stderr."""

from __future__ import annotations

import sys
import time


class Progress:
    """Tells cycles computed and jumped, settlement and time left."""

    def __init__(self, quiet: bool = False) -> None:
        self.stream, self.quiet = sys.stderr, quiet
        self.terminal = self.stream.isatty()
        self._printed = 0.0
        self._first: tuple[float, int] | None = None

    def start(self) -> None:
        """Start to count time and cycles again, for another run."""
        self._first = None

    def print_line(self, text: str) -> None:
        """A line that stays."""
        if not self.quiet:
            print(("\r\x1b[K" if self.terminal else "") + text, file=self.stream, flush=True)

    def show_cycles(
        self, *, done: int, total: int, computed: int, settlement: float | None, computed_here: int,
        to_compute: int,
    ) -> None:  # fmt: skip
        """How far the run is.

        ``done`` and ``computed`` cycles of ``total``; ``settlement`` of the loaded body [m];
        ``computed_here`` by this process, ``to_compute`` still.
        """
        now = time.monotonic()
        if self._first is None:
            self._first = now, computed_here
        if self.quiet or now - self._printed < (0.2 if self.terminal else 10.0):
            return
        self._printed = now
        text = f"cycle {done} of {total}: {computed} computed, {done - computed} jumped"
        if settlement is not None:
            text += f", settlement {1e6 * settlement:.1f} um"
        started, at_start = self._first
        if computed_here > at_start:
            left = (now - started) / (computed_here - at_start) * to_compute
            text += f", {left / 60:.0f} min left" if left > 90 else f", {left:.0f} s left"
        if self.terminal:
            print(f"\r\x1b[K{text}", end="", file=self.stream, flush=True)
        else:
            print(text, file=self.stream, flush=True)
