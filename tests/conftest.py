"""Tests that need an engine: skipped with the reason where it is missing, failed in CI."""

from __future__ import annotations

import os
import shutil
from functools import cache

import pytest

ENGINES = ("liggghts", "lammps", "yade")
"""Engines that tell their version; other names are those of programs, such as ``chromium``."""


@cache
def engine_missing(name: str) -> str:
    """Why an engine or a program can not be used; empty where it can."""
    if name not in ENGINES:
        return "" if shutil.which(name) else f"the engine {name} is not installed"
    from adapters.engine import engine_named
    from adapters.errors import EngineMissing

    try:
        engine_named(name).version()
    except EngineMissing as error:
        return error.what
    return ""


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Ask every ``@pytest.mark.engine`` (default: liggghts) for its version."""
    for mark in item.iter_markers("engine"):
        name = mark.args[0] if mark.args else mark.kwargs.get("name", "liggghts")
        missing = engine_missing(name)
        if missing:
            reason = f"{missing} (./setup.sh test installs it)"
            if os.environ.get("CI") == "true":
                pytest.fail(reason, pytrace=False)
            pytest.skip(reason)
