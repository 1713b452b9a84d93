"""The kernel against assembled matrices: each contestant in a process of its own, one at a time.

    python -m validation.studies.qdem_cost.race '{"who": "qdem", "threads": 2}' 222 22 20

All advance the same beam under a force at its tip by public calls.  A contestant is measured in a
new process in every round, so that none is judged by where its memory happened to lie.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numba import njit, prange, set_num_threads

import qdem_fem as q
from qdem_fem.files.errors import LibraryMissing
from qdem_fem.mesh.generation import make_box_mesh
from validation.bench.qdem_gpu.beam import FORCE, MATERIAL, SIZE
from validation.studies.qdem_cost.matrices import (
    ENVIRONMENT,
    MklRival,
    ScipyRival,
    build_problem,
    load_mkl,
)

DURATION = 6.5e-4
"""Warm-up [s]: a wave of 4.5 km/s has been at every node, and no number is denormal any more."""
SECONDS = 3.0
"""Length of a measurement [s]."""
UNWANTED = ("OMP_", "MKL_", "KMP_", "GOMP_", "NUMBA_NUM_THREADS", "NUMBA_THREADING_LAYER")


@dataclass(frozen=True)
class Contestant:
    """Who computes, and how."""

    who: Literal["qdem", "mkl", "scipy"]
    precision: Literal["float64", "float32"] = "float64"
    threads: int = 1
    viscosity: float = 0.0
    """Shear viscosity [Pa s]."""
    strain: Literal["finger", "small"] = "finger"
    storage: str = ""
    """Of MKL's matrix: compressed rows, or blocks of 3 x 3."""

    @property
    def name(self) -> str:
        """For people."""
        how = (
            self.strain + ", viscous" * (self.viscosity > 0) if self.who == "qdem" else self.storage
        )
        return " ".join(filter(None, (self.who, how, self.precision, f"{self.threads} threads")))


QDEM = [
    Contestant("qdem", precision, threads)
    for precision in ("float64", "float32")
    for threads in (1, 2)
]  # fmt: skip
CONTESTANTS = [
    *QDEM,
    Contestant("qdem", threads=2, viscosity=1e3), Contestant("qdem", threads=2, strain="small"),
    Contestant("scipy"),
    *(Contestant("mkl", one.precision, one.threads, storage=storage)
      for storage in ("rows", "blocks") for one in QDEM),
]  # fmt: skip


def start_qdem(one: Contestant, nodes: Any, elements: Any) -> tuple[Callable[[int], None], Any]:
    """Ours: what advances so many steps, and u [m], (n, 3)."""
    young, poisson, density = MATERIAL
    material = q.Material(young, poisson, density, shear_viscosity=one.viscosity)
    beam = q.Body((nodes, elements), material, name="beam")
    run = q.Simulation([beam], strain=one.strain, precision=one.precision, threads=one.threads)
    run.fix(beam, nodes[:, 0] == 0)
    run.load(beam, np.isclose(nodes[:, 0], SIZE[0]), FORCE)
    run.advance(DURATION)
    return lambda steps: run.advance(steps * run.step), lambda: beam.displacement  # type: ignore[return-value]


def start_matrix(one: Contestant, nodes: Any, elements: Any) -> tuple[Callable[[int], None], Any]:
    """The rivals."""
    tip = np.isclose(nodes[:, 0], SIZE[0])
    force = np.zeros_like(nodes)
    force[tip] = np.array(FORCE) / tip.sum()
    problem = build_problem(nodes, elements, MATERIAL, nodes[:, 0] == 0, force)
    rival: Any = ScipyRival(problem, one.precision)
    if one.who == "mkl":
        rival = MklRival(problem, one.precision, one.threads, one.storage)
    rival.advance(round(DURATION / problem.step))
    return rival.advance, rival.displacement


def measure_speed(one: Contestant, cells: tuple[int, int, int]) -> dict[str, float]:
    """Million elements times steps a second of wall, and where the tip is after the warm-up [m]."""
    mesh = make_box_mesh(SIZE, cells, "five")
    start = start_qdem if one.who == "qdem" else start_matrix
    advance, displacement = start(one, mesh.nodes, mesh.elements)
    tip = float(displacement()[np.isclose(mesh.nodes[:, 0], SIZE[0]), 2].mean())
    steps, took = 4, 0.0
    while took < SECONDS / 4:
        steps *= 2
        began = time.perf_counter()
        advance(steps)
        took = time.perf_counter() - began
    steps = round(steps * SECONDS / took)
    began = time.perf_counter()
    advance(steps)
    speed = len(mesh.elements) * steps / (time.perf_counter() - began) / 1e6
    return {"speed": speed if np.isfinite(displacement()).all() else np.nan, "tip": tip}


def race(cells: tuple[int, int, int], rounds: int) -> dict[str, dict[str, float]]:
    """Every contestant in ``rounds`` turns: the median speed [Mel/s], and its tip [m]."""
    try:
        load_mkl()
        contestants = CONTESTANTS
    except LibraryMissing:
        contestants = [one for one in CONTESTANTS if one.who != "mkl"]
    kept = {name: value for name, value in os.environ.items() if not name.startswith(UNWANTED)}
    found: dict[str, list[dict[str, float]]] = {one.name: [] for one in contestants}
    for _ in range(rounds):
        for one in contestants:
            words = [json.dumps(asdict(one)), *map(str, cells)]
            printed = subprocess.run(
                [sys.executable, "-m", "validation.studies.qdem_cost.race", *words], check=True,
                stdout=subprocess.PIPE, cwd=Path(__file__).parents[3], env=kept | ENVIRONMENT,
            )  # fmt: skip
            found[one.name].append(json.loads(printed.stdout))
    return {
        name: {"speed": float(np.median([turn["speed"] for turn in turns])), "tip": turns[0]["tip"]}
        for name, turns in found.items()
    }


# --- the machine --------------------------------------------------------------------------------


@njit(parallel=True, fastmath=True, cache=True)
def _run_triad(a: Any, b: Any, c: Any, threads: int, rounds: int) -> None:
    for thread in prange(threads):
        first, last = thread * a.size // threads, (thread + 1) * a.size // threads
        for number in range(rounds):
            for i in range(first, last):
                a[i] = b[i] + (0.5 + number) * c[i]


def measure_bandwidth(threads: int, size: int = 16_000_000, rounds: int = 5) -> float:
    """STREAM's triad a = b + s c in memory, 24 bytes an element [GB/s]; the best of five."""
    a, b, c = (np.full(size, value) for value in (0.0, 1.0, 2.0))
    set_num_threads(threads)
    _run_triad(a, b, c, threads, 1)
    walls = []
    for _ in range(5):
        began = time.perf_counter()
        _run_triad(a, b, c, threads, rounds)
        walls.append(time.perf_counter() - began)
    return 24 * size * rounds / min(walls) / 1e9


def count_bytes(elements: int, nodes: int) -> float:
    """Least traffic of a step to memory [B], elastic, float64, if each array moved once.

    An element's nine gradients, two stiffnesses and four node numbers are read; a node's
    displacement, velocity and force, four numbers each, are read and written, its inverse mass
    is read.
    """
    return 11 * 8 + 4 * 4 + (3 * 2 * 4 + 1) * 8 * nodes / elements


if __name__ == "__main__":
    words = sys.argv[1:]
    print(json.dumps(measure_speed(
        Contestant(**json.loads(words[0])), (int(words[1]), int(words[2]), int(words[3]))
    )))  # fmt: skip
