"""One contact in LAMMPS, under the contact law, walls and settings that every scene gets."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from adapters.bed.state import FloatArray
from adapters.engines.lammps import LammpsEngine
from adapters.files.dump_reader import read_frames
from adapters.files.window import read_contacts
from adapters.scene.tables import Scene
from validation.bench.few_grains import RADIUS, Track

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


def track_run(
    scene: Scene,
    position: FloatArray,
    velocity: FloatArray,
    motion: Sequence[str],
    *,
    time_step: float,
    every: int = 1,
    materials: Callable[[str], str] = str,
) -> Track:
    """Run LAMMPS, without gravity; as `validation.bench.few_grains.track_run`.

    Raises as `LammpsEngine.run`.
    """
    engine = LammpsEngine()
    lines = []
    for number, v in enumerate(velocity, 1):
        lines.append(f"group grain_{number} id {number}")
        lines.append(f"velocity grain_{number} set {v[0]:.17g} {v[1]:.17g} {v[2]:.17g} units box")
    deck = DECK.format(
        every=every,
        time_step=time_step,
        columns=" ".join(VECTORS),
        lines="\n".join([*lines, *motion]),
    )
    with TemporaryDirectory() as temporary:
        folder = Path(temporary)
        height = float(position[:, 2].max())
        radius = np.full(len(position), RADIUS)
        digests = engine.write_preparation(scene, position, radius, height, folder)
        (folder / "in.few").write_text(deck)
        scene_part = folder / "scene.in"
        scene_part.write_text(materials(scene_part.read_text()))
        engine.run(scene, "in.few", folder, lambda: None, digests)
        frames = list(read_frames(folder / "states.dump"))
        contacts = tuple(read_contacts(frame) for frame in read_frames(folder / "contacts.dump"))
    position, velocity, spin, force = (
        np.array([frame.block(*columns.split()) for frame in frames]) for columns in VECTORS
    )
    time = time_step * np.array([frame.time_step for frame in frames])
    return Track(time, position, velocity, spin, force, contacts)
