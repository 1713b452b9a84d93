"""The mesh of a body of a scene, and which of its nodes the scene names."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from qdem_fem.files import Floats, Integers
from qdem_fem.tables.keys import Mesh, Nodes
from qdem_fem.tables.types import WrongKey
from trackbed.scene_files import suggest_word

if TYPE_CHECKING:
    from qdem_fem.mesh import TetMesh


SIDE = 1e-6
"""Distance to a side, over the size of the mesh, within which a node lies on it; mesh files keep
single precision or a few digits."""
KINDS = ("set", "box", "plane", "nearest", "all")
CELLS_MOST = 4_000_000
"""Most cells of a generated mesh: what 128 GB of memory hold."""


def make_body_mesh(table: Mesh, folder: Path, key: str) -> TetMesh:
    """The mesh of a body; a relative path counts from ``folder``.

    Raises `MeshError`, or `WrongKey` with the key for measures that make no mesh.
    """
    from qdem_fem.mesh import make_box_mesh, read_mesh

    if (table.file is None) == (table.box is None):
        raise WrongKey(key, "give one of file, box")
    if table.box is None:
        mesh = read_mesh(folder / str(table.file))
        return replace(mesh, nodes=table.scale * mesh.nodes)
    if table.scale != 1.0:
        raise WrongKey(f"{key}.scale", "it is the unit of a file: give the box in metres")
    count = int(np.prod(table.box.cells))
    if count > CELLS_MOST:
        raise WrongKey(f"{key}.box.cells", f"{count} cells are too many; at most {CELLS_MOST}")
    return read_mesh(make_box_mesh(*dict(table.box).values()))


def list_node_sets(mesh: TetMesh) -> dict[str, Integers]:
    """The mesh's own node sets, and x-min ... z-max where it has none of these names."""
    used = np.ones(len(mesh.nodes), bool)
    used[mesh.unused] = False
    low, high = mesh.nodes[used].min(axis=0), mesh.nodes[used].max(axis=0)
    near = SIDE * float((high - low).max())
    sets = {}
    for axis, letter in enumerate("xyz"):
        x = mesh.nodes[:, axis]
        sets[f"{letter}-min"] = np.flatnonzero(used & (x <= low[axis] + near))
        sets[f"{letter}-max"] = np.flatnonzero(used & (x >= high[axis] - near))
    return sets | mesh.node_sets


def find_named_nodes(nodes: Nodes, mesh: TetMesh, key: str) -> Integers:
    """Numbers of the nodes that a scene names at ``key``, sorted, without nodes of no element.

    Raises `WrongKey` for an unknown set and for a selection that names no node.
    """
    given = [name for name in KINDS if getattr(nodes, name) is not None]
    if len(given) != 1:
        raise WrongKey(key, f"give exactly one of {', '.join(KINDS)}")
    kind = given[0]
    x = mesh.nodes
    used = np.ones(len(x), bool)
    used[mesh.unused] = False
    if nodes.set is not None:
        sets = list_node_sets(mesh)
        if nodes.set not in sets:
            near = suggest_word(nodes.set, sets)
            known = f" (sets of this mesh: {', '.join(sorted(sets)[:20])})"
            what = f"there is no set {nodes.set!r}{near}{known if 'mean' in near else ''}"
            raise WrongKey(f"{key}.set", what)
        found = sets[nodes.set]
    elif nodes.box is not None:
        low, high = np.array(nodes.box.min), np.array(nodes.box.max)
        if (low > high).any():
            raise WrongKey(f"{key}.box", "min must not be above max")
        found = np.flatnonzero(((x >= low) & (x <= high)).all(axis=1))
    elif nodes.plane is not None:
        normal = make_unit_vector(nodes.plane.normal, f"{key}.plane.normal")
        height = (x - np.array(nodes.plane.point)) @ normal
        found = np.flatnonzero(np.abs(height) <= nodes.plane.tolerance)
    elif nodes.nearest is not None:
        distance = np.linalg.norm(x - np.array(nodes.nearest), axis=1)
        found = np.argmin(np.where(used, distance, np.inf)).reshape(1)
    else:
        found = np.flatnonzero(used)
    found = found[used[found]]
    if not len(found):
        low, high = x[used].min(axis=0), x[used].max(axis=0)
        spans = ", ".join(f"{a:g} ... {b:g}" for a, b in zip(low, high, strict=True))
        what = f"names no node; the body spans {spans} m"
        raise WrongKey(f"{key}.{kind}", what)
    return found


def make_unit_vector(vector: tuple[float, float, float], key: str) -> Floats:
    """The vector over its length; raises `WrongKey` for zero."""
    length = float(np.linalg.norm(vector))
    if length == 0:
        raise WrongKey(key, "has no direction")
    return np.array(vector) / length
