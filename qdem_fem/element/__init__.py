"""The tetrahedron: kinematics, strain measures (one file each), stress, material."""

from qdem_fem.element import stress
from qdem_fem.element.kinematics import displacement_gradient, volume_change, von_mises
from qdem_fem.element.material import Material
from qdem_fem.element.strain_measures import MEASURES, Strain, elastic_energy, stress_cauchy

__all__ = [
    "MEASURES", "Material", "Strain", "displacement_gradient", "elastic_energy", "stress",
    "stress_cauchy", "volume_change", "von_mises",
]  # fmt: skip
