"""A few grains in LIGGGHTS under the contact law, walls and settings that every scene gets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from adapters import decks
from adapters.contact_law import CONTACT_TIME_FACTOR
from adapters.dump import dump_frames
from adapters.engine_liggghts import LiggghtsEngine
from adapters.scene import Scene
from adapters.scene_file import scene_load
from adapters.state import Contacts, FloatArray
from adapters.window import contacts_of_frame
from scenes import scene_path

PAIR_STYLE = "pair_style gran model ${contact_model}"

DECK = """\
variable gravity index 0.0
{own}
include parameters.in
include settings.in
read_data grains.data
include bed.in
timestep {time_step:.17g}
dump grains grains custom {every} grains.dump id x y z vx vy vz omegax omegay omegaz fx fy fz
dump_modify grains sort id first yes format "%d{columns}"
variable steps_per_cycle index {every}
include {output}
thermo_modify lost error norm no
{motion}
write_restart end.restart
variable steps_done equal step
print "COMPLETE step ${{steps_done}}"
"""


@dataclass(frozen=True)
class Track:
    """``s`` instants of ``n`` grains, evenly spaced in time but where a run follows another."""

    time: FloatArray
    """Time [s], shape (s,)."""
    position: FloatArray
    """Centres [m], shape (s, n, 3)."""
    velocity: FloatArray
    """Velocities [m/s], shape (s, n, 3)."""
    spin: FloatArray
    """Angular velocities [rad/s], shape (s, n, 3)."""
    force: FloatArray
    """Forces [N], shape (s, n, 3)."""
    contacts: tuple[Contacts, ...]
    """Contacts between grains at each instant."""


def scene_of(*overrides: str) -> Scene:
    """Grains, walls and contact law of the paper's Table 1 (``scenes/karrech.toml``), changed."""
    return scene_load(scene_path("karrech"), overrides)


def track_run(
    scene: Scene,
    position: FloatArray,
    velocity: FloatArray,
    radius: FloatArray,
    motion: Sequence[str],
    *,
    time_step: float,
    every: int = 1,
    settings: str = "",
) -> Track:
    """Run LIGGGHTS, without gravity, on grains of ``radius`` [m], shape (n,).

    ``position`` [m] and ``velocity`` [m/s], shape (n, 3); ``motion`` are the deck's lines that
    move them, ``time_step`` [s], ``every`` steps between two instants.  ``replaced`` are texts of
    deck parts by name, in place of the project's own.  Raises as `LiggghtsEngine.run`.
    """
    engine = LiggghtsEngine()
    kind = "frictional" if scene.material.grain.friction > 0 else "frictionless"
    speeds = [
        f"velocity first set {v[0]:.17g} {v[1]:.17g} {v[2]:.17g} units box".replace(
            "first", f"grain_{i}"
        )
        for i, v in enumerate(velocity, 1)
    ]
    groups = [f"group grain_{i} id {i}" for i in range(1, len(radius) + 1)]
    with TemporaryDirectory() as temporary:
        folder = Path(temporary)
        height = float(position[:, 2].max())
        digests = engine.write_preparation(scene, position, radius, height, folder)
        text = DECK.format(
            own="",
            time_step=time_step,
            every=every,
            columns=" %.17g" * 12,
            output=f"output_{kind}.in",
            motion="\n".join([*groups, *speeds, *motion]),
        )
        (folder / "in.few").write_text(text)
        materials = (folder / "scene.in").read_text()
        (folder / "scene.in").write_text(materials.replace(PAIR_STYLE, f"{PAIR_STYLE} {settings}"))
        engine.run(scene, "in.few", folder, lambda: None, digests)
        frames = list(dump_frames(folder / "grains.dump"))
        contacts = tuple(contacts_of_frame(f) for f in dump_frames(folder / "contacts.dump"))
    step = np.array([frame.time_step for frame in frames])
    blocks = [
        np.array([frame.block(*names) for frame in frames])
        for names in (
            ("x", "y", "z"),
            ("vx", "vy", "vz"),
            ("omegax", "omegay", "omegaz"),
            ("fx", "fy", "fz"),
        )
    ]
    return Track(step * time_step, *blocks, contacts)
