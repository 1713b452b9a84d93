"""Tests that need an engine: skipped with the reason where it is missing, failed in CI."""

from __future__ import annotations

import os
import shutil

import pytest


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Look for the program of every ``@pytest.mark.engine`` (default: liggghts)."""
    for mark in item.iter_markers("engine"):
        name = mark.args[0] if mark.args else mark.kwargs.get("name", "liggghts")
        if shutil.which(name) is None:
            reason = f"the engine {name} is not installed (./setup.sh test installs it)"
            if os.environ.get("CI") == "true":
                pytest.fail(reason, pytrace=False)
            pytest.skip(reason)
