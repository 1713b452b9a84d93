"""Meshes of tetrahedra: sources, generation, checks, surface."""

from qdem_fem.mesh.checks import BoolArray, FloatArray, IntArray, named
from qdem_fem.mesh.generation import make_box_mesh
from qdem_fem.mesh.surface import (
    face_area_vectors,
    find_faces_within,
    find_surface_faces,
    pressure_forces,
)
from qdem_fem.mesh.tetrahedra import TetMesh, altitudes, element_gradients, lumped_mass, read_mesh

__all__ = [
    "BoolArray", "FloatArray", "IntArray", "TetMesh", "altitudes", "element_gradients",
    "face_area_vectors", "find_faces_within", "find_surface_faces", "lumped_mass",
    "make_box_mesh", "named", "pressure_forces",
    "read_mesh",
]  # fmt: skip
