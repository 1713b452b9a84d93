"""A marked deck cut in two: what prepares the bed, and a window of load cycles from a restart file.

Of what stands above the cycle a window repeats what the restart file does not hold: fixes,
computes, variables, regions, contact laws, settings, those not undone, each in its place.
"""

from collections.abc import Iterable, Iterator, Sequence

from adapters.decks.parse import Command, Deck

HEADER = frozenset((
    "units", "atom_style", "atom_modify", "boundary", "newton", "dimension", "communicate",
    "comm_modify", "comm_style", "processors", "soft_particles", "hard_particles", "package",
    "suffix", "variable",
))  # fmt: skip
"""Settings that an engine takes only before there is a box, and variables in them."""
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
LIGGGHTS_FORMAT = " ".join(
    "%d" if name in ("id", "type", "ix", "iy", "iz") else "%.17g" for name in STATE.split()
)
WITHOUT_LOSS = {"liggghts": f'format "{LIGGGHTS_FORMAT}"', "lammps": "sort id format float %.17g"}
"""How a dump writes numbers whole; the keys are the engines whose decks are adopted."""
COMPLETE = ("variable trackbed_step equal step", 'print "COMPLETE step ${trackbed_step}"')
"""The last words of a deck: no exit code proves that it came so far."""


def list_live(commands: Sequence[Command]) -> list[Command]:
    """What of ``commands`` a window repeats: not undone, not dropped, in order.

    A redefinition stands in place of the first definition, which others refer to; where it needs
    the value of a variable, in its own.
    """
    live: dict[tuple[str, ...], Command | None] = {}
    for number, one in enumerate(commands):
        if one.name == "clear":
            live = {key: kept for key, kept in live.items() if key[0] == "variable"}
        kind, name = UNDONE.get(one.name, one.name), one.word(1)
        key = (kind, name)
        if one.name == "region" and one.word(2) == "delete":
            live |= {key: None} if key in live else {}  # its place is kept for the walls on it
        elif one.name in UNDONE or (kind == "variable" and one.word(2) == "delete"):
            for gone in [k for k in live if k[:2] in (key, (f"{kind}_modify", name))]:
                del live[gone]
        elif kind == "variable" and one.word(2) in KEPT_STYLES and key in live:
            continue
        elif kind in KEYED:
            again = live.get(key) is not None and one.substituted()
            live[(*key, str(number)) if again else key] = one
        elif kind not in DROPPED:
            live[(*key, str(number))] = one
    return [one for one in live.values() if one is not None]


def find_named(commands: Sequence[Command], kind: str) -> dict[str, Command]:
    """Live things of a kind by name, such as fixes."""
    return {one.word(1): one for one in list_live(commands) if one.name == kind}


def format_window(deck: Deck, engine: str, cycles: int) -> str:
    """``window.in``: ``cycles`` load cycles from ``cycle_0.restart``, each with its state."""
    start = max((n for n, one in enumerate(deck.before) if one.name == "clear"), default=0)
    box = next((n for n, one in enumerate(deck.before) if n >= start and one.name in BOX), 0)
    early = {one for one in deck.before[:box] if one.name in HEADER}
    live = list_live(deck.before)
    header = [one for one in live if one in early]
    numbered = any(one.name == "atom_modify" and "map" in one.words for one in header)
    return join([
        f"# window.in : generated from {deck.path.name}", *(one.text for one in header),
        *([] if numbered else ["atom_modify map array"]), "read_restart cycle_0.restart",
        *(one.text for one in live if one not in early),
        *list_cycles(deck, engine, cycles), *COMPLETE,
    ])  # fmt: skip


def format_whole(deck: Deck, engine: str, cycles: int) -> str:
    """``prepare.in``, all above the cycle and the state; with ``cycles`` ``whole.in``, these load
    cycles in the same process."""
    return join([
        f"# generated from {deck.path.name}", *(one.text for one in deck.before),
        *write_state(engine, "0"), *(list_cycles(deck, engine, cycles) if cycles else ()),
        *COMPLETE,
    ])  # fmt: skip


def list_cycles(deck: Deck, engine: str, cycles: int) -> Iterator[str]:
    """Lines of a loop over load cycles."""
    yield from (f"variable trackbed_cycle loop {cycles}", "label trackbed_cycle")
    yield from (one.text for one in deck.cycle)
    yield from write_state(engine, "${trackbed_cycle}")
    yield from ("next trackbed_cycle", "jump SELF trackbed_cycle")


def write_state(engine: str, cycle: str) -> Iterator[str]:
    """Lines that write the state at the end of a cycle, without loss."""
    yield f"write_dump all custom cycle_{cycle}.dump {STATE} modify {WITHOUT_LOSS[engine]}"
    yield f"write_restart cycle_{cycle}.restart"


def join(lines: Iterable[str]) -> str:
    """Lines as a text."""
    return "\n".join(lines) + "\n"
