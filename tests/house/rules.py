"""The rules of the house, each a function that lists its breaches with file, line and rule.

A room is a folder of a product package; its `__init__.py` names its public words.  The files at the
top of a package stand in no room: each of them is public.  Imports inside functions and those for
type checking alone count as well.
"""

from __future__ import annotations

import ast
import re
import tomllib
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

STORIES = ("adapters", "qdem_fem", "rigid_lcp", "track_line")
PRODUCT = ("trackbed", *STORIES)
DECKS = ("yade_scripts", "liggghts_inputs", "lammps_inputs")
VAGUE = {"utils", "util", "helpers", "helper", "common", "core", "manager", "misc", "tools"}
PRIVATE_WORDS = re.compile(
    r"\b(anew|foretold|made good|makes good|hardly rounded|[a-z_]*_told|told_[a-z_]*|told)\b"
)
"""Words of this project's builders that a native technical editor would not leave."""


VERBS = set(re.sub("#.*", "", Path(__file__).with_name("verbs.txt").read_text()).split())


@dataclass(frozen=True)
class Breach:
    """A place where a rule is broken."""

    file: str
    line: int
    rule: str
    what: str

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.rule}: {self.what}"


@dataclass(frozen=True)
class Import:
    """Names that a file imports from a module, or a module itself (no names)."""

    line: int
    module: str
    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class House:
    """A checkout, and what its files import."""

    root: Path

    @cached_property
    def budget(self) -> dict[str, dict[str, int]]:
        """The numbers of ``tests/house/budget.toml``."""
        return tomllib.loads((self.root / "tests" / "house" / "budget.toml").read_text())

    @cached_property
    def files(self) -> dict[str, str]:
        """Text of each Python file of the product by its path from the root."""
        return {
            path.relative_to(self.root).as_posix(): path.read_text(encoding="utf-8")
            for package in PRODUCT
            for path in sorted((self.root / package).rglob("*.py"))
        }

    @cached_property
    def trees(self) -> dict[str, ast.Module]:
        """Syntax tree of each Python file of the product."""
        return {file: ast.parse(text) for file, text in self.files.items()}

    @cached_property
    def modules(self) -> dict[str, str]:
        """File of each module of the product."""
        return {name_module(file): file for file in self.files}

    @cached_property
    def imports(self) -> dict[str, list[Import]]:
        """What each product file imports from the product."""
        return {
            file: [one for one in read_imports(tree, self.modules) if root_of(one) in PRODUCT]
            for file, tree in self.trees.items()
        }

    def arrows(self) -> Iterator[tuple[str, Import, str]]:
        """Each import as file, import, imported file; of a package's lazy `__init__.py` none."""
        for file, found in self.imports.items():
            if file.count("/") == 1 and file.endswith("/__init__.py"):
                continue
            for one in found:
                if one.module in self.modules:
                    yield file, one, self.modules[one.module]


def root_of(one: Import) -> str:
    """Top-level package of an import."""
    return one.module.partition(".")[0]


def name_module(file: str) -> str:
    """The module of a file."""
    return file.removesuffix(".py").removesuffix("/__init__").replace("/", ".")


def name_room(file: str) -> str:
    """The folder of a file; a file at the top of a package stands by itself."""
    return file.rpartition("/")[0] if file.count("/") > 1 else file


def read_imports(tree: ast.Module, modules: Mapping[str, Any]) -> Iterator[Import]:
    """All imports of a source; ``from a import b`` of a module b is an import of a.b."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                yield Import(node.lineno, alias.name)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            inside = [alias.name for alias in node.names]
            for name in inside:
                if f"{node.module}.{name}" in modules:
                    yield Import(node.lineno, f"{node.module}.{name}")
            names = tuple(name for name in inside if f"{node.module}.{name}" not in modules)
            if names:
                yield Import(node.lineno, node.module, names)
        elif isinstance(node, ast.Call) and is_named(node.func, "import_module"):
            for word in node.args:
                if isinstance(word, ast.Constant) and isinstance(word.value, str):
                    yield Import(node.lineno, word.value)


def is_named(node: ast.expr, name: str) -> bool:
    """Whether an expression is a name, or ends with it after a dot."""
    return name in (getattr(node, "id", ""), getattr(node, "attr", ""))


def find_circles(graph: Mapping[str, set[str]]) -> list[list[str]]:
    """Groups of nodes that reach one another (strongly connected, Tarjan 1972), sorted."""
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    circles = []

    def visit(node: str) -> None:
        order[node] = low[node] = len(order)
        stack.append(node)
        for other in sorted(graph.get(node, ())):
            if other not in order:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], order[other])
        if low[node] == order[node]:
            at = stack.index(node)
            group = stack[at:]
            del stack[at:]
            if len(group) > 1:
                circles.append(sorted(group))

    for node in sorted(graph):
        if node not in order:
            visit(node)
    return circles


def check_rooms(house: House) -> Iterator[Breach]:
    """Rule 1: size of rooms and files, and names of files."""
    bounds, rule = house.budget["room"], "rule 1"
    entries: dict[str, set[str]] = defaultdict(set)
    lines: dict[str, int] = defaultdict(int)
    for file, text in house.files.items():
        room, _, name = file.rpartition("/")
        count = len(text.splitlines())
        lines[room] += count
        entries[room] |= {
            path.name for path in (house.root / room).iterdir() if path.suffix not in {"", ".pyc"}
        }
        while "/" in room:
            room, _, name = room.rpartition("/")
            entries[room].add(name)
        if count > bounds["most_lines_of_a_file"]:
            yield Breach(file, count, rule, f"more than {bounds['most_lines_of_a_file']} lines")
        folder, stem = file.split("/")[-2], file.split("/")[-1].removesuffix(".py")
        if stem.split("_")[0] in {folder, folder.removesuffix("s")}:
            yield Breach(file, 1, rule, "a file does not repeat its folder's name")
        if {stem, folder} & VAGUE:
            yield Breach(file, 1, rule, "named after nothing")
    for room, inside in entries.items():
        if not bounds["fewest_entries"] <= len(inside) <= bounds["most_entries"]:
            yield Breach(room, 1, rule, f"{len(inside)} files and rooms in a room")
        if lines[room] > bounds["most_lines"]:
            yield Breach(room, 1, rule, f"{lines[room]} lines in a room")


def check_circles(house: House) -> Iterator[Breach]:
    """Rule 2: files form no circle of imports, and neither do rooms."""
    files: dict[str, set[str]] = defaultdict(set)
    rooms: dict[str, set[str]] = defaultdict(set)
    lines: dict[tuple[str, str], tuple[str, int]] = {}
    for file, one, other in house.arrows():
        if file != other:
            files[file].add(other)
        here, there = name_room(file), name_room(other)
        if here != there:
            rooms[here].add(there)
            lines.setdefault((here, there), (file, one.line))
    for circle in find_circles(files):
        yield Breach(circle[0], 1, "rule 2", f"files import in a circle: {', '.join(circle)}")
    for circle in find_circles(rooms):
        for here in circle:
            for there in sorted(rooms[here] & set(circle)):
                file, line = lines[here, there]
                yield Breach(file, line, "rule 2", f"rooms in a circle: {here} -> {there}")


def check_public_words(house: House) -> Iterator[Breach]:
    """Rule 3: a room says what it is for, and others import only its public words."""
    for file, tree in house.trees.items():
        if file.endswith("/__init__.py") and not ast.get_docstring(tree):
            yield Breach(file, 1, "rule 3", "does not say what the room is for")
    for file, one, other in house.arrows():
        room = name_room(other)
        if room == other or room == name_room(file):
            continue
        inside = one.module.rpartition(".")[2]
        init = house.trees.get(f"{room}/__init__.py")
        if not one.names and init is not None and inside in read_public_words(init):
            continue
        if not other.endswith("/__init__.py"):
            yield Breach(file, one.line, "rule 3", f"{one.module} is inside the room {room}")
            continue
        public = read_public_words(house.trees[other])
        for name in one.names:
            if name not in public:
                yield Breach(file, one.line, "rule 3", f"{name} is no public word of {room}")


def read_public_words(tree: ast.Module) -> set[str]:
    """The names in ``__all__`` of a source."""
    for node in tree.body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return set(ast.literal_eval(node.value))
    return set()


def check_floor(house: House) -> Iterator[Breach]:
    """Rule 4: the floor imports no story, no story another, and none of them studies or tests."""
    for file, tree in house.trees.items():
        package = file.partition("/")[0]
        strangers = {*STORIES, "validation", "tests"} - {package}
        for one in read_imports(tree, {}):
            if root_of(one) in strangers:
                yield Breach(file, one.line, "rule 4", f"{package} imports {one.module}")


def check_studies(house: House) -> Iterator[Breach]:
    """Rule 5: no test but those of the studies reads a study or its record."""
    for path in sorted((house.root / "tests").rglob("*.py")):
        file = path.relative_to(house.root).as_posix()
        if file.startswith(("tests/studies/", "tests/house/")):
            continue
        text = path.read_text(encoding="utf-8")
        tree = ast.parse(text) if "validation.studies" in text else ast.Module([], [])
        for one in read_imports(tree, {}):
            if one.module.startswith("validation.studies."):
                yield Breach(file, one.line, "rule 5", f"imports {one.module}")
        for number, line in enumerate(text.splitlines(), 1):
            if re.search(r"validation/studies/\w+/record|validation/results|\"results\"\s*/", line):
                yield Breach(file, number, "rule 5", "reads a study's record")


def check_constants(house: House) -> Iterator[Breach]:
    """Rule 6: a constant has one home: no name stands for a number in two files of a package."""
    homes: dict[tuple[str, str], list[tuple[str, int]]] = defaultdict(list)
    for file, tree in house.trees.items():
        for node in tree.body:
            if isinstance(node, ast.Assign) and is_number(node.value):
                for target in node.targets:
                    if isinstance(target, ast.Name) and target.id.isupper():
                        homes[file.partition("/")[0], target.id].append((file, node.lineno))
    for (_, name), places in homes.items():
        for file, line in places[1:]:
            yield Breach(file, line, "rule 6", f"{name} has a home in {places[0][0]} already")


def is_number(node: ast.expr) -> bool:
    """Whether an expression is made of numbers alone."""
    inside = [one for one in ast.walk(node) if isinstance(one, ast.Constant)]
    return (
        bool(inside)
        and all(type(one.value) in (int, float) for one in inside)
        and not any(isinstance(one, ast.Name | ast.Call) for one in ast.walk(node))
    )


def weigh(house: House) -> dict[str, tuple[int, int]]:
    """Rule 7: what each part weighs, and what it may."""
    root, budget = house.root, house.budget

    def lines(*folders: str) -> int:
        paths = (path for folder in folders for path in (root / folder).rglob("*.py"))
        return sum(len(path.read_bytes().splitlines()) for path in paths)

    records = sum(
        path.stat().st_size
        for ending in ("jsonl", "json", "csv", "npz", "xz")
        for path in (root / "validation").rglob(f"*.{ending}")
    )
    pages = [
        *(root / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md")),
        *(root / "docs").rglob("*.md"),
        *(root / "validation").rglob("*.md"),
    ]
    words = sum(len(path.read_text(encoding="utf-8").split()) for path in pages)
    return {
        "lines of the product": (lines(*PRODUCT, *DECKS), budget["lines"]["product"]),
        "lines of tests": (lines("tests"), budget["lines"]["tests"]),
        "lines of validation": (lines("validation"), budget["lines"]["validation"]),
        "bytes of records": (records, budget["bytes"]["records"]),
        "words of prose": (words, budget["words"]["prose"]),
    }


def check_words(house: House) -> Iterator[Breach]:
    """Plain English: none of the builders' private words in names, messages and docstrings."""
    for file, text in house.files.items():
        for number, line in enumerate(text.splitlines(), 1):
            if found := PRIVATE_WORDS.search(line):
                yield Breach(file, number, "plain words", f"{found[0]!r}")


def check_verbs(house: House) -> Iterator[Breach]:
    """A function of a module begins with a verb of ``verbs.txt``."""
    for file, tree in house.trees.items():
        for node in (one for one in tree.body if isinstance(one, ast.FunctionDef)):
            word = node.name.lstrip("_").split("_")[0]
            if word not in VERBS and not node.name.startswith("__"):
                yield Breach(file, node.lineno, "verbs", f"{node.name} begins with no verb")


def check_references(house: House) -> Iterator[Breach]:
    """What a docstring of the product refers to, as in `House`, has that name somewhere in it."""
    known = set(re.findall(r"\w+", " ".join(house.modules.values())))
    texts: list[tuple[str, int, str]] = []
    for file, tree in house.trees.items():
        for node in ast.walk(tree):
            known.update(value for _, value in ast.iter_fields(node) if isinstance(value, str))
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
                texts.append((file, node.lineno, str(node.value.value)))
    page = house.root / "docs" / "equations.md"
    for number, row in enumerate(page.read_text().splitlines() if page.exists() else (), 1):
        texts.append(("docs/equations.md", number, re.sub(r"`\S*[/-]\S*`|`\w+\.py`", "", row)))
        for path in re.findall(r"`(\w+/[\w/.]+)`", row):
            if not (house.root / path).exists():
                yield Breach("docs/equations.md", number, "references", f"there is no {path}")
    for file, line, text in texts:
        for name in re.findall(r"(?<!`)`([A-Za-z_][\w.]*)`(?!`)", text):
            if name.split(".")[-1] not in known and not name.startswith(("scipy.", "skfem.")):
                yield Breach(file, line, "references", f"there is no {name}")


def check_readme(house: House) -> Iterator[Breach]:
    """README is short, blocks of code aside, and so is each of its sentences and cells."""
    page, budget = house.root / "README.md", house.budget["readme"]
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)
    if (words := len(text.split())) > budget["words"]:
        yield Breach(page.name, 1, "readme", f"{words} words of {budget['words']}")
    for sentence in re.split(r"[.?!]\s|\n\n|\n[-#]|\|", text):
        if len(sentence.split()) > budget["words_of_a_sentence"]:
            yield Breach(page.name, 1, "readme", f"a long sentence: {sentence.strip()}")


RULES = (
    check_rooms, check_circles, check_public_words, check_floor, check_studies, check_constants,
    check_verbs, check_references, check_words, check_readme,
)  # fmt: skip
