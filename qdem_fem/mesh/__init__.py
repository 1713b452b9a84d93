"""Meshes of tetrahedra: sources, generation, checks, surface."""

from qdem_fem.mesh.checks import BoolArray, FloatArray, IntArray, Problem, named, raise_problems
from qdem_fem.mesh.generation import gmsh_model, make_box_mesh, make_gmsh_tetrahedra, make_ring_mesh
from qdem_fem.mesh.surface import (
    face_area_vectors,
    find_faces_within,
    find_surface_faces,
    pressure_forces,
)
from qdem_fem.mesh.tetrahedra import TetMesh, altitudes, element_gradients, lumped_mass, read_mesh

__all__ = [
    "BoolArray", "FloatArray", "IntArray", "Problem", "TetMesh", "altitudes", "element_gradients",
    "face_area_vectors", "find_faces_within", "find_surface_faces", "gmsh_model", "lumped_mass",
    "make_box_mesh", "make_gmsh_tetrahedra", "make_ring_mesh", "named", "pressure_forces",
    "raise_problems", "read_mesh",
]  # fmt: skip
