"""Relaxation by an engine itself: a few damped steps, and the minimisers that engines have.

A user without a relaxation of his own would let the engine do it.  Two recipes of damped steps in
LIGGGHTS, with friction, gravity and all walls: ``drag``, a viscous force that damps a contact
critically at the mean overlap the bed carries (``fix viscous``), and ``limit``, steps that move no
grain further than a share of its radius (``fix nve/limit``; no rotation).  And ``minimize`` of
both engines, as far as it gets: granular pairs have no energy for a line search, and walls and
gravity do not act in it, so the grains at the walls are held as in section 4.2 of the paper.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from adapters.contact_law import normal_stiffness
from adapters.dump import dump_frames
from adapters.engine import EngineStart, engine_failure, engine_named
from adapters.engine_process import process_run
from adapters.scene import Scene
from adapters.state import FloatArray
from validation.relaxation_jumps import Jumped

LIMIT_SHARE = 1e-4
"""Greatest way of a grain in a step of ``limit``, over its radius."""

STYLES = {"liggghts": ("cg", "fire"), "lammps": ("cg", "sd", "hftn", "quickmin", "fire")}
"""Styles of ``min_style`` that are tried in an engine; LIGGGHTS has ``cg`` alone."""

END = "write_dump all custom relaxed.dump id x y z modify sort id format {precise}\n"

FROM_DATA = """\
include parameters.in
include settings.in
read_data grains.data
include bed.in
{motion}
thermo_modify lost error norm no
run {steps}
"""

FROM_RESTART = """\
# Relaxation by damped steps from a saved state, contacts keep their springs.  The lid is the piston
# at its new height, held.  The steps are taken from the count, so that load cycles start after it.
include parameters.in
include settings.in
read_restart start.restart
include bed.in
group piston type 2
neigh_modify exclude type 1 2
fix lid grains mesh/surface/stress file piston.stl type 2 move 0.0 0.0 ${{piston_height}} &
    stress on reference_point 0.0 0.0 0.0
fix piston_wall grains wall/gran model ${{contact_model}} &
    mesh n_meshes 1 meshes lid store_force yes
{motion}
thermo_modify lost error norm no
include start_moved.in
reset_timestep {first_step}
run {steps}
velocity grains set 0.0 0.0 0.0 units box
set group grains omegax 0.0 omegay 0.0 omegaz 0.0
write_restart end.restart
"""

MINIMISE = """\
include parameters.in
include settings.in
read_data grains.data
include bed.in
group held id {held}
fix hold held setforce 0.0 0.0 0.0
{energy}
thermo 1000000
thermo_modify lost error norm no
min_style {style}
minimize 0.0 {force:.17g} {iterations} {evaluations}
"""


@dataclass(frozen=True)
class EngineRelaxed:
    """What an engine made of a jump."""

    position: FloatArray
    """Centres [m], (n, 3)."""
    cpu_s: float
    """Processor time of the process, its start-up included [s]."""
    folder: Path
    """Where its files are; ``end.restart`` among them when it began from one."""


def drag_critical(jump: Jumped) -> float:
    """Viscous coefficient 2 sqrt(m S_n) [N s/m] of the mean grain at the mean carried overlap."""
    carried = jump.around_before.search(jump.before.position, 0.0)
    overlap = float(carried.overlap.mean())
    radius = float(jump.before.radius.mean()) / 2
    stiffness = float(normal_stiffness(overlap, jump.stiffness.grain, radius))
    return 2 * float(np.sqrt(jump.before.mass.mean() * stiffness))


def motion_text(jump: Jumped, recipe: str) -> str:
    """Lines that let the grains move by a ``recipe``: ``drag`` or ``limit``."""
    if recipe == "limit":
        return f"fix motion grains nve/limit radius_ratio {LIMIT_SHARE:.17g}"
    return f"fix motion grains nve/sphere\nfix drag grains viscous {drag_critical(jump):.17g}"


def damped_from_data(
    scene: Scene, jump: Jumped, recipe: str, steps: int, folder: Path
) -> EngineRelaxed:
    """Damped steps of LIGGGHTS from the estimate alone: tangential springs start from nothing."""
    folder.mkdir(parents=True)
    engine = engine_named("liggghts")
    height = float((jump.estimate[:, 2] + jump.before.radius).max())
    engine.write_preparation(scene, jump.estimate, jump.before.radius, height, folder)
    text = FROM_DATA.format(motion=motion_text(jump, recipe), steps=steps)
    return _relaxed(scene, "liggghts", text, folder)


def damped_from_restart(
    scene: Scene, jump: Jumped, start: EngineStart, recipe: str, steps: int, folder: Path
) -> tuple[EngineRelaxed, EngineStart]:
    """Damped steps of LIGGGHTS from the state before the jump, moved; and how to go on from them.

    ``start`` is that of an ordinary resubmission of the estimate.
    """
    folder.mkdir(parents=True)
    engine_named("liggghts").write_cycles(scene, start, 1, folder)
    text = FROM_RESTART.format(
        motion=motion_text(jump, recipe), steps=steps, first_step=start.time_step - steps
    )
    found = _relaxed(scene, "liggghts", text, folder)
    restart = EngineStart(
        folder / "end.restart", start.time_step, start.piston_mesh, start.piston_height
    )
    return found, restart


def minimised_by(
    engine_name: str, scene: Scene, jump: Jumped, style: str, iterations: int, folder: Path
) -> EngineRelaxed:
    """``minimize`` of an engine from the estimate, the grains at the walls held.

    Raises `EngineFailed` with the engine's own words.
    """
    folder.mkdir(parents=True)
    engine = engine_named(engine_name)
    height = float((jump.estimate[:, 2] + jump.before.radius).max())
    engine.write_preparation(scene, jump.estimate, jump.before.radius, height, folder)
    touching = jump.around_before.search(jump.before.position, 0.0)
    held = np.unique(touching.first[touching.second < 0]) + 1
    text = MINIMISE.format(
        held=" ".join(map(str, held)),
        energy="" if engine_name == "lammps" else "compute thermo_pe all pe",
        style=style,
        force=1e-12,
        iterations=iterations,
        evaluations=10 * iterations,
    )
    return _relaxed(scene, engine_name, text, folder)


def _relaxed(scene: Scene, engine_name: str, text: str, folder: Path) -> EngineRelaxed:
    """Run a deck that ends with the dump of `END`; raises `EngineFailed`."""
    lammps = engine_name == "lammps"
    precise = "float %.17g" if lammps else '"%d %.17g %.17g %.17g"'
    (folder / "in.relax").write_text(text + END.format(precise=precise))
    command = engine_named(engine_name).command(scene, "in.relax")
    status, cpu_s, _ = process_run(command, folder, lambda: None)
    path = folder / "relaxed.dump"
    if status != 0 or not path.exists():
        raise engine_failure(status, folder)
    (frame,) = dump_frames(path)
    return EngineRelaxed(frame.block("x", "y", "z")[: scene.grain_count], cpu_s, folder)


STOPPED = re.compile(r"Stopping criterion = (.*)")


def stopped_because(folder: Path) -> str:
    """Why a minimiser says that it ended; empty when it does not."""
    found = STOPPED.search((folder / "screen.txt").read_text(errors="replace"))
    return "" if found is None else found[1].strip()
