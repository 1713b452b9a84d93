"""Tests that need an engine, the order of tests, and what several processes may take."""

from __future__ import annotations

import os
import shutil
import time
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


BEGAN = time.monotonic()  # each process reads this file at its start


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--long-until 600``: a slow machine leaves out long tests and still ends in time."""
    parser.addoption(
        "--long-until", type=float, default=float("inf"), metavar="SECONDS",
        help="skip tests marked long that have not begun when these seconds are over",
    )  # fmt: skip


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The two packages with many kernels apart from each other: one early, one last.

    A third of a whole run is compiling.  Two processes (``-n 2 --dist worksteal``) begin with one
    half of the tests each and trade what is left later: so hardly a kernel is compiled in both.
    Tests that lean on their order stand in front, where nothing is traded.  Each process has the
    long ones last, so that these are what a slow machine leaves out.
    """
    items.sort(key=_place)


def _place(item: pytest.Item) -> tuple[int, bool, int]:
    """Half, long or not, and story."""
    story = item.path.stem.split("_")[1]  # test_STORY_...
    of_story = {"qdem": 1, "rigid": 3}.get(story, 2)
    number = of_story if item.path.parent.name in ("unit", "verification") else 0
    return number // 2, item.get_closest_marker("long") is not None, number


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
    """Skip what a slow machine has no time for, and what needs an engine that is missing.

    In CI a missing engine (``@pytest.mark.engine``; default: liggghts) fails.
    """
    seconds = item.config.getoption("--long-until")
    if item.get_closest_marker("long") and time.monotonic() - BEGAN > seconds:
        pytest.skip(f"a long test, and {seconds:g} s are over (pytest -m long runs them)")
    for mark in item.iter_markers("engine"):
        name = mark.args[0] if mark.args else mark.kwargs.get("name", "liggghts")
        missing = engine_missing(name)
        if missing:
            reason = f"{missing} (./setup.sh test installs it)"
            if os.environ.get("CI") == "true":
                pytest.fail(reason, pytrace=False)
            pytest.skip(reason)
