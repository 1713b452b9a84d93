"""A marked deck cut in two: what prepares the bed, and a window of load cycles from a restart file.

Of what stands above the cycle a window repeats what the restart file does not hold: fixes,
computes, variables, regions, contact laws, settings, those not undone, each in its place.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from adapters.decks.parse import Command, Deck

HEADER = frozenset((
    "units", "atom_style", "atom_modify", "boundary", "newton", "dimension", "communicate",
    "comm_modify", "comm_style", "processors", "soft_particles", "hard_particles", "package",
    "suffix",
))  # fmt: skip
"""Settings that an engine takes only before there is a box."""
BOX = frozenset(("create_box", "read_data", "read_restart"))
"""Commands that make the box."""
DROPPED = BOX | frozenset((
    "create_atoms", "read_dump", "set", "velocity", "group", "delete_atoms", "displace_atoms",
    "displace_box", "change_box", "replicate", "mass", "run", "minimize", "rerun", "balance",
    "reset_timestep", "reset_atoms", "write_restart", "write_dump", "write_data", "restart",
    "print", "shell", "echo", "log", "info", "clear", "label", "next", "jump", "if", "quit",
))  # fmt: skip
"""What is done once, or what the restart file holds."""
KEYED = {"fix": "unfix", "compute": "uncompute", "dump": "undump", "variable": "", "region": ""}
"""Commands that give a thing a name, and those that take it away."""
UNDONE = {undo: kind for kind, undo in KEYED.items() if undo}
KEPT_STYLES = ("index", "loop", "world", "universe", "uloop")
"""Styles of variables that keep their first value when they are set a second time."""
STATE = "id type x y z ix iy iz vx vy vz omegax omegay omegaz radius mass"
"""Columns of the state at a cycle end, in both engines."""
WHOLE_COLUMNS = ("id", "type", "ix", "iy", "iz")


@dataclass(frozen=True)
class Dialect:
    """What an engine wants otherwise than the other."""

    state_format: str  # how a dump writes numbers without loss
    moved: str  # columns that read_dump takes
    read_dump: str  # and its keywords


DIALECTS = {
    "liggghts": Dialect(
        'format "' + " ".join("%d" if c in WHOLE_COLUMNS else "%.17g" for c in STATE.split()) + '"',
        "x y z vx vy vz radius", "replace yes box no",
    ),
    "lammps": Dialect("sort id format float %.17g", "x y z vx vy vz", "box no replace yes"),
}  # fmt: skip
"""Engines whose decks are adopted."""


def list_live(commands: Sequence[Command]) -> list[Command]:
    """What of ``commands`` a window repeats: not undone, not dropped, in order.

    A redefinition stands in place of the first definition, which others refer to; where it needs
    the value of a variable, in its own.
    """
    live: dict[tuple[str, ...], Command | None] = {}
    for number, one in enumerate(commands):
        kind, name = UNDONE.get(one.name, one.name), one.word(1)
        key = (kind, name)
        if one.name in UNDONE or one.word(2) == "delete":
            # a region's place is kept: walls that stand behind it are declared with it
            if kind == "region" and key in live:
                live[key] = None
            else:
                live.pop(key, None)
            for other in [k for k in live if k[:2] == (kind + "_modify", name)]:
                del live[other]
        elif kind == "variable" and one.word(2) in KEPT_STYLES and key in live:
            continue
        elif kind in KEYED:
            if live.get(key) is not None and one.substituted():
                live[(*key, str(number))] = one
            else:
                live[key] = one
        elif kind not in DROPPED:
            live[(kind, name, str(number))] = one
    return [one for one in live.values() if one is not None]


def split_header(deck: Deck) -> tuple[list[Command], list[Command]]:
    """Live commands that stand before the restart file is read, and those behind."""
    box = next((n for n, one in enumerate(deck.before) if one.name in BOX), 0)
    early = {one for one in deck.before[:box] if one.name in HEADER or one.name == "variable"}
    live = list_live(deck.before)
    return [one for one in live if one in early], [one for one in live if one not in early]


def find_named(commands: Sequence[Command], kind: str) -> dict[str, Command]:
    """Live things of a kind by name, such as fixes."""
    return {one.word(1): one for one in list_live(commands) if one.name == kind}


def format_prepare(deck: Deck, engine: str) -> str:
    """``prepare.in``: all above the cycle, then the state and the restart file."""
    lines = [f"# prepare.in : generated from {deck.path.name}", *(c.text for c in deck.before)]
    return join([*lines, *write_state(engine, "0"), "write_restart cycle_0.restart", *COMPLETE])


def format_window(deck: Deck, engine: str, cycles: int, moved_at: int | None = None) -> str:
    """``window.in``: ``cycles`` load cycles from ``cycle_0.restart``, the state at each one's end.

    ``moved_at``: step of ``cycle_0.dump``, with the places that a jump gave the grains; None goes
    on from the restart file as it is.
    """
    header, live = split_header(deck)
    numbered = any(one.name == "atom_modify" and "map" in one.words for one in header)
    return join([
        f"# window.in : generated from {deck.path.name}", *(one.text for one in header),
        *([] if numbered else ["atom_modify map array"]),
        "read_restart cycle_0.restart", *(one.text for one in live),
        *format_cycles(deck, engine, cycles, moved_at), *COMPLETE,
    ])  # fmt: skip


def format_whole(deck: Deck, engine: str, cycles: int) -> str:
    """``whole.in``: preparation and ``cycles`` load cycles in one process."""
    prepare = format_prepare(deck, engine).removesuffix(join(COMPLETE))
    return prepare + join([*format_cycles(deck, engine, cycles, None), *COMPLETE])


def format_cycles(deck: Deck, engine: str, cycles: int, moved_at: int | None) -> Iterator[str]:
    """Lines of a loop over load cycles; grains are moved in the first, before its first run."""
    yield f"variable trackbed_cycle loop {cycles}"
    yield "label trackbed_cycle"
    for one in deck.cycle:
        if one.name == "run" and moved_at is not None:
            dialect = DIALECTS[engine]
            read = f"read_dump cycle_0.dump {moved_at} {dialect.moved} {dialect.read_dump}"
            yield f'if "${{trackbed_cycle}} == 1" then "{read}"'
            moved_at = None
        yield one.text
    yield from write_state(engine, "${trackbed_cycle}")
    yield "write_restart cycle_${trackbed_cycle}.restart"
    yield "next trackbed_cycle"
    yield "jump SELF trackbed_cycle"


def write_state(engine: str, cycle: str) -> Iterator[str]:
    """The command that writes the state at the end of a cycle, without loss."""
    form = DIALECTS[engine].state_format
    yield f"write_dump all custom cycle_{cycle}.dump {STATE} modify {form}"


COMPLETE = ("variable trackbed_step equal step", 'print "COMPLETE step ${trackbed_step}"')
"""The last words of a deck: no exit code proves that it came so far."""


def join(lines: Sequence[str]) -> str:
    """Lines as a text."""
    return "\n".join(lines) + "\n"
