"""A script of YADE as its statements, cut at the two marks around its user's load cycle.

It is run by ``yade_scripts/adopted.py``: a window executes the imports and definitions above the
cycle, loads the saved scene with the values of the variables, and repeats the statements between
the marks.  So a script needs no more marks than a deck of another engine.
"""

import ast
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from adapters.decks import parse
from adapters.decks.findings import Contents, Finding, find_outside, match_patterns, stop
from adapters.decks.parse import BEGIN, Command, Deck
from adapters.errors import UsageError

ENDING = "scripts of YADE, and no other decks, end with .py"


@dataclass(frozen=True)
class Statement(Command):
    """One statement at the top level of a script."""

    node: ast.stmt

    @cached_property
    def words(self) -> tuple[str, ...]:
        """Its kind, then the texts in it and the files of modules that it imports."""
        found = [type(self.node).__name__]
        for one in ast.walk(self.node):
            if isinstance(one, ast.Constant) and isinstance(one.value, str):
                found += [one.value] if one.value.isprintable() else []  # else it names no file
            elif isinstance(one, ast.Import | ast.ImportFrom):
                names = (getattr(one, "module", None), *(name.name for name in one.names))
                found += [f"{name}.py" for name in names if name]
        return tuple(found)

    @cached_property
    def plain(self) -> str:
        """Its text on as few lines as can be."""
        return ast.unparse(self.node)


def read_marked(path: Path, lines: Sequence[str] | None = None) -> Deck:
    """Read a script or, by its name, a deck; raises as `read_deck` and `read_script`."""
    return (read_script if path.suffix == ".py" else parse.read_deck)(path, lines)


def read_script(path: Path, lines: Sequence[str] | None = None) -> Deck:
    """Read a script; ``lines``: what is to stand in the file instead of what does.

    Raises `UsageError` for a file that can not be read, that is no Python, and for marks that are
    not one pair at the top level.
    """
    lines = parse.read_lines(path) if lines is None else lines
    marks = parse.find_marks(path, lines)
    first, last = marks or (len(lines) + 1, len(lines) + 1)
    before, cycle, after = list[Command](), list[Command](), list[Command]()
    try:
        nodes = ast.parse("\n".join(lines), path.name).body
    except (SyntaxError, ValueError) as error:
        what = "it is not in UTF-8" if isinstance(error, UnicodeError) else error
        raise UsageError(f"this is no script of YADE: {what}", where=str(path)) from error
    for node in nodes:
        end = node.end_lineno or node.lineno
        if any(node.lineno < mark <= end for mark in marks or ()):
            raise UsageError(
                "a mark stands inside of a loop, branch or function", remedy="put both around the "
                "statements of one cycle, not indented: trackbed repeats them",
                where=f"{path.name}, line {node.lineno}",
            )  # fmt: skip
        part = before if node.lineno < first else cycle if node.lineno < last else after
        text = "\n".join(lines[node.lineno - 1 : end])
        part.append(Statement(text, path.name, node.lineno, end, node))
    return Deck(path, tuple(lines), tuple(before), tuple(cycle), tuple(after), marks)


def format_script(deck: Deck, kind: str, cycles: int, loaded: str) -> str:
    """The script that runs a stage of a marked script: prepare, window or whole by ``kind``."""
    words = f"{kind!r}, {deck.path.name!r}, {deck.marks}, {cycles}, {loaded!r}, globals()"
    return (
        f"# generated from {deck.path.name!a}\nimport os\nimport sys\n\n"
        "sys.path.insert(0, os.getcwd())\nfrom yade_scripts import adopted\n\n"
        f"adopted.run({words})\n"
    )


def list_script_contents(deck: Deck) -> Contents:
    """Clumps, variables that may hold a body, and of these what is given a velocity."""
    bodies, moved = dict[str, str](), dict[str, str]()
    nodes = [*ast.walk(ast.parse("\n".join(deck.lines)))]
    for one in nodes:
        if isinstance(one, ast.Assign) and "bodies" in ast.unparse(one.value):
            bodies |= {target.id: "body" for target in one.targets if isinstance(target, ast.Name)}
        if isinstance(one, ast.Attribute) and isinstance(one.ctx, ast.Store):
            body, _, of = ast.unparse(one).partition(".")
            moved |= {body: "its velocity"} if of.startswith("state.vel") else {}
    clumped = any(isinstance(one, ast.Attribute) and "lump" in one.attr for one in nodes)
    moved = {name: how for name, how in moved.items() if name in bodies}
    return Contents((), ("clumps",) if clumped else (), bodies, moved)


PATTERNS = (
    ("cycle", r"(?s).*\bO\.(?:reset|load|reload|loadTmp|bodies\.clear)\(", "stops",
     "'{all}' inside the cycle begins another bed", f"put it above '{BEGIN}'"),
    ("cycle", r"(?s).*\bO\.forces\.[ft]\(", "note", "forces are 0 where a window begins",
     "read them behind an O.run"),
    ("before", r"(?s).*\bO\.forces\.setPerm[FT]\(", "stops",
     "permanent forces are in no saved scene", f"put it below '{BEGIN}'"),
    ("both", r"(?s).*\b(realPeriod=[^,)]+)", "stops",
     "{0} waits for seconds of the clock, which are in no two runs alike", "iterPeriod=STEPS"),
    ("both", r"(?s).*\bgravity=[\[(](?=[-\d.])(?![-0.]+, [-0.]+,)", "stops",
     "gravity is not along -z, where settlement is", "turn the script"),
)  # fmt: skip
"""As `adapters.decks.detect.PATTERNS`."""


def find_script_obstacles(deck: Deck) -> Iterator[Finding]:
    """What stands in the way of cutting a script, each as a sentence with the line to add."""
    yield from match_patterns(PATTERNS, {
        "before": deck.before, "cycle": deck.cycle, "both": deck.before + deck.cycle,
    })  # fmt: skip
    if not any(re.search(r"\bO\.(run|step)\(", one.plain) for one in deck.cycle):
        yield Finding("stops", "", "nothing is run between the marks", "O.run(STEPS, True)")
    paused = any("O.pause(" in one.plain for one in deck.commands)
    for one in deck.cycle if not paused else ():
        if "O.run()" in one.plain:
            yield stop(one, f"'{one.short}' never ends", "O.run(STEPS, True)")
    yield from find_outside(deck.commands)
