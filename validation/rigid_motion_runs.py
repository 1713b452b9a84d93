"""Time steps of a large bed under a moving load: cost and residual of every step.

    python -m validation.rigid_motion_runs [--grains 5300] [--steps 40]    adds to the solver record

A settled bed of discs (`rigid_packings.bed`) becomes a scene between two walls.  The discs shrink
by what overlap is left, fall that way and come to rest (not timed); then those at the top, in the
middle third, carry a load that swells and falls at 25 Hz to a fiftieth of the bed's weight.  One
row ``rigid-motion``: median, 99th percentile and worst of all steps.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from adapters.provenance import provenance
from rigid_lcp import Disc, HalfSpace, Scene, Simulation
from rigid_lcp.motion import Motion
from validation.rigid_packings import GRAVITY, Bed, bed, bed_gaps
from validation.rigid_runs import ORIGIN, RECORD, rows_read, rows_write

Row = dict[str, Any]
Floats = NDArray[np.float64]
STEP, FREQUENCY, DENSITY = 1e-3, 25.0, 2700.0
"""[s], [Hz], [kg/m^3]"""
CLEARANCE = 1e-9
"""Share of their radii that discs shrink by, so that no two overlap at the start."""
LOAD_SHARE, REST_STEPS = 0.02, 40
"""Greatest load over the weight of the whole bed, and steps before it begins."""
BAR_S = 1.0


def scene_of(made: Bed) -> Scene:
    """The bed's grains between its walls, discs a little smaller than they were."""
    gap = max(CLEARANCE * float(made.radius.max()), -float(bed_gaps(made).min()))
    scene = Scene(dim=2, gravity=(0.0, -GRAVITY))
    for normal, place in (((0, 1), (0, 0)), ((1, 0), (0, 0)), ((-1, 0), (made.width, 0))):
        scene.add(HalfSpace(normal, float(np.dot(normal, place))), friction=made.friction)
    for centre, radius in zip(made.centre, made.radius, strict=True):
        scene.add(
            Disc(float(radius) - gap), density=DENSITY, position=(centre[0], centre[2]),
            friction=made.friction,
        )  # fmt: skip
    return scene


def load_of(made: Bed, walls: int, weight: float) -> Any:
    """Forces (n, 3) on the discs at the top of the middle third: ``weight (1 - cos) / 2`` [N/m]."""
    x, z = made.centre[:, 0], made.centre[:, 2]
    middle = np.abs(x / made.width - 0.5) < 1.0 / 6.0
    top = walls + np.flatnonzero(middle & (z > z[middle].max() - 2.0 * made.radius.max()))

    def loads(now: float, motion: Motion) -> Floats:
        force = np.zeros((len(motion.position), 3))
        phase = 2.0 * np.pi * FREQUENCY * max(0.0, now - REST_STEPS * STEP)
        force[top, 1] = -weight * (1.0 - np.cos(phase)) / 2.0 / len(top)
        return force

    return loads


def motion_row(grains: int, steps: int, tolerance: float) -> Row:
    """Settle, load, and time every step."""
    kept = os.environ.get("TRACKBED_BEDS")
    made = bed(grains, 2, seed=1, settle=200, folder=Path(kept) if kept else None)
    scene = scene_of(made)
    weight = GRAVITY * DENSITY * float((np.pi * made.radius**2).sum())
    run = Simulation(
        scene, step=STEP, tolerance=tolerance, loads=load_of(made, 3, LOAD_SHARE * weight)
    )
    run.advance(REST_STEPS * STEP)
    before, costs, residuals, contacts, moved = run.positions[:, 1].copy(), [], [], [], 0
    for _ in range(steps):
        run.worst_residual = 0.0
        begun = time.process_time()
        run.advance(STEP)
        costs.append(time.process_time() - begun)
        residuals.append(run.worst_residual)
        contacts.append(len(run.contacts))
        moved = max(moved, int((run.contacts.status == "slide").sum()))
    sunk = float(np.abs(run.positions[:, 1] - before).max())
    return {
        "case": "rigid-motion", "problem": f"{grains} discs under a swelling load", "dim": 2,
        "contacts": int(np.median(contacts)), "method": "rigid_lcp", "seed": 1,
        "setting": {"tolerance": tolerance, "step_s": STEP, "steps": steps},
        "error": float(np.max(residuals)), "error_median": float(np.median(residuals)),
        "error_kind": "natural residual", "cost_s": float(np.median(costs)),
        "cost_99_s": float(np.percentile(costs, 99)), "cost_worst_s": float(np.max(costs)),
        "work": float(steps), "work_unit": "steps", "most_sliding": moved, "way_m": sunk,
        "steps_above": int(np.sum(np.array(residuals) > tolerance)),
        "ok": bool(np.max(residuals) <= tolerance), "why": "", "bar_s": BAR_S,
    }  # fmt: skip


def main(words: Sequence[str] | None = None) -> None:
    """Measure and put the row in the record."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--grains", type=int, default=5300)
    parser.add_argument("--steps", type=int, default=40, help="40: a cycle of the load")
    parser.add_argument("--tolerance", type=float, default=1e-6)
    parser.add_argument("--out", type=Path, default=RECORD)
    asked = parser.parse_args(words)
    origin = provenance(["python", "-m", "validation.rigid_motion_runs"])
    made = motion_row(asked.grains, asked.steps, asked.tolerance)
    made |= {key: origin[key] for key in ORIGIN}
    rows = [
        row for row in rows_read(asked.out)
        if (row.get("problem"), row["setting"]) != (made["problem"], made["setting"])
    ]  # fmt: skip
    rows_write(asked.out, [*rows, made])
    print({name: made[name] for name in ("contacts", "error", "cost_s", "cost_99_s")})


if __name__ == "__main__":
    main()
