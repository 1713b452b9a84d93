"""Five million elements within 24 GiB: memory and time of every stage, in a process of its own.

    python -m validation.qdem_hard_size 100

prints one line of JSON for a cube of 100 cells a side, five tetrahedra a cell.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Literal

import numpy as np

from qdem_fem import Body, Material, Simulation
from qdem_fem.mesh_generation import box_mesh
from validation.case import Check
from validation.qdem_problem import below, near, reported

ROOT = Path(__file__).parents[1]
STEPS = 20
"""Steps whose time is taken, after three that are not."""
GIB = 2.0**30
MATERIAL = Material(45e9, 0.167, 2350.0)
FORCE = 1e6
"""On the upper side, 1 m^2 [N]."""


def peak() -> float:
    """Most memory that this process has had resident [GiB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / GIB


class Stages:
    """Seconds and peak memory of stage after stage."""

    def __init__(self) -> None:
        self.rows: dict[str, dict[str, float]] = {}
        self.begun = time.perf_counter(), time.process_time()

    def done(self, name: str) -> None:
        """The stage that ends here."""
        wall, cpu = time.perf_counter(), time.process_time()
        self.rows[name] = {
            "wall_s": wall - self.begun[0], "cpu_s": cpu - self.begun[1], "peak_gib": peak()
        }  # fmt: skip
        self.begun = time.perf_counter(), time.process_time()


def large_body(cells: int) -> dict[str, Any]:
    """Mesh, body, both precisions: three steps, then `STEPS`, and where the loaded face is."""
    stages = Stages()
    mesh = box_mesh((1.0, 1.0, 1.0), (cells, cells, cells), "five")
    stages.done("mesh")
    body = Body((mesh.nodes, mesh.elements), MATERIAL)
    stages.done("mesh checked, body")
    elements, nodes = len(body.elements), len(body.nodes)
    bottom, top = mesh.node_sets["z-min"], mesh.node_sets["z-max"]
    del mesh
    moved: dict[str, float] = {}
    wave = 0.0
    precisions: tuple[Literal["float64", "float32"], ...] = ("float64", "float32")
    for precision in precisions:
        body = Body(body.mesh, body.material)
        run = Simulation([body], precision=precision, threads=1)
        run.fix(body, bottom)
        run.load(body, top, (0.0, 0.0, FORCE))
        _ = run.assembly
        stages.done(f"{precision}: simulation")
        _ = run.critical_step
        stages.done(f"{precision}: critical step")
        run.advance(3 * run.step)
        stages.done(f"{precision}: three steps, with compilation")
        run.advance(STEPS * run.step)
        stages.done(f"{precision}: {STEPS} steps")
        wave = FORCE * run.time / float(np.max(MATERIAL.density * MATERIAL.wave_speed))
        moved[precision] = float(body.displacement[top, 2].mean())
        del run
    return {
        "elements": elements,
        "nodes": nodes,
        "moved": moved,
        "wave": wave,
        "stages": stages.rows,
    }


def large_body_checks(cells: int = 100) -> list[Check]:
    """Five million elements (5 x 100^3) unless ``cells`` says less."""
    variables = {name: "1" for name in (
        "NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"
    )}  # fmt: skip
    answer = subprocess.run(
        [sys.executable, "-m", "validation.qdem_hard_size", str(cells)],
        cwd=ROOT, env=os.environ | variables, check=True, capture_output=True, text=True,
    ).stdout  # fmt: skip
    found = json.loads(answer)
    count, moved = found["elements"], found["moved"]
    title = f"{count:,} elements"
    rows = [reported(f"{title}: nodes", found["nodes"])]
    for name, stage in found["stages"].items():
        rows.append(reported(f"{title}, {name}: time of a processor", stage["cpu_s"], "s"))
        if name.endswith(f"{STEPS} steps"):
            speed = count * STEPS / stage["cpu_s"] / 1e6
            rows.append(reported(f"{title}, {name}: speed on one thread", speed, "Mel/s"))
        rows.append(below(f"{title}, {name}: peak memory so far", stage["peak_gib"], 24, "GiB"))
    apart = abs(moved["float32"] / moved["float64"] - 1)
    # within the body the front is plane and its side moves by p t/(rho c); edges move more freely
    rows.append(near(f"{title}: mean motion of the loaded side", 1e6 * moved["float64"],
                     1e6 * found["wave"], 0.1, "um"))  # fmt: skip
    return [*rows, below(f"{title}: single to double precision", apart, 1e-4)]


if __name__ == "__main__":
    print(json.dumps(large_body(int(sys.argv[1]))))
