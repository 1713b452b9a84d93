"""The strain measures: each is a file here that sets ``MEASURE``, found by being there.

``MEASURE`` is the type by which compiled code chooses a measure, and ``OBJECTIVE`` says whether a
body may turn under it.  ``stress_numbers`` is its nominal stress, written once for numbers,
arrays, lanes and GPU; ``viscous_numbers`` what viscosity adds to it, and where there is one
``pulls_viscous`` both at once; ``stress_nominal`` and ``energy_stored`` are on arrays.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal

from numpy.typing import ArrayLike

from qdem_fem.element.kinematics import IDENTITY, FloatArray, transposed, volume_change
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


def stress_cauchy(H: FloatArray, nominal: FloatArray, strain: Strain) -> FloatArray:
    """Cauchy stress T = P F^T/J [Pa], (m, 3, 3); T is P where the measure is not objective."""
    if not MEASURES[strain].OBJECTIVE:
        return nominal
    return nominal @ transposed(IDENTITY + H) / (1 + volume_change(H))[..., None, None]


def elastic_energy(
    H: FloatArray,
    volume: FloatArray,
    lame_first: ArrayLike,
    lame_second: ArrayLike,
    strain: Strain,
) -> FloatArray:
    """Stored energy of every element [J], (m,); ``volume`` is V0 (m,) [m^3]."""
    found: FloatArray = MEASURES[strain].energy_stored(H, volume, lame_first, lame_second)
    return found
