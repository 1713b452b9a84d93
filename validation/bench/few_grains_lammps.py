"""One contact in LAMMPS, under the contact law, walls and settings that every scene gets."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from adapters.bed.state import FloatArray
from adapters.engines.lammps import LammpsEngine
from adapters.scene.tables import Scene
from validation.bench.few_grains import Track, run_deck

DECK = """\
variable gravity index 0.0
variable steps_per_cycle index {every}
include parameters.in
include settings.in
read_data grains.data
include bed.in
timestep {time_step:.17g}
dump states grains custom {every} states.dump id {columns} radius mass
dump_modify states sort id first yes format float %.17g
include ${{output_part}}
thermo_modify lost error norm no
{lines}
write_restart end.restart
print "COMPLETE step $(step)"
"""

VECTORS = ("x y z", "vx vy vz", "omegax omegay omegaz", "fx fy fz")
"""Columns of position, velocity, spin and force."""


def run_grains(
    scene: Scene, position: FloatArray, velocity: FloatArray, motion: Sequence[str], *,
    time_step: float, every: int = 1, materials: Callable[[str], str] = str,
    radius: FloatArray | None = None,
) -> Track:  # fmt: skip
    """Run LAMMPS, without gravity; as `validation.bench.few_grains.run_grains`.

    Raises as `LammpsEngine.run`.
    """
    return run_deck(
        LammpsEngine(), DECK, " ".join(VECTORS), "states.dump", [v.split() for v in VECTORS], scene,
        position, velocity, motion, time_step, every, materials, radius,
    )  # fmt: skip
