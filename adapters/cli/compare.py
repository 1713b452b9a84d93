"""The verb ``compare``: two runs side by side, what was asked of them and what came out."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from adapters.cli.arguments import add_json, print_json
from adapters.errors import UsageError
from trackbed.run_files import MANIFEST, RESULT, SEAL, read_object, refuse_links
from trackbed.run_verbs import describe_run, find_kind, refuse_no_run

NO_RESULTS = ("run_folder", "next", "digests", SEAL)
"""What differs between any two runs and is no result."""


def register(verb: str, parser: argparse.ArgumentParser) -> None:
    """Arguments of ``compare``."""
    parser.add_argument("runs", nargs=2, metavar="RUN", type=Path, help="a run folder")
    add_json(parser)
    parser.set_defaults(command=run_compare)


def run_compare(arguments: argparse.Namespace) -> int:
    """Print the keys of two scenes and the numbers of two runs that differ."""
    kinds = []
    for path in arguments.runs:
        refuse_no_run(path)
        refuse_links(path)
        kinds.append(kind.verb if (kind := find_kind(path)) else "run")
    if kinds[0] != kinds[1]:
        raise UsageError(
            f"a {kinds[0]} run and a {kinds[1]} run have no numbers in common",
            where=" and ".join(map(str, arguments.runs)), remedy="compare two runs of one kind",
        )  # fmt: skip
    asked = list_unlike(*(read_scene(path) for path in arguments.runs))
    found = list_unlike(*(read_numbers(path) for path in arguments.runs))
    if arguments.json:
        print_json({"runs": [str(path) for path in arguments.runs], "scene": asked, "found": found})
        return 0
    for title, rows in (("scene", asked), ("found", found)):
        heads = f"{title:34} {'first':>14} {'second':>14} {'ratio':>8}"
        print(heads if rows else f"{title}: the same in both")
        for name, (one, other) in rows.items():
            numbers = all(type(value) in (int, float) for value in (one, other))
            ratio = f"{other / one:.4g}" if numbers and one else ""
            print(f"  {name:32} {show_value(one):>14} {show_value(other):>14} {ratio:>8}".rstrip())
    return 0


def read_scene(path: Path) -> dict[str, Any]:
    """The effective scene of a run, by dotted key."""
    return dict(list_leaves((read_object(path / MANIFEST) or {}).get("scene", {})))


def read_numbers(path: Path) -> dict[str, Any]:
    """What came out of a run, by dotted name: of a settlement run what ``status`` says, of another
    what its command has left; `UsageError` where it has left nothing yet."""
    if (kind := find_kind(path)) is not None and kind.states:
        result = read_object(path / RESULT)
        if result is None:
            remedy = f"first: {describe_run(path, kind)['next']}"
            raise UsageError("this run is not finished", where=str(path), remedy=remedy)
    else:
        from dataclasses import asdict

        from adapters.cli.run import read_record
        from adapters.procedure import judge_progress, make_plain

        result = make_plain(asdict(judge_progress(read_record(path))))
    return dict(list_leaves({name: one for name, one in result.items() if name not in NO_RESULTS}))


def list_leaves(content: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Values inside of tables and lists, by dotted name; the first of a list is 0."""
    if not isinstance(content, dict | list):
        yield name, content
        return
    for key, value in content.items() if isinstance(content, dict) else enumerate(content):
        yield from list_leaves(value, f"{name}.{key}" if name else str(key))


def list_unlike(one: dict[str, Any], other: dict[str, Any]) -> dict[str, tuple[Any, Any]]:
    """The values that differ in the first six digits, of either; None for what one has not."""
    pairs = {name: (one.get(name), other.get(name)) for name in {**one, **other}}
    return {name: pair for name, pair in pairs.items() if len({*map(show_value, pair)}) > 1}


def show_value(value: Any) -> str:
    """A value as it is printed."""
    return f"{value:.6g}" if isinstance(value, float) else str(value)
