"""The strain measures: each is a file of its own, ``measure_NAME.py``, found by being there.

A measure has ``LAW``, the type by which compiled code chooses it; ``stress_numbers``, its nominal
stress written once for numbers, arrays, lanes and GPU; ``viscous_numbers``, what viscosity adds to
it, and where there is one ``pulls_viscous``, both at once; and, on arrays, ``strain_of``,
``stress_nominal`` and ``energy_stored``.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from numpy.typing import ArrayLike

from qdem_fem.element.kinematics import IDENTITY, FloatArray, transposed, volume_change

PREFIX = "measure_"
MEASURES: dict[str, Any] = {
    path.stem.removeprefix(PREFIX): import_module(f"{__package__}.{path.stem}")
    for path in sorted(Path(__file__).parent.glob(f"{PREFIX}*.py"))
}
"""Name -> module."""

if TYPE_CHECKING:
    Strain = str
else:
    Strain = Literal[tuple(MEASURES)]


def stress_cauchy(H: FloatArray, nominal: FloatArray, strain: Strain) -> FloatArray:
    """Cauchy stress T = P F^T/J [Pa], (m, 3, 3); ``small`` does not tell T from P."""
    if strain == "small":
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
