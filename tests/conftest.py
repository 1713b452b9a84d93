"""Tests that need an engine or a library, their order, and what several processes may take."""

from __future__ import annotations

import os
import shutil
import time
from functools import cache
from importlib import import_module

import pytest
from hypothesis import HealthCheck, settings

if "PYTEST_XDIST_WORKER" in os.environ:  # as many processes as processors: no threads besides
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

settings.register_profile(  # beside other processes time says nothing
    "no clock", settings.default, deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)  # fmt: skip
settings.load_profile("no clock")

BEGAN = time.monotonic()  # each process reads this file at its start


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--nothing-missing``: for CI and ``make test-all``, where everything is installed."""
    parser.addoption(
        "--nothing-missing", action="store_true",
        help="a test whose engine, program or library is missing fails instead of being skipped",
    )  # fmt: skip
    parser.addoption(
        "--begin-until", type=float, default=float("inf"), metavar="SECONDS",
        help="skip tests that have not begun when these seconds are over, and say so",
    )  # fmt: skip


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The two packages with many kernels apart from each other: one early, one last.

    A third of a whole run is compiling.  Two processes (``-n 2 --dist worksteal``) begin with one
    half of the tests each and trade what is left later: so hardly a kernel is compiled in both.
    Tests that lean on their order stand in front, where nothing is traded.
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
    from adapters.engines.contract import get_engine, list_engines
    from adapters.errors import EngineMissing

    if name not in list_engines():
        return "" if shutil.which(name) else f"the engine {name} is not installed"

    try:
        get_engine(name).version()
    except EngineMissing as error:
        return error.what
    return ""


@cache
def peer_missing(name: str) -> str:
    """Why a library can not be imported; empty where it can."""
    try:
        import_module(name)
    except Exception as error:  # numba-cuda without CUDA's runtime raises errors of its own kinds
        return f"{name} can not be imported ({' '.join(str(error).split())})"
    return ""


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip what needs an engine or a library that is missing; with ``--nothing-missing`` it fails.

    ``@pytest.mark.engine`` (default: liggghts) and ``@pytest.mark.peer("coal")``.  A slow
    machine leaves out what has not begun in time (``--begin-until``).
    """
    seconds = item.config.getoption("--begin-until")
    if time.monotonic() - BEGAN > seconds:
        pytest.skip(f"not begun within {seconds:g} s on this slow machine")
    engines = [mark.args[0] if mark.args else "liggghts" for mark in item.iter_markers("engine")]
    peers = [mark.args[0] for mark in item.iter_markers("peer")]
    missing = [*filter(None, map(engine_missing, engines)), *filter(None, map(peer_missing, peers))]
    if not missing:
        return
    reason = f"{missing[0]} (./setup.sh test,peers installs it)"
    if item.config.getoption("--nothing-missing"):
        pytest.fail(reason, pytrace=False)
    pytest.skip(reason)
