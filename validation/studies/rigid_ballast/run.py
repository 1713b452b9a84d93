"""A bed by every level of both methods: a part each."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

from rigid_lcp.errors import RigidError
from rigid_lcp.motion.state import Motion
from rigid_lcp.motion.world import Scene
from validation.studies.rigid_ballast.bed import Moment, load_rigid, load_soft, prepare_bed
from validation.studies.rigid_ballast.soft import STEP_SHARE

Row = dict[str, Any]
CYCLES, BEDS = 5, 30
TOLERANCE = 1e-6
"""Residual of the rigid levels [-]."""


@dataclass(frozen=True)
class Level:
    """One setting of one method."""

    method: str
    """``rigid`` or ``soft``."""
    value: float
    """Step [s] of rigid grains, normal stiffness [N/m] of soft ones."""

    @property
    def name(self) -> str:
        """How the record and the page call it."""
        if self.method == "rigid":
            return f"rigid, h = {1e3 * self.value:g} ms"
        return f"soft, k = {self.value:.0e} N/m".replace("e+0", "e").replace("e+", "e")

    def load(self, scene: Scene, start: Motion) -> Iterator[Moment]:
        """The run of the level."""
        if self.method == "rigid":
            return load_rigid(scene, start, CYCLES, self.value, TOLERANCE)
        return load_soft(scene, start, CYCLES, self.value, STEP_SHARE)


LEVELS = (
    *(Level("rigid", step) for step in (4e-3, 2e-3, 1e-3, 5e-4)),
    *(Level("soft", stiffness) for stiffness in (1e7, 1e8, 1e9, 1e10)),
)  # fmt: skip
"""Of each method the coarse ones first."""


def measure_bed(seed: int) -> Row:
    """All levels on the bed of a seed; a run that fails says why."""
    scene, start = prepare_bed(seed)
    runs: dict[str, Row] = {}
    for level in LEVELS:
        try:
            moments = list(level.load(scene, start))
        except RigidError as error:
            runs[level.name] = {"why": str(error)}
            continue
        whole, peaks, last = moments[::2], moments[1::2], moments[-1]
        lost = [later.work - now.work - later.energy + now.energy for now, later in pairwise(whole)]
        runs[level.name] = {
            "settlement": [whole[0].height - moment.height for moment in whole[1:]],
            "recoil": last.height - peaks[-1].height, "tilt": last.tilt - whole[0].tilt,
            "overlap": max(moment.overlap for moment in moments), "dissipated": lost,
            "cpu_s": last.cpu, "steps": last.steps, "residual": last.residual,
        }  # fmt: skip
    return {"seed": seed, "runs": runs}


PARTS: dict[str, Callable[[], Row]] = {
    f"bed {seed}": partial(measure_bed, seed) for seed in range(1, BEDS + 1)
}
