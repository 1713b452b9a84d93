"""The strain measures: each is a file here that sets ``MEASURE``, found by being there.

``MEASURE`` is the type by which compiled code chooses a measure, and ``OBJECTIVE`` says whether a
body may turn under it.  ``find_stress_numbers`` is its nominal stress, written once for numbers,
arrays, lanes and GPU; ``find_viscous_numbers`` what viscosity adds to it, and where there is one
``find_fused_pulls`` both at once; ``compute_nominal_stress`` and ``compute_stored_energy`` are
on arrays.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal

from qdem_fem.element.kinematics import IDENTITY, find_volume_change, transpose
from qdem_fem.files import Floats
from trackbed.choices import find_choices

MEASURES: dict[str, Any] = {
    name: import_module(module)
    for name, module in find_choices("qdem_fem.element", "MEASURE").items()
}
"""Name -> module."""

if TYPE_CHECKING:
    Strain = str
else:
    Strain = Literal[tuple(MEASURES)]


def compute_cauchy_stress(H: Floats, nominal: Floats, strain: Strain) -> Floats:
    """Cauchy stress T = P F^T/J [Pa], (m, 3, 3); T is P where the measure is not objective."""
    if not MEASURES[strain].OBJECTIVE:
        return nominal
    return nominal @ transpose(IDENTITY + H) / (1 + find_volume_change(H))[..., None, None]
