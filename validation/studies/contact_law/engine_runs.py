"""Single impacts on an engine, many in one run: far apart, under every scene's law and walls.

What an engine gets is what it gets for a bed (`Engine.write_preparation`); added are only the
places, velocities, spins and masses of the grains at the start.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from adapters.bed.contact_law import DAMPING_FACTOR, find_rebound_damping, find_restitution
from adapters.bed.state import FloatArray
from adapters.engines.lammps import LammpsEngine
from adapters.engines.liggghts import LiggghtsEngine
from adapters.engines.yade import PARAMETERS, YadeEngine
from adapters.files.dump_reader import read_frames
from adapters.scene.tables import Scene
from validation.bench import few_grains, few_grains_lammps
from validation.bench.few_grains_lammps import VECTORS
from validation.bench.few_grains_yade import START

YADE_SCRIPT = (
    START
    + """\
start = parameters["impacts"]
states = [O.bodies[number].state for number in range(count)]
for state, velocity, spin, share in zip(
    states, start["velocity"], start["spin"], start["mass_factor"]
):
    state.vel, state.angVel = Vector3(*velocity), Vector3(*spin)
    state.mass, state.inertia = state.mass * share, state.inertia * share
bed.set_engines(parameters)
dumps = record.Dumps(parameters)
force = open("force.txt", "w")


def frame():
    bed.renew_forces()
    dumps.frame()
    np.savetxt(force, [O.forces.f(number, True) for number in range(count)], fmt="%.17g")


frame()
for _ in range(start["steps"]):
    O.step()
    if O.iter % start["every"] == 0:
        frame()
record.save_scene()
force.close()
print(f"COMPLETE step {O.iter}", flush=True)
"""
)


@dataclass(frozen=True)
class Start:
    """``n`` grains at the start; SI units."""

    radius: FloatArray
    """Radii [m], shape (n,)."""
    position: FloatArray
    """Centres [m], shape (n, 3)."""
    velocity: FloatArray
    """Velocities [m/s], shape (n, 3)."""
    spin: FloatArray
    """Angular velocities [rad/s], shape (n, 3)."""
    mass_factor: FloatArray
    """Density over that of the scene's grains, dimensionless, shape (n,)."""


@dataclass(frozen=True)
class Motion:
    """``s`` instants of ``n`` grains; SI units."""

    time: FloatArray
    """Time [s], shape (s,)."""
    position: FloatArray
    """Centres [m], shape (s, n, 3)."""
    velocity: FloatArray
    """Velocities [m/s], shape (s, n, 3); YADE's are those of the half step before."""
    spin: FloatArray
    """Angular velocities [rad/s], shape (s, n, 3)."""
    force: FloatArray
    """Forces on the grains [N], shape (s, n, 3)."""


ImpactRun = Callable[[Scene, Start, float, int, int], Motion]
"""Scene, start, time step [s], steps, steps between two instants -> motion."""


LAWS = ("scene", "unpulled", "undamped", "sliding")
"""Laws of a run: that of every scene, eqs 5 to 7; without pull; without viscous force along the
tangent; and without both, as rigid bodies' limits have it."""


def can_pull(law: str) -> bool:
    """Whether a parting contact pulls, where its engine lets it."""
    return law in ("scene", "undamped")


def has_damping(law: str) -> bool:
    """Whether a viscous force acts along the tangent."""
    return law in ("scene", "unpulled")


def choose_restitution(engine: str, law: str, restitution: float) -> float:
    """Restitution to write into the scene, so that the engine rebounds with ``restitution``.

    Another one where a law that never pulls runs on an engine whose damping is made for one that
    does.
    """
    if can_pull(law) or engine == "yade" or restitution == 1:
        return restitution
    return find_restitution(find_rebound_damping(restitution) / DAMPING_FACTOR)


def edit_law(engine: str, law: str, text: str) -> str:
    """A scene's generated text under a law of `LAWS`.

    Under eq. 7 as engines take it a parting contact pulls, and its friction then adds to the
    impulse; and a viscous force beside the Coulomb limit adds more.
    """
    pulls, damps = can_pull(law), has_damping(law)
    if engine == "liggghts":
        settings = " tangential_damping off" * (not damps) + " limitForce on" * (not pulls)
        pair = "pair_style gran model ${contact_model}"
        text = text.replace(pair, f"{pair}{settings}")
        return text.replace("store_force yes", settings.strip()) if settings else text
    if engine == "lammps":
        if not damps:
            text = re.sub(r"(tangential mindlin\S* \S+) \S+", r"\1 0.0", text)
        key = "coeff_restitution"
        return text.replace(key, key + " limit_damping" * (not pulls))
    return text if damps else re.sub(r'("damping_tangential": )[^,}]+', r"\g<1>0.0", text)


def add_starts(text: str, start: Start) -> str:
    """``grains.data`` with densities scaled, and a section of velocities and spins."""
    head, atoms = text.split("Atoms\n\n")
    rows = [row.split() for row in atoms.splitlines()]
    moving = np.zeros((len(rows), 6))  # the last row is that of the piston, which stands still
    moving[: len(start.radius)] = np.hstack([start.velocity, start.spin])
    for row, factor in zip(rows, start.mass_factor, strict=False):
        row[3] = f"{float(row[3]) * factor:.17g}"
    lines = [" ".join(row) for row in rows]
    starts = [
        f"{number} " + " ".join(f"{value:.17g}" for value in values)
        for number, values in enumerate(moving, 1)
    ]
    return "\n".join([f"{head}Atoms\n", *lines, "\nVelocities\n", *starts]) + "\n"


def run_by_deck(
    engine: LiggghtsEngine | LammpsEngine,
    deck: str,
    columns: str,
    states: str,
    edit: Callable[[str], str],
) -> ImpactRun:
    """Impacts on LIGGGHTS or LAMMPS, whose ``deck`` writes ``columns`` to the file ``states``.

    ``edit`` changes the text of ``scene.in``.
    """

    def run(scene: Scene, start: Start, time_step: float, steps: int, every: int) -> Motion:
        with TemporaryDirectory() as temporary:
            folder = Path(temporary)
            height = float(start.position[:, 2].max())
            digests = engine.write_preparation(scene, start.position, start.radius, height, folder)
            data = folder / "grains.data"
            data.write_text(add_starts(data.read_text(), start))
            scene_part = folder / "scene.in"
            scene_part.write_text(edit(scene_part.read_text()))
            lines = f"fix motion grains nve/sphere\nrun {steps}"
            (folder / "in.impacts").write_text(
                deck.format(every=every, time_step=time_step, columns=columns, lines=lines)
            )
            engine.run(scene, "in.impacts", folder, lambda: None, digests)
            frames = list(read_frames(folder / states))
        time = time_step * np.array([frame.time_step for frame in frames])
        vectors = (np.array([f.block(*names.split()) for f in frames]) for names in VECTORS)
        return Motion(time, *vectors)

    return run


def run_by_script(edit: Callable[[str], str]) -> ImpactRun:
    """Impacts on YADE; ``edit`` changes the text of its parameters."""

    def run(scene: Scene, start: Start, time_step: float, steps: int, every: int) -> Motion:
        engine = YadeEngine()
        with TemporaryDirectory() as temporary:
            folder = Path(temporary)
            height = float(start.position[:, 2].max())
            digests = engine.write_preparation(scene, start.position, start.radius, height, folder)
            content = json.loads((folder / PARAMETERS).read_text())
            count = len(start.radius)
            content |= {"gravity": 0.0, "time_step": time_step, "grain_count": count}
            content["impacts"] = {
                "velocity": start.velocity.tolist(),
                "spin": start.spin.tolist(),
                "mass_factor": start.mass_factor.tolist(),
                "steps": steps,
                "every": every,
            }
            (folder / PARAMETERS).write_text(edit(json.dumps(content)))
            (folder / "impacts.py").write_text(YADE_SCRIPT)
            engine.run(scene, "impacts.py", folder, lambda: None, digests)
            frames = list(read_frames(folder / "states.dump"))
            force = np.loadtxt(folder / "force.txt").reshape(-1, count, 3)
        time = time_step * np.array([frame.time_step for frame in frames])
        position, velocity, spin = (
            np.array([f.block(*names.split()) for f in frames]) for names in VECTORS[:3]
        )
        return Motion(time, position, velocity, spin, force)

    return run


def choose_run(name: str, law: str = "scene") -> ImpactRun:
    """The run on the engine ``liggghts``, ``lammps`` or ``yade``, under a law of `LAWS`.

    Each raises as its engine does.
    """
    edit = partial(edit_law, name, law)
    if name == "yade":
        return run_by_script(edit)
    if name == "lammps":
        vectors = " ".join(VECTORS)
        return run_by_deck(LammpsEngine(), few_grains_lammps.DECK, vectors, "states.dump", edit)
    return run_by_deck(LiggghtsEngine(), few_grains.DECK, " %.17g" * 12, "grains.dump", edit)
