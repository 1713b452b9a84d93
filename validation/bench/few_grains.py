"""One contact in an engine (LIGGGHTS if no other is named), under every scene's law and walls."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import pi
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from adapters.bed import contact_law
from adapters.bed.contact_law import Collision
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


def find_grain_mass(scene: Scene) -> float:
    """Mass of a grain [kg]."""
    return 4 / 3 * pi * scene.material.grain.density * RADIUS**3


def find_shear_modulus(scene: Scene) -> float:
    """G* of two grains [Pa]."""
    grain = (scene.material.grain.young, scene.material.grain.poisson)
    return contact_law.combine_shear_moduli(*grain, *grain)


TrackRun = Callable[..., Track]
"""Runs a few grains on an engine, with the arguments of `run_grains`, which does on LIGGGHTS."""


def run_grains(
    scene: Scene, position: FloatArray, velocity: FloatArray, motion: Sequence[str], *,
    time_step: float, every: int = 1, materials: Callable[[str], str] = str,
) -> Track:  # fmt: skip
    """Run LIGGGHTS, without gravity, from ``position`` [m] and ``velocity`` [m/s], shape (n, 3).

    ``motion`` are the deck's lines that move the grains, each in a group ``grain_1``, ...;
    ``time_step`` [s]; ``every`` steps between two instants; ``materials`` may change the text of
    ``scene.in``, such as `limit_force`.  Raises as `LiggghtsEngine.run`.
    """
    blocks = [[letter + axis for axis in "xyz"] for letter in ("", "v", "omega", "f")]
    return run_deck(
        LiggghtsEngine(), DECK, " %.17g" * 12, "grains.dump", blocks, scene, position, velocity,
        motion, time_step, every, materials,
    )  # fmt: skip


def run_deck(
    engine: DeckEngine, text: str, columns: str, dump: str, blocks: Sequence[Sequence[str]],
    scene: Scene, position: FloatArray, velocity: FloatArray, motion: Sequence[str],
    time_step: float, every: int, materials: Callable[[str], str],
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
        radius = np.full(len(position), RADIUS)
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


def limit_force(scene_part: str) -> str:
    """``scene.in`` with contacts that end where their force turns to tension."""
    style = "pair_style gran model ${contact_model}"
    return scene_part.replace(style, f"{style} limitForce on")


def mirror_tangential(scene_part: str) -> str:
    """``scene.in`` with the grains' own contact law, at friction 0, on the mirror planes."""
    return scene_part.replace("wall/gran model hertz ", "wall/gran model ${contact_model} ")


def collide(
    scene: Scene,
    speed: float,
    *,
    steps: float = 1000,
    mirror: bool = False,
    slide: float = 0.0,
    materials: Callable[[str], str] = str,
    run: TrackRun = run_grains,
) -> tuple[Collision, Track]:
    """Two grains that meet at ``speed`` [m/s], or one and its image in the mirror plane x = 0.

    ``steps`` in the time of an undamped contact; ``slide`` [m/s] is a velocity of both along z.
    """
    mass = find_grain_mass(scene) / 2
    undamped = contact_law.solve_hertz_collision(speed, scene.stiffness.grain, RADIUS / 2, mass)
    time_step = undamped.contact_time / steps
    gap = 2.25 * speed * time_step  # small, and no whole number of steps
    middle = np.array([0.0 if mirror else PLACE[0], *PLACE[1:]])
    apart = np.array([RADIUS + gap / 2, 0.0, 0.0])
    position = np.array([middle + apart, middle - apart])
    velocity = np.array([[-speed / 2, 0.0, slide], [speed / 2, 0.0, slide]])
    grains = 1 if mirror else 2
    track = run(
        scene,
        position[:grains],
        velocity[:grains],
        ["fix motion grains nve/sphere", f"run {round(1.7 * steps)}"],
        time_step=time_step,
        materials=materials,
    )
    x, v = track.position[:, :, 0], track.velocity[:, :, 0]
    overlap = 2 * (RADIUS - x[:, 0]) if mirror else 2 * RADIUS - (x[:, 0] - x[:, 1])
    rebound = 2 * v[-1, 0] if mirror else v[-1, 0] - v[-1, 1]
    touching = np.flatnonzero(overlap > 0)
    ends = [
        track.time[i] - overlap[i] * (track.time[j] - track.time[i]) / (overlap[j] - overlap[i])
        for i, j in ((touching[0], touching[0] - 1), (touching[-1], touching[-1] + 1))
    ]
    return Collision(rebound / speed, float(overlap.max()), ends[1] - ends[0]), track


def drive_contact(
    scene: Scene,
    overlap: FloatArray,
    displacement: FloatArray,
    *,
    speed: float = 1e-3,
    steps: int = 1000,
    run: TrackRun = run_grains,
) -> tuple[Track, FloatArray, FloatArray]:
    """One contact driven along straight legs between the corners of a path; the other grain held.

    ``overlap`` delta_n and ``displacement`` delta_t [m] of the corners, shape (c,); ``speed`` [m/s]
    along each leg, in ``steps`` steps.  Returns the track, delta_n and the distance moved along the
    tangent [m], shape (s,) each.  The normal turns by delta_t/(2 R), which must be small.
    """
    legs = np.column_stack([-np.diff(overlap), np.diff(displacement)])  # along x, along y
    length = np.hypot(*legs.T)
    time_step = float(length.max()) / speed / steps
    motion = []
    for leg in legs / (steps * time_step):
        motion.append(f"fix leg grain_1 move linear {leg[0]:.17g} {leg[1]:.17g} 0.0 units box")
        motion += [f"run {steps}", "unfix leg"]
    start = PLACE + np.array([[2 * RADIUS - overlap[0], displacement[0], 0.0], [0.0, 0.0, 0.0]])
    every = max(steps // 100, 1)
    track = run(scene, start, np.zeros((2, 3)), motion, time_step=time_step, every=every)
    apart = track.position[:, 0] - track.position[:, 1]
    return track, 2 * RADIUS - np.linalg.norm(apart, axis=1), apart[:, 1]


def slide_on_mirror(
    scene: Scene,
    speed: float,
    runs: int,
    materials: Callable[[str], str] = str,
    run: TrackRun = run_grains,
) -> Track:
    """A grain that 1 N presses on the mirror plane x = 0 slides along z at ``speed`` [m/s].

    In ``runs`` commands ``run`` of ten steps each, at the scene's own time step.
    """
    modulus = scene.stiffness.mirror
    overlap = float(contact_law.find_overlap_under_force(1.0, modulus, RADIUS))
    push = ["fix motion grains nve/sphere", "fix push grains addforce -1.0 0.0 0.0"]
    return run(
        scene,
        np.array([[RADIUS - overlap, *PLACE[1:]]]),
        np.array([[0.0, 0.0, speed]]),
        [*push, *["run 10"] * runs],
        time_step=scene.time_step,
        materials=materials,
    )
