"""The paper's bed on YADE at its own stiffness: ten load cycles, their cost, their energies.

python -m validation.yade_paper FOLDER        15 CPU minutes; goes on with what FOLDER holds
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median

import numpy as np
from scipy.integrate import trapezoid

from adapters.checks import check_window
from adapters.engine_plan import seat_plan
from adapters.window import Window
from validation.yade_scale import Bed, after, changed, rested, scene_of, soft_bed
from validation.yade_share import Added, window_timed

GRAINS, CYCLES, LAST = 1085, 10, 5
"""Grains, load cycles, and of how many at the end the cost is told."""

SHRUNK = 0.999
"""What radii are multiplied with, so that no grain is pushed off by a soft grain's overlap."""


@dataclass(frozen=True)
class PaperScale:
    """1,085 grains of 46.9 GPa at the scene's own step."""

    steps_per_cycle: int
    cycle_s: float
    """CPU time of a load cycle, mean of the last [s], start-up and files shared out."""
    grain_steps: float
    """Grains times steps over that time [1/s]."""
    speed: float
    """Speed through the adapter over that of the bare engine, median of the cycles."""
    kinetic_at_ends: tuple[float, ...]
    """Kinetic energy at the end of every cycle [J]."""
    kinetic_share: float
    """Greatest kinetic energy in the last cycle over the piston's work in it."""
    work: float
    """Work of the piston on the bed in the last cycle [J]."""
    settlement: float
    """Way down of the grains' mean height in all cycles [m]."""
    force_error: float
    """Greatest rms of piston force less target in a cycle behind the first, over the peak."""
    overlap_share: float
    """Greatest overlap over the smallest radius, all cycle ends."""


def paper_bed(seated: Window, folder: Path) -> Bed:
    """A seated soft bed with the paper's stiffness, come to rest again.

    It rests until its kinetic energy is 1e-5 of its potential one.
    """
    scene = scene_of("karrech")
    steps = scene.steps_per_cycle
    radius = SHRUNK * seated.radius
    top = float((seated.position[-1, :, 2] + radius).max())

    def soon(place: Path) -> None:
        still = {"equilibrium_ratio": 1e-5, "check_steps": steps, "minimum_steps": steps}
        changed(place, "settle", **still, history_steps=steps // 4)

    return rested(scene, seated.position[-1], radius, top, folder, soon)


def paper_cycles(seated: Window, home: Path) -> tuple[list[Window], list[Added]]:
    """Seat the piston and load, cycle by cycle, each a window of its own in ``home``.

    Seating takes one cycle, as bed and piston have met before.
    """
    bed = paper_bed(seated, home / "rest")
    steps = bed.scene.steps_per_cycle

    def short(place: Path) -> None:
        if bed.start.first:
            halves = {"steps": steps // 2, "release_steps": steps - steps // 2}
            changed(place, "window", seat=asdict(seat_plan(bed.scene)) | halves)

    made, times = [], []
    for number in range(1, CYCLES + 1):
        folder = home / f"cycle_{number}"
        one, added = window_timed(bed, 1, folder, short)
        made.append(one)
        times.append(added)
        bed = after(bed, one, folder)
        print(number, kinetic_at_end(one), added, flush=True)
    return made, times


def kinetic_at_end(window: Window) -> float:
    """Kinetic energy of the grains, both kinds, at a window's end [J]."""
    piston = window.piston
    return float(piston.kinetic_translational[-1] + piston.kinetic_rotational[-1])


def paper_scale(seated: Window, home: Path) -> PaperScale:
    """Figures of `paper_cycles` on the bed of a soft window's end."""
    scene = scene_of("karrech")
    steps = scene.steps_per_cycle
    made, times = paper_cycles(seated, home)
    cycle_s = float(np.mean([each.engine_s for each in times[-LAST:]]))
    piston = made[-1].piston
    height = np.concatenate([[made[-1].piston_start], piston.height])
    force = np.concatenate([made[-2].piston.contact_force[-1:], piston.contact_force])
    work = -float(trapezoid(force, height))
    kinetic = piston.kinetic_translational + piston.kinetic_rotational
    down = made[0].position[0, :, 2] - made[-1].position[-1, :, 2]
    return PaperScale(
        steps_per_cycle=steps,
        cycle_s=cycle_s,
        grain_steps=scene.grain_count * steps / cycle_s,
        speed=median(each.speed for each in times[1:]),
        kinetic_at_ends=tuple(kinetic_at_end(each) for each in made),
        kinetic_share=float(kinetic.max()) / work,
        work=work,
        settlement=float(down.mean()),
        force_error=max(float(each.piston.force_error(steps)[-1]) for each in made[1:]),
        overlap_share=max(check_window(scene, each, 1)["overlap_share"] for each in made),
    )


def main(words: Sequence[str] | None = None) -> None:
    """Compute what a folder lacks, and print the figures."""
    home = Path((sys.argv[1:] if words is None else words)[0])
    _, seated = soft_bed(home / "soft", GRAINS)
    print(paper_scale(seated, home / "paper"))


if __name__ == "__main__":
    main()
