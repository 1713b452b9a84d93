"""Meshes to test and to compare with, boxes and rings; and gmsh with a model of its own."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import permutations
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from qdem_fem.files import LibraryMissing, MeshError
from qdem_fem.mesh.checks import IntArray
from qdem_fem.mesh.surface import find_surface_faces
from qdem_fem.mesh.tetrahedra import TetMesh, altitudes, element_gradients, read_mesh

Pattern = Literal["kuhn", "five"]
Triple = tuple[float, float, float]


def make_box_mesh(
    size: Triple, cells: tuple[int, int, int], pattern: Pattern = "kuhn", origin: Triple = (0, 0, 0)
) -> TetMesh:
    """A box of ``size`` (lx, ly, lz) [m] with its lowest corner at ``origin`` [m].

    Each of the ``cells`` (nx, ny, nz) is cut

    ``kuhn``  into six tetrahedra around its diagonal, all cells alike (Kuhn 1960);
    ``five``  into a regular one (for cubes) and four at its corners, neighbours mirrored.

    Node i + (nx + 1) (j + (ny + 1) k) is at the grid point (i, j, k).  Node sets: ``x-min``,
    ``x-max``, ``y-min``, ... ``z-max``.

    Raises `MeshError` for a size or a number of cells that makes no box.
    """
    _positive("size", size)
    counts = _counts(cells)
    if pattern not in ("kuhn", "five"):
        raise MeshError(
            f"there is no pattern {pattern!r}", where="box_mesh", remedy="use 'kuhn' or 'five'"
        )
    axes = [
        start + length * np.arange(count + 1) / count
        for start, length, count in zip(origin, size, counts, strict=True)
    ]
    z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    nodes = np.stack([x.reshape(-1), y.reshape(-1), z.reshape(-1)], axis=1)
    elements = _cells_cut(counts, (False, False, False), pattern)
    grid = np.arange(len(nodes)).reshape(x.shape)
    sets = {}
    for axis, letter in enumerate("xyz"):
        sides = np.moveaxis(grid, 2 - axis, 0)
        sets[f"{letter}-min"] = np.sort(sides[0].reshape(-1))
        sets[f"{letter}-max"] = np.sort(sides[-1].reshape(-1))
    return TetMesh(nodes, elements, node_sets=sets)


def make_ring_mesh(
    inner: float, outer: float, height: float, cells: tuple[int, int, int]
) -> TetMesh:
    """A ring around the z-axis between two radii [m], from z = 0 to ``height`` [m].

    ``cells`` are those along the radius, around (three at least), and along the axis, each cut
    into six tetrahedra.  The circles are polygons, the mesh closes on itself without a seam.
    Node sets: ``inner``, ``outer``, ``z-min``, ``z-max``.

    Raises `MeshError` for radii, a height or a number of cells that make no ring.
    """
    _positive("inner, outer - inner and height", (inner, outer - inner, height))
    radial, around, axial = _counts(cells)
    if around < 3:
        raise MeshError(
            f"{around} cells around make no ring", where="ring_mesh", remedy="use three or more"
        )
    z, angle, r = np.meshgrid(
        height * np.arange(axial + 1) / axial,
        2 * np.pi * np.arange(around) / around,
        inner + (outer - inner) * np.arange(radial + 1) / radial,
        indexing="ij",
    )
    nodes = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=-1).reshape(-1, 3)
    grid = np.arange(len(nodes)).reshape(r.shape)
    sets = {
        "inner": grid[:, :, 0].reshape(-1),
        "outer": grid[:, :, -1].reshape(-1),
        "z-min": grid[0].reshape(-1),
        "z-max": grid[-1].reshape(-1),
    }
    elements = _cells_cut((radial, around, axial), (False, True, False), "kuhn")
    return TetMesh(nodes, elements, node_sets=sets)


def jitter(mesh: TetMesh, fraction: float, seed: int) -> TetMesh:
    """Move the interior nodes at random, to make a mesh as irregular as a generator's.

    Each goes uniformly into a ball around it whose radius is ``fraction`` of the smallest
    altitude of its elements; nodes of the surface stay.  Below a fraction of 1/4 no element can
    be turned inside out: a tetrahedron is at least half its smallest altitude wide, and four
    nodes that reach a common plane must together cross that width.

    Raises `MeshError` if the fraction is negative, or if an element is turned inside out.
    """
    if not 0 <= fraction < np.inf:
        raise MeshError(
            f"fraction is {fraction}", where="jitter", remedy="use 0 or more, best below 0.25"
        )
    gradients, _ = element_gradients(mesh.nodes, mesh.elements)
    reach = np.full(len(mesh.nodes), np.inf)
    for corner in mesh.elements.T:
        np.minimum.at(reach, corner, altitudes(gradients))
    reach[find_surface_faces(mesh.elements).reshape(-1)] = 0
    reach[~np.isfinite(reach)] = 0

    generator = np.random.default_rng(seed)
    move = generator.standard_normal(mesh.nodes.shape)
    move /= np.linalg.norm(move, axis=1)[:, None]
    radius = fraction * reach * np.cbrt(generator.random(len(mesh.nodes)))
    nodes = mesh.nodes + move * radius[:, None]
    try:
        element_gradients(nodes, mesh.elements)
    except MeshError as error:
        raise MeshError(
            f"moved too far: {error.what}", where="jitter", remedy="use a fraction below 0.25"
        ) from error
    return TetMesh(
        nodes, mesh.elements, mesh.flipped, mesh.unused, mesh.node_sets, mesh.element_sets
    )


@contextmanager
def gmsh_model(where: str, h: float, remedy: str) -> Iterator[Any]:
    """gmsh with a model of its own and element size ``h`` [m]; what was open stays as it was.

    Raises `LibraryMissing` without gmsh; what gmsh raises becomes a `MeshError` with ``remedy``.
    """
    try:
        gmsh: Any = importlib.import_module("gmsh")
    except (ImportError, OSError) as error:  # OSError: its shared libraries are missing
        raise LibraryMissing(
            f"{where} needs gmsh ({error})", where=where, remedy="pip install gmsh"
        ) from error
    ours = not gmsh.isInitialized()
    if ours:
        # Interruptible, gmsh would take over the signal handlers of the process.
        gmsh.initialize(readConfigFiles=False, interruptible=False)
    before = None if ours else gmsh.model.getCurrent()
    options = {
        "General.Terminal": 0.0,
        "General.NumThreads": 1.0,
        "Mesh.MeshSizeMin": h,
        "Mesh.MeshSizeMax": h,
        "Mesh.ElementOrder": 1.0,
        "Mesh.Algorithm3D": 1.0,
    }
    saved = {name: gmsh.option.getNumber(name) for name in options}
    try:
        for name, value in options.items():
            gmsh.option.setNumber(name, value)
        gmsh.model.add(where)
        try:
            yield gmsh
        finally:
            gmsh.model.remove()
    except Exception as error:  # gmsh raises nothing more specific
        if isinstance(error, MeshError):
            raise
        raise MeshError(f"gmsh failed: {error}", where=where, remedy=remedy) from error
    finally:
        for name, value in saved.items():
            gmsh.option.setNumber(name, value)
        if ours:
            gmsh.finalize()
        else:
            gmsh.model.setCurrent(before)


def make_gmsh_tetrahedra(gmsh: Any, where: str) -> TetMesh:
    """The tetrahedra of gmsh's present model, checked."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    _, corners = gmsh.model.mesh.getElementsByType(4)
    name = np.zeros(int(tags.max(initial=0)) + 1, np.int64)
    name[tags] = np.arange(len(tags))
    return read_mesh((coordinates.reshape(-1, 3), name[corners].reshape(-1, 4)), where=where)


def _cells_cut(
    counts: tuple[int, int, int], periodic: tuple[bool, bool, bool], pattern: Pattern
) -> IntArray:
    """Right-handed tetrahedra (m, 4) of a grid of cells, cell by cell, i fastest.

    Along a periodic direction the last cell ends at the first node.
    """
    i, j, k = (
        axis.reshape(-1) for axis in np.meshgrid(*(np.arange(n) for n in counts), indexing="ij")
    )
    order = np.lexsort((i, j, k))
    cell = np.stack([i, j, k], axis=1)[order]
    nodes = [n if closed else n + 1 for n, closed in zip(counts, periodic, strict=True)]
    if pattern == "kuhn":
        return _numbered(cell[:, None, None] + _kuhn(), nodes).reshape(-1, 4)
    odd = cell.sum(axis=1) % 2
    return _numbered(cell[:, None, None] + _five()[odd], nodes).reshape(-1, 4)


def _numbered(point: npt.NDArray[np.int64], nodes: list[int]) -> IntArray:
    """Node number of grid points (..., 3)."""
    i, j, k = (point[..., axis] % nodes[axis] for axis in range(3))
    return i + nodes[0] * (j + nodes[1] * k)


def _kuhn() -> IntArray:
    """Corners (6, 4, 3) of the six tetrahedra of the unit cube, right-handed."""
    tetrahedra = []
    for order in permutations(range(3)):
        corners = np.zeros((4, 3), np.int64)
        for step, axis in enumerate(order):
            corners[step + 1 :, axis] = 1
        tetrahedra.append(corners)
    return np.array([_right_handed(corners) for corners in tetrahedra])


def _five() -> IntArray:
    """Corners (2, 5, 4, 3) of the five tetrahedra of the unit cube, and of the mirrored cube."""
    inner = np.array([[0, 0, 0], [1, 1, 0], [1, 0, 1], [0, 1, 1]])
    tetrahedra = [inner]
    for corner in 1 - inner:
        away = np.abs(inner - corner).sum(axis=1) == 1
        tetrahedra.append(np.concatenate(([corner], inner[away])))
    even = np.array(tetrahedra)
    odd = even.copy()
    odd[..., 0] = 1 - odd[..., 0]
    return np.array([[_right_handed(corners) for corners in five] for five in (even, odd)])


def _right_handed(corners: IntArray) -> IntArray:
    swap = np.linalg.det((corners[1:] - corners[0]).astype(float)) < 0
    return corners[[0, 1, 3, 2]] if swap else corners


def _positive(what: str, values: Sequence[float]) -> None:
    if not all(0 < value < np.inf for value in values):
        raise MeshError(
            f"{what}: {tuple(values)} must all be positive and finite",
            where="mesh generation",
            remedy="give lengths in metres",
        )


def _counts(cells: tuple[int, int, int]) -> tuple[int, int, int]:
    if len(cells) != 3 or not all(int(n) == n and n >= 1 for n in cells):
        raise MeshError(
            f"cells is {tuple(cells)}", where="mesh generation", remedy="give three whole numbers"
        )
    first, second, third = (int(n) for n in cells)
    return first, second, third
