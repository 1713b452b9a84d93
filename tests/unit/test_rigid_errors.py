"""Every error of the package that a user can act on says what to do."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import rigid_lcp
from rigid_lcp import errors

SOURCES = sorted(Path(rigid_lcp.__file__).parent.glob("*.py"))
NAMES = {
    name
    for name, kind in vars(errors).items()
    if isinstance(kind, type) and issubclass(kind, errors.RigidError)
}


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_every_error_has_a_remedy(source: Path) -> None:
    """Each call of an error's class names its ``remedy`` (or passes keywords on)."""
    calls = [
        node
        for node in ast.walk(ast.parse(source.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in NAMES
    ]
    lacking = [
        call.lineno for call in calls if not {each.arg for each in call.keywords} & {"remedy", None}
    ]
    assert lacking == []
