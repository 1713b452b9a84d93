"""Errors of the package: each says what happened, where, and what to do; each has an exit code."""


class QdemError(Exception):
    """Base of all errors a user can act on.

    ``what`` is one sentence on what happened; ``where`` names file, key, body, element or node;
    ``remedy`` says what to do.  ``exit_code`` is what the command ``trackbed`` returns.
    """

    exit_code = 1

    def __init__(self, what: str, *, where: str = "", remedy: str = "") -> None:
        self.what, self.where, self.remedy = what, where, remedy
        super().__init__(
            (f"{where}: " if where else "") + what + (f"\n  -> {remedy}" if remedy else "")
        )


class UsageError(QdemError):
    """A flag or argument of the command can not be used."""

    exit_code = 2


class SceneError(QdemError):
    """A scene file is not valid."""

    exit_code = 3


class MeshError(QdemError):
    """A mesh can not be used: no tetrahedra, no volume, coordinates that are not finite, ..."""

    exit_code = 3


class MaterialError(QdemError):
    """A material breaks a law of physics: density zero, Poisson's ratio 0.5, ..."""

    exit_code = 3


class ConditionError(QdemError):
    """A boundary condition or load can not be used: it names no node, holds NaN, ..."""

    exit_code = 3


class LibraryMissing(QdemError):
    """A library that only this job needs is not installed."""

    exit_code = 4


class DiskFull(QdemError):
    """There is no room for what a run writes: the disk or the quota is full, or a file too long."""

    exit_code = 5


class Unstable(QdemError):
    """The motion grew without bound: the time step is above the critical one."""

    exit_code = 6


class ElementInverted(QdemError):
    """An element was turned inside out; ``element`` is its number in the body's mesh."""

    exit_code = 6

    def __init__(self, what: str, *, where: str = "", remedy: str = "", element: int = -1) -> None:
        self.element = element
        super().__init__(what, where=where, remedy=remedy)


class ContactTooDeep(QdemError):
    """Two bodies are so deep in each other that the contact no longer knows its direction."""

    exit_code = 6


class EnergyLost(QdemError):
    """The account of energies does not close: the motion is not that of the bodies."""

    exit_code = 6


class CheckpointError(QdemError):
    """A saved state is damaged or belongs to another simulation."""

    exit_code = 6


class NotConverged(QdemError):
    """An iteration (dynamic relaxation, power iteration) did not reach its tolerance."""

    exit_code = 7


class StepWarning(UserWarning):
    """One element makes the time step much shorter than the others need."""


class Interrupted(KeyboardInterrupt):
    """The user or the system asked us to stop; everything finished is saved.

    No `Exception`: nothing on its way up that mends errors may take it for one.
    """

    exit_code = 130
