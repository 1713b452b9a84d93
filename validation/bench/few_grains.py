"""One contact in an engine (LIGGGHTS if no other is named), under every scene's law and walls."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from adapters.bed.state import Contacts, FloatArray
from adapters.engines.decks import DeckEngine
from adapters.engines.liggghts import LiggghtsEngine
from adapters.files.dump_reader import read_frames
from adapters.files.window import read_contacts
from adapters.scene.file import load_scene
from adapters.scene.tables import Scene
from trackbed.scenes import find_scene_file

RADIUS = 3.2e-3
"""Radius of every grain here [m], the mean of Table 1."""

PLACE = np.array([0.02, 0.02, 0.02])
"""A place far from every wall [m]."""

DECK = """\
variable gravity index 0.0
variable steps_per_cycle index {every}
include parameters.in
include settings.in
read_data grains.data
include bed.in
timestep {time_step:.17g}
dump grains grains custom {every} grains.dump id x y z vx vy vz omegax omegay omegaz fx fy fz
dump_modify grains sort id first yes format "%d{columns}"
include ${{output_part}}
thermo_modify lost error norm no
{lines}
write_restart end.restart
variable steps_done equal step
print "COMPLETE step ${{steps_done}}"
"""


@dataclass(frozen=True)
class Track:
    """``s`` instants of ``n`` grains."""

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


def load_table_1(*overrides: str) -> Scene:
    """Grains, walls and contact law of the paper's Table 1 (``karrech.toml``), changed."""
    return load_scene(find_scene_file("karrech"), overrides)


TrackRun = Callable[..., Track]
"""Runs a few grains on an engine, with the arguments of `run_grains`, which does on LIGGGHTS."""


def run_grains(
    scene: Scene, position: FloatArray, velocity: FloatArray, motion: Sequence[str], *,
    time_step: float, every: int = 1, materials: Callable[[str], str] = str,
    radius: FloatArray | None = None,
) -> Track:  # fmt: skip
    """Run LIGGGHTS, without gravity, from ``position`` [m] and ``velocity`` [m/s], shape (n, 3).

    ``motion`` are the deck's lines that move the grains, each in a group ``grain_1``, ...;
    ``time_step`` [s]; ``every`` steps between two instants; ``materials`` may change the text of
    ``scene.in``; ``radius`` [m] of the grains, `RADIUS` for None.  Raises as `LiggghtsEngine.run`.
    """
    blocks = [[letter + axis for axis in "xyz"] for letter in ("", "v", "omega", "f")]
    return run_deck(
        LiggghtsEngine(), DECK, " %.17g" * 12, "grains.dump", blocks, scene, position, velocity,
        motion, time_step, every, materials, radius,
    )  # fmt: skip


def run_deck(
    engine: DeckEngine, text: str, columns: str, dump: str, blocks: Sequence[Sequence[str]],
    scene: Scene, position: FloatArray, velocity: FloatArray, motion: Sequence[str],
    time_step: float, every: int, materials: Callable[[str], str],
    radius: FloatArray | None,
) -> Track:  # fmt: skip
    """Run ``text``, an engine's deck, with its ``columns`` in; those of position, velocity, spin
    and force in ``dump`` are ``blocks``."""
    lines = []
    for number, v in enumerate(velocity, 1):
        lines.append(f"group grain_{number} id {number}")
        lines.append(f"velocity grain_{number} set {v[0]:.17g} {v[1]:.17g} {v[2]:.17g} units box")
    deck = text.format(
        every=every, time_step=time_step, columns=columns, lines="\n".join([*lines, *motion])
    )
    with TemporaryDirectory() as temporary:
        folder = Path(temporary)
        height = float(position[:, 2].max())
        radius = np.full(len(position), RADIUS) if radius is None else radius
        digests = engine.write_preparation(scene, position, radius, height, folder)
        (folder / "in.few").write_text(deck)
        scene_part = folder / "scene.in"
        scene_part.write_text(materials(scene_part.read_text()))
        engine.run(scene, "in.few", folder, lambda: None, digests)
        frames = list(read_frames(folder / dump))
        contacts = tuple(read_contacts(frame) for frame in read_frames(folder / "contacts.dump"))
    time = time_step * np.array([frame.time_step for frame in frames])
    position, velocity, spin, force = (
        np.array([frame.block(*names) for frame in frames]) for names in blocks
    )
    return Track(time, position, velocity, spin, force, contacts)
