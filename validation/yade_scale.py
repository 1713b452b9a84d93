"""Beds of the paper's size on YADE, rained soft, and windows of load cycles on them."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from adapters.checks import check_window
from adapters.engine import EngineStart
from adapters.engine_yade import PARAMETERS, YadeEngine
from adapters.radii import radii_sample
from adapters.sample import sample_start
from adapters.scene import Scene
from adapters.scene_file import scene_load
from adapters.state import FloatArray
from adapters.window import Window, state_read, window_load, window_read, window_save
from scenes import scene_path

ENGINE = YadeEngine()
SOFT_YOUNG = 5e8
"""Grains of the bed that is rained and seated, before they get the paper's stiffness [Pa]."""


def scene_of(name: str, *settings: str) -> Scene:
    """A shipped scene on YADE."""
    return scene_load(scene_path(name), ['engine.name="yade"', *settings])


@dataclass(frozen=True)
class Bed:
    """A bed in a folder, from which a window can start."""

    scene: Scene
    start: EngineStart


def changed(folder: Path, table: str, **values: object) -> None:
    """Change values of one table of the parameters in ``folder``."""
    path = folder / PARAMETERS
    content = json.loads(path.read_text())
    content[table] |= values
    path.write_text(json.dumps(content))


def rested(
    scene: Scene,
    position: FloatArray,
    radius: FloatArray,
    height: float,
    folder: Path,
    edit: Callable[[Path], None] = lambda folder: None,
) -> Bed:
    """Grains at ``position`` [m] below ``height`` [m] come to rest; ``edit`` changes the input.

    A ``folder`` where they have is read back.
    """
    if not (folder / "end.restart").exists():
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        digests = ENGINE.write_preparation(scene, position, radius, height, folder)
        edit(folder)
        ENGINE.run(scene, "in.prepare", folder, lambda: None, digests)
    state = state_read(folder, ENGINE.wall_names(scene, piston=False))
    face = float((state.position[:, 2] + state.radius).max())
    start = EngineStart(folder / "end.restart", state.time_step, 0, face, first=True)
    return Bed(scene, start)


def window(
    bed: Bed,
    cycles: int,
    folder: Path,
    edit: Callable[[Path], None] = lambda folder: None,
    deck: str = "in.cycles",
) -> tuple[Window, float]:
    """``cycles`` load cycles of a bed, and the engine's CPU time [s]; the checks have been made.

    ``edit`` changes the input in ``folder``; ``deck``: what is run there.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    digests = ENGINE.write_cycles(bed.scene, bed.start, cycles, folder)
    edit(folder)
    done = ENGINE.run(bed.scene, deck, folder, lambda: None, digests)
    names = ENGINE.wall_names(bed.scene, piston=True)
    result = window_read(folder, 0, names, bed.start.piston_height)
    check_window(bed.scene, result, cycles)
    window_save(result, folder / "states.npz")
    return result, done.cpu_s


def soft_bed(home: Path, count: int) -> tuple[Bed, Window]:
    """A rained bed of ``count`` soft grains as deep as the paper's, and its first cycle.

    What of it is in ``home`` is read back.
    """
    radius = 0.075 * (count / 1085) ** 0.5
    scene = scene_of(
        "karrech",
        f"material.grain.young={SOFT_YOUNG!r}",
        f"sample.count={count}",
        f"sample.radius={radius!r}",
        f"loading.piston_mass={0.1 * count / 1085!r}",
    )
    radii = radii_sample(scene.sample.grain_radius.law, count, scene.sample.seed)
    position, height = sample_start(
        radii, scene.container, scene.sample.relative_density_start, scene.sample.seed
    )
    bed = rested(scene, position, radii, height, home / "rain")
    if (home / "first" / "states.npz").exists():
        return bed, window_load(home / "first" / "states.npz")
    first, _ = window(bed, 1, home / "first")
    return bed, first


def after(bed: Bed, made: Window, folder: Path) -> Bed:
    """The bed behind a window that was computed in ``folder``."""
    end = EngineStart(
        folder / "end.restart", int(made.time_step[-1]), 0, float(made.piston.height[-1])
    )
    return Bed(bed.scene, end)
