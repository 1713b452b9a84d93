"""Cost and size of ``trackbed export`` on the paper's bed, beside the cycles it shows.

The scene ``karrech`` (1,085 grains) on the first engine installed, with grains of 2 GPa in place
of 46.9, so that a cycle is cheap: the export's share of one is an upper bound.  CPU time of this
process with one thread, median of repeats after a warm-up; sizes on the disk.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from validation.case import Check

FEW_CYCLES = ("procedure.k_i=2", "procedure.k=2", "procedure.h=2", "procedure.total_cycles=4")
FULL = ("karrech", ("material.grain.young=2e9", *FEW_CYCLES))
QUICK = (
    "karrech-coarse",
    ("sample.radius=0.018", "sample.count=40", "material.grain.young=1e9",
     "loading.piston_mass=0.001", *FEW_CYCLES),
)  # fmt: skip
"""Scene and what is changed in it."""

SHARE = 0.05
"""Greatest CPU time of an export over that of the cycles themselves."""


def run(quick: bool) -> list[Check]:
    """CPU time [s] and size [byte] of an instant in every format, and the share of a cycle."""
    from adapters.export import FORMATS, export_run
    from adapters.export_instants import exported_run
    from adapters.procedure import run_scene
    from adapters.progress import Progress
    from scenes import scene_path
    from validation.case import Check

    repeats, checks = (3, []) if quick else (7, [])
    scene, overrides = QUICK if quick else FULL
    with tempfile.TemporaryDirectory() as folder:
        home = Path(folder)
        run_scene(
            scene_path(scene), home / "run", overrides=overrides, progress=Progress(quiet=True)
        )
        exported = exported_run(home / "run")
        windows = [outcome for _, outcome in exported.track.windows]
        cycles = sum(outcome.last_cycle - outcome.first_cycle for outcome in windows)
        cycle_s = sum(outcome.cost["engine"] for outcome in windows) / cycles
        instants = len(list(exported.states()))
        states = sum(path.stat().st_size for path in (home / "run").glob("window_*/states.npz"))
        grains = exported.scene.grain_count
        checks.append(
            Check(f"states kept by the run itself, {grains} grains, one instant",
                  states / instants, "is told", True, "byte")
        )  # fmt: skip
        for to in FORMATS:
            files = export_run(exported, to, home / to)
            size = sum(path.stat().st_size for path in files) / instants
            cost = cpu_median(partial(export_run, exported, to, home / to), repeats) / instants
            checks.append(Check(f"{to}: size of an instant", size, "is told", True, "byte"))
            checks.append(Check(f"{to}: CPU time of an instant", cost, "is told", True, "s"))
            share = cost / cycle_s
            name = f"{to}: CPU time over that of a cycle ({cycle_s:.2g} s)"
            checks.append(Check(name, share, f"<= {SHARE}", share <= SHARE))
    return checks


def cpu_median(work: Callable[[], object], repeats: int) -> float:
    """Median CPU time of some work [s]."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        work()
        times.append(time.process_time() - start)
    return median(times)


def page_table(checks: list[dict[str, Any]]) -> str:
    """The checks of a record as the table of ``docs/export.md``."""
    value = {check["name"].partition(" (")[0]: check["value"] for check in checks}
    lines = [
        "| `--to` | size of an instant | CPU time of an instant | over that of a cycle |",
        "|---|---|---|---|",
    ]
    for to in ("vtu", "ovito", "stl", "csv"):
        size, cost = value[f"{to}: size of an instant"], value[f"{to}: CPU time of an instant"]
        share = value[f"{to}: CPU time over that of a cycle"]
        lines.append(
            f"| `{to}` | {size / 1e3:.0f} kB | {1e3 * cost:.1f} ms | {100 * share:.1f} % |"
        )
    return "\n".join(lines)
