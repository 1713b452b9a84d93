"""Decks in folders of their own: what they read is lent, what they write stays."""

import glob
import re
import shutil
import signal
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import cast

from adapters.decks.parse import VARIABLE, Deck, is_outside, list_included
from adapters.decks.scripts import format_script
from adapters.decks.split import format_whole, format_window
from adapters.engines import copy_deck, get_engine, run_process
from adapters.errors import EngineFailed
from adapters.scene import Scene
from trackbed.run_files import write_whole

COMPLETE = re.compile(r"^COMPLETE step \d+", re.MULTILINE)
FAILED = re.compile(r"ERROR.* .|\w+(Error|Exception): ")
"""How a line begins that says why an engine, or a script in YADE, ends."""
PLACE = re.compile(r'^ *File "(?!trackbed_)([^"/]+)", line (\d+)', re.MULTILINE)
"""Where in a script an exception was raised: its file without a folder, unlike our own."""
SILENT_S = 7200.0
"""Without a word in any file before an engine is ended [s], as of every engine here."""
MEANT = {
    "Atom::grow() callback": "LAMMPS says so where a wall's region is missing: declare the region "
    "above the fix",
    "with per-atom info": "a window can make grains behind its first run alone: create_atoms there",
    "Lost atoms": "grains left the box: look at the last state, or take a shorter time step",
    "NameError": "of what stands above the cycle, a window has imports, functions and classes not "
    "inside of if or try, numbers, texts, vectors, arrays, bodies and lists of these: make other "
    "things between the marks, and give an engine a label",
    "MagicMock": "yade.qt shows nothing here: leave its engines out",
    "reuse of fix ID": "a fix is made in each cycle: undo it above '# trackbed: end'",
}
"""What an engine says, and what that means in a deck."""


@dataclass(frozen=True)
class Adopted:
    """A marked deck and what runs it."""

    deck: Deck
    engine: str  # liggghts, lammps or yade
    loaded: tuple[str, str] | None = None  # name and style of the loaded body
    stones: str = ""  # fix that holds the spheres of each stone together; empty for spheres
    launcher: tuple[str, ...] = ()  # words before the engine's command line


def list_inputs(deck: Deck) -> list[Path]:
    """Files that a deck names but itself, from its folder: meshes, data, tables, included decks."""
    included = () if deck.is_script else list_included(deck.lines, deck.path.parent)
    found = {Path(one) for one in included}
    for word in (word for one in deck.commands for word in one.words[1:]):
        if re.search(r"[./]", word) and not is_outside(word):
            pattern = VARIABLE.sub("*", word) if "$" in word else glob.escape(word)
            names = glob.glob(pattern, root_dir=deck.path.parent)
            found.update(Path(n) for n in names if (deck.path.parent / n).is_file())
    return sorted(found - {Path(deck.path.name)})


def list_output_folders(deck: Deck) -> list[Path]:
    """Folders that a deck names a file in, from its own: the engines make none."""
    found = set()
    for word in (word for one in deck.commands for word in one.words[1:] if "/" in word):
        inner = Path(word).parent
        is_file = re.search(r"[.*]", Path(word).name) or (deck.path.parent / inner).is_dir()
        no_folder = {"$", "..", " "} & {*str(inner), *inner.parts}
        if is_file and not (inner.is_absolute() or no_folder):
            found.add(inner)
    return sorted(found)


def format_run(bed: Adopted, kind: str, cycles: int) -> str:
    """The deck of a stage: prepare, window or whole by ``kind``, of ``cycles`` load cycles."""
    if bed.engine == "yade":
        return format_script(bed.deck, kind, cycles, bed.loaded[0] if bed.loaded else "")
    return (format_window if kind == "window" else format_whole)(bed.deck, bed.engine, cycles)


def run_deck(bed: Adopted, text: str, path: Path) -> float:
    """Write a deck to ``path``, run it in that folder, and return the CPU time [s].

    Raises `EngineMissing`, and `EngineFailed` where the deck did not come to its end.
    """
    folder, inputs = path.parent, list_inputs(bed.deck)
    if bed.deck.is_script:
        path = path.with_name(f"trackbed_{path.stem}.py")  # a user's may be called window.py
        inputs = [*inputs, Path(bed.deck.path.name)]
        ours = folder / "yade_scripts"
        ours.mkdir(exist_ok=True)
        copy_deck(ours, ("__init__.py", "adopted.py", "record.py"), ours.name)
    for inner in (*list_output_folders(bed.deck), *(name.parent for name in inputs)):
        (folder / inner).mkdir(parents=True, exist_ok=True)
    lent = {}
    for name in inputs:
        shutil.copyfile(bed.deck.path.parent / name, folder / name)
        lent[folder / name] = (folder / name).stat().st_mtime_ns
    write_whole(path, text.encode(errors="surrogateescape"))
    # of a scene, an engine's command line takes the launcher alone
    scene = cast(Scene, SimpleNamespace(engine=SimpleNamespace(launcher=bed.launcher)))
    engine = get_engine(bed.engine)
    if engine.program() is None:
        engine.version()  # raises, and says how it is installed
    status, cpu_s, _ = run_process(engine.command(scene, path.name), folder, lambda: None, SILENT_S)
    said = (folder / "screen.txt").read_text(errors="replace")
    if status != 0 or COMPLETE.search(said) is None:
        raise explain_failure(status, said, path)
    for copy, written in lent.items():
        if copy.exists() and copy.stat().st_mtime_ns == written:  # else the deck wrote it
            copy.unlink()
    return cpu_s


def explain_failure(status: int, text: str, deck: Path) -> EngineFailed:
    """The error for a deck that ended early, with the engine's own words."""
    lines = [line.strip() for line in text.splitlines() if line.strip()]
    said = [line for line in lines if FAILED.match(line)] or lines[-2:]
    if status == 0:
        said = ["the deck itself ends it, as by exit or quit, before its cycle is through"]
    elif places := PLACE.findall(text):
        said.append(f"{places[-1][0]}, line {places[-1][1]}")
    remedy = next((meaning for words, meaning in MEANT.items() if words in text), "")
    error = EngineFailed(
        f"the engine ended with status {status}: {' | '.join(said[-2:])}", where=str(deck),
        remedy=remedy or "run your own deck, then: trackbed adopt DECK --check",
    )  # fmt: skip
    error.from_outside = -status in (signal.SIGTERM, signal.SIGKILL)
    return error
