"""Many grains: made by seed, saved, loaded, meshed.

trackbed grains --count 5700 --seed 1 --out grains.npz
"""

import os
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np

from qdem_fem.files import Floats, Integers, MeshError
from qdem_fem.grains.hulls import GrainForm, GrainRecipe
from qdem_fem.grains.meshing import make_grain_tetrahedra
from qdem_fem.mesh import TetMesh
from trackbed.choices import find_choice
from trackbed.memory import read_arrays, refuse_more_memory
from trackbed.run_files import write_whole
from trackbed.scene_files import GRADINGS, Grading, draw_sizes, find_sieve_size

BALLAST = GRADINGS["EN 13450 31.5/50"]
"""What grains follow where nothing else is asked for."""
GRAINS_FORMAT = 1


@dataclass(frozen=True, eq=False)
class GrainSet:
    """Grains one behind another; grain i has ``corners[i]`` = M corners."""

    corners: Integers  # M of each grain, (g,)
    nodes: Floats  # nodes of all grains [m], (sum of 5 M - 5, 3), the centroid of each at zero
    corner_faces: Integers
    """Triangles of their corners, (sum of 2 M - 4, 3), by the numbers within the grain."""
    sizes: Floats  # `find_sieve_size` [m], (g,)
    sphericity: Floats
    roundness: Floats

    def __len__(self) -> int:
        return len(self.corners)

    def parts(self, grain: int) -> tuple[Floats, Integers]:
        """Nodes (5 M - 5, 3) [m] and corner faces (2 M - 4, 3) of a grain."""
        before = self.corners[:grain]
        node, face, own = 5 * (before - 1), 2 * (before - 2), self.corners[grain]
        start, first = int(node.sum()), int(face.sum())
        return (
            self.nodes[start : start + 5 * (own - 1)],
            self.corner_faces[first : first + 2 * (own - 2)],
        )

    def mesh(self, grain: int) -> TetMesh:
        """Its tetrahedra, for `qdem_fem.Body`."""
        return make_grain_tetrahedra(*self.parts(grain))

    @property
    def tetrahedra(self) -> Integers:
        """How many each grain has, (g,)."""
        return np.asarray(8 * (2 * self.corners - 4))


def get_shape(name: str) -> Callable[[np.random.Generator, GrainRecipe], GrainForm]:
    """What draws a grain of a shape: the ``SHAPE`` of a file of this room."""
    draw: Callable[[np.random.Generator, GrainRecipe], GrainForm]
    draw = find_choice("qdem_fem.grains", "SHAPE", name, "there is no grain shape")
    return draw


def make_grains(
    count: int, seed: int, recipe: GrainRecipe | None = None, grading: Grading = BALLAST,
    shape: str = "hulls",
) -> GrainSet:  # fmt: skip
    """``count`` random grains of a ``shape`` whose sieve sizes follow ``grading``.

    Grain i depends on ``seed``, i, shape and recipe only; sizes on ``seed``, ``count`` and the
    grading.  Raises `MeshError` for a recipe that random grains do not meet, a count below one, or
    a seed below zero, `UsageError` for a shape that there is not.
    """
    draw, recipe = get_shape(shape), recipe or GrainRecipe()
    if count < 1 or seed < 0:
        raise MeshError(
            f"{count} grains of seed {seed}",
            where="make_grains", remedy="use a seed of 0 or more, and 1 grain or more",
        )  # fmt: skip
    # 5 kB a grain, about, with its nodes and faces while many are made
    refuse_more_memory(5000.0 * count, f"{count} grains", "make_grains", "make fewer")
    sizes = draw_sizes(grading, count, np.random.default_rng([seed, count]))
    forms = [draw(np.random.default_rng([seed, i, GRAINS_FORMAT]), recipe) for i in range(count)]
    own = [find_sieve_size(form.nodes) for form in forms]
    scales = sizes / np.array(own)
    return GrainSet(
        corners=np.array([form.corner_faces.max() + 1 for form in forms]),
        nodes=np.concatenate([s * form.nodes for s, form in zip(scales, forms, strict=True)]),
        corner_faces=np.concatenate([form.corner_faces for form in forms]),
        sizes=sizes,
        sphericity=np.array([form.sphericity for form in forms]),
        roundness=np.array([form.roundness for form in forms]),
    )


def save_grains(path: str | os.PathLike[str], grains: GrainSet) -> None:
    """Write a set of grains, atomically, as .npz: 24 bytes a node, 3 bytes a face."""
    stream = BytesIO()
    np.savez(
        stream,
        format=np.array(GRAINS_FORMAT),
        corners=grains.corners.astype(np.uint8),
        nodes=grains.nodes,
        corner_faces=grains.corner_faces.astype(np.uint8),
        shape=np.stack([grains.sizes, grains.sphericity, grains.roundness]),
    )
    write_whole(Path(path), stream.getvalue())


def load_grains(path: str | os.PathLike[str]) -> GrainSet:
    """Read what `save_grains` wrote, to the last digit; raises `MeshError` for another file."""
    where = f"grains {os.fspath(path)!r}"
    remedy = "give a file that save_grains or trackbed grains wrote"
    try:
        file = read_arrays(Path(path))
        number, corners = int(file["format"]), file["corners"].astype(np.int64)
        nodes, faces, shape = file["nodes"], file["corner_faces"], file["shape"]
    except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise MeshError(f"not a set of grains ({error})", where=where, remedy=remedy) from error
    total, count = corners.sum(), len(corners)
    wanted = (GRAINS_FORMAT, (5 * (total - count), 3), (2 * (total - 2 * count), 3), (3, count))
    if (number, nodes.shape, faces.shape, shape.shape) != wanted:
        raise MeshError(
            f"format {number}, nodes {nodes.shape}, faces {faces.shape} for {count} grains",
            where=where, remedy=remedy,
        )  # fmt: skip
    return GrainSet(corners, nodes, faces.astype(np.int64), *shape)
