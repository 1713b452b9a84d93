"""Contestants of the speed report: each in a process of its own, computing only in its turn.

Threads of MKL and of OpenMP that wait for work spin, for 0.2 s or without end, and would take the
processors from whoever comes next.  So a contestant's process is stopped by a signal between its
turns.  They take turns in several rounds, so that a change of the machine's speed hits all alike,
in new processes in every round, so that none is judged by where its memory happened to lie.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from validation.machine_limits import QUIET_SHARE, measure
from validation.matrix_rivals import (
    ENVIRONMENT,
    MklRival,
    Rival,
    ScipyRival,
    linear_problem,
    problem_load,
    problem_save,
)

SIZE = (2.4, 0.25, 0.22)
"""The beam [m]."""
MATERIAL = (45e9, 0.167, 2350.0)
"""E [Pa], nu, rho [kg/m^3] of the paper's concrete."""
VISCOSITY = 1e3
"""Shear viscosity of the viscous run [Pa s]; small, so that the time step hardly falls."""
FORCE = (100.0, 50.0, -1000.0)
"""Total force on the tip [N]; three components, so that no displacement stays zero."""
DURATION = 6.5e-4
"""Warm-up [s]: a wave of 4.5 km/s has been at every node, and no number is denormal any more."""
QUIET_ROUNDS = 3
"""So many quiet turns are needed of every contestant."""


@dataclass(frozen=True)
class Contestant:
    """Who computes, and how."""

    who: str
    """``"qdem"``, ``"mkl"`` or ``"scipy"``."""
    precision: Literal["float64", "float32"] = "float64"
    threads: int = 1
    viscous: bool = False
    strain: Literal["finger", "small"] = "finger"
    storage: str = "rows"

    @property
    def name(self) -> str:
        """For people."""
        special = {"qdem": self.strain + ", viscous" * self.viscous, "mkl": self.storage}
        parts = (self.who, special.get(self.who, ""), self.precision, f"{self.threads} threads")
        return " ".join(filter(None, parts))


@dataclass(frozen=True)
class Turn:
    """One timed turn of a contestant."""

    steps: int
    wall: float
    """[s]"""
    cpu: float
    """[s]"""
    others: float
    """Share of the processors that others took."""
    finite: bool
    """The state after the turn is."""


@dataclass(frozen=True)
class Result:
    """What a contestant achieved."""

    elements: int
    turns: tuple[Turn, ...]
    tip: float
    """Vertical displacement of the tip after the warm-up [m]."""

    @property
    def quiet_turns(self) -> int:
        """Turns in which others took next to nothing."""
        return len(self._quiet())

    @property
    def speed(self) -> float:
        """Median by wall time of the quiet turns, of all if there is none [Mel/s].

        nan if the state did not stay finite.
        """
        return self._median("wall")

    @property
    def speed_cpu(self) -> float:
        """The same by processor time [Mel/s]."""
        return self._median("cpu")

    @property
    def threads_used(self) -> float:
        """Processor over wall time, median of the turns."""
        return float(np.median([turn.cpu / turn.wall for turn in self.turns]))

    def _quiet(self) -> list[Turn]:
        return [turn for turn in self.turns if turn.others <= QUIET_SHARE]

    def _median(self, clock: str) -> float:
        if not all(turn.finite for turn in self.turns):
            return np.nan
        turns = self._quiet() or self.turns
        rates = [turn.steps / getattr(turn, clock) for turn in turns]
        return float(self.elements * np.median(rates) / 1e6)


# --- the race -----------------------------------------------------------------------------------


def problem_write(folder: Path, nodes: Any, elements: Any) -> None:
    """Files for the processes: the mesh, and the rivals' matrix."""
    tip = np.isclose(nodes[:, 0], SIZE[0])
    force = np.zeros_like(nodes)
    force[tip] = np.array(FORCE) / tip.sum()
    np.savez(folder / "mesh.npz", nodes=nodes, elements=elements, tip=tip)
    problem = linear_problem(nodes, elements, MATERIAL, nodes[:, 0] == 0, force)
    problem_save(folder / "matrix.npz", problem)


class Runner:
    """The process of a contestant, stopped whenever it is not its turn."""

    def __init__(self, contestant: Contestant, folder: Path) -> None:
        command = [sys.executable, __file__, json.dumps(asdict(contestant)), str(folder)]
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment(contestant),
        )
        self.name = contestant.name
        self.ready = self._answer()

    def turn(self, seconds: float) -> Turn:
        """Let it compute for about so long."""
        assert self.process.stdin is not None
        self.process.send_signal(signal.SIGCONT)
        self.process.stdin.write(f"{seconds}\n")
        self.process.stdin.flush()
        return Turn(**self._answer())

    def _answer(self) -> Any:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        if not line:
            raise RuntimeError(f"{self.name} ended with exit code {self.process.wait()}")
        self.process.send_signal(signal.SIGSTOP)
        return json.loads(line)

    def end(self) -> None:
        """End the process, stopped or not."""
        self.process.kill()
        self.process.communicate()


def race(
    contestants: list[Contestant], folder: Path, rounds: int, seconds: float
) -> dict[Contestant, Result]:
    """Turns of all contestants, A, B, C, A, B, C, ..., in processes that are new in every round.

    Where the system puts a process's memory can cost it a third of its speed as long as it lives,
    so a median over turns of one process would be a judgement on that place.  Up to twice as many
    rounds more for those without enough quiet turns.
    """
    answers: dict[Contestant, list[Any]] = {contestant: [] for contestant in contestants}
    turns: dict[Contestant, list[Turn]] = {contestant: [] for contestant in contestants}

    def results() -> dict[Contestant, Result]:
        return {
            c: Result(answers[c][-1]["elements"], tuple(turns[c]), answers[c][-1]["tip"])
            for c in contestants
        }

    racing = contestants
    for number in range(3 * rounds):
        if number >= rounds:
            racing = [c for c, result in results().items() if result.quiet_turns < QUIET_ROUNDS]
        runners: dict[Contestant, Runner] = {}
        try:
            for contestant in racing:
                runners[contestant] = Runner(contestant, folder)
            for contestant, runner in runners.items():
                turns[contestant].append(runner.turn(seconds))
                answers[contestant].append(runner.ready)
        finally:
            for runner in runners.values():
                runner.end()
    return results()


def environment(contestant: Contestant) -> dict[str, str]:
    """A user's, without what others set for threads; MKL keeps the threads it is told to use."""
    unwanted = ("OMP_", "MKL_", "KMP_", "GOMP_", "NUMBA_NUM_THREADS", "NUMBA_THREADING_LAYER")
    kept = {name: value for name, value in os.environ.items() if not name.startswith(unwanted)}
    root = str(Path(__file__).resolve().parents[1])
    return kept | {"PYTHONPATH": root} | (ENVIRONMENT if contestant.who == "mkl" else {})


# --- the process of a contestant ----------------------------------------------------------------


def contestant_main(contestant: Contestant, folder: Path) -> None:
    """Warm up, say so, then a turn for each line of standard input that names its seconds."""
    with np.load(folder / "mesh.npz") as file:
        nodes, elements, tip = file["nodes"], file["elements"], file["tip"]
    start = qdem_start if contestant.who == "qdem" else matrix_start
    advance, displacement, step = start(contestant, folder, nodes, elements, tip)
    steps = round(DURATION / step)
    advance(steps)
    answer = {"tip": float(displacement()[tip, 2].mean()), "elements": len(elements)}
    began = time.perf_counter()
    pace = advance(1 + steps // 10) / (time.perf_counter() - began)
    print(json.dumps(answer), flush=True)
    for line in sys.stdin:
        count = [max(1, round(float(line) * pace))]

        def work(count: list[int] = count) -> None:
            count[0] = advance(count[0])

        interval = measure(work)
        pace = count[0] / interval.wall
        finite = bool(np.isfinite(displacement()).all())
        turn = Turn(count[0], interval.wall, interval.cpu, interval.others, finite)
        print(json.dumps(asdict(turn)), flush=True)


Start = tuple[Callable[[int], int], Callable[[], Any], float]
"""Advances so many steps and returns how many it did; u [m], (n, 3); the time step [s]."""


def qdem_start(contestant: Contestant, folder: Path, nodes: Any, elements: Any, tip: Any) -> Start:
    """Ours, by its public calls."""
    import qdem_fem as q

    young, poisson, density = MATERIAL
    viscosity = VISCOSITY if contestant.viscous else 0.0
    material = q.Material(young=young, poisson=poisson, density=density, shear_viscosity=viscosity)
    beam = q.Body((nodes, elements), material, name="beam")
    simulation = q.Simulation(
        [beam],
        strain=contestant.strain,
        precision=contestant.precision,
        threads=contestant.threads,
    )
    simulation.fix(beam, nodes[:, 0] == 0)
    simulation.load(beam, tip, FORCE)

    def advance(steps: int) -> int:
        before = simulation.steps_done
        simulation.advance(steps * simulation.step)
        return int(simulation.steps_done - before)

    return advance, lambda: beam.displacement, float(simulation.step)


def matrix_start(
    contestant: Contestant, folder: Path, nodes: Any, elements: Any, tip: Any
) -> Start:
    """The rivals."""
    problem = problem_load(folder / "matrix.npz")
    rival: Rival
    if contestant.who == "mkl":
        rival = MklRival(problem, contestant.precision, contestant.threads, contestant.storage)
    else:
        rival = ScipyRival(problem, contestant.precision)

    def advance(steps: int) -> int:
        rival.advance(steps)
        return steps

    return advance, rival.displacement, problem.step


if __name__ == "__main__":
    contestant_main(Contestant(**json.loads(sys.argv[1])), Path(sys.argv[2]))
