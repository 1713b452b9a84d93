"""A script of YADE as its statements, cut at the two marks around its user's load cycle.

It is run by ``yade_scripts/adopted.py``: a window executes the imports and definitions above the
cycle, loads the saved scene with the values of the variables, and repeats the statements between
the marks.  So a script needs no more marks than a deck of another engine.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from adapters.decks.findings import Contents, Finding, note, stop
from adapters.decks.parse import BEGIN, END, Command, Deck, find_marks, is_outside, read_lines
from adapters.errors import UsageError

STEPS = 1000
"""Time steps of the cycle that is put at the end of a script that runs none: a guess, and said."""


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
                found.append(one.value)
            elif isinstance(one, ast.Import):
                found += [f"{name.name}.py" for name in one.names]
            elif isinstance(one, ast.ImportFrom):
                found.append(f"{one.module}.py")
        return tuple(found)

    def calls(self, *names: str) -> list[ast.Call]:
        """Calls in it of functions or methods of these names, such as ``O.run``."""
        calls = (one for one in ast.walk(self.node) if isinstance(one, ast.Call))
        return [one for one in calls if ast.unparse(one.func) in names]


def read_script(path: Path, lines: Sequence[str] | None = None) -> Deck:
    """Read a script; ``lines``: what is to stand in the file instead of what does.

    Raises `UsageError` for a file that can not be read, that is no Python, and for marks that are
    not one pair at the top level.
    """
    lines = read_lines(path) if lines is None else lines
    marks = find_marks(path, lines)
    first, last = marks or (len(lines) + 1, len(lines) + 1)
    before, cycle, after = list[Command](), list[Command](), list[Command]()
    try:
        nodes = ast.parse("\n".join(lines), path.name).body
    except (SyntaxError, ValueError) as error:
        raise UsageError(f"this is no script of YADE: {error}", where=str(path)) from error
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


def list_statements(commands: Sequence[Command]) -> list[Statement]:
    """Commands of a script as what they are."""
    return [one for one in commands if isinstance(one, Statement)]


def list_script_contents(deck: Deck) -> Contents:
    """Clumps, variables that may hold a body, and of these what is given a velocity."""
    bodies, moved = dict[str, str](), dict[str, str]()
    nodes = [n for one in list_statements(deck.commands) for n in ast.walk(one.node)]
    for one in nodes:
        if isinstance(one, ast.Assign) and "bodies" in ast.unparse(one.value):
            bodies |= {target.id: "body" for target in one.targets if isinstance(target, ast.Name)}
        if isinstance(one, ast.Attribute) and isinstance(one.ctx, ast.Store):
            body, _, of = ast.unparse(one).partition(".")
            moved |= {body: "its velocity"} if of.startswith("state.vel") else {}
    clumped = any(isinstance(one, ast.Attribute) and "lump" in one.attr for one in nodes)
    moved = {name: how for name, how in moved.items() if name in bodies}
    return Contents((), ("clumps",) if clumped else (), bodies, moved)


def find_script_obstacles(deck: Deck) -> Iterator[Finding]:
    """What stands in the way of cutting a script, each as a sentence with the line to add."""
    statements, cycle = list_statements(deck.commands), list_statements(deck.cycle)
    pauses = any(one.calls("O.pause") for one in statements)
    if not any(one.calls("O.run", "O.step") for one in cycle):
        yield Finding("stops", "", "nothing is run between the marks", "O.run(STEPS, True)")
    for one in cycle:
        for call in one.calls("O.run"):
            if not (call.args or call.keywords) and not pauses:
                yield stop(one, f"'{one.short}' never ends", "O.run(STEPS, True)")
        for call in one.calls("O.reset", "O.load", "O.reload", "O.loadTmp", "O.bodies.clear"):
            what = f"'{ast.unparse(call)}' inside the cycle begins another bed"
            yield stop(one, what, f"put it above '{BEGIN}'")
        if "O.forces.f(" in one.text or "O.forces.t(" in one.text:
            yield note(one, "forces are 0 where a window begins", "read them behind an O.run")
    for one in statements:
        if one not in cycle and one.calls("O.forces.setPermF", "O.forces.setPermT"):
            yield stop(one, "permanent forces are in no saved scene", f"put it below '{BEGIN}'")
        for call in (n for n in ast.walk(one.node) if isinstance(n, ast.Call)):
            keys = {key.arg: key.value for key in call.keywords}
            if "realPeriod" in keys:
                what = f"'{ast.unparse(call)}' waits for seconds of the clock, in no two runs alike"
                yield stop(one, what, f"line {call.lineno}: iterPeriod=STEPS")
            pull = keys.get("gravity")
            if isinstance(pull, (ast.Tuple, ast.List)) and any(
                ast.unparse(x).strip("-0.") for x in pull.elts[:2]
            ):
                yield stop(one, "gravity is not along -z, where settlement is", "turn the script")
        for word in one.words[1:]:
            if is_outside(word) and len(Path(word).parts) > 2:
                what = f"{word} lies outside of the folder of the script, and is not carried along"
                yield stop(one, what, "put it beside the script, and name it so")


def add_script_marks(deck: Deck) -> tuple[list[str], Finding]:
    """Lines of a script with marks around its last run, and what is to be said of that.

    A script that runs nothing, as one for YADE's window, gets a run of `STEPS` at its end.
    """
    lines = list(deck.lines)
    runs = [one for one in list_statements(deck.before) if one.calls("O.run")]
    runs = [one for one in runs if isinstance(one.node, ast.Expr)]
    remedy = "move them in the copy if your load cycle is another stretch of statements"
    if not runs:
        what = f"nothing is run at the top level: {STEPS} steps are put at the end as a cycle"
        return [*lines, BEGIN, f"O.run({STEPS}, True)", END], Finding("added", "", what, remedy)
    run = runs[-1]
    lines[run.line - 1 : run.last] = [BEGIN, *lines[run.line - 1 : run.last], END]
    what = f"no load cycle is marked: the marks are put around the last run, '{run.short}'"
    return lines, Finding("added", run.place, what, remedy)
