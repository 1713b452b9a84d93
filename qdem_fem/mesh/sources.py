"""What a mesh can be given as: arrays, scikit-fem, meshio, a file.  Nothing is checked here yet.

Neither scikit-fem nor meshio is imported: their meshes are known by what they hold, and meshio
is loaded only to read a file.
"""

import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from qdem_fem.files import MeshError, warn_user
from trackbed.mesh_file import PHYSICAL, find_marks, list_groups, read_mesh_file

_ACCEPTED = (
    "give a skfem.MeshTet, a meshio.Mesh, a pair (nodes, elements) of arrays, "
    "or the path of a mesh file"
)
_KEEP_CORNERS = (
    "mesh with linear elements (gmsh: Mesh.ElementOrder = 1), or keep the four corners of each "
    "element, `elements[:, :4]`"
)
_OTHER_SOLIDS = ("hexahedron", "wedge", "pyramid", "polyhedron", "VTK_LAGRANGE_HEX")
"""How meshio's names of solid cells with other shapes begin."""


@dataclass(frozen=True)
class MeshParts:
    """Nodes, elements and named sets as they were given, of any type and not checked."""

    nodes: Any
    elements: Any
    node_sets: dict[str, Any] = field(default_factory=dict)
    element_sets: dict[str, Any] = field(default_factory=dict)


def read_mesh_parts(source: Any, where: str) -> MeshParts:
    """Take a mesh apart; see `qdem_fem.mesh.read_mesh` for what ``source`` may be.

    Raises `MeshError` if the source is of no known kind, or holds no linear tetrahedra.
    """
    if isinstance(source, (str, os.PathLike)):
        return _read_meshio(read_mesh_file(source, where), where)
    if isinstance(source, (tuple, list)):
        if len(source) != 2:
            raise MeshError(
                f"a mesh of arrays is a pair (nodes, elements), not {len(source)} items",
                where=where, remedy=_ACCEPTED,
            )  # fmt: skip
        return MeshParts(source[0], source[1])
    if hasattr(source, "points") and hasattr(source, "cells"):
        return _read_meshio(source, where)
    if hasattr(source, "p") and hasattr(source, "t"):
        return _read_skfem(source, where)
    raise MeshError(
        f"an object of type {type(source).__name__} is no mesh", where=where, remedy=_ACCEPTED
    )


def _read_skfem(mesh: Any, where: str) -> MeshParts:
    """``p`` is (3, n), ``t`` is (4, m); boundaries hold facets, subdomains hold elements."""
    kind = type(mesh).__name__
    shape = getattr(getattr(mesh, "elem", None), "__name__", "ElementTetP1")
    if "Tet" not in shape:
        raise MeshError(
            f"a {kind} has no tetrahedra",
            where=where,
            remedy="split its cells first, as skfem's `to_meshtet` does where a mesh has it",
        )
    if shape != "ElementTetP1":
        raise MeshError(
            f"a {kind} is of higher order; QDEM's meshes are linear, of quadratic bodies too",
            where=where, remedy="skfem.MeshTet.from_mesh(mesh) keeps the corners",
        )  # fmt: skip
    node_sets: dict[str, Any] = {}
    try:
        for name, facets in (getattr(mesh, "boundaries", None) or {}).items():
            node_sets[name] = np.unique(mesh.facets[:, np.asarray(facets, dtype=np.int64)])
    except (IndexError, TypeError, ValueError) as error:
        raise MeshError(
            f"the boundaries of the {kind} can not be read: {error}",
            where=where, remedy="name facets of the mesh only",
        ) from error  # fmt: skip
    subdomains = getattr(mesh, "subdomains", None) or {}
    return MeshParts(np.asarray(mesh.p).T, np.asarray(mesh.t).T, node_sets, dict(subdomains))


def _read_meshio(mesh: Any, where: str) -> MeshParts:
    """All blocks of tetrahedra joined; sets and physical groups of every block by name."""
    kinds = [block.type for block in mesh.cells]
    others = sorted({kind for kind in kinds if kind.startswith(_OTHER_SOLIDS)})
    if others:
        raise MeshError(
            f"the mesh holds solid cells that are no tetrahedra ({', '.join(others)}); without "
            "them the body would have holes",
            where=where,
            remedy="split them into tetrahedra, or remove their blocks if they are no part of it",
        )
    curved = sorted({kind for kind in kinds if kind.startswith("tetra") and kind != "tetra"})
    if curved:
        raise MeshError(
            f"the mesh holds elements of higher order ({', '.join(curved)}); "
            "QDEM's meshes are linear, of quadratic bodies too",
            where=where, remedy=_KEEP_CORNERS,
        )  # fmt: skip
    blocks = [block.data for block in mesh.cells if block.type == "tetra"]
    if sum(len(block) for block in blocks) == 0:
        found = ", ".join(f"{len(data)} of type {kind}" for kind, data in mesh.cells_dict.items())
        raise MeshError(
            f"the mesh holds no tetrahedra, only {found}" if found else "the mesh holds no cells",
            where=where,
            remedy="mesh the volume with tetrahedra (gmsh: `mesh.generate(3)`), and save them",
        )
    try:
        elements = np.concatenate(blocks)
        node_sets, element_sets = list_groups(mesh, "tetra")
        marks = find_marks(mesh)
    except (IndexError, TypeError, ValueError, AttributeError, KeyError) as error:
        raise MeshError(
            f"cells and sets of the meshio mesh do not fit together: {error}",
            where=where, remedy="make the mesh again with meshio.Mesh, which checks this",
        ) from error  # fmt: skip
    named = {name for name, entry in mesh.field_data.items() if np.shape(entry) == (2,)}
    if lost := named - {*node_sets, *element_sets}:
        warn_user(
            f"{where}: the groups {', '.join(sorted(lost))} are named, and their reader gives no "
            "cells of them: a cell in two groups keeps one in MSH 4; write MSH 2.2"
        )
    if unused := [k for k in mesh.cell_data if k != marks and not k.startswith("gmsh:")]:
        rest = "" if marks else "; one array alone, of whole numbers, would number groups"
        warn_user(f"{where}: these data of its cells are not used: {', '.join(unused)}{rest}")
    if marks == PHYSICAL:
        tags = mesh.get_cell_data(PHYSICAL, "tetra")
        elements, element_sets = _join_groups(elements, tags, element_sets)
    return MeshParts(mesh.points, elements, node_sets, element_sets)


def _join_groups(elements: Any, tags: Any, sets: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
    """One element where MSH 2.2 writes one for each group that it is in.

    Elements that repeat in the same group stay: they are a fault."""
    rows = np.column_stack([np.sort(elements, axis=1), tags])
    _, once = np.unique(rows, axis=0, return_index=True)
    if len(once) < len(rows):
        return elements, sets
    _, first, same = np.unique(rows[:, :4], axis=0, return_index=True, return_inverse=True)
    kept, place = np.unique(first, return_inverse=True)
    number = place[same.reshape(-1)]
    return elements[kept], {name: np.unique(number[own]) for name, own in sets.items()}
