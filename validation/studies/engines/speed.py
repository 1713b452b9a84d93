"""The settled bed on which engines are timed: one tile of 1,111 grains, its mirror images, a run.

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

from adapters.bed.overlaps import find_pairs_within
from adapters.bed.sample import GRAVITY
from adapters.bed.state import FloatArray, load_state
from adapters.engines.contract import get_engine
from adapters.engines.process import explain_engine_failure, run_process
from adapters.errors import NotCredible
from adapters.files.dump_reader import read_frames
from adapters.procedure.progress import Progress
from adapters.procedure.run import run_scene
from adapters.scene.file import load_scene
from adapters.scene.tables import Scene

COLUMNS = "id x y z vx vy vz radius mass"

DECK = """\
include parameters.in
include settings.in
read_data grains.data
include bed.in
fix motion grains nve/sphere
thermo_style custom step atoms c_kinetic_translational
thermo {steps}
thermo_modify lost error norm no
run {steps}
write_dump grains custom end.dump {columns} modify sort id {precise}
"""

SCRIPT = """\
import os
import sys

sys.path.insert(0, os.getcwd())
import bed
import record
from yade import Omega

O = Omega()
parameters = bed.read_parameters()
bed.add_materials(parameters)
bed.add_grains(parameters)
bed.add_walls(parameters)
bed.set_engines(parameters)
O.run({steps}, True)
grains = record.tabulate_grains(parameters["grain_count"])
with open("end.dump", "w") as stream:
    rows = [[i, *g[:6], *g[9:]] for i, g in enumerate(grains, 1)]
    record.write_frame(
        stream, "ATOMS", "{columns}", record.np.array(rows), 1, parameters["box"]
    )
"""

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


def load_tiles(engine: str, tiles: tuple[int, int], more: str = "", **material: float) -> Scene:
    """The scene of ``tiles`` along x and y on an engine.

    ``more`` tables as text; ``material`` as `TABLE_1`, whose values are taken for all not named.
    """
    with TemporaryDirectory() as temporary:
        path = Path(temporary) / "bed.toml"
        path.write_text(write_scene(engine, tiles, **material) + more)
        return load_scene(path)


def write_scene(engine: str, tiles: tuple[int, int], **material: float) -> str:
    return SCENE.format(
        engine=engine,
        size_x=tiles[0] * SIDE,
        size_y=tiles[1] * SIDE,
        count=tiles[0] * tiles[1] * TILE_GRAINS,
        **TABLE_1 | material,
    )


def settle_tile(work: Path, young: float = TABLE_1["young"]) -> tuple[FloatArray, FloatArray]:
    """Centres [m], shape (n, 3), and radii [m] of a settled tile; a run in ``work``, once.

    ``young``: modulus of the grains [Pa].
    """
    folder = work / "tile"
    if not (folder / "preparation" / "state.npz").exists():
        path = work / "tile.toml"
        path.write_text(write_scene("auto", (1, 1), **MIRROR, young=young))
        run_scene(path, folder, progress=Progress(quiet=True))
    state = load_state(folder / "preparation" / "state.npz")
    return state.position, state.radius


def mirror_tiles(
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


def write_deck(engine: str, steps: int) -> str:
    """Deck or script that runs a settled bed for ``steps``."""
    if engine == "yade":
        return SCRIPT.format(steps=steps, columns=COLUMNS)
    precise = "format float %.17g" if engine == "lammps" else 'format "%d' + " %.17g" * 8 + '"'
    return DECK.format(steps=steps, columns=COLUMNS, precise=precise)


def run_bed(
    scene: Scene, position: FloatArray, radius: FloatArray, steps: int, folder: Path
) -> tuple[float, FloatArray]:
    """CPU time [s] of all processes for ``steps`` of a bed at rest; `COLUMNS` at the end, (n, 9).

    Centres [m], shape (n, 3), radii [m], shape (n,).  Raises `EngineFailed`, and `NotCredible` when
    the bed fell apart.
    """
    engine = get_engine(scene.engine.name)
    folder.mkdir(parents=True)
    height = float((position[:, 2] + radius).max())
    engine.write_preparation(scene, position, radius, height, folder)
    name = "speed.py" if engine.name == "yade" else "in.speed"
    (folder / name).write_text(write_deck(engine.name, steps))
    status, cpu_s, _ = run_process(engine.command(scene, name), folder, lambda: None)
    if status != 0:
        raise explain_engine_failure(status, folder)
    (frame,) = read_frames(folder / "end.dump")
    check_end(frame.values, len(radius))
    return cpu_s, frame.values


def check_end(end: FloatArray, grains: int) -> None:
    """No time is reported of a bed that is not whole, finite and at rest; raises `NotCredible`.

    At rest: less kinetic energy than lifts every grain by a thousandth of its radius.
    """
    speed_square, radius, mass = (end[:, 4:7] ** 2).sum(axis=1), end[:, 7], end[:, 8]
    kinetic = 0.5 * float(mass @ speed_square)
    bound = 1e-3 * GRAVITY * float(mass @ radius)
    if len(end) != grains or not kinetic <= bound:
        raise NotCredible(
            f"{len(end)} of {grains} grains are left, with {kinetic:.3g} J; at rest is {bound:.3g}",
            remedy="start from a settled bed, with a shorter step",
        )


def count_contacts(end: FloatArray) -> float:
    """Mean number of grains that touch a grain, from positions and radii alone."""
    return 2 * len(find_pairs_within(end[:, 1:4], end[:, 7], 0.0)) / len(end)
