"""What stands in the way of cutting a deck into windows, each as a sentence with the line to add.

Every one was measured, on decks that others wrote: a window that misses it computes another bed, or
none.
"""

import re
from collections.abc import Callable, Iterator, Sequence

from adapters.decks.findings import Contents, Finding, find_outside, match_patterns, note, stop
from adapters.decks.parse import BEGIN, END, METRE, VALUE, VARIABLE, Command, Deck
from adapters.decks.scripts import find_script_obstacles, list_script_contents
from adapters.decks.split import KEYED, find_named, list_live

RIGID = re.compile(r"rigid(/.*)?|poems")
STATE = re.compile(
    r"(?<![\w.])(step|elapsed|elaplong|time|ke|pe|atoms|temp|press|[cf]_\w+)(?!\w)"
    r"|\b(xcm|vcm|bound|count|mass|ke|gyration|fcm|random|normal)(?=\()"
)
"""Parts of a formula whose value is another when the window starts."""
STEPS = 1000
"""Time steps of the cycle that is put at the end of a script that runs none: a guess, and said."""
DECLARED = r"\b(?:fix|unfix|compute|region|dump|pair_style|pair_coeff)\s"
OUTPUTS = ("dump", "log", "write_dump", "write_restart")
AVERAGES = ("print", "ave/time", "ave/chunk")
"""Commands, and styles of fixes, that write files."""
PATTERNS = (
    ("standing", r"fix (\S+) \S+ (?:insert/\S+|pour|deposit)(?!\S)", "added",
     "fix {0} still inserts grains: each window would insert them again", "unfix {0}"),
    ("standing", r"fix (\S+) \S+ (rigid(?:/\S*)?|poems)(?!\S)", "stops",
     "fix {0} {1} holds grains together, and trackbed can not move its bodies",
     "spheres, or in LIGGGHTS 'fix multisphere'"),
    ("standing", r"fix (\S+) (?!all )\S+ (multisphere.*)", "stops",
     "fix {0} {1} is not of all: spheres beside it vanish at the second run", "fix {0} all {1}"),
    ("standing", r"fix (\S+) \S+ \S+/servo(?!\S)", "note",
     "the controller of fix {0} starts again in each window",
     "trackbed adopt --check says how far that goes"),
    ("live", r"fix \S+ \S+ gravity .*\bvector (?![-+0.]+ [-+0.]+(?!\S))", "stops",
     "gravity is not along -z, where settlement is", "turn the deck"),
    ("live", r"fix (\S+) (\S+) (freeze|move|setforce)(?!\S)", "note",
     "fix {0} {2} holds or moves grains of {1}",
     "grains that do not move in a window are not moved by a jump"),
    ("standing", r"fix (\S+) \S+ wall/gran\S* .*\bwiggle(?!\S)", "stops",
     "the motion of wall {0} starts again from its first phase in each window",
     f"'{{all}}' below '{BEGIN}', 'unfix {{0}}' above '{END}', whole periods"),
    ("live", r"fix (\S+) \S+ move/mesh .*\bwiggle(?!\S)", "note",
     "fix {0} goes on in its phase to round-off only (8e-7 m were seen)",
     "a cycle must be whole periods of it"),
    ("live", r"variable (\S+) .*?(?<![\w.])(elapsed|elaplong|ramp|stagger|logfreq|vdisplace|"
     r"[sc]wiggle)(?!\w)", "note", "variable {0} counts {1} steps from the start of each run",
     "the motion must be whole in each run"),
    ("live", rf"units (?!(?:{'|'.join(METRE)})(?!\S))(\S+)", "note",
     "lengths are in units {0}, no metres", ""),
    ("live", r"thermo_modify .*\b(?:ignore|warn)(?!\S)", "note",
     "grains that leave the box vanish without stopping the engine", "thermo_modify lost error"),
    ("before", r"group (\S+) .*\bdynamic(?!\S)", "note",
     "group {0} keeps the grains it has at the mark", ""),
    ("cycle", r"(?:create_box|read_data|read_restart|clear|reset_timestep)(?!\S)",
     "stops", "'{all}' inside the cycle begins another bed", f"put it above '{BEGIN}'"),
    ("cycle", r"(?:if .*\b)?delete_atoms (?!.*\bcompress no\b)", "stops",
     "'{all}' numbers the grains that are left again", "delete_atoms ... compress no"),
    ("cycle", r"if (?!.*delete_atoms)", "note", "'{all}': all must take the same branch", ""),
    ("before", rf"if .*(?:{DECLARED}|\b(?:variable|timestep|neighbor)\s)", "stops",
     "'{all}' declares something or not: a window can not know which",
     "write the command that it comes to, without if"),
    ("both", r"if .*\binclude\s", "stops",
     "include inside of if: LIGGGHTS refuses it, and a window can not know what it does",
     "the included lines instead"),
    ("both", r"jump (?!SELF(?!\S))\S", "stops", "'{all}' goes on in a file that is named",
     "jump SELF LABEL, or include another file"),
)  # fmt: skip
"""Where a command stands (standing: above the cycle, and not undone; live: that or inside), how it
begins, the kind of finding, what is said of it, and what to write instead."""


def list_contents(deck: Deck) -> Contents:
    """What is in a deck: groups, clumps, meshes and which of them move."""
    if deck.is_script:
        return list_script_contents(deck)
    fixes = find_named(deck.before, "fix")
    fixes |= {one.word(1): one for one in deck.cycle if one.name == "fix"}
    styles = {name: one.word(3) for name, one in fixes.items()}
    meshes = {name: style for name, style in styles.items() if style.startswith("mesh/")}
    moved = {name: style for name, style in meshes.items() if style.endswith("/servo")}
    for name, one in fixes.items():
        if styles[name] == "move/mesh" and "mesh" in one.words[:-1]:
            where = "inside the cycle" if one in deck.cycle else "all the time"
            moved[one.words[one.words.index("mesh") + 1]] = f"fix {name}, {where}"
    clumps = (
        f"{name} ({style})" for name, style in styles.items()
        if RIGID.fullmatch(style) or style.startswith("multisphere")
    )  # fmt: skip
    groups = dict.fromkeys(one.word(1) for one in deck.before if one.name == "group")
    return Contents(tuple(groups), tuple(clumps), meshes, moved)


def find_obstacles(deck: Deck, engine: str) -> list[Finding]:
    """All findings of a marked deck, in the order of its lines where they have one."""
    if engine == "yade":
        return list(find_script_obstacles(deck))
    found = [one for rule in RULES for one in rule(deck, engine)]
    order = {one.place: n for n, one in reversed(list(enumerate(deck.commands)))}
    return sorted(found, key=lambda one: order.get(one.place, -1))


def find_unfinished(deck: Deck, engine: str) -> Iterator[Finding]:
    """Things that a cycle makes and leaves, or takes away: the next one can not be the same."""
    for kind, undo in KEYED.items():
        if kind == "variable":
            continue
        start, end = (find_named(part, kind) for part in (deck.before, deck.before + deck.cycle))
        for name in end.keys() - start.keys():
            what = f"the cycle makes {kind} {name} and leaves it: the next cycle can not make it"
            line = f"{undo} {name}" if undo else f"region {name} delete"
            yield Finding("added", end[name].place, what, line, "end")
        for name in start.keys() - end.keys():
            what = f"the cycle takes {kind} {name} away, which the next one wants again"
            yield stop(start[name], what, f"above '{END}': {start[name].short}")


def find_absolute_runs(deck: Deck, engine: str) -> Iterator[Finding]:
    """Cycles without a run, or to a step that only the first can reach."""
    if not any(one.name == "run" for one in deck.cycle):
        yield Finding("stops", "", "nothing is run between the marks", "run STEPS")
    for number, one in enumerate(deck.cycle):
        if one.name == "run" and "upto" in one.words:
            done = count_steps(deck.before + deck.cycle[:number])
            steps = int(one.word(1)) - done if done and one.word(1).isdecimal() else "STEPS"
            what = f"'{one.short}' runs up to a step: only the first cycle has so far to run"
            yield stop(one, what, f"run {steps}")


def count_steps(commands: Sequence[Command]) -> int:
    """Time steps that commands run from step 0; 0 where these are no plain numbers."""
    done = 0
    for one in commands:
        if one.name == "run":
            if not one.word(1).isdecimal():
                return 0
            done = int(one.word(1)) + (0 if "upto" in one.words else done)
    return done


def find_frozen_values(deck: Deck, engine: str) -> Iterator[Finding]:
    """``${v}`` and ``$(...)`` of the bed's state in a declaration: a window has another value."""
    variables = find_named(deck.before, "variable")
    for one in list_live(deck.before):
        for text in dict.fromkeys(one[0] for one in VALUE.finditer(one.text)):
            if part := find_state(text, variables):
                what = f"{text} in '{one.short}' comes of {part}, and is another number when a "
                what += "window starts"
                yield stop(one, what, f"the number itself, as this prints it: print {text}")


def find_state(formula: str, variables: dict[str, Command], depth: int = 0) -> str:
    """What of the bed's state a formula depends on; empty for none."""
    if part := STATE.search(VARIABLE.sub("", formula)):
        return part[0]
    names = {a or b or c for a, b, c in re.findall(rf"{VARIABLE.pattern}|\bv_(\w+)", formula)}
    inner = [one for name in names if (one := variables.get(name)) and depth <= len(variables)]
    found = (
        find_state(" ".join(one.words[3:]), variables, depth + 1)
        for one in inner if one.word(2) in ("equal", "atom")
    )  # fmt: skip
    return next(filter(None, found), "")


def find_lying_forces(deck: Deck, engine: str) -> Iterator[Finding]:
    """Forces of meshes that LIGGGHTS does not have where a run begins."""
    meshes = list_contents(deck).meshes if engine == "liggghts" else {}
    for one in (*list_live(deck.before), *deck.cycle):
        formula = " ".join(one.words[3:]) if one.name == "variable" else ""
        if read := set(re.findall(r"\bf_(\w+)\[", formula)) & meshes.keys():
            what = (
                f"f_{min(read)}[...] is 0 where a window begins and doubled where a further run "
                "begins: a motion that follows it takes a wrong step there"
            )
            yield note(one, what, "read the force a step earlier")


def find_patterns(deck: Deck, engine: str) -> Iterator[Finding]:
    """What `PATTERNS` have, and walls on a region that is gone, of which LAMMPS says something
    about an atom's callback."""
    standing, regions = list_live(deck.before), find_named(deck.before, "region")
    places = {
        "standing": standing, "live": [*standing, *deck.cycle], "before": deck.before,
        "cycle": deck.cycle, "both": deck.before + deck.cycle,
    }  # fmt: skip
    yield from match_patterns(PATTERNS, places)
    for one in standing:
        for word, region in zip(one.words[3:], one.words[4:], strict=False):
            gone = region not in regions and "$" not in region
            if (one.name, word) == ("fix", "region") and gone:
                what = f"fix {one.word(1)} needs the region {region}, gone where the cycle begins"
                yield stop(one, what, f"declare it above '{BEGIN}': region {region} ...")


def find_branches(deck: Deck, engine: str) -> Iterator[Finding]:
    """Commands in branches and loops, which a window can not follow."""
    labels = {one.word(1) for one in deck.cycle if one.name == "label"}
    for one in deck.cycle:
        if one.name == "jump" and one.word(2) not in labels:
            what = f"'{one.short}' leaves the cycle"
            yield stop(one, what, f"put '{END}' above this loop's next and jump")
    around = {one.word(1): n for n, one in enumerate(deck.before) if one.name == "label"}
    turned = {name for one in deck.commands if one.name == "next" for name in one.words[1:]}
    turned -= {one.word(1) for one in deck.cycle if one.name == "variable"}
    for one in deck.after:
        if one.name == "jump" and one.word(2) in around:
            what = f"the loop {one.word(2)} around the cycle is left out: trackbed counts cycles"
            yield note(one, what)
    used = (*list_live(deck.before), *deck.cycle)
    reads = {one: one.substituted() | {*re.findall(r"\bv_(\w+)", one.text)} for one in used}
    wanted = set[str]().union(*reads.values())  # what only made the bed is wanted no more
    earliest = {one.word(1): one for one in deck.cycle[::-1] if one.name == "variable"}
    for one, read in reads.items():
        idle = one.name == "variable" and one.word(1) not in wanted
        for name in sorted(turned & read) if not idle else ():
            what = f"${{{name}}} in '{one.short}' keeps its first value: no window repeats next"
            yield stop(one, what, "a cycle that is the same in each turn")
        if one in earliest.values() and one.word(1) in read:
            what = f"'{one.short}' goes on from cycle to cycle, and begins again in each window"
            yield stop(one, what, "a cycle that is the same in each turn")
    for number, one in enumerate(deck.before):
        for label in re.findall(r"\bjump SELF (\w+)", one.text):
            first, last = sorted((number, around.get(label, number)))
            for inner in list_live(deck.before):
                if inner in deck.before[first:last] and re.match(DECLARED, inner.text):
                    what = f"'{inner.short}' is made in a loop, or jumped over, by '{one.short}'"
                    yield stop(inner, what, "make it once, above or below")


def find_losses(deck: Deck, engine: str) -> Iterator[Finding]:
    """Settings with which results are overwritten, or not what they seem."""
    for one in (*list_live(deck.before), *deck.cycle):
        path = next((word for word in one.words[1:] if word.startswith("/")), "")
        if path and (one.name in OUTPUTS or one.word(3) in AVERAGES):
            what = f"{path} is written by each window over the last one's"
            yield note(one, what, "a relative name: each window has a folder of its own")
    yield from find_outside(one for one in deck.commands if one.name not in OUTPUTS)


def find_missing(deck: Deck, engine: str) -> Iterator[Finding]:
    """Beds and meshes that are read from files which are not there and no other command names."""
    readers = ("read_data", "fix")
    made = {word for one in deck.commands if one.name not in readers for word in one.words[1:]}
    for one in deck.commands:
        named = one.words[1:2] if one.name == "read_data" else []
        if one.name == "fix" and one.word(3).startswith("mesh/") and "file" in one.words[:-1]:
            named = [one.words[one.words.index("file") + 1]]
        for name in named:
            if "$" not in name and name not in made and not (deck.path.parent / name).exists():
                yield stop(one, f"there is no file {name}", "put it there, as seen from the deck")


RULES: Sequence[Callable[[Deck, str], Iterator[Finding]]] = (
    find_unfinished, find_absolute_runs, find_frozen_values, find_lying_forces, find_patterns,
    find_branches, find_losses, find_missing,
)  # fmt: skip
"""What is looked for."""


def add_lines(deck: Deck, findings: Sequence[Finding]) -> list[str]:
    """Lines of a marked deck with what was ``added``."""
    assert deck.marks is not None
    lines = list(deck.lines)
    for where, mark in zip(("end", "cycle"), reversed(deck.marks), strict=True):
        added = [one.remedy for one in findings if one.kind == "added" and one.above == where]
        lines[mark - 1 : mark - 1] = added
    return lines


def add_marks(deck: Deck) -> tuple[list[str], Finding]:
    """Lines of a deck with marks around its last run, and what is to be said of that.

    A script that runs nothing, as one for YADE's window, gets a run of `STEPS` at its end.
    """
    lines, runs = list(deck.lines), [one for one in deck.before if one.file == deck.path.name]
    runs = [one for one in runs if re.match(r"run |O\.run\(", one.plain)]
    remedy = "move them in the copy if your load cycle is another stretch of commands"
    if not runs:
        what = f"nothing is run at the top level: {STEPS} steps are put at the end as a cycle"
        added = [BEGIN, f"O.run({STEPS}, True)", END]
        return lines + added, Finding("added", "", what, remedy)
    run = runs[-1]
    lines[run.line - 1 : run.last] = [BEGIN, *lines[run.line - 1 : run.last], END]
    what = f"no load cycle is marked: the marks are put around the last run, '{run.short}'"
    return lines, Finding("added", run.place, what, remedy)
