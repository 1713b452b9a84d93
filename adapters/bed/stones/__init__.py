"""Stones: rigid bodies of several spheres; their forms, mass, packing, and contacts in a bed."""

from adapters.bed.stones.catalogue import find_form
from adapters.bed.stones.form import (
    SPHERE,
    Form,
    find_kinetic_energies,
    find_rotation,
    find_touching,
    spread_spheres,
    turn_stones,
)
from adapters.bed.stones.packing import pack_spheres
from adapters.bed.stones.toml import write_form

__all__ = [
    "SPHERE", "Form", "find_form", "find_kinetic_energies", "find_rotation", "find_touching",
    "pack_spheres", "spread_spheres", "turn_stones", "write_form",
]  # fmt: skip
