"""Ctrl-C and SIGTERM end a run with a sentence that says what is kept."""

import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any

from trackbed.errors import Interrupted


@dataclass
class Stop:
    """Whether we were asked to stop: ``name`` of the signal."""

    name: str = ""


HEARD = Stop()
"""The Ctrl-C that a command got; Python drops what is raised while it clears away an object."""


@contextmanager
def note_interrupts() -> Iterator[None]:
    """Raise `KeyboardInterrupt` at Ctrl-C inside, and again where a run begins or the block ends
    if nobody took notice."""

    def interrupt(number: signal.Signals) -> None:
        HEARD.name = number.name
        raise KeyboardInterrupt

    try:
        with handle_signals(interrupt, (signal.SIGINT,)):
            yield
            raise_if_heard()
    finally:
        HEARD.name = ""


def raise_if_heard() -> None:
    """Raise `KeyboardInterrupt` if there was one."""
    if HEARD.name:
        raise KeyboardInterrupt


@contextmanager
def handle_signals(
    act: Callable[[signal.Signals], None],
    numbers: Sequence[signal.Signals] = (signal.SIGTERM, signal.SIGINT), *, once: bool = False,
) -> Iterator[None]:  # fmt: skip
    """Call ``act`` for these signals inside; the handlers before come back behind it.

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
        for number in numbers:
            before[number] = signal.signal(number, call_handler)
    try:
        yield
    finally:
        restore()


@contextmanager
def hold_signals() -> Iterator[None]:
    """Act on a signal only when the block ends: its files are closed, what it writes is whole."""
    held: list[signal.Signals] = []
    try:
        with handle_signals(held.append):
            yield
    finally:
        for number in held[:1]:
            signal.raise_signal(number)


@contextmanager
def raise_on_signals(kept: str, remedy: str, where: str = "") -> Iterator[None]:
    """Raise `Interrupted` at a signal: ``kept`` says what is saved, ``remedy`` how to go on."""

    def stop(number: signal.Signals) -> None:
        place = f"{where}: " if where else ""
        raise Interrupted(f"{place}stopped by {number.name}; {kept}\n  -> {remedy}")

    raise_if_heard()
    with handle_signals(stop):
        yield


@contextmanager
def note_signals() -> Iterator[Stop]:
    """Only note a signal: the run looks at it where it can save its state.

    A second signal stops at once, as if we were not there.
    """
    stop = Stop()

    def note(number: signal.Signals) -> None:
        stop.name = number.name
        print(f"{stop.name}: the state is saved, then the run stops", file=sys.stderr)

    raise_if_heard()
    with handle_signals(note, once=True):
        yield stop
