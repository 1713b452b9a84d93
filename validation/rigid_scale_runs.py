"""Large packings: a warm-started step of 1e4 contacts, and 1e5 contacts to 1e-6.

    python -m validation.rigid_scale_runs            adds to the record of `rigid_runs`

Rows ``rigid-scale``; `rigid_runs` makes those that lack.  Cost: the median of some runs.  Warm: the
start is the impulses of the time step before, as a simulation has them.  The beds settle for
minutes; they are kept in the folder TRACKBED_BEDS, if it is set.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from adapters.provenance import provenance
from rigid_lcp.solver import solve_friction
from validation.rigid_packings import bed, bed_problem, bed_start, bed_touching
from validation.rigid_peers import ONE_THREAD
from validation.rigid_problems import bodies_anew

Row = dict[str, Any]
STEP = 1e-3
"""Time step [s]."""


@dataclass(frozen=True)
class Scale:
    """A packing, how it is started, what is asked for, and what it may cost."""

    name: str
    grains: int
    dim: int
    started_warm: bool
    tolerance: float
    bar_s: float
    settle: int = 200
    repeats: int = 5


SCALES = (
    Scale("1e4 contacts, discs, warm", 5300, 2, True, 1e-6, 1.0),
    Scale("1e4 contacts, discs, warm, 1e-12", 5300, 2, True, 1e-12, 1.0),
    Scale("1e4 contacts, spheres, warm", 3700, 3, True, 1e-6, 1.0),
    Scale("1e5 contacts, spheres, cold", 40_000, 3, False, 1e-6, 60.0, settle=60, repeats=3),
)
"""Some 1.9 contacts a disc and 2.8 a sphere."""


def scale_row(scale: Scale) -> Row:
    """Make the packing and solve it, each time anew."""
    kept = os.environ.get("TRACKBED_BEDS")
    folder = Path(kept) if kept else None
    made = bed_touching(bed(scale.grains, scale.dim, seed=1, settle=scale.settle, folder=folder))
    problem = bed_problem(made, STEP)
    start = bed_start(made, STEP) if scale.started_warm else None
    before = 1.0 if start is None else problem.residual(start)
    costs = []
    for _ in range(scale.repeats):
        bodies = bodies_anew(problem)
        begun = time.process_time()
        found = solve_friction(
            bodies, problem.offset, problem.friction, problem.dim, start, scale.tolerance
        )
        costs.append(time.process_time() - begun)
    unit, count = max(found.work.items(), key=lambda each: each[1], default=("", 0.0))
    return {
        "case": "rigid-scale", "problem": scale.name, "contacts": problem.contacts,
        "dim": scale.dim, "method": "rigid_lcp", "seed": 1,
        "setting": {"tolerance": scale.tolerance, "warm": scale.started_warm},
        "error": found.residual, "error_kind": "natural residual",
        "cost_s": float(np.median(costs)), "repeats_s": costs, "work": count, "work_unit": unit,
        "ok": found.solved, "why": found.message, "start_error": before, "bar_s": scale.bar_s,
        "by": found.method,
    }  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> None:
    """Make those runs whose names hold the given words, and put them in the record."""
    from validation.rigid_dantzig_runs import warm
    from validation.rigid_runs import ORIGIN, RECORD, rows_read, rows_write

    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--only", default="", help="words in the names of the runs")
    parser.add_argument("--out", type=Path, default=RECORD, help="the record (JSON lines)")
    asked = parser.parse_args(arguments)
    if any(os.environ.get(name) != "1" for name in ONE_THREAD):
        raise SystemExit(f"set {', '.join(ONE_THREAD)} to 1: costs are of one thread")
    words = sys.argv[1:] if arguments is None else arguments
    origin = provenance(["python", "-m", "validation.rigid_scale_runs", *map(str, words)])
    warm()
    for scale in SCALES:
        if asked.only in scale.name:
            made = scale_row(scale) | {key: origin[key] for key in ORIGIN}
            rows = [row for row in rows_read(asked.out) if row.get("problem") != scale.name]
            rows_write(asked.out, [*rows, made])
            print(f"{scale.name}: {made['error']:.1e} @ {made['cost_s']:.2f} s", flush=True)


if __name__ == "__main__":
    main()
