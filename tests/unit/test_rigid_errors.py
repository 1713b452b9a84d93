"""Every error of the package that a user can act on says what to do."""

from __future__ import annotations

import ast
from pathlib import Path

import rigid_lcp
from rigid_lcp import errors

NAMES = {
    name
    for name, kind in vars(errors).items()
    if isinstance(kind, type) and issubclass(kind, errors.RigidError)
}


def test_every_error_has_a_remedy() -> None:
    """Each call of an error's class names its ``remedy`` (or passes keywords on)."""
    calls = {
        f"{path.name}:{node.lineno}": {each.arg for each in node.keywords}
        for path in Path(rigid_lcp.__file__).parent.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in NAMES
    }
    assert len(calls) > 100
    assert [place for place, named in calls.items() if not named & {"remedy", None}] == []
