"""What is found in a deck: what it has, and what stands in the way of windows."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from adapters.decks.parse import Command, is_outside


@dataclass(frozen=True)
class Finding:
    """Something of a deck that its user should know."""

    kind: str  # "stops": no window is right; "added": put into the marked copy; "note"
    place: str  # file and line; empty for the deck as a whole
    what: str
    remedy: str = ""
    above: str = ""  # above which mark the remedy is added: "cycle" or "end"

    def __str__(self) -> str:
        where = f"{self.place}: " if self.place else ""
        return f"{where}{self.what}" + (f"\n    -> {self.remedy}" if self.remedy else "")


def stop(one: Command, what: str, remedy: str) -> Finding:
    """A finding with which no window is right."""
    return Finding("stops", one.place, what, remedy)


def note(one: Command, what: str, remedy: str = "") -> Finding:
    """A finding to think of."""
    return Finding("note", one.place, what, remedy)


@dataclass(frozen=True)
class Contents:
    """What a deck has of what cycle jumps need."""

    groups: tuple[str, ...]
    clumps: tuple[str, ...]  # fixes that hold grains of several spheres together
    meshes: dict[str, str]  # mesh -> style
    moved: dict[str, str]  # mesh -> what moves it

    @property
    def loaded_body(self) -> str:
        """The mesh that is driven, where there is one alone; else empty."""
        return next(iter(self.moved)) if len(self.moved) == 1 else ""


def find_outside(commands: Iterable[Command]) -> Iterator[Finding]:
    """Files that no run carries along."""
    for one in commands:
        for word in one.words[1:]:
            if is_outside(word) and word.strip() not in ("/", ".."):
                what = f"{word} lies outside of the folder of the deck, and is not carried along"
                yield stop(one, what, "put it beside the deck, and name it so")


def match_patterns(
    patterns: Sequence[tuple[str, str, str, str, str]], places: Mapping[str, Sequence[Command]]
) -> Iterator[Finding]:
    """Findings of commands in the lists ``places`` that begin as one of ``patterns``."""
    for where, pattern, kind, what, remedy in patterns:
        for one in places[where]:
            if found := re.match(pattern, one.plain):
                said, line = (t.format(*found.groups(), all=one.short) for t in (what, remedy))
                yield Finding(kind, one.place, said, line, "cycle" if kind == "added" else "")
