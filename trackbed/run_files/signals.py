"""Ctrl-C and SIGTERM end a run with a sentence that says what is kept."""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

from trackbed.errors import Interrupted


@contextmanager
def handle_signals(act: Callable[[signal.Signals], None], *, once: bool = False) -> Iterator[None]:
    """Call ``act`` for SIGTERM and Ctrl-C inside; the handlers before come back behind it.

    With ``once`` they come back at the first signal already.  In the main thread only: elsewhere
    whoever runs us takes care of signals.
    """
    before: dict[signal.Signals, Any] = {}

    def restore() -> None:
        for number, old in before.items():
            signal.signal(number, signal.SIG_DFL if old is None else old)

    def call_handler(number: int, _frame: object) -> None:
        if once:
            restore()
        act(signal.Signals(number))

    with suppress(ValueError):  # not in the main thread
        for number in (signal.SIGTERM, signal.SIGINT):
            before[number] = signal.signal(number, call_handler)
    try:
        yield
    finally:
        restore()


@contextmanager
def raise_on_signals(kept: str, remedy: str, where: str = "") -> Iterator[None]:
    """Raise `Interrupted` at a signal: ``kept`` says what is saved, ``remedy`` how to go on."""

    def stop(number: signal.Signals) -> None:
        place = f"{where}: " if where else ""
        raise Interrupted(f"{place}stopped by {number.name}; {kept}\n  -> {remedy}")

    with handle_signals(stop):
        yield


@dataclass
class Stop:
    """Whether we were asked to stop: ``name`` of the signal."""

    name: str = ""


@contextmanager
def note_signals() -> Iterator[Stop]:
    """Only note a signal: the run looks at it where it can save its state.

    A second signal stops at once, as if we were not there.
    """
    stop = Stop()

    def note(number: signal.Signals) -> None:
        stop.name = number.name
        print(f"{stop.name}: the state is saved, then the run stops", file=sys.stderr)

    with handle_signals(note, once=True):
        yield stop
