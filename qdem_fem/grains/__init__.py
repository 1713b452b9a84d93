"""Ballast grains: random hulls, gradings, sieves, their meshes."""

from qdem_fem.grains.hulls import GrainRecipe
from qdem_fem.grains.measures import find_edge_angles, find_surface_edges
from qdem_fem.grains.sets import BALLAST, GrainSet, make_grains, save_grains

__all__ = [
    "BALLAST", "GrainRecipe", "GrainSet", "find_edge_angles", "find_surface_edges",
    "make_grains", "save_grains",
]  # fmt: skip
