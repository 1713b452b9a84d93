"""The verb ``adopt``: a deck of the user's own, made one that jumps over load cycles."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from adapters.errors import NotCredible, SceneError

if TYPE_CHECKING:
    from adapters.decks import Adoption


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``adopt`` to its parser."""
    parser.add_argument(
        "deck", metavar="DECK", type=Path,
        help="input file of the engine, a line '# trackbed: cycle' above the commands of one load "
        "cycle and '# trackbed: end' below them; it is never changed: a marked copy and a scene "
        "go to a folder beside it",
    )  # fmt: skip
    parser.add_argument(
        "--engine", required=True, choices=("liggghts", "lammps", "yade"),
        help="that it is written for",
    )  # fmt: skip
    parser.add_argument(
        "--check", action="store_true",
        help="run two cycles in one process and in windows, and print the difference",
    )  # fmt: skip
    parser.set_defaults(command=run_adopt)


def run_adopt(arguments: argparse.Namespace) -> int:
    """Adopt a deck; print what it has, what was added, and what it needs."""
    from adapters.decks import adopt

    adoption = adopt(arguments.deck, arguments.engine)
    deck = adoption.deck.path
    print(*describe(adoption), sep="\n")
    if adoption.stops:
        again = f"trackbed adopt {shlex.quote(str(deck))} --engine {arguments.engine}"
        raise SceneError(
            "windows of this deck would compute another bed:\n  "
            + "\n  ".join(map(str, adoption.stops)),
            where=str(deck), remedy=f"change the copy, then: {again}",
        )  # fmt: skip
    if arguments.check:
        check(adoption)
    print(f"next: trackbed run {shlex.quote(str(adoption.scene))} --control")
    return 0


def describe(adoption: Adoption) -> list[str]:
    """What is in a deck, and what of it was found, a line each."""
    deck, contents = adoption.deck, adoption.contents
    first, last = deck.marks or (0, 0)
    driven = {name: f", moved by {moved}" for name, moved in contents.moved.items()}
    return [
        f"{deck.path}: the marked copy",
        f"cycle: {len(deck.cycle)} commands between lines {first} and {last}",
        f"grains: {', '.join(contents.clumps) or 'spheres'}",
        f"groups: {', '.join(contents.groups) or 'all'}",
        *(f"mesh {name}: {s}{driven.get(name, '')}" for name, s in contents.meshes.items()),
        f"loaded body: {contents.loaded_body or 'none known; the mean grain alone settles'}",
        *(f"{one.kind}: {one}" for one in adoption.findings if one.kind != "stops"),
    ]


def check(adoption: Adoption) -> None:
    """Run a deck both ways and print how far they part; raises `NotCredible` where they do."""
    from adapters.decks import check_cut, keep_check, load_deck_scene

    bed = load_deck_scene(adoption.scene)[1]
    with TemporaryDirectory(prefix="trackbed-check-") as folder:
        found = check_cut(bed, Path(folder))
    print(f"one process against windows of one cycle, {found.grains} grains:")
    for cycle, (place, way) in enumerate(zip(found.place, found.path, strict=True), 1):
        print(f"  cycle {cycle}: places differ by {place:.3g} m at most; grains went {way:.3g} m")
    if adoption.contents.loaded_body:
        print(f"  heights of the loaded body differ by {found.height.max():.3g} m")
    if not found.agrees:
        raise NotCredible(
            "windows of this deck compute another bed than one process does",
            where=str(adoption.deck.path),
            remedy="look for what the engine keeps in no restart file: phases of motions, "
            "insertions, forces read where a run begins; a bed that still falls or flows parts by "
            "chaos alone, so mark a shorter cycle, of a bed at rest",
        )  # fmt: skip
    keep_check(adoption.scene, bed)
