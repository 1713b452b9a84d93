"""A user's deck made one that trackbed can run: a marked copy and a scene; his is not touched."""

import json
from dataclasses import dataclass
from pathlib import Path

from adapters.decks.detect import add_lines, add_marks, find_obstacles, list_contents
from adapters.decks.engine import list_inputs, list_output_folders
from adapters.decks.findings import Contents, Finding
from adapters.decks.parse import BEGIN, END, Deck
from adapters.decks.scene import is_deck_scene
from adapters.decks.scripts import ENDING, read_marked
from adapters.errors import UsageError
from trackbed.run_files import refuse_writing, write_whole
from trackbed.run_verbs import refuse_scene

SCENE = """\
# {name}: load cycles computed and jumped on a deck of your own.  Written by trackbed adopt.

[deck]
file = {file}
engine = "{engine}"
loaded_body = "{body}"  # mesh, or body in a script's variable, of the sleeper; "": the mean grain

[procedure]
total_cycles = 200  # computed and jumped; trackbed new karrech FOLDER explains what else there is
"""


@dataclass(frozen=True)
class Adoption:
    """What came of a deck."""

    scene: Path
    deck: Deck  # the marked copy, beside the scene
    contents: Contents
    findings: tuple[Finding, ...]

    @property
    def stops(self) -> list[Finding]:
        """What its user has to change before a window can be right."""
        return [one for one in self.findings if one.kind == "stops"]


def adopt(path: Path, engine: str) -> Adoption:
    """Write a marked copy of the deck at ``path``, with what it reads, and a scene.

    They go to a folder beside the deck that is called after it.  A deck beside a scene that `adopt`
    wrote is such a copy, and looked at where it is.  Raises `UsageError` for decks that can not be
    read or marked, and for another file where the copy should be.
    """
    refuse_scene(path, "no deck of an engine")
    path = path.absolute()
    if not path.name.isprintable():  # a scene could not name it
        raise UsageError("the deck's name is no text", where=ascii(path.name), remedy="rename it")
    if (path.suffix == ".py") != (engine == "yade"):
        raise UsageError(ENDING, where=str(path), remedy="name the engine that it is written for")
    marked, found, copy = read_marked(path), list[Finding](), path
    if not (is_deck_scene(path.parent / "scene.toml") and marked.marks):
        if marked.marks is None:
            runs = any(one.name == "run" and one.file == path.name for one in marked.before)
            if not (runs or marked.is_script):
                raise UsageError(
                    "nothing is run in this deck, so there is no load cycle", where=str(path),
                    remedy=f"put '{BEGIN}' above the commands of one cycle, '{END}' below them",
                )  # fmt: skip
            lines, said = add_marks(marked)
            marked, found = read_marked(path, lines), [said]
        found += [one for one in find_obstacles(marked, engine) if one.kind == "added"]
        name = path.name.removeprefix("in.").partition(".")[0] or "deck"
        folder = path.parent / name
        for inner in (Path(), *list_output_folders(marked)):
            with refuse_writing(folder):
                (folder / inner).mkdir(parents=True, exist_ok=True)
        for one in list_inputs(marked):
            write_new(folder / one, (path.parent / one).read_bytes())
        text, copy = "\n".join(add_lines(marked, found)) + "\n", folder / path.name
        write_new(copy, text.encode(errors="surrogateescape"))
        body = list_contents(marked).loaded_body if engine != "lammps" else ""
        file = json.dumps(path.name, ensure_ascii=False)
        text = SCENE.format(name=name, file=file, engine=engine, body=body)
        write_new(folder / "scene.toml", text.encode())
    deck = read_marked(copy)
    found += find_obstacles(deck, engine)
    return Adoption(copy.with_name("scene.toml"), deck, list_contents(deck), tuple(found))


def write_new(path: Path, content: bytes) -> None:
    """Write a file that is not there; raises `UsageError` where another one is."""
    if path.exists() and path.read_bytes() != content:
        raise UsageError(
            "another file is there already and is kept", where=str(path),
            remedy="change and adopt that one, or move it away",
        )  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, content)
