"""Tetrahedral meshes: read and checked once, then gradients and volumes."""

import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from qdem_fem.files import Floats, Integers, MeshError, warn_user
from qdem_fem.mesh import checks
from qdem_fem.mesh.sources import MeshParts, read_mesh_parts

_GRADIENTS_AT_ONCE = 1 << 14
"""Elements worked on at once: what they need stays in the cache of a core."""
_SLIVER = 1e-2
"""Six volumes over the product of three edges below which gradients are made in extended
precision; few or no elements of a sound mesh are below it."""


@dataclass(frozen=True, eq=False)
class TetMesh:
    """Linear tetrahedra in the reference configuration; every element is right-handed.

    Made by `read_mesh`, which checks it, or by `qdem_fem.mesh.generation`.
    """

    nodes: Floats  # coordinates X [m], (n, 3)
    elements: Integers
    """The nodes of each element, (m, 4), with (X1 - X0) x (X2 - X0) . (X3 - X0) > 0."""
    flipped: Integers = field(default_factory=lambda: np.zeros(0, np.int64))
    """Elements that were left-handed as given, and whose last two nodes were swapped, (k,)."""
    unused: Integers = field(default_factory=lambda: np.zeros(0, np.int64))
    """Nodes of no element, (j,); they have no mass and do not move."""
    node_sets: dict[str, Integers] = field(default_factory=dict)  # named nodes, each sorted
    element_sets: dict[str, Integers] = field(default_factory=dict)  # named elements, each sorted


def read_mesh(source: Any, *, where: str = "") -> TetMesh:
    """Take a mesh in any form that users have, check it, and make every element right-handed.

    ``source`` is one of

    - a pair ``(nodes, elements)``: coordinates (n, 3) [m], and node numbers (m, 4) from 0;
    - a ``skfem.MeshTet``: its boundaries become node sets, its subdomains element sets;
    - a ``meshio.Mesh``: its blocks of tetrahedra are joined, cells of surfaces and lines only make
      node sets, hexahedra and other solid cells are refused;
      cell sets, point sets and gmsh's physical groups keep their names, a group without a name
      has its number;
    - the path of a file that meshio reads;
    - a `TetMesh`, which is checked again.

    ``where`` names the mesh in errors, a path also names itself.  The arrays are copied.
    Left-handed elements are mended and listed in ``flipped``, nodes of no element are listed in
    ``unused``; nodes at the same place are no error, as cracks are made of them, but warned of, as
    are parts that share no face and elements that overlap (`SceneWarning`).

    Raises `MeshError`, which names all problems found: shape or type, coordinates that are not
    finite, indices out of range, a node twice in an element, elements that repeat, elements
    without volume (see `qdem_fem.mesh.checks.FLAT`), sets that name what is not there, no
    tetrahedra, elements of higher order, a file that can not be read.
    """
    if isinstance(source, (str, os.PathLike)):
        where = f"{where}, " * bool(where) + f"mesh file {os.fspath(source)!r}"
    where = where or "mesh"
    if isinstance(source, TetMesh):
        parts = MeshParts(source.nodes, source.elements, source.node_sets, source.element_sets)
    else:
        parts = read_mesh_parts(source, where)

    nodes, problems = checks.convert_nodes(parts.nodes)
    elements, found = checks.convert_elements(parts.elements)
    problems += found
    if len(nodes) == 0 and not problems:
        problems.append(checks.Problem("there are no nodes", "give coordinates (n, 3) in metres"))
    if len(nodes) == 0 or len(elements) == 0:
        checks.raise_problems(problems, where)

    sound, found = checks.find_index_problems(elements, len(nodes))
    problems += found
    problems += checks.find_repeated_elements(elements, sound)
    lost = np.flatnonzero(~np.isfinite(nodes).all(axis=1))
    if len(lost):
        sound &= ~np.isin(elements, lost).any(axis=1)
    volume, found = checks.find_flat_elements(nodes, elements, sound)
    problems += found
    node_sets, found = checks.convert_sets(parts.node_sets, "node", len(nodes))
    problems += found
    element_sets, found = checks.convert_sets(parts.element_sets, "element", len(elements))
    checks.raise_problems(problems + found, where)

    flipped = np.flatnonzero(volume < 0)
    elements[flipped, 2:] = elements[flipped, :1:-1]
    if isinstance(source, TetMesh):
        flipped = np.union1d(flipped, source.flipped)
    else:  # what others made
        for text in checks.find_doubts(nodes, elements, find_gradients(nodes, elements)[0]):
            warn_user(f"{where}: {text}")
    used = np.zeros(len(nodes), bool)
    used[elements.reshape(-1)] = True
    return TetMesh(nodes, elements, flipped, np.flatnonzero(~used), node_sets, element_sets)


def find_gradients(nodes: Floats, elements: Integers) -> tuple[Floats, Floats]:
    """Gradients of the linear shape functions, and volumes: rows of dX^-1 (paper, eq. 1).

    ``nodes`` (n, 3) [m], right-handed ``elements`` (m, 4).  Returns ``gradients`` (m, 3, 3)
    [1/m], row a - 1 is grad_X N_a for a = 1, 2, 3 (grad_X N_0 is minus their sum), and
    ``volumes`` (m,) [m^3].  With edges e_a = X_a - X_0 and 6 V = e_1 . (e_2 x e_3)

        grad N_1 = e_2 x e_3 / 6 V,   grad N_2 = e_3 x e_1 / 6 V,   grad N_3 = e_1 x e_2 / 6 V.

    The determinant of a sliver loses as many digits as it is flat, and its gradients magnify
    what is lost; slivers are therefore worked out in extended precision where the machine has it.

    Raises `MeshError` if a volume is not positive.  Not for the deformed configuration: QDEM
    needs gradients there nowhere.
    """
    gradients = np.empty((len(elements), 3, 3))
    volumes = np.empty(len(elements))
    for start in range(0, len(elements), _GRADIENTS_AT_ONCE):
        part = slice(start, start + _GRADIENTS_AT_ONCE)
        x = nodes[elements[part]].transpose(1, 2, 0)
        gradient, sixfold, lengths = _find_cofactors(x)
        gradients[part], volumes[part] = gradient.transpose(2, 0, 1), sixfold / 6
        slivers = np.flatnonzero(sixfold < _SLIVER * lengths)
        if len(slivers):
            gradient, sixfold, _ = _find_cofactors(x[:, :, slivers].astype(np.longdouble))
            gradients[start + slivers] = gradient.transpose(2, 0, 1)
            volumes[start + slivers] = sixfold / 6
    bad = np.flatnonzero(~(volumes > 0))
    if len(bad):
        raise MeshError(
            checks.name_elements("no positive volume", bad, f"has {volumes[bad[0]]:.3g} m^3"),
            where="mesh", remedy="pass the mesh through read_mesh first",
        )  # fmt: skip
    return gradients, volumes


def _find_cofactors(x: npt.NDArray[Any]) -> tuple[npt.NDArray[Any], ...]:
    """Gradients (3, 3, k), six volumes (k,), product of three edge lengths (k,), of x (4, 3, k)."""
    e = x[1:] - x[0]
    gradient = np.empty_like(e)
    for a in range(3):
        (bx, by, bz), (cx, cy, cz) = e[(a + 1) % 3], e[(a + 2) % 3]
        gradient[a, 0] = by * cz - bz * cy
        gradient[a, 1] = bz * cx - bx * cz
        gradient[a, 2] = bx * cy - by * cx
    sixfold = e[0, 0] * gradient[0, 0] + e[0, 1] * gradient[0, 1] + e[0, 2] * gradient[0, 2]
    squares = e[:, 0] ** 2 + e[:, 1] ** 2 + e[:, 2] ** 2
    with np.errstate(divide="ignore", invalid="ignore"):  # no volume: the caller says which
        gradient /= sixfold
    return gradient, sixfold, np.sqrt(squares[0]) * np.sqrt(squares[1]) * np.sqrt(squares[2])


def find_altitudes(gradients: Floats) -> Floats:
    """Smallest of the four altitudes of each element [m], (m,), of ``gradients`` (m, 3, 3) [1/m].

    The altitude over the face opposite node a is 1 / |grad N_a|.
    """
    g = np.ascontiguousarray(gradients.transpose(1, 2, 0))
    squares = [(row * row).sum(axis=0) for row in (*g, g.sum(axis=0))]
    return np.asarray(1 / np.sqrt(np.max(squares, axis=0)))
