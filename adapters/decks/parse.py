"""A deck of LIGGGHTS or LAMMPS as its commands, with the two marks around its user's load cycle.

A mark is a comment line: ``# trackbed: cycle`` above the cycle, ``# trackbed: end`` below it.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from adapters.errors import UsageError
from trackbed.memory import read_bounded

MARK = re.compile(r"^\s*#\s*trackbed\s*:\s*(cycle|end)\s*$")
NEAR_MARK = re.compile(r"^\s*#\s*trackbed\s*:", re.IGNORECASE)
"""A comment that is meant as a mark, whether it is one or not."""
BEGIN, END = "# trackbed: cycle", "# trackbed: end"
WORD = re.compile(r"\"[^\"]*\"|'[^']*'|[^\s\"']+")
COMMENT = re.compile(r"^((?:\"[^\"]*\"|'[^']*'|[^#\"'])*)#.*$", re.DOTALL)
VARIABLE = re.compile(r"\$(?:\{(\w+)\}|(\w))")
"""``${name}`` or ``$n``: the engine puts the variable's value in its place."""
VALUE = re.compile(rf"{VARIABLE.pattern}|\$(\((?:[^()]|\([^()]*\))*\))")
"""That, or ``$(formula)``, whose value it puts there too."""
METRE = {"si": (1.0, 1.0), "cgs": (1e-2, 1e-3)}
"""Units with seconds in them: lengths [m] and masses [kg]."""
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
    def plain(self) -> str:
        """Its words with one space between them."""
        return " ".join(self.words)

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
        found = VALUE.findall(self.text)
        inner = re.findall(r"\bv_(\w+)", " ".join(formula for _, _, formula in found))
        return {*inner, *(a or b for a, b, formula in found if not formula)}


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
    def is_script(self) -> bool:
        """Whether it is one of Python, for YADE."""
        return self.path.suffix == ".py"

    @property
    def units(self) -> tuple[float, float]:
        """Its unit of length [m] and of mass [kg]; 1 where neither is known."""
        names = [one.word(1) for one in self.before if one.name == "units"]
        return METRE.get(names[-1] if names else "si", (1.0, 1.0))

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
    before, cycle, after = list[Command](), list[Command](), list[Command]()
    for one in join_lines(lines, path.name):
        part = before if one.line < first else cycle if one.line < last else after
        part.extend(expand(one, path.parent))
    return Deck(path, tuple(lines), tuple(before), tuple(cycle), tuple(after), marks)


def read_lines(path: Path) -> list[str]:
    """Lines of a deck; raises `UsageError` for a file that is not there or is no text."""
    try:
        plain = path.is_file() or not path.exists()  # what is read from a pipe is not there again
        text = read_bounded(path, errors="surrogateescape") if plain else ""  # in any encoding
        text = text.removeprefix("\ufeff")  # which editors of Windows put there
        reason = "" if plain and "\0" not in text else "it is no text file"
    except OSError as error:
        text, reason = "", error.strerror or str(error)
    if reason:
        raise UsageError(
            f"this deck can not be read ({reason})", where=str(path),
            remedy="give the input file that you run by liggghts -in or lmp -in",
        )  # fmt: skip
    return text.removesuffix("\n").split("\n")


def find_marks(path: Path, lines: Sequence[str]) -> tuple[int, int] | None:
    """Lines of the two marks, from 1; None where there is none."""
    meant = {n: line.strip() for n, line in enumerate(lines, 1) if NEAR_MARK.match(line)}
    found = {n: mark[1] for n, line in meant.items() if (mark := MARK.match(line))}
    if strange := [n for n in meant if n not in found]:
        raise UsageError(
            f"'{meant[strange[0]]}' is no mark", where=f"{path}, line {strange[0]}",
            remedy=f"write just '{BEGIN}' or '{END}'",
        )  # fmt: skip
    if not found:
        return None
    if list(found.values()) != ["cycle", "end"]:
        listed = ", ".join(f"'{word}' in line {number}" for number, word in found.items())
        raise UsageError(
            f"the marks are not one pair: {listed}", where=str(path),
            remedy=f"one line '{BEGIN}' above the load cycle and one line '{END}' below it",
        )  # fmt: skip
    return min(found), max(found)


def join_lines(lines: Sequence[str], file: str) -> Iterator[Command]:
    """Commands of a file: a line that ends with ``&`` goes on in the next."""
    text, first = "", 0
    for number, line in enumerate(lines, 1):
        first = first if text else number
        text += line.rstrip()
        if text.endswith("&") and number < len(lines):
            text = text[:-1] + " "
            continue
        if text := COMMENT.sub(r"\1", text).strip():
            one = Command(text, file, first, number)
            if not one.words:
                raise UsageError(
                    f"'{one.short}' is no command: a quote is not closed", where=one.place,
                    remedy="close it, or leave the line out",
                )  # fmt: skip
            yield one
        text = ""


def list_included(lines: Sequence[str], folder: Path) -> Iterator[str]:
    """Names of the files that lines include, and that these include; `read_deck` refuses others."""
    for one in join_lines(lines, ""):
        if one.name == "include":
            yield one.word(1)
            yield from list_included(read_lines(folder / one.word(1)), folder)


def is_outside(name: str) -> bool:
    """Whether a file of this name lies outside of its deck's folder, wherever that is."""
    return Path(name).is_absolute() or ".." in Path(name).parts


def expand(command: Command, folder: Path, depth: int = 0) -> Iterator[Command]:
    """A command, or those of the file that it includes."""
    if command.name != "include":
        yield command
        return
    name, why = command.word(1), ""
    if is_outside(name):
        why = "lies outside of the folder of the deck: put it there"
    elif "$" in name:
        why = "has a variable in its name: write it out"
    elif depth == NESTED:
        why = "includes itself"
    elif not (folder / name).is_file():
        why = "does not exist in the folder of the deck"
    elif any(MARK.match(line) for line in read_lines(folder / name)):
        why = "has a mark: put both into the deck itself"
    if why:
        raise UsageError(f"the file {name} that is included here {why}", where=command.place)
    for one in join_lines(read_lines(folder / name), name):
        yield from expand(one, folder, depth + 1)
