"""Processes of an engine: its program, a run of a deck to its end or to what ended it early.

A deck says ``COMPLETE step N`` when it is through: no exit code proves that.
"""

import ctypes
import os
import re
import shutil
import signal
import subprocess
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import repeat
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory

from adapters.bed import list_wall_names
from adapters.engines.contract import EngineRun, EngineStart
from adapters.engines.plan import PLAN
from adapters.errors import EngineFailed, EngineMissing, NotConverged
from adapters.scene import Scene


@dataclass(frozen=True)
class ProcessNumbers:
    """Times and lengths by which a process is watched."""

    poll_s: float = 0.05  # between two looks at a running engine [s]: a look costs 0.3 ms,
    poll_most_s: float = 1.0  # and at most in a long run [s],
    poll_share: float = 1e-3  # where it is so great a part of the run's length [-]
    end_s: float = 10  # for an engine to end when it is asked to, before it is killed [s]
    start_s: float = 30  # from its start in which a second one beside it is looked for [s]
    start_bytes: int = 1 << 16  # of its print in which the engines' first words are looked for
    patience_s: float = 60  # for a program to print its version [s]
    silent_s: float = 7200
    """Without a word in any file before an engine is ended [s]: ten million grains on one core
    write a line in an hour."""


PROCESS = ProcessNumbers()


def _die_with_parent() -> None:
    """Have the kernel end this child when Python is killed, so that no orphan keeps computing."""
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # 1 = PR_SET_PDEATHSIG


def run_process(
    command: Sequence[str], folder: Path, watch: Callable[[], None], silent_s: float = inf
) -> tuple[int, float, float]:
    """Run ``command`` in ``folder``, output to ``screen.txt``; exit status, CPU s, elapsed s.

    On any exception, Ctrl-C included, it is ended first as `end_process` does.
    Raises `EngineMissing` when the program cannot be started, `EngineFailed` when it writes
    nothing in its folder for ``silent_s``.
    """
    environment = os.environ | {
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    }
    started = time.monotonic()
    with (folder / "screen.txt").open("wb") as screen:
        try:
            child = subprocess.Popen(
                command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=screen,
                stderr=subprocess.STDOUT, start_new_session=True, preexec_fn=_die_with_parent,
            )  # fmt: skip
        except OSError as error:
            raise EngineMissing(
                f"cannot start {command[0]} ({error.strerror})",
                remedy="install it, or correct the scene's engine.launcher; see: trackbed doctor",
            ) from error
        try:
            pid, written, silent = 0, 0, 0.0
            while pid == 0:
                pause = max(PROCESS.poll_s, PROCESS.poll_share * (time.monotonic() - started))
                pause = min(pause, PROCESS.poll_most_s)
                time.sleep(pause)
                watch()
                # pauses are summed: a batch system may have halted us both for a day
                now = find_last_change(folder)
                written, silent = now, silent + pause if now == written else 0.0
                if silent > silent_s:
                    raise explain_silence(folder, silent)
                pid, status, usage = os.wait4(child.pid, os.WNOHANG)
        except BaseException:
            end_process(child)
            raise
    child.returncode = os.waitstatus_to_exitcode(status)
    return child.returncode, usage.ru_utime + usage.ru_stime, time.monotonic() - started


def end_process(child: subprocess.Popen[bytes]) -> None:
    """Ask a process group to end, and kill what of it is left after `PROCESS.end_s`.

    A launcher that is killed cannot inform the tasks it started elsewhere: srun's belong to the
    daemon of SLURM, and would go on computing in the folder in which the run is resumed.
    """
    try:
        with suppress(ProcessLookupError):
            os.killpg(child.pid, signal.SIGTERM)
        until = time.monotonic() + PROCESS.end_s
        # Not reaped before the last signal: the number of its group stays its own.
        while time.monotonic() < until and not os.waitid(
            os.P_PID, child.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT
        ):
            time.sleep(0.01)
    finally:
        with suppress(ProcessLookupError):
            os.killpg(child.pid, signal.SIGKILL)
        child.wait()


def find_last_change(folder: Path) -> int:
    """Time of the last change of a file in a folder [ns]; one that the engine removes counts no
    longer."""
    last = 0
    with os.scandir(folder) as entries:
        for one in entries:
            with suppress(FileNotFoundError):
                last = max(last, one.stat(follow_symlinks=False).st_mtime_ns)
    return last


def explain_silence(folder: Path, silent_s: float) -> EngineFailed:
    """The error for an engine that hangs, with its last words; no jump is to blame for it."""
    error = EngineFailed(
        f"the engine wrote nothing for {silent_s / 60:.3g} minutes and was ended; its last "
        f"words: {read_screen_tail(folder) or 'none'}",
        where=str(folder),
        remedy="look whether its launcher or disk hangs, then: trackbed resume RUN",
    )
    error.from_outside = True
    return error


CRASHES = (signal.SIGSEGV, signal.SIGFPE, signal.SIGABRT, signal.SIGBUS, signal.SIGILL)
"""Signals by which a program ends itself; all others come from outside."""


def read_screen_tail(folder: Path, lines: int = 3) -> str:
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


def explain_engine_failure(status: int, folder: Path) -> EngineFailed:
    """The error for a process that ended badly, with the engine's own words.

    ``status`` is its exit code, or minus the signal that ended it; shells and mpirun say
    128 + signal.
    """
    number = -status if status < 0 else status - 128
    if number in signal.valid_signals():
        how = f"was ended by {signal.Signals(number).name}"
    else:
        how = f"ended with exit code {status} and no sentinel line"
    tail = read_screen_tail(folder)
    meant = (meaning for words, meaning in SAID.items() if words in tail)
    error = EngineFailed(
        f"the engine {how}: {tail}",
        where=str(folder),
        remedy=next(meant, "remove the cause and go on with: trackbed resume RUN"),
    )
    error.from_outside = number in signal.valid_signals() and number not in CRASHES
    return error


CPU_USE = re.compile(r"^([\d.]+)% CPU use with", re.MULTILINE)
"""How LAMMPS says what share of the elapsed time each of its processes computed."""
COMPLETE = re.compile(r"^COMPLETE step \d+", re.MULTILINE)
"""The last line of every deck: no exit code proves that a run got so far."""


def refuse_several(folder: Path, begun: re.Pattern[str], launch: str) -> None:
    """Raise `EngineFailed` when more than one run prints in ``folder``; before they compute.

    A launcher of another MPI starts runs of one process each, that all write the same files and
    end well.
    """
    try:
        with (folder / "screen.txt").open("rb") as stream:
            text = stream.read(PROCESS.start_bytes).decode(errors="replace")
    except OSError:
        return
    runs = len(begun.findall(text))
    if runs > 1:
        error = EngineFailed(
            f"{runs} runs of the engine started that know nothing of one another",
            where=str(folder),
            remedy=launch,
        )
        error.from_outside = True
        raise error


class ProcessEngine(ABC):
    """What engines with a process of their own share: how a deck is run and judged."""

    name: str
    title: str  # what it calls itself
    question: str = "-h"  # the word that its version is asked with
    banner: re.Pattern[str]
    """What it answers: group 1 is the version's text, further groups are numbers."""
    oldest: tuple[int, ...]  # those numbers of the oldest version that is known to work
    remedy: str  # how to get it
    begun: re.Pattern[str]
    """What the engine prints once when it starts; without it the failure came from outside (a
    launcher, a loader), twice it is two runs in one folder."""
    loop_time: re.Pattern[str]
    """Its words for the seconds that the time steps took and the processes they took them on, 1
    where it says CPU time."""
    launch: str  # how it is launched rightly
    ended_early: str | None = None
    """What it prints when it is ended by SIGTERM and exits 0 all the same."""
    piston_wall = "piston_wall"
    """Name of the piston among the walls whose forces ``states.dump`` holds."""

    @abstractmethod
    def command(self, scene: Scene, deck: str) -> list[str]:
        """Command line that runs ``deck`` in its folder."""

    def complete(self, scene: Scene, folder: Path) -> None:
        """Look at what a finished run left, and convert what others read in another form.

        Raises `EngineFailed` where there is no restart file, as on a full disk.
        """
        path = folder / "end.restart"
        if not path.exists() or path.stat().st_size == 0:
            raise EngineFailed(
                "the engine left no restart file",
                where=str(path),
                remedy="look whether the disk is full; resume computes it again",
            )

    def wall_names(self, scene: Scene, piston: bool) -> tuple[str, ...]:
        """Names of the walls whose forces ``states.dump`` holds, in the order of its columns."""
        names = list_wall_names(scene.container.walls())
        return (*names, self.piston_wall) if piston else names

    def program(self) -> list[str] | None:
        """Words that start it; None where it is not installed."""
        path = shutil.which(self.name)
        return None if path is None else [path]

    def version(self) -> str:
        """Version banner such as ``LAMMPS 22 Jul 2025 - Update 4``.

        Raises `EngineMissing` for a program that is missing, does not start, or is another one.
        """
        words = self.program()
        if words is None:
            raise EngineMissing(f"{self.title} is not installed", remedy=self.remedy)
        try:
            with TemporaryDirectory() as folder:  # LIGGGHTS writes a log where it is started
                asked = subprocess.run(
                    [*words, self.question], cwd=folder, capture_output=True, text=True,
                    errors="replace", stdin=subprocess.DEVNULL, timeout=PROCESS.patience_s,
                )  # fmt: skip
        except (OSError, subprocess.TimeoutExpired) as error:
            raise EngineMissing(
                f"{self.title} does not start ({error})", where=words[-1], remedy=self.remedy
            ) from error
        answer = asked.stdout + asked.stderr
        banner = self.banner.search(answer)
        if banner is None or tuple(map(int, banner.groups()[1:])) < self.oldest:
            wanted = ".".join(map(str, self.oldest))
            said = banner[0] if banner else (answer.strip().splitlines() or ["nothing"])[-1]
            raise EngineMissing(
                f"this is not {self.title} {wanted} or later; it says: {said.strip()}",
                where=words[-1],
                remedy=self.remedy,
            )
        text = banner[1].strip()
        return text if text.startswith(self.title) else f"{self.title} {text}"

    def cycles_done(self, scene: Scene, start: EngineStart, folder: Path) -> int:
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

    def run(
        self, scene: Scene, deck: str, folder: Path, watch: Callable[[], None],
        digests: dict[str, str],
    ) -> EngineRun:  # fmt: skip
        """Run a deck; raises `EngineFailed`, `EngineMissing`, `NotConverged` (not settled)."""
        started, command = time.monotonic(), self.command(scene, deck)

        def watch_start() -> None:
            if time.monotonic() - started < PROCESS.start_s:
                refuse_several(folder, self.begun, self.launch)
            watch()

        status, cpu_s, wall_s = run_process(command, folder, watch_start, PROCESS.silent_s)
        refuse_several(folder, self.begun, self.launch)
        text = (folder / "screen.txt").read_text(errors="replace")
        if "NOT SETTLED" in text:
            raise NotConverged(
                f"the bed still moves after {PLAN.settle_times} falling times",
                where=str(folder),
                remedy="more damping (viscous_alpha), or a shorter time step",
            )
        if status == 0 and self.ended_early is not None and self.ended_early in text:
            raise explain_engine_failure(-signal.SIGTERM, folder)
        if status != 0 or COMPLETE.search(text) is None:
            failure = explain_engine_failure(status, folder)
            failure.from_outside |= self.begun.search(text) is None
            raise failure
        self.complete(scene, folder)
        return EngineRun(tuple(command), cpu_s, wall_s, self.find_start_up(cpu_s, text), digests)

    def find_start_up(self, cpu_s: float, text: str) -> float:
        """CPU time [s] that was not spent in time steps, of ``cpu_s`` in all, by what was printed.

        Their elapsed time counts by the share of a processor that LAMMPS prints behind it; LIGGGHTS
        prints none, and on a machine that is shared less is left for the start-up then.
        """
        loops, shares = self.loop_time.findall(text), CPU_USE.findall(text)
        used = map(float, shares) if len(shares) == len(loops) else repeat(100.0)
        spent = [float(s) * int(n or 1) * u / 100 for (s, n), u in zip(loops, used, strict=False)]
        return max(cpu_s - sum(spent), 0.0)
