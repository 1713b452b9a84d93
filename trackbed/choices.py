"""Choices that are one file each, found by being there: docs/extend.md shows one of each kind.

A file is a choice when it sets the word of its room at its top level: ``LAW``, ``MOVE``,
``ENGINE``, ``METHOD``, ``MEASURE`` or ``SHAPE``.  Its name is that of the file, with hyphens for
underscores.
Names are read without importing the files.
"""

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
def find_choices(room: str, word: str) -> Mapping[str, str]:
    """Name -> module of every file of the package ``room`` that sets ``word``, sorted by name."""
    spec = find_spec(room)
    assert spec is not None
    return {
        path.stem.replace("_", "-"): f"{room}.{path.stem}"
        for folder in spec.submodule_search_locations or ()
        for path in sorted(Path(folder).glob("*.py"))
        if re.search(rf"^{word} = ", path.read_text(encoding="utf-8"), re.MULTILINE)
    }


def find_choice(
    room: str, word: str, name: str, missing: str, retired: Mapping[str, str] | None = None
) -> Any:
    """The object ``word`` of the choice ``name``; raises `UsageError` with the nearest name.

    ``missing``: what an error says before the name, "there is no law"; ``retired``: choices that
    left trackbed, and what to use instead.
    """
    known = find_choices(room, word)
    if name not in known:
        why = explain_retired(name, retired or {})
        near = get_close_matches(name.lower().replace("_", "-"), known, n=1)
        if near and not why:
            why = f"; did you mean '{near[0]}'?"
        raise UsageError(
            f"{missing} '{name}'{why}", remedy=f"the {word.lower()}s are: " + ", ".join(known)
        )
    return getattr(import_module(known[name]), word)


def explain_retired(name: str, retired: Mapping[str, str]) -> str:
    """Which version has a choice that left trackbed, and what to use; empty for other names."""
    said = f": only studies used it, and trackbed {RETIRED_AFTER} is the last to have it; use "
    return f"{said}'{retired[name]}'" if name in retired else ""
