"""The tetrahedron: kinematics, strain measures (one file each), stress, material."""

from qdem_fem.element import stress
from qdem_fem.element.kinematics import (
    apply_hooke,
    find_displacement_gradient,
    find_volume_change,
    find_von_mises,
)
from qdem_fem.element.material import Material
from qdem_fem.element.strain_measures import MEASURES, Strain, compute_cauchy_stress

__all__ = [
    "MEASURES", "Material", "Strain", "apply_hooke", "compute_cauchy_stress",
    "find_displacement_gradient", "find_volume_change", "find_von_mises", "stress",
]  # fmt: skip
