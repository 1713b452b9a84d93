"""Meshes of tetrahedra: sources, generation, checks, surface."""

from qdem_fem.mesh.checks import BoolArray, name_some
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.mesh.middles import EDGES, find_middles, split_faces
from qdem_fem.mesh.surface import (
    find_area_vectors,
    find_faces_within,
    find_pressure_forces,
    find_surface_faces,
)
from qdem_fem.mesh.tetrahedra import TetMesh, find_altitudes, find_gradients, read_mesh

__all__ = [
    "EDGES", "BoolArray", "TetMesh", "find_altitudes", "find_area_vectors", "find_faces_within",
    "find_gradients", "find_middles", "find_pressure_forces", "find_surface_faces",
    "make_box_mesh", "name_some", "read_mesh", "split_faces",
]  # fmt: skip
