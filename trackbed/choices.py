"""Choices that are one file each of a folder: a law, a move, an engine, found by being there.

A file is a choice when it sets the folder's word (``LAW``, ``MOVE``, ``ENGINE``) at its top level;
users write its name with hyphens.  Names are read without importing the files.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from difflib import get_close_matches
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from trackbed.errors import UsageError

RETIRED_AFTER = "0.1"
"""The last version of trackbed that has the ways which only studies used."""


@cache
def find_choices(neighbour: str, word: str) -> Mapping[str, str]:
    """Name -> module of every choice in the folder of the module ``neighbour``, sorted by name."""
    spec = find_spec(neighbour)
    assert spec is not None
    assert spec.origin is not None
    package = neighbour if spec.submodule_search_locations else neighbour.rpartition(".")[0]
    found = {}
    for path in Path(spec.origin).parent.glob("*.py"):
        if re.search(rf"^{word} = ", path.read_text(encoding="utf-8"), re.MULTILINE):
            name = path.stem.removeprefix(f"{word.lower()}_").replace("_", "-")
            found[name] = f"{package}.{path.stem}"
    return dict(sorted(found.items()))


def find_choice(
    neighbour: str, word: str, name: str, missing: str, retired: Mapping[str, str] | None = None
) -> Any:
    """The object ``word`` of the choice ``name``; raises `UsageError` with the nearest name.

    ``missing``: what an error says before the name, "there is no law"; ``retired``: choices that
    left trackbed, and what to use instead.
    """
    known = find_choices(neighbour, word)
    if name not in known:
        why = tell_retired(name, retired or {})
        near = get_close_matches(name.lower().replace("_", "-"), known, n=1)
        if near and not why:
            why = f"; did you mean '{near[0]}'?"
        raise UsageError(
            f"{missing} '{name}'{why}", remedy=f"the {word.lower()}s are: " + ", ".join(known)
        )
    return getattr(import_module(known[name]), word)


def tell_retired(name: str, retired: Mapping[str, str]) -> str:
    """Which version has a choice that left trackbed, and what to use; empty for other names."""
    if name not in retired:
        return ""
    use = retired[name]
    return (
        f": only studies used it, and trackbed {RETIRED_AFTER} is the last to have it; use '{use}'"
    )
