"""The runs of the ballast study, one line each in validation/results/rigid-ballast.jsonl.

    python -m validation.rigid_ballast_runs [--beds 30] [--out FILE]    go on where the record ends

Lines: ``bed`` (the tamped state that a seed's runs start from), ``rigid`` and ``soft`` (a run),
``state`` (the contacts of the first seed under the last peak load, for the picture), ``push`` (the
first push alone, by steps and stiffnesses finer than a whole run can be given), ``damped``
(the same with dashpots that let nothing ring), ``long`` (many cycles on a few beds).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from adapters.provenance import provenance
from rigid_lcp.errors import RigidError
from rigid_lcp.motion import Motion
from rigid_lcp.scene import Scene, world_of
from validation.rigid_ballast_bed import (
    FRICTION,
    PERIOD,
    REST,
    Bed,
    Moment,
    bed_prepared,
    bed_scene,
    rigid_moments,
    sleeper_of,
    soft_moments,
)
from validation.rigid_ballast_md import DAMPING, STEP_SHARE
from validation.rigid_ballast_measures import dissipated, fabric_of

RECORD = Path(__file__).parent / "results" / "rigid-ballast.jsonl"
Row = dict[str, Any]
CYCLES, BEDS = 5, 30
PUSHED, PUSH_PARTS = 8, 20
"""Beds whose first push is followed, and moments in a cycle there."""
CONTROLLED = 15
LONG, LONG_CYCLES = 4, 40
"""Beds of the long runs, and their cycles."""


@dataclass(frozen=True)
class Level:
    """One setting of one method."""

    method: str
    """``rigid`` or ``soft``."""
    value: float
    """Step [s] of rigid grains, normal stiffness [N/m] of soft ones."""
    extra: float
    """Residual asked for [-] (rigid); step as a share of ``2 sqrt(m / k)`` (soft)."""
    damping: float = DAMPING
    """Share of critical damping of a soft contact [-]."""

    @property
    def name(self) -> str:
        """How the record and the page call it."""
        if self.method == "rigid":
            return f"h = {self.value:.3g} s, residual {self.extra:.0e}"
        own = "" if self.damping == DAMPING else f", damping {self.damping:g}"
        return f"k = {self.value:.0e} N/m, step share {self.extra:g}{own}"


TOLERANCE, FINE = 1e-6, 1e-9
"""Residual of the rigid levels; of the control and of the finest first push [-]."""
LEVELS = (
    *(Level("rigid", step, TOLERANCE) for step in (1e-3, 2e-3, 4e-3)),
    *(Level("soft", stiffness, STEP_SHARE) for stiffness in (1e7, 1e8, 1e9, 1e10)),
    Level("rigid", 5e-4, TOLERANCE),
)  # fmt: skip
"""Run on one bed after the other, so that the record is always of whole beds."""
CONTROLS = (
    *(Level("soft", stiffness, 2 * STEP_SHARE) for stiffness in (1e8, 1e9)),
    Level("rigid", 1e-3, FINE),
)  # fmt: skip
"""Run on the first `CONTROLLED` beds when every bed has its levels."""
PUSHES = (
    *(Level("rigid", step, TOLERANCE) for step in (2e-3, 1e-3, 5e-4, 2.5e-4)),
    Level("rigid", 1e-4, FINE),
    *(Level("soft", stiffness, STEP_SHARE) for stiffness in (1e8, 1e9, 1e10, 1e11)),
)  # fmt: skip
DAMPED = (Level("soft", 1e10, 0.25 * STEP_SHARE, 4.0),)
"""First pushes that do not ring; kind ``damped``."""
QUICK_LEVELS = (
    *(Level("rigid", step, TOLERANCE) for step in (4e-3, 2e-3)),
    *(Level("soft", stiffness, STEP_SHARE) for stiffness in (1e8, 1e9)),
)  # fmt: skip
PICTURED = (Level("rigid", 1e-3, TOLERANCE), Level("soft", 1e9, STEP_SHARE))
"""Levels whose state is drawn; those of the long runs too."""


def bed_row(bed: Bed) -> Row:
    """Pour and tamp; the line to record."""
    try:
        _, motion, cpu = bed_prepared(bed)
    except RigidError as error:
        return {"kind": "no bed", "bed": asdict(bed), "why": str(error)}
    return {
        "kind": "bed", "bed": asdict(bed), "cpu_s": cpu, "position": motion.position.tolist(),
        "angle": motion.angle.tolist(),
    }  # fmt: skip


def bed_again(row: Row) -> tuple[Bed, Scene, Motion]:
    """Bed, scene and state of a recorded line."""
    bed = Bed(**row["bed"])
    scene = bed_scene(bed)
    still = world_of(scene)[1]
    position, angle = np.array(row["position"]), np.array(row["angle"])
    return bed, scene, Motion(position, angle, 0 * still.velocity, 0 * still.spin)


def level_moments(
    level: Level, bed: Bed, scene: Scene, start: Motion, count: int, parts: int = 2
) -> Iterator[Moment]:
    """The run of a level: ``count`` moments, ``parts`` in a cycle."""
    if level.method == "rigid":
        return rigid_moments(bed, scene, start, count, level.value, level.extra, parts)
    return soft_moments(bed, scene, start, count, level.value, level.extra, parts, level.damping)


def run_row(
    level: Level, bed: Bed, scene: Scene, start: Motion, cycles: int, drawn: bool = False
) -> list[Row]:
    """The line of a run, and with it that of its state if it is ``drawn``."""
    row: Row = {
        "kind": level.method,
        "level": asdict(level),
        "name": level.name,
        "bed": asdict(bed),
    }
    moments, why = [], ""
    try:
        for moment in level_moments(level, bed, scene, start, 2 * cycles):
            moments.append(moment)
    except RigidError as error:
        why = str(error)
    whole, peaks = moments[::2], moments[1::2]
    done = not why and all(np.isfinite(m.place).all() for m in moments)
    row |= {"ok": bool(done), "why": why or ("" if done else "the motion blew up"),
            "cycles": len(whole) - 1}  # fmt: skip
    if not done or not peaks:
        return [row]
    height = np.array([m.place[1] for m in whole])
    stones = sum(body.movable for body in scene.bodies)
    last = moments[-1]
    row |= {
        "settlement": (height[0] - height[1:]).tolist(),
        "at_peaks": [float(height[0] - m.place[1]) for m in peaks],
        "rest_drift": float(start.position[sleeper_of(scene), 1] - height[0]),
        "deflection": float(whole[-1].place[1] - peaks[-1].place[1]),
        "tilt": float(last.place[2] - whole[0].place[2]),
        "dissipated": dissipated([m.work for m in whole], [m.energy for m in whole]).tolist(),
        "overlap": max(max(0.0, -float(m.contacts["gap"].min(initial=0.0))) for m in peaks),
        "overlap_after": max(overlap_of(scene, m.motion) for m in moments),
        "fabric": fabric_of(peaks[-1].contacts, stones, FRICTION),
        "cpu_s": last.cpu, "steps": last.steps, "residual": last.residual,
        "step_s": (REST + PERIOD * (len(whole) - 1)) / last.steps,
    }  # fmt: skip
    rows = [row]
    if drawn:
        rows.append(state_row(level, bed, peaks[-1]))
    return rows


def push_row(level: Level, bed: Bed, scene: Scene, start: Motion) -> Row:
    """The line of the first push: sleeper and energies from the rest to the first peak."""
    row: Row = {"kind": "push", "level": asdict(level), "name": level.name, "bed": asdict(bed)}
    count = PUSH_PARTS // 2
    try:
        moments = list(level_moments(level, bed, scene, start, count, PUSH_PARTS))
    except RigidError as error:
        return row | {"ok": False, "why": str(error)}
    height = [m.place[1] for m in moments]
    last = moments[-1]
    return row | {
        "ok": True, "sunk": [height[0] - y for y in height], "cpu_s": last.cpu,
        "steps": last.steps, "residual": last.residual,
        "pushed": [float(m.place[0] - moments[0].place[0]) for m in moments],
        "work": [m.work for m in moments], "energy": [m.energy for m in moments],
    }  # fmt: skip


def overlap_of(scene: Scene, motion: Motion) -> float:
    """Greatest overlap of any two bodies in a state [m]."""
    return max(0.0, -float(world_of(scene)[0].contacts(motion, 0.0).gap.min(initial=0.0)))


def state_row(level: Level, bed: Bed, moment: Moment) -> Row:
    """A state to be drawn, to seven digits."""

    def short(values: Any) -> Any:
        return json.loads(json.dumps(np.asarray(values).tolist()), parse_float=_seven)

    return {
        "kind": "state", "level": asdict(level), "name": level.name, "bed": asdict(bed),
        "cycle": moment.cycle, "position": short(moment.motion.position),
        "angle": short(moment.motion.angle),
        "contacts": {name: short(values) for name, values in moment.contacts.items()},
    }  # fmt: skip


def _seven(text: str) -> float:
    return float(f"{float(text):.7g}")


def study(
    beds: Sequence[Bed], levels: Sequence[Level], cycles: int, known: Sequence[Row],
    write: Callable[[Row], None], controls: Sequence[Level] = (), pushed: int = 0, long: int = 0,
) -> None:  # fmt: skip
    """All runs that ``known`` lacks; each line is written when it is there.

    The first push of the first ``pushed`` beds; one bed after the other, on each the ``levels``;
    the ``controls`` of some, and the ``long`` runs of so many beds.
    """
    _compile()
    poured = {row["bed"]["seed"]: row for row in known if row["kind"] in ("bed", "no bed")}
    done = {(row["kind"], row["bed"]["seed"], row["name"]) for row in known if "name" in row}
    plan = [("push", bed, level) for bed in beds[:pushed] for level in PUSHES]
    plan += [("damped", bed, level) for bed in beds[:pushed] for level in DAMPED]
    plan += [(level.method, bed, level) for bed in beds for level in levels]
    plan += [(level.method, bed, level) for bed in beds[:CONTROLLED] for level in controls]
    plan += [("long", bed, level) for bed in beds[:long] for level in PICTURED]
    for kind, bed, level in plan:
        if bed.seed not in poured:
            poured[bed.seed] = bed_row(bed)
            write(poured[bed.seed])
        state = poured[bed.seed]
        if state["kind"] == "no bed" or (kind, bed.seed, level.name) in done:
            continue
        again = bed_again(state)
        if kind in ("push", "damped"):
            write(push_row(level, *again) | {"kind": kind})
        elif kind == "long":
            write(run_row(level, *again, LONG_CYCLES)[0] | {"kind": "long"})
        else:
            for row in run_row(level, *again, cycles, level in PICTURED and bed is beds[0]):
                write(row)


def _compile() -> None:
    """Few stones that fall, by both methods, so that no cost holds the time of a compiler."""
    bed = Bed(1, stones=4, crib=1, width=0.22, sleeper=0.08, peak=2e3)
    scene = bed_scene(bed)
    start = world_of(scene)[1]
    for level in QUICK_LEVELS[::2]:
        list(level_moments(level, bed, scene, start, 2))


def rows_read(path: Path = RECORD) -> list[Row]:
    """Lines of a record; none if there is no file."""
    if not path.is_file():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def main(words: Sequence[str] | None = None) -> None:
    """Read the command line and go on with the study."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--beds", type=int, default=BEDS, help="how many")
    parser.add_argument("--out", type=Path, default=RECORD, help="the record")
    arguments = parser.parse_args(words)
    command = ["python", "-m", "validation.rigid_ballast_runs", "--beds", str(arguments.beds)]
    origin = provenance(command)
    kept = {name: origin[name] for name in ("commit", "command", "machine", "started")}
    kept["damping"] = DAMPING

    def write(row: Row) -> None:
        with arguments.out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row | kept) + "\n")

    beds = [Bed(seed) for seed in range(1, arguments.beds + 1)]
    study(beds, LEVELS, CYCLES, rows_read(arguments.out), write, CONTROLS, PUSHED, LONG)


if __name__ == "__main__":
    main()
