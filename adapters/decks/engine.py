"""Decks in folders of their own: what they read is linked, what they write stays there."""

from __future__ import annotations

import glob
import re
import signal
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import cast

from adapters.decks.parse import VARIABLE, Deck
from adapters.decks.split import format_prepare, format_window
from adapters.engines import get_engine, run_process
from adapters.errors import EngineFailed
from adapters.scene import Scene
from trackbed.run_files import write_whole

COMPLETE = re.compile(r"^COMPLETE step (\d+)", re.MULTILINE)
SILENT_S = 7200.0
"""Without a word in any file before an engine is ended [s], as of every engine here."""
MEANT = {
    "Atom::grow() callback": "LAMMPS says so where a wall's region is missing: declare the region "
    "above the fix",
    "Lost atoms": "grains left the box: look at the last state, or take a shorter time step",
    "reuse of fix ID": "a fix is made in each cycle: undo it above '# trackbed: end'",
}
"""What an engine says, and what that means in a deck."""


@dataclass(frozen=True)
class Adopted:
    """A marked deck and what runs it."""

    deck: Deck
    engine: str  # liggghts or lammps
    loaded: tuple[str, str] | None = None  # name and style of the loaded body's mesh
    stones: str = ""  # fix that holds the spheres of each stone together; empty for spheres
    launcher: tuple[str, ...] = ()  # words before the engine's command line

    @property
    def reads_restarts(self) -> bool:
        """Whether the restart file of each cycle is looked into."""
        return bool(self.loaded or self.stones)


def list_inputs(deck: Deck) -> list[Path]:
    """Files that a deck names, from its folder: meshes, data, tables, included decks."""
    found: set[Path] = set()
    for one in deck.commands:
        for word in one.words[1:]:
            if word.startswith(("/", "..")) or not re.search(r"[./]", word):
                continue
            pattern = VARIABLE.sub("*", word) if "$" in word else glob.escape(word)
            names = glob.glob(pattern, root_dir=deck.path.parent)
            found.update(Path(n) for n in names if (deck.path.parent / n).is_file())
    included = {Path(one.file) for one in deck.commands} - {Path(deck.path.name)}
    return sorted(found | included)


def list_output_folders(deck: Deck) -> list[Path]:
    """Folders that a deck names a file in, from its own: the engines make none."""
    found = set()
    for word in (word for one in deck.commands for word in one.words[1:]):
        inner = Path(word).parent
        is_file = re.search(r"[.*]", Path(word).name) or (deck.path.parent / inner).is_dir()
        if "/" in word and is_file and "$" not in str(inner) and ".." not in inner.parts:
            found.add(inner)
    return sorted(one for one in found if not one.is_absolute())


def lay_out(deck: Deck, folder: Path) -> None:
    """Make a folder in which a deck finds what it reads, linked, and can write."""
    for inner in list_output_folders(deck):
        (folder / inner).mkdir(parents=True, exist_ok=True)
    for name in list_inputs(deck):
        place = folder / name
        place.parent.mkdir(parents=True, exist_ok=True)
        if not place.exists():
            place.symlink_to((deck.path.parent / name).resolve())


def prepare_bed(bed: Adopted, folder: Path) -> float:
    """Run what stands above the cycle in ``folder``; the CPU time [s].  Raises as `run_deck`."""
    return run_deck(bed, format_prepare(bed.deck, bed.engine), "prepare.in", folder)


def run_window(
    bed: Adopted, folder: Path, cycles: int, moved_at: int | None = None,
    watch: Callable[[], None] = lambda: None,
) -> float:  # fmt: skip
    """Run load cycles from ``cycle_0.restart`` in ``folder``; the CPU time [s].

    ``moved_at``: time step of ``cycle_0.dump`` where grains are to be placed as it says.  Raises as
    `run_deck`.
    """
    text = format_window(bed.deck, bed.engine, cycles, moved_at)
    return run_deck(bed, text, "window.in", folder, watch)


def run_deck(
    bed: Adopted, text: str, name: str, folder: Path, watch: Callable[[], None] = lambda: None
) -> float:
    """Write a deck to ``folder``, run it there, and return the CPU time [s].

    Raises `EngineMissing`, and `EngineFailed` where the deck did not come to its end.
    """
    lay_out(bed.deck, folder)
    write_whole(folder / name, text.encode(errors="surrogateescape"))
    # of a scene, an engine's command line takes the launcher alone
    scene = cast(Scene, SimpleNamespace(engine=SimpleNamespace(launcher=bed.launcher)))
    engine = get_engine(bed.engine)
    if engine.program() is None:
        engine.version()  # raises and says how it is installed
    status, cpu_s, _ = run_process(engine.command(scene, name), folder, watch, SILENT_S)
    said = (folder / "screen.txt").read_text(errors="replace")
    if status != 0 or COMPLETE.search(said) is None:
        raise explain_failure(status, said, folder / name)
    return cpu_s


def explain_failure(status: int, text: str, deck: Path) -> EngineFailed:
    """The error for a deck that ended early, with the engine's own words."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    said = [line for line in lines if line.startswith("ERROR")] or lines[-2:]
    remedy = next((meaning for words, meaning in MEANT.items() if words in text), "")
    error = EngineFailed(
        f"the engine ended with status {status}: {' | '.join(said[-2:])}", where=str(deck),
        remedy=remedy or "run your own deck, then: trackbed adopt DECK --check",
    )  # fmt: skip
    error.from_outside = -status in (signal.SIGTERM, signal.SIGKILL)
    return error
