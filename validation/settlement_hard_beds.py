"""Beds that no scene rains, for hard cases of the settlement procedure: crystals, and a loose bed.

Each writes the preparation of a run; ``trackbed run`` then goes on with it as with any other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from adapters.contact_law import equivalent_modulus, overlap_under_force
from adapters.engine import engine_named
from adapters.procedure import manifest_settle
from adapters.progress import Progress
from adapters.run_folder import RunFolder
from adapters.scene import Scene
from adapters.scene_file import scene_load
from adapters.stages import Run, Variant, prepare
from adapters.state import FloatArray

SIDE, LAYERS = 5, 7
"""Grains along the side of a crystal's square layers, and layers, the lowest among them."""
RADIUS = 3.2e-3
"""Of a crystal's grains [m]."""
APART = 1e-6
"""Share of its diameter by which grains of a crystal are apart before they are let go."""
VACANCIES = (12, 61, 90)
"""Grains that a near-crystal lacks: two in the middle of a square of 5, one in one of 4."""
ROUGH = ("material.grain.friction=10.0", "material.wall.friction=10.0")
"""Settings of a rain that leaves a loose bed: no contact slides."""


def crystal() -> FloatArray:
    """Centres of a face-centred cubic crystal that fills a box of `SIDE` diameters [m], (148, 3).

    Square layers of 5 and of 4 grains along a side by turns, each grain in the hollow of four: the
    planes (100), which walls fit.
    """
    step = 2 * RADIUS * (1 + APART)
    layers = []
    for layer in range(LAYERS):
        odd = layer % 2
        x, y = (axis.ravel() for axis in np.meshgrid(*2 * [np.arange(SIDE - odd)]))
        z = np.full(x.size, layer / np.sqrt(2))
        layers.append(np.column_stack([x + odd / 2, y + odd / 2, z]))
    return RADIUS * (1 + APART) + step * np.concatenate(layers)


def crystal_hollows() -> int:
    """Contacts between layers of the whole crystal: four above and four below in a small one.

    The load needs them all; neighbours in a layer touch or not, as the walls give way.
    """
    return (LAYERS - 1) * 4 * (SIDE - 1) ** 2


def crystal_deflection(scene: Scene) -> float:
    """How much lower the peak of the load holds the top of the whole crystal than no load [m].

    All layers stay level and no contact slides: the normals between layers lean by 45 degrees, so
    each closes by dz / sqrt(2) and is sheared by as much, with the stiffness 2 (1 - nu) / (2 - nu)
    of its normal one (Mindlin 1949).  Hertz' law there and at floor and piston.
    """
    grain, wall = scene.material.grain, scene.material.wall
    force = float(scene.stress_at(0.5)) * scene.loaded_area
    sheared = 2 * (1 - grain.poisson) / (2 - grain.poisson)
    normal = force / (crystal_hollows() / (LAYERS - 1)) * np.sqrt(2) / (1 + sheared)
    inside = equivalent_modulus(grain.young, grain.poisson, grain.young, grain.poisson)
    outside = equivalent_modulus(grain.young, grain.poisson, wall.young, wall.poisson)
    between = np.sqrt(2) * float(overlap_under_force(normal, inside, RADIUS / 2))
    ends = float(overlap_under_force(force / SIDE**2, outside, RADIUS))
    return float((LAYERS - 1) * between + 2 * ends)


def crystal_prepared(scene: Scene, run: Run) -> None:
    """A crystal, less what the scene has fewer grains than it."""
    place = crystal()
    if scene.grain_count < len(place):
        place = np.delete(place, VACANCIES, axis=0)
    prepare(run, (place, float(place[:, 2].max()) + RADIUS))


def loose_prepared(scene: Scene, run: Run) -> None:
    """Grains that were rained without sliding; the scene's friction acts from the load on."""
    prepare(run)


PREPARED: dict[str, tuple[Callable[[Scene, Run], None], tuple[str, ...]]] = {
    "crystal": (crystal_prepared, ()),
    "loose": (loose_prepared, ROUGH),
}
"""By name: what writes the preparation, and settings that hold while it does."""


def bed_prepare(name: str, scene_path: Path, overrides: Sequence[str], path: Path) -> None:
    """Write the manifest and the preparation ``name`` of a scene into the empty folder ``path``."""
    write, settings = PREPARED[name]
    scene = scene_load(scene_path, overrides)
    rained = scene_load(scene_path, [*overrides, *settings])
    folder = RunFolder(path)
    with folder.locked():
        manifest_settle(folder, scene, scene_path, overrides, control=False)
        engine = engine_named(scene.engine.name)
        write(scene, Run(rained, folder, engine, Variant(), Progress(quiet=True)))
