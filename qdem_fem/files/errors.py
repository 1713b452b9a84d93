"""Errors of QDEM runs: those of every story (`trackbed.errors`), and their own."""

import warnings

from trackbed.errors import (
    DiskFull,
    Interrupted,
    LibraryMissing,
    MeshError,
    NotConverged,
    NotCredible,
    NotValid,
    SceneError,
    TrackbedError,
    UsageError,
)

__all__ = [
    "CheckpointError", "ConditionError", "ContactTooDeep", "DiskFull", "ElementInverted",
    "EnergyLost", "Interrupted", "LibraryMissing", "MaterialError", "MeshError", "NotConverged",
    "QdemError", "SceneError", "SceneWarning", "StepWarning", "Unstable", "UsageError",
    "warn_user",
]  # fmt: skip

QdemError = TrackbedError
"""Base of all errors that `qdem_fem` raises."""


class MaterialError(NotValid):
    """A material breaks a law of physics: density zero, Poisson's ratio 0.5, ..."""


class ConditionError(NotValid):
    """A boundary condition or load can not be used: it names no node, holds NaN, ..."""


class Unstable(NotCredible):
    """The motion grew without bound: the time step is above the critical one."""


class ElementInverted(NotCredible):
    """An element was turned inside out; ``element`` is its number in the body's mesh."""

    def __init__(self, what: str, *, where: str = "", remedy: str = "", element: int = -1) -> None:
        self.element = element
        super().__init__(what, where=where, remedy=remedy)


class ContactTooDeep(NotCredible):
    """Two bodies are so deep in each other that the contact no longer knows its direction."""


class EnergyLost(NotCredible):
    """The account of energies does not close: the motion is not that of the bodies."""


class CheckpointError(NotCredible):
    """A saved state is damaged or belongs to another simulation."""


class SceneWarning(UserWarning):
    """What was given can be computed, but is hardly meant, or its answer is hardly right."""


class StepWarning(UserWarning):
    """One element makes the time step much shorter than the others need."""


def warn_user(text: str) -> None:
    """Say a `SceneWarning`."""
    warnings.warn(text, SceneWarning, stacklevel=3)
