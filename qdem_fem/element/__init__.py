"""The tetrahedron: kinematics, strain measures (one file each), stress, material."""

from qdem_fem.element import stress
from qdem_fem.element.kinematics import (
    compute_displacement_gradient,
    compute_volume_change,
    compute_von_mises,
)
from qdem_fem.element.material import Material
from qdem_fem.element.strain_measures import MEASURES, Strain, compute_cauchy_stress

__all__ = [
    "MEASURES", "Material", "Strain", "compute_cauchy_stress", "compute_displacement_gradient",
    "compute_volume_change", "compute_von_mises", "stress",
]  # fmt: skip
