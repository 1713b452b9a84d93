"""Engines alone: what a user of each would run by hand, without record, frames or Python.

Two things are run: the settled bed of `validation.engine_speed_bed` for a number of steps, and a
window of load cycles as `trackbed` writes it, with everything that is only there to be read
afterwards taken out.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from adapters.dump import dump_frames
from adapters.engine import Engine, engine_failure, engine_named
from adapters.engine_process import process_run
from adapters.engine_yade import PARAMETERS
from adapters.errors import NotCredible
from adapters.sample import GRAVITY
from adapters.scene import Scene
from adapters.state import FloatArray

COLUMNS = "id x y z vx vy vz radius mass"

DECK = """\
include parameters.in
include settings.in
read_data grains.data
include bed.in
fix motion grains nve/sphere
thermo_style custom step atoms c_kinetic_translational
thermo {steps}
thermo_modify lost error norm no
run {steps}
write_dump grains custom end.dump {columns} modify sort id {precise}
"""

SCRIPT = """\
import os
import sys

sys.path.insert(0, os.getcwd())
import bed
import record
from yade import Omega

O = Omega()
parameters = bed.parameters_read()
bed.materials_add(parameters)
bed.grains_add(parameters)
bed.walls_add(parameters)
bed.engines_set(parameters)
O.run({steps}, True)
grains = record.grain_table(parameters["grain_count"])
with open("end.dump", "w") as stream:
    rows = [[i, *g[:6], *g[9:]] for i, g in enumerate(grains, 1)]
    record.frame_write(
        stream, "ATOMS", "{columns}", record.np.array(rows), 1, parameters["box"]
    )
"""

CYCLES_SCRIPT = """\
import os
import sys

sys.path.insert(0, os.getcwd())
import bed
import record
from yade import Omega

O = Omega()
parameters = bed.parameters_read()
window = parameters["window"]
record.scene_load()
piston = bed.Piston(parameters)
bed.engines_set(parameters, [bed.load_engine(window["load"], piston)])
piston.press(window["load"]["mean_force"], parameters["gravity"])
O.run(window["cycles"] * window["steps_per_cycle"], True)
record.scene_save()
"""
"""A window of cycles.py that goes on from a saved bed, without record and frames."""

READ_AFTERWARDS = re.compile(
    r"^(include dump_states\.in|include \$\{output_part\}|variable track_next|fix track).*\n",
    re.MULTILINE,
)
"""Lines of in.cycles that no grain feels."""

TIMINGS = re.compile(r"^(Pair|Neigh|Comm|Modify|Other)\s+(?:time \(%\) = )?([^\n]*)", re.MULTILINE)


SHARED = re.compile(r"^(Nlocal|Nghost|Neighs):\s+(\S+) ave\s+(\S+) max", re.MULTILINE)


@dataclass(frozen=True)
class BedRun:
    """A settled bed that an engine ran."""

    cpu_s: float
    """CPU time of all processes, user and system [s]."""
    wall_s: float
    """Elapsed time [s]."""
    screen: str
    """What the engine printed."""
    end: FloatArray
    """Columns `COLUMNS` of every grain at the end, shape (n, 9)."""


def bed_deck(engine: str, steps: int) -> str:
    """Deck or script that runs a settled bed for ``steps``."""
    if engine == "yade":
        return SCRIPT.format(steps=steps, columns=COLUMNS)
    precise = "format float %.17g" if engine == "lammps" else 'format "%d' + " %.17g" * 8 + '"'
    return DECK.format(steps=steps, columns=COLUMNS, precise=precise)


def bed_run(
    scene: Scene, position: FloatArray, radius: FloatArray, steps: int, folder: Path
) -> BedRun:
    """Run a bed at rest for ``steps``; raises `EngineFailed`, and `NotCredible` when it fell apart.

    Centres [m], shape (n, 3), radii [m], shape (n,).
    """
    engine = engine_named(scene.engine.name)
    folder.mkdir(parents=True)
    height = float((position[:, 2] + radius).max())
    engine.write_preparation(scene, position, radius, height, folder)
    name = "speed.py" if engine.name == "yade" else "in.speed"
    (folder / name).write_text(bed_deck(engine.name, steps))
    cpu_s, wall_s = hand_run(engine.command(scene, name), folder)
    screen = (folder / "screen.txt").read_text(errors="replace")
    (frame,) = dump_frames(folder / "end.dump")
    check_end(frame.values, len(radius))
    return BedRun(cpu_s, wall_s, screen, frame.values)


def hand_run(command: Sequence[str], folder: Path) -> tuple[float, float]:
    """CPU time and elapsed time [s] of a command in ``folder``; raises `EngineFailed`."""
    status, cpu_s, wall_s = process_run(command, folder, lambda: None)
    if status != 0:
        raise engine_failure(status, folder)
    return cpu_s, wall_s


def check_end(end: FloatArray, grains: int) -> None:
    """No time is told of a bed that is not whole, finite and at rest; raises `NotCredible`.

    At rest: less kinetic energy than lifts every grain by a thousandth of its radius.
    """
    speed_square, radius, mass = (end[:, 4:7] ** 2).sum(axis=1), end[:, 7], end[:, 8]
    kinetic = 0.5 * float(mass @ speed_square)
    bound = 1e-3 * GRAVITY * float(mass @ radius)
    if len(end) != grains or not kinetic <= bound:
        raise NotCredible(
            f"{len(end)} of {grains} grains are left, with {kinetic:.3g} J; at rest is {bound:.3g}",
            remedy="start from a settled bed, with a shorter step",
        )


def cycles_bare(engine: Engine, scene: Scene, folder: Path) -> float:
    """CPU time [s] of the window of load cycles that `Engine.write_cycles` wrote in ``folder``."""
    if engine.name == "yade":
        parameters = json.loads((folder / PARAMETERS).read_text())
        assert parameters["window"]["start"] == "continue"
        (folder / "bare.py").write_text(CYCLES_SCRIPT)
        return hand_run(engine.command(scene, "bare.py"), folder)[0]
    deck = (folder / "in.cycles").read_text()
    (folder / "in.bare").write_text(READ_AFTERWARDS.sub("", deck))
    return hand_run(engine.command(scene, "in.bare"), folder)[0]


def timings(screen: str) -> dict[str, list[float]]:
    """Elapsed time [s] of the parts of the time steps: least, mean, greatest of all processes.

    LIGGGHTS tells the mean of all processes alone.
    """
    found = {}
    for name, text in TIMINGS.findall(screen):
        cells = [cell.strip() for cell in text.replace("(", "|").split("|") if cell.strip()]
        numbers = [float(cell) for cell in cells[:3] if re.fullmatch(r"[-+.\de]+", cell)]
        if numbers:  # of LAMMPS' "Other" there is the mean alone, then a percentage
            found[name.lower()] = numbers if len(numbers) == 3 else numbers[:1]
    return found


def most_shared(screen: str) -> dict[str, float]:
    """Grains, copies of other processes' grains, and pairs of neighbours of the fullest process."""
    return {name.lower(): float(most) for name, _, most in SHARED.findall(screen)}


def load_average() -> float:
    """Processes that want a processor, over the last minute."""
    return os.getloadavg()[0]


def contacts_per_grain(end: FloatArray) -> float:
    """Mean number of grains that touch a grain, from positions and radii alone."""
    from adapters.sample import pairs_in_contact

    return 2 * len(pairs_in_contact(end[:, 1:4], end[:, 7])) / len(end)


def mean_height(end: FloatArray) -> float:
    """Mean height of the centres [m]."""
    return float(np.mean(end[:, 3]))
