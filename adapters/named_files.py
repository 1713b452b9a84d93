"""Choices that are one file each of a package: ``PREFIX_NAME.py``, named as users write them."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType

from adapters.errors import UsageError


def names_known(path: Iterable[str], prefix: str) -> tuple[str, ...]:
    """Names of the files ``PREFIX_*.py`` of a package's ``path``, sorted, with hyphens."""
    files = (module.name for module in iter_modules(path))
    return tuple(
        sorted(
            name.removeprefix(f"{prefix}_").replace("_", "-")
            for name in files
            if name.startswith(f"{prefix}_")
        )
    )


def file_named(
    package: str, path: Iterable[str], prefix: str, name: str, missing: str
) -> ModuleType:
    """The file of this name; raises `UsageError` with the nearest name when there is none.

    ``missing``: what an error says before the name, "there is no law".
    """
    known = names_known(path, prefix)
    if name not in known:
        near = get_close_matches(name.lower().replace("_", "-"), known, n=1)
        raise UsageError(
            f"{missing} '{name}'" + (f"; did you mean '{near[0]}'?" if near else ""),
            remedy=f"the {prefix}s are: " + ", ".join(known),
        )
    return import_module(f"{package}.{prefix}_{name.replace('-', '_')}")
