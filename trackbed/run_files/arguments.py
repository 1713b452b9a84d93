"""What verbs share that run a scene to its end in a folder: their arguments, the cost that a dry
run states, and lines on the way."""

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from trackbed.errors import UsageError
from trackbed.run_files.folder import RunFolder
from trackbed.run_files.provenance import record_provenance
from trackbed.run_files.signals import raise_on_signals

TRIAL = 0.5
"""Time that a dry run may spend on trial steps to find the cost [s]."""


def add_run_arguments(
    parser: argparse.ArgumentParser, scene: str, override: str, resumed_from: str,
    *, needed: bool = True,
) -> None:  # fmt: skip
    """Add SCENE and its flags; the words say what a scene is, an override, and what goes on.

    ``needed``: whether there is nothing to do without a scene.
    """
    count = None if needed else "?"
    parser.add_argument("scene", metavar="SCENE", type=Path, nargs=count, help=scene)
    parser.add_argument(
        "--run-folder", type=Path, metavar="FOLDER", help="default: SCENE-run beside the scene"
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides",
        help=f"change a key of the scene, such as {override}; may be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--dry-run", action="store_true",
        help="check the scene and say what would run: steps, their length, what is left out",
    )  # fmt: skip
    parser.add_argument("--resume", action="store_true", help=f"go on from {resumed_from}")
    parser.add_argument(
        "--force", action="store_true", help="lose the run that is in the folder and start again"
    )
    parser.add_argument("--no-pictures", action="store_true", help="write the report without any")
    parser.add_argument("--json", action="store_true", help="print JSON on standard output")


def place_run(arguments: argparse.Namespace) -> Path:
    """The run's folder: the one given, or SCENE-run beside the scene.

    Raises `UsageError` for ``--resume`` beside ``--force``.
    """
    if arguments.resume and arguments.force:
        raise UsageError("--resume and --force exclude each other", remedy="give one of them")
    scene: Path = arguments.scene
    return arguments.run_folder or scene.parent / f"{scene.stem}-run"


def make_manifest(scene: dict[str, Any]) -> dict[str, Any]:
    """What a run folder keeps of a ``scene`` that the command line asks for."""
    return {"scene": scene, "provenance": record_provenance(["trackbed", *sys.argv[1:]])}


@contextmanager
def open_run(
    folder: RunFolder, manifest: Mapping[str, Any], scene: str, arguments: argparse.Namespace,
    kept: str,
) -> Iterator[bool]:  # fmt: skip
    """Hold the ``folder`` of a run, made ready by `RunFolder.prepare`; gives whether a run goes on.

    ``kept`` says what a signal leaves.  Raises as `RunFolder.prepare`, and `Interrupted`.
    """
    remedy = "the same command with --resume goes on from there"
    with folder.lock(), raise_on_signals(kept, remedy, str(folder.path)):
        yield folder.prepare(manifest, scene, resume=arguments.resume, force=arguments.force)


def time_step(advance: Callable[[float], object], step: float, most: int) -> float:
    """Time of one of at ``most`` so many steps on the clock [s]; the first ones compile.

    ``advance`` goes on by so many seconds, ``step`` is the length of one step [s].
    """

    def time_trial(steps: int) -> float:
        started = time.perf_counter()
        advance(steps * step)
        return time.perf_counter() - started

    time_trial(1)
    steps = 1
    while (spent := time_trial(steps)) <= TRIAL / 4 and 2 * steps <= most:
        steps *= 2
    return min(spent, time_trial(steps)) / steps  # what first touches in a trial compiles there


class Progress:
    """How far a run is, on standard error: lines that are ``apart`` [s] at least."""

    def __init__(self, apart: float = 10.0) -> None:
        self.apart, self._printed = apart, time.monotonic()
        self._first: tuple[float, float] | None = None

    def report(self, done: float, total: float, text: str) -> None:
        """So much of the ``total`` is done, in words the ``text``; the first call is the start."""
        now = time.monotonic()
        first = self._first = self._first or (now, done)
        if now - self._printed >= self.apart and done > first[1]:
            self._printed = now
            left = (now - first[0]) / (done - first[1]) * max(total - done, 0.0)
            with suppress(OSError):  # who reads this line may be gone; the run goes on
                print(f"{text}, {left:.0f} s left", file=sys.stderr, flush=True)
