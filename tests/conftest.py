"""Tests that need an engine, the order of tests, and what several processes may take."""

from __future__ import annotations

import os
import shutil
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

if "PYTEST_XDIST_WORKER" in os.environ:  # as many processes as processors: no threads besides
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

settings.register_profile(  # beside other processes time says nothing
    "no clock", settings.default, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("no clock")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The two packages with many kernels apart from each other: one early, one last.

    A third of a whole run is compiling.  Two processes (``-n 2 --dist worksteal``) begin with one
    half of the tests each and trade what is left later: so hardly a kernel is compiled in both.
    Tests that lean on their order stand in front, where nothing is traded.
    """
    items.sort(key=lambda item: _place(item.path))


def _place(path: Path) -> int:
    if path.parent.name not in ("unit", "verification"):
        return 0
    return {"qdem": 1, "rigid": 3}.get(path.stem.split("_")[1], 2)  # test_STORY_...


@cache
def engine_missing(name: str) -> str:
    """Why an engine, or a program such as ``chromium``, can not be used; empty where it can."""
    if not (Path(__file__).parents[1] / "adapters" / f"engine_{name}.py").exists():
        return "" if shutil.which(name) else f"the engine {name} is not installed"
    from adapters.engine import engine_named
    from adapters.errors import EngineMissing

    try:
        engine_named(name).version()
    except EngineMissing as error:
        return error.what
    return ""


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip a test whose ``@pytest.mark.engine`` (default: liggghts) is missing; fail it in CI."""
    for mark in item.iter_markers("engine"):
        name = mark.args[0] if mark.args else mark.kwargs.get("name", "liggghts")
        missing = engine_missing(name)
        if missing:
            reason = f"{missing} (./setup.sh test installs it)"
            if os.environ.get("CI") == "true":
                pytest.fail(reason, pytrace=False)
            pytest.skip(reason)
