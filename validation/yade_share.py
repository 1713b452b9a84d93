"""What the adapter adds to YADE: its frames and records, timed within one run.

Two runs of YADE differ by a tenth and more on a machine that other work shares, so that a pair of
them (`validation.engine_speed_windows`) can not tell some hundredths.  What is there only to be
read afterwards can be timed within one run, and told against the rest of the same run.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

from adapters.engine import python_cpu_s
from adapters.window import Window, window_load
from validation.yade_scale import Bed, window

TIMED = """\
import os, sys, time
sys.path.insert(0, os.getcwd())
import bed, record
added, depth = 0.0, 0

def timed(owner, name):
    work = getattr(owner, name)
    def measured(*arguments):
        global added, depth
        began, depth = time.thread_time(), depth + 1
        try:
            return work(*arguments)
        finally:
            depth -= 1
            added += 0.0 if depth else time.thread_time() - began
    setattr(owner, name, measured)

for name in ("before", "behind", "last"):
    timed(record.PistonRecord, name)
timed(record.Dumps, "frame")
timed(record, "grain_table")
timed(bed, "forces_renew")
exec(compile(open("cycles.py").read(), "cycles.py", "exec"))
print(f"ADDED {added:.6f} s", flush=True)
"""
"""cycles.py, the CPU time of its frames and of the piston's record added up.

Not counted: that YADE looks at two more engines in every step, and calls Python in one of some
hundred (30 us a call).
"""

ADDED = re.compile(r"^ADDED (\S+) s", re.MULTILINE)


@dataclass(frozen=True)
class Added:
    """CPU times of one window [s]."""

    engine_s: float
    """YADE as the adapter runs it, all of its process."""
    added_s: float
    """Of it frames and the piston's record: all that is only there to be read afterwards."""
    python_s: float
    """What the adapter's own Python takes beside it."""

    @property
    def speed(self) -> float:
        """Speed through the adapter over that of the bare engine."""
        return (self.engine_s - self.added_s) / (self.engine_s + self.python_s)


def window_timed(
    bed: Bed, cycles: int, folder: Path, edit: Callable[[Path], None] = lambda folder: None
) -> tuple[Window, Added]:
    """``cycles`` load cycles as the adapter computes them, what it adds timed within the run.

    Read back where ``folder`` holds them.
    """
    told = folder / "added.json"
    if told.exists():
        return window_load(folder / "states.npz"), Added(**json.loads(told.read_text()))

    def script(place: Path) -> None:
        edit(place)
        (place / "timed.py").write_text(TIMED)

    before = python_cpu_s()
    made, engine_s = window(bed, cycles, folder, script, "timed.py")
    python_s = python_cpu_s() - before
    found = ADDED.search((folder / "screen.txt").read_text())
    assert found is not None
    times = Added(engine_s, float(found[1]), python_s)
    told.write_text(json.dumps(asdict(times)) + "\n")
    return made, times
