"""Errors of rigid runs: those of every story (`trackbed.errors`), and their own."""

from trackbed.errors import (
    LibraryMissing,
    NotConverged,
    NotCredible,
    NotValid,
    SceneError,
    TrackbedError,
    UsageError,
)

__all__ = [
    "LibraryMissing", "NoSolution", "NotConverged", "Overlapping", "ProblemError", "RigidError",
    "SceneError", "ShapeError", "UsageError",
]  # fmt: skip

RigidError = TrackbedError
"""Base of all errors that `rigid_lcp` raises."""


class ProblemError(NotValid):
    """A friction problem can not be posed: W is not square, q holds NaN, friction is negative."""


class ShapeError(NotValid):
    """A shape can not be used: a polygon is not convex, a body has no volume."""


class Overlapping(NotCredible):
    """Bodies overlap, at the start or by a step that no smaller step could mend."""


class NoSolution(NotCredible):
    """There are no finite forces that obey Coulomb's law (Painleve)."""
