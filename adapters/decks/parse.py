"""A deck of LIGGGHTS or LAMMPS as its commands, with the two marks around its user's load cycle.

A mark is a comment line: ``# trackbed: cycle`` above the cycle, ``# trackbed: end`` below it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from adapters.errors import UsageError
from trackbed.memory import read_bounded

MARK = re.compile(r"^\s*#\s*trackbed\s*:\s*(\S*)\s*$")
BEGIN, END = "# trackbed: cycle", "# trackbed: end"
WORD = re.compile(r"\"[^\"]*\"|'[^']*'|[^\s\"']+")
COMMENT = re.compile(r"^((?:\"[^\"]*\"|'[^']*'|[^#\"'])*)#.*$", re.DOTALL)
VARIABLE = re.compile(r"\$(?:\{(\w+)\}|(\w))")
"""``${name}`` or ``$n``: the engine puts the variable's value in its place."""
NESTED = 10
"""Decks that include one another further than this include themselves."""


@dataclass(frozen=True)
class Command:
    """One command, its continued lines joined and its comment left out."""

    text: str
    file: str  # name of the file it stands in, from the deck's folder
    line: int  # its first line there
    last: int  # its last line there

    @cached_property
    def words(self) -> tuple[str, ...]:
        """Its words, quotes taken off."""
        return tuple(word.strip("\"'") for word in WORD.findall(self.text))

    @property
    def name(self) -> str:
        """The first word."""
        return self.words[0]

    @property
    def place(self) -> str:
        """File and line, for a sentence."""
        return f"{self.file}, line {self.line}"

    @property
    def short(self) -> str:
        """Its text for a sentence, on one line and not too long."""
        return " ".join(self.text.split())[:100]

    def word(self, number: int) -> str:
        """A word by its number; empty where the command is shorter."""
        return self.words[number] if number < len(self.words) else ""

    def substituted(self) -> set[str]:
        """Names of the variables whose values the engine puts into it."""
        return {a or b for a, b in VARIABLE.findall(self.text)}


@dataclass(frozen=True)
class Deck:
    """A deck, cut at its marks; ``cycle`` and ``after`` are empty where it has none."""

    path: Path
    lines: tuple[str, ...]  # of the file itself
    before: tuple[Command, ...]
    cycle: tuple[Command, ...]
    after: tuple[Command, ...]
    marks: tuple[int, int] | None  # lines of the two marks, from 1; None without

    @property
    def commands(self) -> tuple[Command, ...]:
        """All commands in order."""
        return self.before + self.cycle + self.after


def read_deck(path: Path, lines: Sequence[str] | None = None) -> Deck:
    """Read a deck, and the files that it includes, in the order in which the engine does.

    ``lines``: what is to stand in the file instead of what does.  Raises `UsageError` for a file
    that can not be read, an include that can not be followed, and marks that are not one pair.
    """
    lines = read_lines(path) if lines is None else lines
    marks = find_marks(path, lines)
    first, last = marks or (len(lines) + 1, len(lines) + 1)
    found = [(one.line, part) for one in join_lines(lines, path.name)
             for part in expand(one, path.parent)]  # fmt: skip
    return Deck(
        path, tuple(lines),
        tuple(one for line, one in found if line < first),
        tuple(one for line, one in found if first < line < last),
        tuple(one for line, one in found if line > last), marks,
    )  # fmt: skip


def read_lines(path: Path) -> list[str]:
    """Lines of a deck; raises `UsageError` for a file that is not there or is no text."""
    remedy = "give the input file that you run by liggghts -in or lmp -in"
    try:
        text = read_bounded(path, errors="surrogateescape")  # comments may be in any encoding
    except OSError as error:
        what = f"this deck can not be read ({error.strerror})"
        raise UsageError(what, where=str(path), remedy=remedy) from error
    if "\0" in text:
        raise UsageError("this is no deck: it is no text", where=str(path), remedy=remedy)
    return text.split("\n")[: -1 if text.endswith("\n") else None]


def find_marks(path: Path, lines: Sequence[str]) -> tuple[int, int] | None:
    """Lines of the two marks, from 1; None where there is none."""
    found = [
        (number, mark[1]) for number, line in enumerate(lines, 1) if (mark := MARK.match(line))
    ]
    if not found:
        return None
    if [word for _, word in found] != ["cycle", "end"]:
        listed = ", ".join(f"'{word}' in line {number}" for number, word in found)
        raise UsageError(
            f"the marks are not one pair: {listed}", where=str(path),
            remedy=f"one line '{BEGIN}' above the load cycle and one line '{END}' below it",
        )  # fmt: skip
    return found[0][0], found[1][0]


def join_lines(lines: Sequence[str], file: str) -> Iterator[Command]:
    """Commands of a file: a line that ends with ``&`` goes on in the next."""
    text, first = "", 0
    for number, line in enumerate(lines, 1):
        first = first if text else number
        text += line.rstrip("\r")
        if text.rstrip().endswith("&") and number < len(lines):
            text = text.rstrip()[:-1] + " "
            continue
        text = COMMENT.sub(r"\1", text).strip()
        if text:
            yield Command(text, file, first, number)
        text = ""


def expand(command: Command, folder: Path, depth: int = 0) -> Iterator[Command]:
    """A command, or those of the file that it includes."""
    if command.name != "include":
        yield command
        return
    name = command.word(1)
    inner = folder / name
    if "$" in name or depth == NESTED or not inner.is_file():
        why = "does not exist" if "$" not in name else "has a variable in its name"
        raise UsageError(
            f"the file {name} that is included here "
            + ("includes itself" if depth == NESTED else why),
            where=command.place, remedy="include files by name, from the folder of the deck",
        )  # fmt: skip
    lines = read_lines(inner)
    if any(MARK.match(line) for line in lines):
        raise UsageError(
            f"a mark stands in the included file {name}", where=command.place,
            remedy="put both marks into the deck itself",
        )  # fmt: skip
    for one in join_lines(lines, name):
        yield from expand(one, folder, depth + 1)
