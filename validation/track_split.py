"""What several processes would have to tell each other a step, counted on a bed as it lies.

    python -m validation.track_split SCENE    of a scene's prepared bed: its record

The domain is cut into slabs of equal numbers of elements.  A grain belongs to the process in whose
slab its centre lies, with all its elements: only the sleeper is cut.  A step then needs

* the positions of the vertices of others that may touch one's own: those within two radii and the
  skin.  Both sides compute such a contact, with its spring, so no force goes back;
* the forces at the nodes of the sleeper that two processes share, each adding the other's.

Both are three double numbers a vertex.  Masses, springs and lists stay where they are; vertices are
handed on anew only where the lists of pairs are made anew.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from qdem_fem.contact_spheres import SKIN
from qdem_fem.grain_set import GrainSet
from qdem_fem.mesh_checks import FloatArray, IntArray
from qdem_fem.output import write_whole
from qdem_fem.scene_checks import scene_load
from qdem_fem.surface import surface_faces
from qdem_fem.track_bed import bed_read
from qdem_fem.track_recipe import BedRecipe, grains_of, meshes_of
from qdem_fem.track_scene import TrackPrepared

RECORD = Path(__file__).parent / "results" / "track-split.json"
VECTOR = 24
"""Bytes of three double numbers."""
PARTS = (2, 4, 8)


def split_counts(
    recipe: BedRecipe, grains: GrainSet, nodes: list[FloatArray]
) -> list[dict[str, Any]]:
    """Counts for `PARTS` slabs along the sleeper (x) and along the track (y)."""
    meshes = meshes_of(recipe, grains, nodes)
    vertices = [x[np.unique(surface_faces(m.elements))] for m, x in zip(meshes, nodes, strict=True)]
    sleeper = meshes[-1]
    centre = np.array([x.mean(axis=0) for x in nodes[:-1]])
    middle = nodes[-1][sleeper.elements].mean(axis=1)
    weight = np.concatenate([[len(m.elements) for m in meshes[:-1]], np.ones(len(middle), int)])
    body = np.repeat(np.arange(len(vertices)), [len(x) for x in vertices])
    every = np.concatenate(vertices)
    counts, width = [], recipe.box.width if recipe.periodic else None
    for axis, name in enumerate("xy"):
        along = np.concatenate([centre[:, axis], middle[:, axis]])
        order = np.argsort(along)
        share = np.cumsum(weight[order]) / weight.sum()
        for parts in PARTS:
            cuts = along[order][np.searchsorted(share, np.arange(1, parts) / parts)]
            owner = np.searchsorted(cuts, along)
            of_vertex = np.where(
                body < len(centre), owner[np.minimum(body, len(centre) - 1)],
                np.searchsorted(cuts, every[:, axis]),
            )  # fmt: skip
            load = np.bincount(owner, weight, parts)
            cut = body == len(centre)
            told, heard = ghosts(recipe.radius, width, every, of_vertex, cut, parts)
            shared = shared_nodes(sleeper.elements, owner[len(centre) :], parts)
            counts.append({
                "axis": name, "parts": parts, "busiest": float(load.max() / load.mean()),
                "vertices": int((told + heard).max()), "shared": int(shared.max()),
                "bytes": int(VECTOR * (told + heard + 2 * shared).max()),
            })  # fmt: skip
    return counts


def ghosts(
    radius: float, width: float | None, every: FloatArray, owner: IntArray,
    cut: NDArray[np.bool_], parts: int,
) -> tuple[IntArray, IntArray]:  # fmt: skip
    """Positions of vertices (k, 3) [m] that each process sends and receives a step, (parts,) both.

    ``owner`` (k,): the process that a vertex belongs to; ``cut`` (k,): whether it is of the body
    that several have a part of, whose vertices do not touch each other; ``radius`` of spheres [m];
    ``width`` after which all repeats along y [m], or None.
    """
    reach = (2 + SKIN) * radius
    shifts = [0.0] if width is None else [-width, 0.0, width]
    told, heard = np.zeros((2, parts), np.int64)
    mine = [[np.flatnonzero((owner == p) & (cut == part)) for part in (0, 1)] for p in range(parts)]
    whole = [cKDTree(every[grains]) for grains, _ in mine]
    both = [cKDTree(every[np.concatenate(each)]) for each in mine]
    for here in range(parts):
        for there in range(parts):
            if here == there:
                continue
            for of_it, tree in zip(mine[there], (both[here], whole[here]), strict=True):
                needed = np.zeros(len(of_it), bool)
                for shift in shifts:
                    moved = every[of_it] + np.array([0.0, shift, 0.0])
                    away, _ = tree.query(moved, distance_upper_bound=reach)
                    needed |= np.isfinite(away)
                told[there] += needed.sum()
                heard[here] += needed.sum()
    return told, heard


def shared_nodes(elements: IntArray, owner: IntArray, parts: int) -> IntArray:
    """Nodes of a body cut by its elements (m, 4) that each process shares with others, (parts,)."""
    touched = np.zeros((elements.max() + 1, parts), bool)
    touched[elements.ravel(), np.repeat(owner, 4)] = True
    return np.asarray(touched[touched.sum(axis=1) > 1].sum(axis=0))


def main() -> None:
    """Count on the prepared bed of a scene and write the record."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument("scene", type=Path)
    arguments = parser.parse_args()
    prepared = scene_load(arguments.scene)
    assert isinstance(prepared, TrackPrepared)
    recipe = prepared.recipe
    bed = bed_read(prepared.bed_file, recipe)
    record = {
        "command": f"python -m validation.track_split scenes/{arguments.scene.name}",
        "stage": bed.stage, "grains": recipe.below + recipe.beside,
        "split": split_counts(recipe, grains_of(recipe), bed.positions),
    }  # fmt: skip
    write_whole(RECORD, json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
