"""Where the keys of a scene file stand: line numbers by dotted key."""

import tomllib
from collections.abc import Iterator
from typing import Any


def find_key_lines(text: str) -> dict[str, int]:
    """Line number of every table and key of a valid TOML text, by dotted key.

    Statement by statement through the TOML reader itself, which knows about quotes, comments,
    inline tables and values of many lines.
    """
    lines: dict[str, int] = {}
    table: tuple[str, ...] = ()
    entries: dict[tuple[str, ...], int] = {}
    statement: list[str] = []
    for number, line in enumerate(text.split("\n"), 1):
        statement.append(line)
        if len(statement) > 1 and line.endswith(",") and "#" not in line:
            continue  # inside a long array: spares trying it at every line
        try:
            parsed = tomllib.loads("\n".join(statement))
        except (ValueError, RecursionError):
            continue
        first = number - len(statement) + 1
        start = statement[0].lstrip()
        statement = []
        if start.startswith("["):
            names = _read_header(parsed)
            if start.startswith("[["):
                outer = _number_entries(names[:-1], entries) + names[-1:]
                lines.setdefault(".".join(outer), first)
                entries[outer] = entries.get(outer, -1) + 1
            table, parsed = _number_entries(names, entries), {}
            lines.setdefault(".".join(table), first)
        for inner in _list_paths(parsed):
            lines.setdefault(".".join(table + inner), first)
    return lines


def _read_header(parsed: Any) -> tuple[str, ...]:
    """Names in a table's header, from what the TOML reader makes of it."""
    names = []
    while parsed:
        if isinstance(parsed, list):
            parsed = parsed[0]
        else:
            name, parsed = next(iter(parsed.items()))
            names.append(str(name))
    return tuple(names)


def _number_entries(names: tuple[str, ...], entries: dict[tuple[str, ...], int]) -> tuple[str, ...]:
    """Names of a table with the number of the entry behind each list of tables."""
    path: tuple[str, ...] = ()
    for name in names:
        path += (name,)
        if path in entries:
            path += (str(entries[path]),)
    return path


def _list_paths(value: Any) -> Iterator[tuple[str, ...]]:
    pairs = value.items() if isinstance(value, dict) else enumerate(value)
    for key, inner in pairs:
        if isinstance(value, dict) or isinstance(inner, dict):
            yield (str(key),)
        if isinstance(inner, dict | list):
            yield from ((str(key), *path) for path in _list_paths(inner))
