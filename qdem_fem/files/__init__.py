"""Time series, VTU files and tables of a run; errors, and names for arrays in signatures."""

from qdem_fem.files.arrays import Floats, Integers
from qdem_fem.files.errors import (
    CheckpointError,
    ConditionError,
    ContactTooDeep,
    ElementInverted,
    EnergyLost,
    Interrupted,
    LibraryMissing,
    MaterialError,
    MeshError,
    NotConverged,
    QdemError,
    SceneWarning,
    StepWarning,
    Unstable,
    UsageError,
    warn_user,
)
from qdem_fem.files.output import Table, read_table, write_bodies_vtu
from qdem_fem.files.series import Driver, Series, Value, is_real, make_ramp

__all__ = [
    "CheckpointError", "ConditionError", "ContactTooDeep", "Driver", "ElementInverted",
    "EnergyLost", "Floats", "Integers", "Interrupted", "LibraryMissing", "MaterialError",
    "MeshError", "NotConverged", "QdemError", "SceneWarning", "Series", "StepWarning", "Table",
    "Unstable", "UsageError", "Value", "is_real", "make_ramp", "read_table", "warn_user",
    "write_bodies_vtu",
]  # fmt: skip
