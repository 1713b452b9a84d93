"""The run on each engine that the contract, the faults and the exports are judged by."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Callable, Iterator

import pytest

from tests.engine_sample import ENGINES, Sample
from tests.forked_commands import Commands


@pytest.fixture(scope="session")
def samples(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Sample]:
    """By the engine's name; made once, though several test processes may ask for it."""
    home = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        home = home.parent

    def made(name: str) -> Sample:
        with (home / f"sample_{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            return Sample(name, home / f"sample_{name}")

    return made


@pytest.fixture(scope="session", params=ENGINES)
def sample(request: pytest.FixtureRequest, samples: Callable[[str], Sample]) -> Sample:
    """That of each engine in turn."""
    return samples(request.param)


@pytest.fixture(scope="session")
def commands(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Commands]:
    """A server of commands."""
    server = Commands(tmp_path_factory.mktemp("commands"))
    yield server
    server.close()
