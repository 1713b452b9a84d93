"""Stones as they were scanned: STL and other files of triangles, checked, thinned out, meshed."""

from __future__ import annotations

import importlib
import os
from dataclasses import dataclass
from typing import Any

import numpy as np

from qdem_fem.files import LibraryMissing, MeshError
from qdem_fem.grains.checks import check_surface
from qdem_fem.grains.measures import (
    polyhedron_integrals,
    roundness_wadell,
    sphericity_true,
    surface_area,
)
from qdem_fem.mesh import (
    FloatArray,
    IntArray,
    TetMesh,
    find_surface_faces,
    gmsh_model,
    make_gmsh_tetrahedra,
)
from trackbed.mesh_file import read_surface


@dataclass(frozen=True, eq=False)
class Scan:
    """The closed surface of one stone, as `check_surface` wants it."""

    nodes: FloatArray
    """[m], (n, 3)."""
    faces: IntArray
    """(k, 3), outward."""

    @property
    def volume(self) -> float:
        """[m^3]."""
        return polyhedron_integrals(self.nodes, self.faces).volume

    @property
    def sphericity(self) -> float:
        return sphericity_true(self.volume, surface_area(self.nodes, self.faces))

    @property
    def roundness(self) -> float:
        """At the mesh size of the scan: compare scans that `thin_scan` left alike."""
        return roundness_wadell(self.nodes, self.faces)


def read_scan(path: str | os.PathLike[str], unit: float | str = 1.0) -> Scan:
    """Read the triangles of a file that meshio reads (STL, PLY, OBJ, ...), and check them.

    ``unit`` is the length of the file's unit [m], or its name: 1e-3 or "mm".  Corners of the same
    coordinates become one node, as STL repeats them, and triangles that lose a corner by that are
    left out.  Raises `MeshError` for a file that can not be read, has no triangles, or whose
    surface is open, not manifold, inside out or cuts itself (`check_surface`).
    """
    where = f"scan {os.fspath(path)!r}"
    surface = read_surface(path, unit, where=where)
    scan = Scan(surface.nodes, surface.faces)
    check_surface(scan.nodes, scan.faces, where)
    return scan


def thin_scan(scan: Scan, faces: int) -> Scan:
    """The stone with about so many triangles: edges collapsed by quadric error, volume scaled back.

    50 triangles give about a hundred tetrahedra.  Raises `LibraryMissing` without pyvista,
    `MeshError` for fewer than 12 triangles, or where what is left is no sound surface any more.
    """
    if faces < 12:
        raise MeshError(f"{faces} triangles", where="scan_thinned", remedy="use 12 or more")
    if faces >= len(scan.faces):
        return scan
    try:
        pyvista: Any = importlib.import_module("pyvista")
    except ImportError as error:
        raise LibraryMissing(
            f"thinning a scan needs pyvista ({error})",
            where="scan_thinned",
            remedy="pip install pyvista, or thin the scan out with another program",
        ) from error
    cells = np.column_stack([np.full(len(scan.faces), 3), scan.faces])
    thin = pyvista.PolyData(scan.nodes, cells.reshape(-1)).decimate(
        1 - faces / len(scan.faces), volume_preservation=True
    )
    nodes = np.asarray(thin.points, float)
    left = Scan(nodes, thin.faces.reshape(-1, 4)[:, 1:].astype(np.int64))
    check_surface(left.nodes, left.faces, f"scan, thinned to {len(left.faces)} triangles")
    centre = polyhedron_integrals(left.nodes, left.faces).centroid
    back = np.cbrt(scan.volume / left.volume)
    return Scan(centre + back * (left.nodes - centre), left.faces)


def mesh_scan(scan: Scan, size: float | None = None) -> TetMesh:
    """Tetrahedra inside the triangles of a scan, which stay as they are, by gmsh.

    ``size`` of the inner elements [m], the mean edge of the surface by default.  Node set
    ``surface``.  Raises `LibraryMissing` without gmsh, `MeshError` if gmsh fails.
    """
    edge = np.linalg.norm(scan.nodes[scan.faces] - scan.nodes[np.roll(scan.faces, 1, 1)], axis=2)
    h = float(edge.mean()) if size is None else size
    if not (np.isfinite(h) and h > 0):
        raise MeshError(f"elements of {h} m", where="mesh_scan", remedy="give a size in metres")
    with gmsh_model("mesh_scan", h, "thin the scan out or mend its flattest triangles") as gmsh:
        surface = gmsh.model.addDiscreteEntity(2)
        tags = np.arange(1, len(scan.nodes) + 1)
        gmsh.model.mesh.addNodes(2, surface, tags, scan.nodes.reshape(-1))
        gmsh.model.mesh.addElementsByType(surface, 2, [], (scan.faces + 1).reshape(-1))
        shell = gmsh.model.geo.addSurfaceLoop([surface])
        gmsh.model.geo.addVolume([shell])
        gmsh.model.geo.synchronize()
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.optimize("Netgen")
        mesh = make_gmsh_tetrahedra(gmsh, "mesh_scan")
    outer = np.unique(find_surface_faces(mesh.elements))
    return TetMesh(mesh.nodes, mesh.elements, mesh.flipped, mesh.unused, {"surface": outer})
