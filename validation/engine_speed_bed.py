"""The settled bed on which engines are timed: one tile of 1,111 grains, and its mirror images.

A tile settles in a box whose four sides are rigid frictionless mirrors.  A bed of nx times ny tiles
is made of it by reflection: the image of a grain that touches a side with overlap d overlaps it by
2 d, and two equal spheres push each other then with the force of the mirror (E*/2, R/2, 2 d), so
that a larger bed is in balance as it is, without a step of its own.  No two tiles are in another
order than their neighbours mirrored; speed does not depend on it.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from adapters.procedure import run_scene
from adapters.progress import Progress
from adapters.scene import Scene
from adapters.scene_file import scene_load
from adapters.state import FloatArray, state_load

SIDE = 0.0665
"""Side of a tile [m]: the section and, with `TILE_GRAINS`, the height of the paper's bed."""

TILE_GRAINS = 1111

SCENE = """\
[sample]
container = "box"
size_x = {size_x!r}
size_y = {size_y!r}
symmetry = ["x", "y"]
count = {count}
relative_density_start = 0.15

[sample.grain_radius]
distribution = "normal"
mean = 3.2e-3
standard_deviation = 5.651e-4

[material.grain]
young = {young!r}
poisson = 0.25
density = 2710.0
viscous_alpha = 0.44
friction = 0.5

[material.wall]
young = {wall_young!r}
poisson = 0.3
friction = {wall_friction!r}

[engine]
name = "{engine}"
rayleigh_share = 0.2
"""
"""Grains of the paper's Table 1."""

TABLE_1 = {"young": 46.9e9, "wall_young": 210e9, "wall_friction": 0.5}
MIRROR = {"wall_young": 1e15, "wall_friction": 0.0}
"""Walls that do what a mirror does, while the tile settles."""


def bed_scene(engine: str, tiles: tuple[int, int], more: str = "", **material: float) -> Scene:
    """The scene of ``tiles`` along x and y on an engine.

    ``more`` tables as text; ``material`` as `TABLE_1`, whose values are taken for all not named.
    """
    with TemporaryDirectory() as temporary:
        path = Path(temporary) / "bed.toml"
        path.write_text(_text(engine, tiles, **material) + more)
        return scene_load(path)


def _text(engine: str, tiles: tuple[int, int], **material: float) -> str:
    return SCENE.format(
        engine=engine,
        size_x=tiles[0] * SIDE,
        size_y=tiles[1] * SIDE,
        count=tiles[0] * tiles[1] * TILE_GRAINS,
        **TABLE_1 | material,
    )


def tile_settled(work: Path, young: float = TABLE_1["young"]) -> tuple[FloatArray, FloatArray]:
    """Centres [m], shape (n, 3), and radii [m] of a settled tile; a run in ``work``, once.

    ``young``: modulus of the grains [Pa].
    """
    folder = work / "tile"
    if not (folder / "preparation" / "state.npz").exists():
        path = work / "tile.toml"
        path.write_text(_text("auto", (1, 1), **MIRROR, young=young))
        run_scene(path, folder, progress=Progress(quiet=True))
    state = state_load(folder / "preparation" / "state.npz")
    return state.position, state.radius


def mirrored(
    position: FloatArray, radius: FloatArray, tiles: tuple[int, int], side: float = SIDE
) -> tuple[FloatArray, FloatArray]:
    """``tiles`` along x and y of a settled tile of a ``side`` [m], every other one reflected."""
    places = []
    for i in range(tiles[0]):
        for j in range(tiles[1]):
            image = position.copy()
            for axis, number in ((0, i), (1, j)):
                if number % 2:
                    image[:, axis] = side - image[:, axis]
                image[:, axis] += number * side
            places.append(image)
    return np.concatenate(places), np.tile(radius, tiles[0] * tiles[1])
