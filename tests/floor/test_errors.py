"""One form of sentence and one exit code for what went wrong, whoever says it."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pytest

from trackbed.command import main
from trackbed.errors import EXIT_CODES, Interrupted, TrackbedError

ERRORS = ("adapters.errors", "qdem_fem.files.errors", "rigid_lcp.errors")
DOORS = {"run": "engine", "qdem": "simulation", "rigid": "run", "line": "line"}
"""Verbs that read a scene file, and a table of each."""


@pytest.mark.parametrize("module", ERRORS)
def test_every_error_is_one_of_the_floor(module: str) -> None:
    """A story's own errors come from the floor's, with an exit code that the help explains."""
    kinds = [
        kind
        for kind in vars(import_module(module)).values()
        if isinstance(kind, type) and issubclass(kind, BaseException)
    ]
    for kind in kinds:
        if issubclass(kind, Warning):
            continue
        assert issubclass(kind, TrackbedError | Interrupted), kind
        assert kind.exit_code in EXIT_CODES


def test_an_error_says_what_where_and_what_to_do() -> None:
    """The three parts of an error stand in its text; an error moved names the other place."""
    error = TrackbedError("it is broken", where="here", remedy="mend it")
    assert str(error) == "here: it is broken\n  -> mend it"
    assert str(error.relocate("there")) == "there: it is broken\n  -> mend it"


@pytest.mark.parametrize("verb", DOORS)
def test_a_missing_scene_reads_alike_at_every_door(verb: str, tmp_path, capsys) -> None:
    """No file: exit code 2 and the file's name first, at every door."""
    path = tmp_path / "none.toml"
    assert main([verb, str(path)]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"trackbed: {path}: can not read the scene (No such file or directory)")
    assert "\n  -> " in said


@pytest.mark.parametrize("verb", DOORS)
@pytest.mark.parametrize(
    ("text", "where", "what"),
    [
        ("a = 1\nb = = 2\n", ":2: this is not TOML: ", "b = = 2"),
        ("\n[surprise]\nx = 1\n", ":2: surprise: unknown key", "problem"),
        ("TABLE = 3\n", ":1: TABLE: must be a table, not 3", "problem"),
        ("\0\xff\x80garbage", ": ", "not a text file"),
    ],
)
def test_a_wrong_scene_reads_alike_at_every_door(
    verb: str, text: str, where: str, what: str, tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    """Not TOML, an unknown table, a wrong type, no text: exit code 3, file, line, key, a sentence.

    No run is made.
    """
    path = tmp_path / "scene.toml"
    path.write_bytes(text.replace("TABLE", DOORS[verb]).encode("latin-1"))
    assert main([verb, str(path)]) == 3
    said = capsys.readouterr().err
    assert f"{path}{where}".replace("TABLE", DOORS[verb]) in said
    assert what in said
    assert "\n  -> " in said
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("verb", DOORS)
def test_an_override_that_is_none_reads_alike_at_every_door(verb: str, tmp_path, capsys) -> None:
    """``--set`` without a key: exit code 2 and how to write one."""
    path = tmp_path / "scene.toml"
    path.write_text('title = "one"\n')
    assert main([verb, str(path), "--set", "nothing"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("trackbed: --set: can not read the override 'nothing'\n  -> write ")
