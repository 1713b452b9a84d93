"""The record of the validation of QDEM: a line a part, tables beside it, the code behind each.

A part is computed once and its line kept as long as the code behind it stays the same.  That code
is the part's module with all that it imports of QDEM and its judge, as syntax trees: comments,
docstrings and layout may change.  A part made by other code is shown and said to be so.
"""

from __future__ import annotations

import ast
import csv
import hashlib
import io
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from validation.case import Check

ROOT = Path(__file__).parents[1]
RECORD = ROOT / "validation" / "results" / "qdem.jsonl"
PREFIXES = ("qdem_fem", "validation.qdem_")
"""Modules that figures may depend on."""
WITHOUT_SAY = {
    "qdem_fem.checkpoint",
    "qdem_fem.errors",
    "qdem_fem.mesh_checks",
    "qdem_fem.mesh_sources",
    "validation.qdem_record",
}
"""Those that say how things are told or kept, and change no figure."""
Table = Mapping[str, ArrayLike]
"""Columns of equal length by name, ``"time [s]"``; numbers or words."""


@dataclass(frozen=True)
class Outcome:
    """What a part of the validation found."""

    checks: list[Check]
    tables: dict[str, Table] = field(default_factory=dict)
    """What is drawn, by name: written to ``qdem.NAME.csv`` beside the record."""


# --- lines ------------------------------------------------------------------------------------


def record_lines(path: Path = RECORD) -> list[dict[str, Any]]:
    """The parts recorded so far."""
    if not path.exists():
        return []
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def line_of(part: str, path: Path = RECORD) -> dict[str, Any] | None:
    """The line of a part, or None."""
    return next((line for line in record_lines(path) if line["part"] == part), None)


def line_write(line: dict[str, Any], order: Iterable[str], path: Path = RECORD) -> None:
    """Put a part's line in the place of its earlier one; parts in the given order."""
    lines = {each["part"]: each for each in [*record_lines(path), line]}
    names = [name for name in order if name in lines]
    names += [name for name in lines if name not in names]
    text = "".join(json.dumps(lines[name], allow_nan=False) + "\n" for name in names)
    write_atomically(path, text)


def checks_of(line: dict[str, Any]) -> list[Check]:
    """The checks of a line; a value that was no finite number is NaN."""
    return [
        Check(**(check | {"value": np.nan if check["value"] is None else check["value"]}))
        for check in line["checks"]
    ]


def write_atomically(path: Path, text: str) -> None:
    """Write a file, whole or not at all."""
    temporary = path.with_name(path.name + ".partial")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(path)


# --- tables -----------------------------------------------------------------------------------


def table_path(name: str, path: Path = RECORD) -> Path:
    """Where the table of a name lies, beside the record."""
    return path.with_name(f"{path.stem}.{name}.csv")


def table_write(name: str, table: Table, path: Path = RECORD) -> None:
    """Write a table with nine digits."""
    columns = [np.asarray(column) for column in table.values()]
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(table)
    for row in zip(*columns, strict=True):
        writer.writerow([_cell(value) for value in row])
    write_atomically(table_path(name, path), stream.getvalue())


def table_read(name: str, path: Path = RECORD) -> dict[str, NDArray[Any]]:
    """The columns of a table: numbers where all are numbers, else words."""
    with table_path(name, path).open(encoding="utf-8") as stream:
        head, *rows = list(csv.reader(stream))
    return {
        title: _column(values) for title, values in zip(head, zip(*rows, strict=True), strict=True)
    }


def _cell(value: Any) -> str:
    return f"{value:.9g}" if isinstance(value, (int, float, np.number)) else str(value)


def _column(cells: tuple[str, ...]) -> NDArray[Any]:
    try:
        return np.array([float(cell) for cell in cells])
    except ValueError:
        return np.array(cells)


# --- the code behind a part -------------------------------------------------------------------


def code_digest(module: str) -> str:
    """Digest of a module and of all it imports that may have a say in its figures."""
    digest = hashlib.sha256()
    for name in sorted(modules_behind(module)):
        digest.update(f"{name}\0{_statements(_source(name))}\0".encode())
    return digest.hexdigest()[:16]


def modules_behind(module: str) -> set[str]:
    """``module`` and, over all steps, what it imports at its head of `PREFIXES`."""
    found: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name not in found and name not in WITHOUT_SAY and _source(name) is not None:
            found.add(name)
            waiting += [other for other in _imported(_source(name)) if other.startswith(PREFIXES)]
    return found


def _source(module: str) -> Path | None:
    """File of a module of this checkout, None for a name that is none."""
    path = ROOT.joinpath(*module.split("."))
    files = (path.with_suffix(".py"), path / "__init__.py")
    return next((file for file in files if file.exists()), None)


@cache
def _imported(file: Path | None) -> set[str]:
    """Names after ``import`` at the head of a file, those of modules among them."""
    names = set()
    tree = _tree(file).body
    # what stands under ``if TYPE_CHECKING`` is loaded later, on use
    later = [inner for outer in tree if isinstance(outer, ast.If) for inner in outer.body]
    for statement in [*tree, *later]:
        if isinstance(statement, ast.ImportFrom) and statement.module:
            names |= {f"{statement.module}.{alias.name}" for alias in statement.names}
            names.add(statement.module)
        elif isinstance(statement, ast.Import):
            names |= {alias.name for alias in statement.names}
    return names


@cache
def _statements(file: Path | None) -> str:
    """The source without comments, docstrings and other bare strings."""
    tree = _tree(file)
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [each for each in body if not _is_words(each)] or [ast.Pass()]  # type: ignore[attr-defined]
    return ast.unparse(tree)


def _is_words(statement: ast.stmt) -> bool:
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


def _tree(file: Path | None) -> ast.Module:
    return ast.parse("" if file is None else file.read_text(encoding="utf-8"))
