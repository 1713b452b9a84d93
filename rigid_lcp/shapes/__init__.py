"""Grain shapes, one file each."""

from rigid_lcp.shapes.disc import (
    Disc,
)
from rigid_lcp.shapes.half_space import (
    HalfSpace,
)
from rigid_lcp.shapes.numbers import (
    require_vector,
)
from rigid_lcp.shapes.plain_numbers import (
    real_numbers,
)
from rigid_lcp.shapes.polygon import (
    Polygon,
    check_outline,
)
from rigid_lcp.shapes.polyhedron import (
    Polyhedron,
    box,
)
from rigid_lcp.shapes.rotations import (
    quaternion_of_matrix,
    quaternion_of_rotation,
    quaternion_product,
    quaternion_rate,
    rotate,
    rotate_back,
    rotation_matrix,
    turn_quaternion,
    unit_quaternion,
)
from rigid_lcp.shapes.sphere import (
    Sphere,
)
from rigid_lcp.shapes.stones import (
    cut_points,
    fragments,
)

__all__ = [
    "Disc",
    "HalfSpace",
    "Polygon",
    "Polyhedron",
    "Sphere",
    "box",
    "check_outline",
    "cut_points",
    "fragments",
    "quaternion_of_matrix",
    "quaternion_of_rotation",
    "quaternion_product",
    "quaternion_rate",
    "real_numbers",
    "require_vector",
    "rotate",
    "rotate_back",
    "rotation_matrix",
    "turn_quaternion",
    "unit_quaternion",
]
