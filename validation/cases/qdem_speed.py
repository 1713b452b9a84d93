"""Speed of a QDEM step, beside the assembled matrix (MKL, scipy) and the machine's limits.

A cantilever of 2.4 x 0.25 x 0.22 m under a force at its tip.  The contestants (`qdem_race`) take
turns; compared are medians of the wall time of public calls, with nothing subtracted.  No speed
counts unless the state is finite and the tip is where the others have it.  Turns in which other
processes computed are left out, and a check says how many were left.

Mel/s: million elements times steps a second.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from qdem_fem import stress
from qdem_fem.mesh_generation import box_mesh
from validation.case import Check
from validation.machine_limits import QUIET_SHARE, MachineLimits, machine_limits_apart
from validation.qdem_race import (
    QUIET_ROUNDS,
    SIZE,
    Contestant,
    Result,
    environment,
    problem_write,
    race,
)

ROUNDS = 5
SECONDS, SECONDS_QUICK = 3.0, 0.6
"""Length of a turn, which is one call and bears its fixed cost too."""
TIP_TOLERANCE = 0.02
"""Between time steps, precisions and strain measures, at one time of the warm-up."""


OURS = Contestant("qdem", threads=2)
"""The one that the others are compared with."""
OURS_ONE = Contestant("qdem")
OURS_SINGLE = Contestant("qdem", "float32", 2)
VISCOUS = Contestant("qdem", threads=2, viscous=True)
SMALL = Contestant("qdem", threads=2, strain="small")
SCIPY = Contestant("scipy")
MKL = [
    replace(Contestant("mkl", threads=threads, storage=storage), precision=precision)
    for storage in ("rows", "blocks")
    for precision in ("float64", "float32")
    for threads in (1, 2)
]
CONTESTANTS = [
    OURS, SCIPY, *MKL, OURS_ONE, Contestant("qdem", "float32"), OURS_SINGLE, VISCOUS, SMALL,
]  # fmt: skip


def run(quick: bool) -> list[Check]:
    """Speeds [Mel/s], their ratios, and their shares of the machine's limits."""
    mesh = box_mesh(SIZE, (96, 10, 8) if quick else (222, 22, 20), "kuhn" if quick else "five")
    limits = [machine_limits_apart(environment(OURS))]
    with tempfile.TemporaryDirectory() as folder:
        problem_write(Path(folder), mesh.nodes, mesh.elements)
        results = race(CONTESTANTS, Path(folder), ROUNDS, SECONDS_QUICK if quick else SECONDS)
        compiled = first_call_seconds(Path(folder))
    limits.append(machine_limits_apart(environment(OURS)))
    imported = import_seconds()
    return [
        *speed_checks(results, quick),
        *limit_checks(results[OURS], len(mesh.nodes), limits),
        Check("first step in a new process, nothing compiled", compiled, "< 10", compiled < 10,
              "s CPU"),
        Check("import qdem_fem", imported, "< 1", imported < 1, "s"),
    ]  # fmt: skip


def speed_checks(results: dict[Contestant, Result], quick: bool) -> list[Check]:
    """The bars on speeds and ratios, and every contestant's figure.

    The bars beside MKL and on the speed itself are those of the full mesh.  The quick one's matrix
    half fits into the cache, where MKL's blocks are the faster: reported.
    """
    speed = {contestant: result.speed for contestant, result in results.items()}

    def best_mkl(precision: str, threads: int) -> float:
        return max(speed[c] for c in MKL if (c.precision, c.threads) == (precision, threads))

    mkl_rows = next(speed[c] for c in MKL if (c.precision, c.threads) == ("float64", 2))
    tips = np.array([result.tip for result in results.values()])
    ours = speed[OURS]
    apart = float(np.abs(tips / results[SCIPY].tip - 1).max())
    quiet = min(result.quiet_turns for result in results.values())
    idle = min(result.threads_used / c.threads for c, result in results.items())

    def least(name: str, value: float, bar: float, unit: str = "", *, judged: bool = True) -> Check:
        if not judged:
            return Check(name, value, f"reported (full mesh: >= {bar:g})", bool(value > 0), unit)
        return Check(name, value, f">= {bar:g}", value >= bar, unit)

    checks = [
        least("quiet turns of the contestant with fewest", quiet, QUIET_ROUNDS),
        least("threads used over threads asked for, smallest", idle, 0.8),
        Check("tips apart after the warm-up, largest", apart, f"<= {TIP_TOLERANCE:g}",
              apart <= TIP_TOLERANCE),
        least("speed, float64, 2 threads", ours, 110, "Mel/s", judged=not quick),
        least("over MKL's rows, float64, 2 threads", ours / mkl_rows, 1, judged=not quick),
        least("over MKL's best, float64, 2 threads", ours / best_mkl("float64", 2), 1,
              judged=not quick),
        least("over scipy, float64, 2 threads", ours / speed[SCIPY], 1.5),
        least("float32 over float64, 2 threads", speed[OURS_SINGLE] / ours, 1.5),
        Check("cost of viscosity, float64, 2 threads", ours / speed[VISCOUS], "<= 1.35",
              ours / speed[VISCOUS] <= 1.35),
        least("2 threads over 1, float64", ours / speed[OURS_ONE], 1.9),
    ]  # fmt: skip
    for contestant, result in results.items():
        name = f"{contestant.name}; {result.speed_cpu:.1f} by CPU time of one thread"
        checks.append(Check(name, result.speed, "finite", True, "Mel/s"))
    return checks


def limit_checks(ours: Result, node_count: int, limits: list[MachineLimits]) -> list[Check]:
    """The limits, best of those measured before and after the race, and our shares of them."""
    bandwidth = {
        (place, threads): max(getattr(found, f"triad_{place}")[threads] for found in limits)
        for place in ("memory", "cache")
        for threads in (1, 2)
    }
    peak = max(found.fma_float64_threads for found in limits)
    others = min(found.others for found in limits)
    flops, traffic = flops_per_element(), bytes_per_element(ours.elements, node_count)
    shares = {
        f"arithmetic, {flops} flop an element, of the FMA limit": ours.speed * flops / 1e3 / peak,
        f"traffic, {traffic:.0f} B an element, of the memory triad": (
            ours.speed * traffic / 1e3 / bandwidth["memory", 2]
        ),
    }
    rows = [
        Check("others' share of the processors while limits were measured", others, "<= 0.05",
              others <= QUIET_SHARE),
        *[Check(f"triad, {place}, {threads} threads", value, "finite", True, "GB/s")
          for (place, threads), value in bandwidth.items()],
        Check("FMA, float64, 1 thread", max(found.fma_float64 for found in limits), "finite", True,
              "GFlop/s"),
        Check("FMA, float32, 1 thread", max(found.fma_float32 for found in limits), "finite", True,
              "GFlop/s"),
        Check("FMA, float64, 2 threads", peak, "finite", True, "GFlop/s"),
    ]  # fmt: skip
    # above 1 neither figure can be right
    rows += [Check(name, share, "<= 1", share <= 1) for name, share in shares.items()]
    return rows


# --- work of one element and step ---------------------------------------------------------------


class Counted:
    """A number that counts the operations on it."""

    operations = 0

    def _count(self, other: object) -> Counted:
        Counted.operations += 1
        return self

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = _count


def flops_per_element() -> int:
    """Operations of the kernel's own functions on an element, float64, Finger strain, elastic.

    Twenty-one more are in the gathering of its edges (9) and the scattering of its forces (12,
    and 6 for the sum of corner 0).  Negations are not counted.
    """
    one = Counted()
    nine: Any = (one,) * 9
    Counted.operations = 9 + 12 + 6
    h = stress.element_gradient(nine, nine)
    pull, _ = stress.stress_finger(h, one, one, one)
    stress.element_pulls(pull, nine)
    return Counted.operations


def bytes_per_element(element_count: int, node_count: int, size: int = 8) -> float:
    """Least traffic of a step to memory [B], elastic, if each array moved once.

    An element's nine gradients, two stiffnesses and four node numbers are read; a node's
    displacement, velocity and force, four numbers each, are read and written, its inverse mass
    is read.
    """
    return 11 * size + 4 * 4 + (3 * 2 * 4 + 1) * size * node_count / element_count


# --- the first call -----------------------------------------------------------------------------

FIRST_STEP = """
import numpy as np, qdem_fem as q
nodes = np.vstack([np.zeros(3), np.eye(3)])
body = q.Body((nodes, np.array([[0, 1, 2, 3]])), q.Material(young=1e9, poisson=0.2, density=1e3))
run = q.Simulation([body])
run.load(body, [3], (0, 0, 1))
run.advance(2 * run.step)
"""


def first_call_seconds(folder: Path) -> float:
    """CPU time [s] of a new process that makes a step of one element, nothing compiled before."""
    before = os.times()
    variables = environment(OURS) | {"NUMBA_CACHE_DIR": str(folder / "cache")}
    subprocess.run([sys.executable, "-c", FIRST_STEP], env=variables, check=True)
    after = os.times()
    return (after.children_user + after.children_system) - (
        before.children_user + before.children_system
    )


def import_seconds() -> float:
    """Median time [s] of importing what a simulation needs in five new processes."""
    code = (
        "import time; t = time.perf_counter(); from qdem_fem import Body, Material, Simulation; "
        "print(time.perf_counter() - t)"
    )
    seconds = [
        float(
            subprocess.run(
                [sys.executable, "-c", code],
                env=environment(OURS),
                check=True,
                capture_output=True,
                text=True,
            ).stdout
        )
        for _ in range(5)
    ]
    return float(np.median(seconds))
