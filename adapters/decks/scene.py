"""The scene of an adopted deck: the deck, its engine, its loaded body, and the procedure."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from adapters.decks.detect import list_contents
from adapters.decks.engine import Adopted
from adapters.decks.scripts import ENDING, read_marked
from adapters.laws import get_law
from adapters.moves import get_move
from adapters.scene import Procedure, expand_schedule, fill_procedure
from trackbed.run_verbs import find_file_kind
from trackbed.scene_files import Guide, Problem, Table, Text, read_scene

GUIDE = Guide("karrech", "procedure.total_cycles=200")
UNKNOWN = {
    "tolerance": "jumps that choose themselves", "members": "members",
    "relaxation": "a relaxation, as its walls are not known",
}  # fmt: skip
"""Keys of other procedures that runs of decks do not have, and what they would be."""


class DeckTable(Table):
    """A marked deck of the user's own."""

    file: Text  # from the scene's folder
    engine: Literal["liggghts", "lammps", "yade"]  # that runs the deck
    loaded_body: str = ""
    """Mesh, or variable of a script that holds a body, whose settlement is asked for, and which a
    jump lowers; none: that of the mean grain."""
    launcher: Annotated[tuple[Annotated[str, Field(min_length=1)], ...], Field(strict=False)] = ()
    """Words before the engine's command line, such as ("mpirun", "-np", "4")."""


class DeckScene(Table):
    """An adopted deck and how it is gone through."""

    deck: DeckTable
    procedure: Procedure


def is_deck_scene(path: Path) -> bool:
    """Whether a scene file has the table ``[deck]``; False where it can not be read."""
    return find_file_kind(path).table == "deck"


def load_deck_scene(path: Path, overrides: Sequence[str] = ()) -> tuple[DeckScene, Adopted]:
    """Read and check the scene of a deck, and the deck; raises as `adapters.scene.load_scene`."""
    text = read_scene(path, overrides, guide=GUIDE)
    text.convert_numbers(DeckScene)
    if isinstance(text.data.get("procedure"), dict):
        text.data["procedure"] = fill_procedure(text.data["procedure"])
    problems = list(expand_schedule(text.data))
    text.check(DeckScene)
    text.refuse([*problems, *text.problems])
    scene = DeckScene.model_validate(text.data)
    p, body = scene.procedure, scene.deck.loaded_body
    for key, what in UNKNOWN.items():
        if getattr(p, key) != Procedure.model_fields[key].default:
            problems.append(Problem(f"procedure.{key}", f"a deck is run without {what}"))
    if p.k_i >= p.total_cycles:
        what = f"must exceed k_i = {p.k_i}, is {p.total_cycles}"
        problems.append(Problem("procedure.total_cycles", what))
    if p.h is None or p.k is None:
        problems.append(Problem("procedure", "missing: give k and h, or leave both out"))
    deck = read_marked(path.parent / scene.deck.file)
    if deck.is_script != (scene.deck.engine == "yade"):
        problems.append(Problem("deck.engine", ENDING))
    contents = list_contents(deck)
    meshes = contents.meshes if scene.deck.engine != "lammps" else {}
    if deck.marks is None:
        problems.append(Problem("deck.file", "no load cycle is marked there: trackbed adopt DECK"))
    if body and body not in meshes:
        what = f"{body} is no mesh of this deck; its meshes are: {', '.join(meshes) or 'none'}"
        problems.append(Problem("deck.loaded_body", what))
    text.refuse(problems)
    get_law(p.law)
    get_move(p.move)
    loaded = (body, meshes[body]) if body else None
    clumps = contents.clumps if deck.is_script else ()
    stones = clumps or [one.partition(" ")[0] for one in contents.clumps if "(multisphere" in one]
    bed = Adopted(deck, scene.deck.engine, loaded, "".join(stones[:1]), scene.deck.launcher)
    return scene, bed
