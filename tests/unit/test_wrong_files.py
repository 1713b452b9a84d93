"""A file of one kind where another should be: named as what it is, with what to do."""

from __future__ import annotations

import bz2
from pathlib import Path

import numpy as np
import pytest

from adapters.files import Frame, read_series, write_dump
from trackbed.command import main

pytestmark = pytest.mark.lowest


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A scene of each story, and dumps by other names."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "karrech-coarse", "."]) == 0
    Path("qdem.toml").write_text("[simulation]\n")
    frames = [
        Frame(step, ("id", "x", "y", "z"), np.array([[1, 0, 0, z], [2, 1, 0, z]]))
        for step, z in ((0, 0.1), (1, 0.09), (2, 0.085))
    ]
    write_dump("a.dump", frames)
    text = Path("a.dump").read_bytes()
    for name in ("a.csv", "text.gz"):
        Path(name).write_bytes(text)
    for name in ("bz2.gz", "bz2.xz"):
        Path(name).write_bytes(bz2.compress(text))


@pytest.mark.parametrize(
    ("words", "code", "what", "remedy"),
    [
        ("adopt scene.toml --engine liggghts", 2, "this is a scene, no deck", "trackbed run scene"),
        ("adopt qdem.toml --engine yade", 2, "this is a scene, no deck", "trackbed qdem qdem.toml"),
        ("relax scene.toml --out a.npz", 2, "this is a scene, no series", "trackbed run scene"),
        ("fit text.gz", 6, "this cannot be read as .gz: it begins with 'ITEM", "leave .gz out"),
        ("fit bz2.gz", 6, "this cannot be read as .gz", "a name that ends in .bz2"),
        ("fit bz2.xz", 6, "this cannot be read as .xz", "a name that ends in .bz2"),
    ],
)
def test_wrong_files_are_named(
    capsys: pytest.CaptureFixture[str], words: str, code: int, what: str, remedy: str
) -> None:
    """By what they are, and the remedy is that of this file."""
    capsys.readouterr()
    assert main(words.split()) == code
    said, _, do = capsys.readouterr().err.partition("\n  -> ")
    assert what in said
    assert remedy in do


@pytest.mark.peer("distributed")
def test_a_sweep_needs_a_folder(capsys: pytest.CaptureFixture[str]) -> None:
    """A file in its place is named."""
    assert main(["sweep", "scene.toml", "--engine", "fake", "--into", "a.csv"]) == 2
    said, _, do = capsys.readouterr().err.partition("\n  -> ")
    assert "can not be written" in said
    assert "a file is where" in do


def test_a_dump_may_be_called_csv() -> None:
    """By its first word it is the dump that it is."""
    assert read_series([Path("a.csv")]).settlement == pytest.approx([0, 0.01, 0.015])
