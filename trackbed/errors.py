"""Errors a user can act on: each says what happened, where and what to do, and has an exit code."""

from errno import EDQUOT, EFBIG, ENOSPC
from typing import Self

EXIT_CODES = {
    0: "ok", 1: "bug in trackbed", 2: "usage", 3: "scene invalid", 4: "engine or library missing",
    5: "engine failed, disk or memory full", 6: "result not credible", 7: "not converged",
    8: "members of a sweep failed", 130: "interrupted, state saved",
}  # fmt: skip
"""What the command ``trackbed`` returns, and what it means."""

NO_ROOM = (ENOSPC, EDQUOT, EFBIG)
"""Numbers of the system's errors: no space on the disk, none left in the user's quota, or a longer
file than is allowed."""


def describe_exit_codes() -> str:
    """The table of exit codes as the command's help prints it, in two columns."""
    entries = [f"{code:3}  {meaning}" for code, meaning in EXIT_CODES.items()]
    half = (len(entries) + 1) // 2
    rows = zip(entries[:half], entries[half:], strict=True)
    return "exit codes:\n" + "".join(f"{left:32} {right}\n" for left, right in rows)


class TrackbedError(Exception):
    """Base of all errors a user can act on.

    ``what`` is one sentence on what happened; ``where`` names file, line, key, body or contact;
    ``remedy`` says what to do.  ``exit_code`` is one of `EXIT_CODES`.
    """

    exit_code = 1

    def __init__(self, what: str, *, where: str = "", remedy: str = "") -> None:
        self.what, self.where, self.remedy = what, where, remedy
        super().__init__(
            (f"{where}: " if where else "") + what + (f"\n  -> {remedy}" if remedy else "")
        )

    def relocate(self, where: str) -> Self:
        """The same error, of another place."""
        return type(self)(self.what, where=where, remedy=self.remedy)


class UsageError(TrackbedError):
    """A flag, argument or input file of the command can not be used."""

    exit_code = 2


class NotValid(TrackbedError):
    """What is given can not be computed with: a scene, a mesh, a material, a problem."""

    exit_code = 3


class SceneError(NotValid):
    """A scene, or its file, is not valid."""


class MeshError(NotValid):
    """A mesh can not be used: no tetrahedra, no volume, coordinates that are not finite, ..."""


class LibraryMissing(TrackbedError):
    """A library that only this job needs is not installed."""

    exit_code = 4


class DiskFull(TrackbedError):
    """There is no room for what a run writes: the disk or the quota is full, or a file too long.

    Everything finished is saved; with room again the run goes on.
    """

    exit_code = 5


class OutOfMemory(TrackbedError, MemoryError):
    """What was asked for would need more memory than there is; it was not taken."""

    exit_code = 5


class NotCredible(TrackbedError):
    """A computation ended, but what it left breaks a law of physics or a bound."""

    exit_code = 6


class NotConverged(TrackbedError):
    """An iteration (a solver, a preparation, a relaxation, a fit) did not reach its tolerance."""

    exit_code = 7


class Interrupted(KeyboardInterrupt):
    """The user or the system asked us to stop; everything finished is saved.

    No `Exception`: nothing on its way up that mends errors may take it for one.
    """

    exit_code = 130
