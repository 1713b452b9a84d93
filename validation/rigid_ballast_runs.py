"""The runs of the ballast study, one line each in validation/results/rigid-ballast.jsonl.

    python -m validation.rigid_ballast_runs [--beds 12] [--out FILE]    go on where the record ends

Lines: ``bed`` (the tamped state that a seed's runs start from), ``rigid`` and ``soft`` (a run),
``state`` (the contacts of the first seed under the last peak load, for the picture).
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
CYCLES, BEDS, SEEDS = 10, 12, 60


@dataclass(frozen=True)
class Level:
    """One setting of one method."""

    method: str
    """``rigid`` or ``soft``."""
    value: float
    """Step [s] of rigid grains, normal stiffness [N/m] of soft ones."""
    extra: float
    """Residual asked for [-] (rigid); step as a share of ``2 sqrt(m / k)`` (soft)."""

    @property
    def name(self) -> str:
        """How the record and the page call it."""
        if self.method == "rigid":
            return f"h = {self.value:.3g} s, residual {self.extra:.0e}"
        return f"k = {self.value:.0e} N/m, step share {self.extra:g}"


TOLERANCE, ROUGH = 1e-9, 1e-6
LEVELS = (
    *(Level("rigid", step, TOLERANCE) for step in (4e-3, 2e-3, 1e-3)),
    *(Level("soft", stiffness, STEP_SHARE) for stiffness in (1e7, 1e8, 1e9)),
    Level("rigid", 1e-3, ROUGH), Level("rigid", 5e-4, TOLERANCE), Level("soft", 1e10, STEP_SHARE),
)  # fmt: skip
"""In the order of their runs."""
QUICK_LEVELS = (
    *(Level("rigid", step, TOLERANCE) for step in (4e-3, 2e-3)),
    *(Level("soft", stiffness, STEP_SHARE) for stiffness in (1e8, 1e9)),
)  # fmt: skip
PICTURED = (Level("rigid", 1e-3, TOLERANCE), Level("soft", 1e9, STEP_SHARE))


def bed_row(bed: Bed) -> Row:
    """Pour and tamp; the line to record."""
    _, motion, cpu = bed_prepared(bed)
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
    level: Level, bed: Bed, scene: Scene, start: Motion, cycles: int
) -> Iterator[Moment]:
    """The run of a level, twice a cycle a moment."""
    if level.method == "rigid":
        return rigid_moments(bed, scene, start, cycles, level.value, level.extra)
    return soft_moments(bed, scene, start, cycles, level.value, level.extra)


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
        for moment in level_moments(level, bed, scene, start, cycles):
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
    beds: Sequence[Bed], wanted: int, levels: Sequence[Level], cycles: int,
    known: Sequence[Row], write: Callable[[Row], None],
) -> None:  # fmt: skip
    """All runs that ``known`` lacks: the first ``wanted`` of the beds that can be used, then level
    after level; each line is written when it is there."""
    _compile()
    poured = {row["bed"]["seed"]: row for row in known if row["kind"] == "bed"}
    failed = {row["bed"]["seed"] for row in known if row["kind"] == "no bed"}
    for bed in beds:
        if bed.seed in poured or bed.seed in failed or len(poured) >= wanted:
            continue
        try:
            poured[bed.seed] = bed_row(bed)
            write(poured[bed.seed])
        except RigidError as error:
            write(
                {
                    "kind": "no bed",
                    "bed": asdict(bed),
                    "why": str(error),
                    "error": type(error).__name__,
                }
            )
    done = {(row["bed"]["seed"], row["name"]) for row in known if row["kind"] in ("rigid", "soft")}
    usable = [bed for bed in beds if bed.seed in poured][:wanted]
    for level in levels:
        for bed in usable:
            if (bed.seed, level.name) not in done:
                drawn = level in PICTURED and bed is usable[0]
                for row in run_row(level, *bed_again(poured[bed.seed]), cycles, drawn):
                    write(row)


def _compile() -> None:
    """Few stones that fall, by both methods, so that no cost holds the time of a compiler."""
    bed = Bed(1, stones=4, width=0.15, sleeper=0.08, peak=2e3)
    scene = bed_scene(bed)
    start = world_of(scene)[1]
    for level in QUICK_LEVELS[::2]:
        list(level_moments(level, bed, scene, start, 1))


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

    beds = [Bed(seed) for seed in range(1, SEEDS + 1)]
    study(beds, arguments.beds, LEVELS, CYCLES, rows_read(arguments.out), write)


if __name__ == "__main__":
    main()
