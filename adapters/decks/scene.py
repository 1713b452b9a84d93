"""The scene of an adopted deck: the deck, its engine, its loaded body, and the procedure."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from adapters.decks.detect import list_contents
from adapters.decks.engine import Adopted
from adapters.decks.parse import Deck, read_deck
from adapters.errors import SceneError
from adapters.laws import get_law
from adapters.moves import get_move
from adapters.scene import Procedure, expand_schedule, fill_procedure
from trackbed.scene_files import Guide, Problem, Table, Text, read_scene

GUIDE = Guide("karrech", "procedure.total_cycles=200")
UNKNOWN = {"tolerance": "jumps that choose themselves", "members": "members"}
"""Keys of other procedures that runs of decks do not have, and what they would be."""


class DeckTable(Table):
    """A marked deck of the user's own."""

    file: Text  # from the scene's folder
    engine: Literal["liggghts", "lammps"]
    loaded_body: str = ""
    """Mesh whose settlement is asked for, and which a jump lowers; none: that of the mean grain."""
    launcher: Annotated[tuple[Annotated[str, Field(min_length=1)], ...], Field(strict=False)] = ()
    """Words before the engine's command line, such as ("mpirun", "-np", "4")."""


class DeckScene(Table):
    """An adopted deck and how it is gone through."""

    deck: DeckTable
    procedure: Procedure


def is_deck_scene(path: Path) -> bool:
    """Whether a scene file has the table ``[deck]``; False where it can not be read."""
    try:
        return "deck" in tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError):
        return False


def load_deck_scene(path: Path, overrides: Sequence[str] = ()) -> DeckScene:
    """Read and check the scene of a deck; raises as `adapters.scene.load_scene`."""
    text = read_scene(path, overrides, guide=GUIDE)
    if isinstance(text.data.get("procedure"), dict):
        text.data["procedure"] = fill_procedure(text.data["procedure"])
    problems = list(expand_schedule(text.data))
    text.check(DeckScene)
    text.refuse([*problems, *text.problems])
    scene = DeckScene.model_validate(text.data)
    p = scene.procedure
    problems = [
        Problem(f"procedure.{key}", f"a deck is run without {what}: leave this out")
        for key, what in UNKNOWN.items()
        if getattr(p, key) != Procedure.model_fields[key].default
    ]
    if p.k_i >= p.total_cycles:
        problems.append(
            Problem("procedure.total_cycles", f"must exceed k_i = {p.k_i}, is {p.total_cycles}")
        )
    if p.h is None or p.k is None:
        problems.append(Problem("procedure", "missing: give k and h, or leave both out"))
    text.refuse(problems)
    get_law(p.law)
    get_move(p.move)
    return scene


def adopt_scene(path: Path, scene: DeckScene) -> Adopted:
    """The marked deck of the scene at ``path``; raises `SceneError` for a body it has not."""
    deck = read_deck(path.parent / scene.deck.file)
    return adopt_deck(deck, scene.deck.engine, scene.deck.loaded_body, scene.deck.launcher)


def adopt_deck(
    deck: Deck, engine: str, loaded_body: str = "", launcher: tuple[str, ...] = ()
) -> Adopted:
    """A marked deck with what runs it.

    Raises `SceneError` for a deck without marks, and for a loaded body that is no mesh of it.
    """
    if deck.marks is None:
        raise SceneError(
            "no load cycle is marked in this deck", where=str(deck.path),
            remedy="trackbed adopt DECK writes a marked copy",
        )  # fmt: skip
    contents = list_contents(deck)
    loaded = None
    if loaded_body:
        if loaded_body not in contents.meshes or engine != "liggghts":
            known = ", ".join(contents.meshes) if engine == "liggghts" else ""
            raise SceneError(
                f"the loaded body {loaded_body} is no mesh of this deck; its meshes are: "
                f"{known or 'none'}",
                where=str(deck.path), remedy='deck.loaded_body = "": then the mean grain alone',
            )  # fmt: skip
        loaded = loaded_body, contents.meshes[loaded_body]
    stones = [one.partition(" ")[0] for one in contents.clumps if "(multisphere" in one]
    return Adopted(deck, engine, loaded, stones[0] if stones else "", launcher)
