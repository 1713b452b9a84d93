"""The program of an engine: is it here, does it start, is it new enough."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from tempfile import TemporaryDirectory

from adapters.errors import EngineMissing

PATIENCE_S = 60
"""Time a program has to tell its version [s]."""


@dataclass(frozen=True)
class Program:
    """How a program tells its version, and from which one on it is known to work."""

    title: str
    question: str
    """The word it is asked with."""
    banner: re.Pattern[str]
    """What it answers: group 1 is the version's text, further groups are numbers."""
    oldest: tuple[int, ...]
    """Those numbers of the oldest version that will do."""
    remedy: str
    """How to get it."""

    def version(self, words: Sequence[str] | None) -> str:
        """The version as text, of the program that ``words`` start; None where there is none.

        Raises `EngineMissing` for a program that is missing, does not start, or is another one.
        """
        if words is None:
            raise EngineMissing(f"{self.title} is not installed", remedy=self.remedy)
        try:
            with TemporaryDirectory() as folder:  # LIGGGHTS writes a log where it is started
                asked = subprocess.run(
                    [*words, self.question],
                    cwd=folder,
                    capture_output=True,
                    text=True,
                    errors="replace",
                    stdin=subprocess.DEVNULL,
                    timeout=PATIENCE_S,
                )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise EngineMissing(
                f"{self.title} does not start ({error})", where=words[-1], remedy=self.remedy
            ) from error
        answer = asked.stdout + asked.stderr
        banner = self.banner.search(answer)
        if banner is None or tuple(map(int, banner.groups()[1:])) < self.oldest:
            wanted = ".".join(map(str, self.oldest))
            said = banner[0] if banner else (answer.strip().splitlines() or ["nothing"])[-1]
            raise EngineMissing(
                f"this is not {self.title} {wanted} or later; it says: {said.strip()}",
                where=words[-1],
                remedy=self.remedy,
            )
        return banner[1].strip()
