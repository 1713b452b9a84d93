"""The verb ``adopt``: a deck of the user's own, made one that jumps over load cycles."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from adapters.errors import NotCredible, SceneError

if TYPE_CHECKING:
    from adapters.decks import Adoption, Difference


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``adopt`` to its parser."""
    parser.add_argument(
        "deck", metavar="DECK", type=Path,
        help="input file of the engine; a line '# trackbed: cycle' above the commands of one load "
        "cycle, '# trackbed: end' below them; the file itself is never changed",
    )  # fmt: skip
    parser.add_argument(
        "--engine",
        required=True,
        choices=("liggghts", "lammps"),
        help="the engine it is written for",
    )
    parser.add_argument(
        "--into", type=Path, metavar="FOLDER",
        help="for the marked copy and its scene; default: beside the deck, called after it",
    )  # fmt: skip
    parser.add_argument(
        "--check",
        action="store_true",
        help="run two cycles in one process and in windows, and print the difference",
    )
    parser.set_defaults(command=run_adopt)


def run_adopt(arguments: argparse.Namespace) -> int:
    """Adopt a deck; print what it has, what was added, and what it needs."""
    from adapters.decks import adopt

    adoption = adopt(arguments.deck, arguments.engine, arguments.into)
    print(*describe(adoption), sep="\n")
    if adoption.stops:
        raise SceneError(
            "windows of this deck would compute another bed:\n  "
            + "\n  ".join(map(str, adoption.stops)),
            where=str(adoption.deck.path),
            remedy=f"change the copy, then: trackbed adopt {shlex.quote(str(adoption.deck.path))} "
            f"--engine {arguments.engine}",
        )  # fmt: skip
    if arguments.check:
        check(adoption)
    return 0


def describe(adoption: Adoption) -> list[str]:
    """What is in a deck, and what of it was found, a line each."""
    deck, contents = adoption.deck, adoption.contents
    lines = [f"{deck.path}  (the marked copy)"]
    if deck.marks:
        lines.append(f"cycle: lines {deck.marks[0]} to {deck.marks[1]}, {len(deck.cycle)} commands")
    lines.append(f"grains: {', '.join(contents.clumps) or 'spheres'}")
    lines.append(f"groups: {', '.join(contents.groups) or 'all'}")
    for name, style in contents.meshes.items():
        moved = contents.moved.get(name)
        lines.append(f"mesh {name}: {style}" + (f", moved by {moved}" if moved else ""))
    body = contents.loaded_body
    lines.append(f"loaded body: {body or 'none known; the settlement is that of the mean grain'}")
    lines += [f"{one.kind}: {one}" for one in adoption.findings if one.kind != "stops"]
    return lines


def check(adoption: Adoption) -> None:
    """Run a deck both ways and print how far they part; raises `NotCredible` where they do."""
    from adapters.decks import adopt_scene, check_cut, load_deck_scene

    path = adoption.folder / "scene.toml"
    bed = adopt_scene(path, load_deck_scene(path))
    with TemporaryDirectory(prefix="trackbed-check-") as folder:
        found = check_cut(bed, Path(folder))
    print(*describe_difference(found), sep="\n")
    if not found.agrees:
        raise NotCredible(
            "windows of this deck compute another bed than one process does",
            where=str(adoption.deck.path),
            remedy="look for what the engine keeps in no restart file: phases of motions, "
            "insertions, forces read where a run begins",
        )  # fmt: skip


def describe_difference(found: Difference) -> list[str]:
    """One process against windows, a line for each cycle."""
    lines = [f"one process against windows of one cycle, {found.grains} grains:"]
    for cycle, (place, way) in enumerate(zip(found.place, found.path, strict=True), 1):
        lines.append(
            f"  cycle {cycle}: places differ by {place:.3g} m at most; grains went {way:.3g} m"
        )
    if found.height[0] == found.height[0]:
        lines.append(f"  height of the loaded body: {found.height.max():.3g} m")
    return lines
