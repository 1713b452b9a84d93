"""Boundaries of QDEM: what absorbing faces let back, what they spare, what a periodic width costs.

python -m validation.qdem_boundaries           measures, prints a line a part, writes the record
python -m validation.qdem_boundaries_page      writes docs/qdem-boundaries.md and its figure from it
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

import qdem_fem as q
from qdem_fem.leapfrog import accelerations_free
from qdem_fem.mesh_generation import box_mesh
from validation.parts_record import parts_measure
from validation.qdem_boundary_waves import GROUND, bar, bar_share, oblique_share
from validation.qdem_contact_packing import GRAIN, RADIUS, STIFFNESS, lattice, seconds_a_step

Floats = NDArray[np.float64]
Row = dict[str, Any]
RECORD = Path(__file__).parent / "results" / "qdem-boundaries.jsonl"
CELL, LOADED, PULSE, END = 0.1, 0.2, 6e-3, 24e-3
"""Of the ground: cell and half side of the load [m], duration of the load and of all [s]."""
TRUTH = 4.2
"""Side of the block [m] from whose ends nothing has come back by then: 2 TRUTH/c_p = END."""


def bar_part() -> Row:
    """Energy that comes back from the end of a bar, by wave, by the width of the pulse, by end."""
    rows = []
    for wave in ("p", "s"):
        for width in (2.5, 5.0, 10.0):
            share = bar_share(wave, width=width, cells=int(16 * width))
            rows.append({"wave": wave, "end": "dashpots", "width": width, **share._asdict()})
        share = bar_share(wave, 0.5, 120)
        rows.append({"wave": wave, "end": "depth", "width": 5.0, **share._asdict()})
        for end in ("fixed", "free"):
            share = bar_share(wave, end=end)
            row = {"wave": wave, "end": end, "width": 5.0, **share._asdict()}
            rows.append(row | {"left_derived": 1.0, "absorbed_derived": 0.0})
    return {"rows": rows}


def oblique_part() -> Row:
    """Energy that comes back of p-waves at an angle, on two meshes."""
    rows = []
    for degrees, meshes in ((15, (36, 48)), (30, (24, 36, 48)), (45, (24, 36)), (60, (24, 36)),
                            (75, (24,))):  # fmt: skip
        for cells in meshes:
            share = oblique_share(degrees, cells)
            rows.append({"degrees": degrees, "cells": cells, "left": share.left,
                         "derived": share.left_derived})  # fmt: skip
    return {"rows": rows}


def pulse(when: float) -> float:
    """A load that comes and goes [-]."""
    return float(np.sin(np.pi * min(when / PULSE, 1.0)) ** 2)


def lasting(when: float) -> float:
    """A load that comes and stays [-]."""
    return float(np.sin(0.5 * np.pi * min(when / PULSE, 1.0)) ** 2)


def ground_motion(
    side: float, end: str, load: Callable[[float], float], depth: float | None = None
) -> tuple[Floats, Row]:
    """Settlement under the load, (k, 2) [m], of a quarter of a block of ground; what it cost.

    Rows are at the times of a fixed sampling; columns are the middle of the load and 0.6 m beside
    it.  ``end``: "fixed", "free" or "absorb" on its two outer sides and below.
    """
    cells = round(side / CELL)
    body = q.Body(box_mesh((side,) * 3, (cells,) * 3, "kuhn"), GROUND, name="ground")
    run = q.Simulation([body], strain="small", threads=1, step=1e-4)
    x, y, z = body.nodes.T
    run.fix(body, x < 1e-9, "x")
    run.fix(body, y < 1e-9, "y")
    for face in (x > side - 1e-9, y > side - 1e-9, z < 1e-9):
        if end == "fixed":
            run.fix(body, face)
        elif end == "absorb":
            run.absorb(body, face, depth)
    top = z > side - 1e-9
    below = top & (x < LOADED + 1e-9) & (y < LOADED + 1e-9)
    run.pressure(body, below, lambda when: 1e4 * load(when))
    probes = {name: [int(np.argmin(((body.nodes - (at, 0, side)) ** 2).sum(axis=1)))]
              for name, at in (("middle", 0.0), ("beside", 0.6))}  # fmt: skip
    assert run.step <= run.critical_step.value
    started = time.process_time()
    history = run.advance(END, probes, sampling=2e-4)
    cost = {"cpu_s": time.process_time() - started, "elements": len(body.elements)}
    return np.column_stack([history[name][:, 2] for name in probes]), cost


def ground_part() -> Row:
    """Error of a block's settlement against the endless ground's, by end and size; its cost."""
    rows = []
    for name, load in (("pulse", pulse), ("lasting", lasting)):
        truth, cost = ground_motion(TRUTH, "absorb", load)
        rows.append({"load": name, "end": "truth", "side": TRUTH, "error": [0.0, 0.0], **cost})
        ways: list[tuple[str, float, str, float | None]] = []
        for side in (1.2, 1.8, 2.4, 3.0):
            ways += [("fixed", side, "fixed", None), ("free", side, "free", None)]
            ways += [("dashpots", side, "absorb", None), ("depth", side, "absorb", side)]
        ways += [("half depth", 1.2, "absorb", 0.6), ("twice depth", 1.2, "absorb", 2.4)]
        for label, side, end, depth in ways:
            found, cost = ground_motion(side, end, load, depth)
            apart = np.sqrt(((found - truth) ** 2).mean(axis=0) / (truth**2).mean(axis=0))
            row = {"load": name, "end": label, "side": side, "error": apart.tolist(), **cost}
            if load is lasting:  # settlement at the end
                row["last"] = float(found[-1, 0] / truth[-1, 0])
            rows.append(row)
            print(json.dumps(row), flush=True)
    return {"rows": rows}


def lagged_step(run: q.Simulation) -> float:
    """Critical step [s] if dashpots acted on the velocity half a step behind instead of the mean.

    The least dt at which ``4 M - 2 dt C - dt^2 K`` is not positive, by all eigenvalues.
    """
    assert run.absorbers is not None
    own = run.master == np.arange(len(run.master))
    root = np.sqrt(np.where(run.assembly.mass > 0, run.assembly.mass, 1.0))
    still = np.zeros((len(root), 3))

    def matrix(of: Callable[[Floats], Floats]) -> Floats:
        columns = []
        for unit in np.eye(3 * len(root)):
            field = unit.reshape(-1, 3) / root[:, None]
            columns.append((-of(field[run.master]) * root[:, None] * own[:, None]).ravel())
        return (np.array(columns) + np.array(columns).T) / 2

    absorbers = run.absorbers
    stiffness = matrix(lambda u: accelerations_free(run, 1e-9 * u, still) * 1e9)
    damping = matrix(lambda v: -absorbers.decelerations(v))
    return float(brentq(
        lambda dt: 4 - np.linalg.eigvalsh(2 * dt * damping + dt**2 * stiffness)[-1],
        1e-9, 2 * run.critical_step.value,
    ))  # fmt: skip


def step_part() -> Row:
    """Critical step with dashpots and with springs beside them, over that without; if lagged."""
    plain = bar(4).critical_step.value
    rows = []
    for depth in (None, 0.4, 0.1, 0.01):
        run = bar(4)
        body = run.bodies[0]
        run.absorb(body, body.nodes[:, 0] > 0.35, depth)
        rows.append({"depth": depth, "step": run.critical_step.value / plain,
                     "lagged": lagged_step(run) / plain})  # fmt: skip
    return {"rows": rows}


def cost_part() -> Row:
    """CPU time of a step of 64 grains with contact, and across the sides of a width; one thread."""
    rows = []
    for model in ("spheres", "surface"):
        size = GRAIN + (RADIUS if model == "spheres" else 0.0)
        near = 2 * (0.95 if model == "spheres" else 0.96) * size
        runs = []
        for periodic in (None, q.PeriodicWidth("y", 4 * near)):
            touch: Any = q.SphereContact(RADIUS, STIFFNESS, 0.577, periodic=periodic)
            if model == "surface":
                touch = q.SurfaceContact(STIFFNESS, 0.577, periodic=periodic)
            runs.append(q.Simulation(lattice(4, near), threads=1, step=1e-8, contact=touch))
        steps = seconds_a_step(runs, 200, 7)
        looks, pairs = [], []
        for run in runs:
            assert run.contacts is not None
            least = np.inf
            for _ in range(5):
                started = time.process_time()
                run.contacts.pairs_find()
                least = min(least, time.process_time() - started)
            looks.append(least)
            kernel = run.contacts.kernel
            pairs.append(int(kernel.pairs.touching.sum() if model == "spheres"
                             else (kernel.near.weight > 0).sum()))  # fmt: skip
        rows.append({"model": model, "step_s": steps, "look_s": looks, "touching": pairs})
    return {"rows": rows}


PARTS: dict[str, Callable[[], Row]] = {
    "bar": bar_part,
    "oblique": oblique_part,
    "ground": ground_part,
    "step": step_part,
    "cost": cost_part,
}


if __name__ == "__main__":
    parts_measure(PARTS, RECORD, "validation.qdem_boundaries", __doc__)
