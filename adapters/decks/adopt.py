"""A user's deck made one that trackbed can run: a marked copy and a scene; his is not touched."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from adapters.decks.detect import (
    Contents,
    Finding,
    add_lines,
    add_marks,
    find_obstacles,
    list_contents,
)
from adapters.decks.engine import list_inputs, list_output_folders
from adapters.decks.parse import BEGIN, END, Deck, read_deck
from adapters.decks.scene import is_deck_scene, load_deck_scene
from adapters.errors import UsageError
from trackbed.run_files import refuse_writing, write_whole

SCENE = """\
# {name}: load cycles computed and jumped on a deck of your own.  Written by trackbed adopt.

[deck]
file = "{file}"
engine = "{engine}"
loaded_body = "{loaded_body}"  # ID of a mesh that stands for the sleeper; "": the mean grain alone

[procedure]
total_cycles = 200  # computed and jumped; trackbed new karrech FOLDER explains what else there is
"""


@dataclass(frozen=True)
class Adoption:
    """What came of a deck."""

    folder: Path  # where the copy, its inputs and the scene are
    deck: Deck  # the marked copy
    contents: Contents
    findings: tuple[Finding, ...]

    @property
    def stops(self) -> list[Finding]:
        """What its user has to change before a window can be right."""
        return [one for one in self.findings if one.kind == "stops"]


def adopt(path: Path, engine: str, into: Path | None = None) -> Adoption:
    """Write a marked copy of the deck at ``path``, with what it reads, and a scene.

    They go to the folder ``into``, by default one beside the deck that is called after it.  The
    deck of a scene that `adopt` wrote is looked at where it is.  Raises `UsageError` for decks that
    can not be read or marked, and for another file where the copy should be.
    """
    path = path.absolute()
    own = path.parent / "scene.toml"
    marked = read_deck(path)
    found: list[Finding] = []
    if is_deck_scene(own) and load_deck_scene(own).deck.file == path.name and marked.marks:
        return judge_copy(marked, engine, found)
    if marked.marks is None:
        if not any(one.name == "run" and one.file == path.name for one in marked.before):
            raise UsageError(
                "nothing is run in this deck, so there is no load cycle", where=str(path),
                remedy=f"put '{BEGIN}' above the commands of one cycle and '{END}' below them",
            )  # fmt: skip
        lines, said = add_marks(marked)
        marked, found = read_deck(path, lines), [said]
    found += [one for one in find_obstacles(marked, engine) if one.kind == "added"]
    folder = into or path.parent / name_deck(path)
    with refuse_writing(folder):
        for inner in (Path(), *list_output_folders(marked)):
            (folder / inner).mkdir(parents=True, exist_ok=True)
    for name in list_inputs(marked):
        write_new(folder / name, (path.parent / name).read_bytes())
    text = "\n".join(add_lines(marked, found)) + "\n"
    write_new(folder / path.name, text.encode(errors="surrogateescape"))
    adoption = judge_copy(read_deck(folder / path.name), engine, found)
    text = SCENE.format(
        name=name_deck(path), file=path.name, engine=engine,
        loaded_body=adoption.contents.loaded_body if engine == "liggghts" else "",
    )  # fmt: skip
    write_new(folder / "scene.toml", text.encode())
    return adoption


def judge_copy(deck: Deck, engine: str, found: list[Finding]) -> Adoption:
    """What is to be said of a marked copy, behind what was ``found`` and put into it."""
    rest = find_obstacles(deck, engine)
    return Adoption(deck.path.parent, deck, list_contents(deck), (*found, *rest))


def name_deck(path: Path) -> str:
    """What a deck is called: ``packing`` of ``in.packing`` or ``packing.in``."""
    return path.name.removeprefix("in.").removesuffix(".in").partition(".")[0] or "deck"


def write_new(path: Path, content: bytes) -> None:
    """Write a file that is not there; raises `UsageError` where another one is."""
    if path.exists():
        if path.read_bytes() == content:
            return
        raise UsageError(
            "another file is there already and is kept", where=str(path),
            remedy="change and adopt that one, or name another folder: --into FOLDER",
        )  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, content)
