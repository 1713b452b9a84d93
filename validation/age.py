"""Which parts of a study's record are older than the code that they measure.

A study names that code in ``ROOMS`` of its ``__init__.py``, as ``"adapters: bed laws.fit"``, with
semicolons between stories.  A row keeps a digest of each room (or module) as it was when the row
was measured; docstrings, comments, layout and ways to import a name are in no digest.  A study that
runs engines names `tests.golden.digests` for all that writes their decks: a new feature does not
age it, another byte in the deck of an older scene does.  ``older.toml`` lists studies that cannot
be measured again now, and why.
"""

from __future__ import annotations

import ast
import hashlib
import tomllib
from collections.abc import Iterable, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from types import MappingProxyType
from typing import Any

ROOT = Path(__file__).parents[1]


def list_content(node: object, names: Mapping[str, str] = MappingProxyType({})) -> object:
    """What runs of a syntax tree, as nested lists; the same for every version of Python.

    ``names``: what imported names stand for, so that ``from a import b`` and ``a.b`` are alike.
    """
    if isinstance(node, list):
        return [list_content(one, names) for one in node if not is_no_code(one)]
    if not isinstance(node, ast.AST):
        return repr(node)
    if whole := find_whole_name(node, names):
        return ["Name", whole]
    fields = [
        [name, list_content(value, names)]
        for name, value in ast.iter_fields(node)
        if value not in (None, [])
    ]
    return [type(node).__name__, *fields]


def find_whole_name(node: ast.AST, names: Mapping[str, str]) -> str:
    """``a.b.c`` of a name, or of attributes of a name, that was imported; else empty."""
    if isinstance(node, ast.Name):
        return names.get(node.id, "")
    if isinstance(node, ast.Attribute) and (whole := find_whole_name(node.value, names)):
        return f"{whole}.{node.attr}"
    return ""


def list_imports(tree: ast.AST) -> dict[str, str]:
    """What each name that a file imports stands for."""
    found: dict[str, str] = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            found |= {one.asname or one.name: f"{node.module}.{one.name}" for one in node.names}
        elif isinstance(node, ast.Import):
            found |= {one.asname: one.name for one in node.names if one.asname}
    return found


def is_no_code(node: object) -> bool:
    """Whether a statement is a string alone, or an import."""
    return isinstance(node, (ast.Import, ast.ImportFrom)) or (
        isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    )


@cache
def digest_room(room: str) -> str:
    """Twelve digits that change with the code of a package, rooms inside counted, or a module."""
    path = ROOT.joinpath(*room.split("."))
    files = sorted(path.rglob("*.py")) if path.is_dir() else [path.with_suffix(".py")]
    trees = [ast.parse(file.read_text(encoding="utf-8")) for file in files]
    content = [list_content(tree, list_imports(tree)) for tree in trees]
    return hashlib.sha256(repr(content).encode()).hexdigest()[:12]


def digest_rooms(name: str) -> dict[str, str]:
    """Digest of each room that the study ``name`` measures."""
    study = import_module(f"validation.studies.{name.replace('-', '_')}")
    stories = (rooms.split(": ") for rooms in study.ROOMS.split("; "))
    names = [f"{story}.{room}" for story, rooms in stories for room in rooms.split()]
    return {one: digest_room(one) for one in names}


def describe_age(name: str, rows: Iterable[Mapping[str, Any]]) -> str:
    """Which rows are older than which rooms, a line for each set of rooms; empty if none is."""
    now = digest_rooms(name)
    older: dict[str, list[str]] = {}
    for row in rows:
        known = row.get("code", {})
        changed = ", ".join(room for room in now if known.get(room) != now[room])
        older.setdefault(changed, []).append(row["part"])
    return "\n".join(
        f"{name}: older than {rooms}: {', '.join(parts[:5])}"
        + (f" and {len(parts) - 5} more parts" if len(parts) > 5 else "")
        for rooms, parts in older.items()
        if rooms
    )


def list_excuses() -> dict[str, str]:
    """Studies that cannot be measured again now, and why."""
    text = Path(__file__).with_name("older.toml").read_text(encoding="utf-8")
    excuses: dict[str, str] = tomllib.loads(text)
    return excuses


def excuse_page(name: str, page: str) -> str:
    """A page that says below its title why it is older than its code, where that is known."""
    if (excuse := list_excuses().get(name)) is None:
        return page
    title, _, rest = page.partition("\n")
    return f"{title}\n\n**Older than the code that it measures**: {excuse}\n{rest}"
