"""Materials of grains and walls."""

from typing import Annotated

from pydantic import Field

from adapters.bed import contact_law
from trackbed.scene_files import NonNegative, Positive, Table

Poisson = Annotated[float, Field(ge=0, lt=0.5, allow_inf_nan=False)]
Restitution = Annotated[float, Field(gt=0.05, le=1, allow_inf_nan=False)]
ViscousAlpha = Annotated[float, Field(ge=0, lt=contact_law.find_alpha(0.05), allow_inf_nan=False)]


class GrainMaterial(Table):
    """Material of the grains."""

    young: Positive  # Young's modulus [Pa]
    poisson: Poisson  # Poisson's ratio [-]
    density: Positive  # mass density [kg/m^3]
    viscous_alpha: ViscousAlpha | None = None  # coefficient alpha_n = alpha_t of eq. 7 [-]
    restitution: Restitution | None = None
    """Coefficient of restitution [-], instead of ``viscous_alpha``."""
    friction: NonNegative  # Coulomb's coefficient between grains [-]
    rolling_friction: Positive | None = None
    """Greatest torque that resists rolling between grains over R* F_n [-]; None: no resistance."""


class WallMaterial(Table):
    """Material of floor, walls and piston; symmetry planes are rigid and frictionless."""

    young: Positive  # Young's modulus [Pa]
    poisson: Poisson  # Poisson's ratio [-]
    friction: NonNegative  # Coulomb's coefficient between grain and wall [-]
    rolling_friction: Positive | None = None  # as that of grains [-], with R* = R


class Material(Table):
    """Materials of grains and walls."""

    grain: GrainMaterial
    wall: WallMaterial
