"""Errors of the package: each says what happened, where, and what to do; each has an exit code."""

from __future__ import annotations

from typing import Self


class RigidError(Exception):
    """Base of all errors a user can act on.

    ``what`` is one sentence on what happened; ``where`` names file, key, body or contact;
    ``remedy`` says what to do.  ``exit_code`` is what the command ``trackbed`` returns.
    """

    exit_code = 1

    def __init__(self, what: str, *, where: str = "", remedy: str = "") -> None:
        self.what, self.where, self.remedy = what, where, remedy
        super().__init__(
            (f"{where}: " if where else "") + what + (f"\n  -> {remedy}" if remedy else "")
        )

    def at(self, where: str) -> Self:
        """The same error, told of another place."""
        return type(self)(self.what, where=where, remedy=self.remedy)


class UsageError(RigidError):
    """A flag or argument of the command can not be used."""

    exit_code = 2


class SceneError(RigidError):
    """A scene, or its file, is not valid."""

    exit_code = 3


class ProblemError(RigidError):
    """A friction problem can not be posed: W is not square, q holds NaN, friction is negative."""

    exit_code = 3


class ShapeError(RigidError):
    """A shape can not be used: a polygon is not convex, a body has no volume."""

    exit_code = 3


class LibraryMissing(RigidError):
    """A library that only this job needs is not installed."""

    exit_code = 4


class DiskFull(RigidError):
    """There is no room for what a run writes: the disk or the quota is full, or a file too long.

    Everything finished is saved; with room again the run goes on.
    """

    exit_code = 5


class Overlapping(RigidError):
    """Bodies overlap, at the start or by a step that no smaller step could mend."""

    exit_code = 6


class NoSolution(RigidError):
    """There are no finite forces that obey Coulomb's law (Painleve)."""

    exit_code = 6


class NotConverged(RigidError):
    """A solver did not reach its tolerance; the message has its best residual."""

    exit_code = 7


class Interrupted(KeyboardInterrupt):
    """The user or the system asked us to stop; everything finished is saved.

    No `Exception`: nothing on its way up that mends errors may take it for one.
    """

    exit_code = 130
