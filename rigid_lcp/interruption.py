"""Ctrl-C and SIGTERM end a run with a sentence that says what is kept."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rigid_lcp.errors import Interrupted


@contextmanager
def interruptible(folder: Path) -> Iterator[None]:
    """SIGTERM and Ctrl-C raise `Interrupted` inside, with the name of the run's ``folder``.

    In the main thread only: elsewhere whoever runs us takes care of signals.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, _frame: object) -> None:
        raise Interrupted(
            f"{folder}: stopped by {signal.Signals(number).name}; every finished frame is saved"
            "\n  -> the same command with --resume goes on from the last one"
        )

    before = {number: signal.signal(number, stop) for number in (signal.SIGTERM, signal.SIGINT)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)
